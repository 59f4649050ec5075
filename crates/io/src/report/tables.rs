//! The tables of the page: settings worth their time, rungs, prices, effects.

use std::fmt::Write;

use raywright_core::accuracy::{EffectCost, EffectCosts, Interval, LadderReport, Measured, OutputReport, RungCost, RungReport};
use raywright_core::bench::Spread;
use raywright_core::effects::Status;

use super::page::{Page, number};
use super::plot::escaped;
use crate::limits::human_bytes;

fn interval(of: Interval, f: fn(f64) -> f64) -> String {
    if of.is_lost_in_noise() { format!("&lt;\u{2009}{}", number(f(of.high))) } else { number(f(of.value)) }
}

impl Page<'_> {
    /// The settings worth their time, each with its command.
    pub(super) fn frontier(&self) -> String {
        let mut rows = String::new();
        for (i, (candidate, flags)) in (1..).zip(self.report.frontier.iter().zip(self.flags)) {
            let own = if candidate.flags.is_empty() { " class=\"own\"" } else { "" };
            let _ = writeln!(
                rows,
                "<tr{own}><td>({i})</td><td class=\"text\"><code>{}</code></td>{}</tr>",
                escaped(flags),
                self.cells(&candidate.measured, None),
            );
        }
        if rows.is_empty() {
            return String::new();
        }
        format!(
            "<h2>Worth their time</h2>\n<p>No setting that was measured is both faster and nearer to the reference. The first row whose \
             error is small enough is the cheapest setting for that error; the last one within a time is the best for that time. The flags \
             stand behind <code>{}</code></p>\n\
             <div class=\"wide\"><table><thead><tr><th></th><th>flags</th>{HEADS}</tr></thead><tbody>\n{rows}</tbody></table></div>\n",
            escaped(self.own_command),
        )
    }

    pub(super) fn rungs(&self) -> String {
        let mut rows = String::new();
        let _ = writeln!(rows, "<tr class=\"own\"><td>as it is</td>{}</tr>", self.cells(&self.report.own, None));
        let (samples, others): (Vec<_>, Vec<_>) = self.report.ladders.iter().partition(|ladder| ladder.ladder == "samples");
        samples.iter().for_each(|ladder| rows += &self.rows_of(ladder));
        if let Some(base) = &self.report.base {
            let _ = writeln!(
                rows,
                "<tr class=\"ladder\"><td>all below: {} samples</td>{}</tr>",
                base.samples,
                self.cells(&base.measured, None)
            );
        }
        others.iter().for_each(|ladder| rows += &self.rows_of(ladder));
        let mut in_vain = String::new();
        for ladder in &self.report.ladders {
            for (rung, [error, own]) in ladder.in_vain() {
                let [name, about, in_use] = [rung.rung.as_str(), rung.about, ladder.in_use.as_str()].map(escaped);
                let (error, own) = (number(error), number(own));
                let _ = writeln!(
                    in_vain,
                    "<li><code>{}={name}</code>: alone {error}, and {own} of {in_use}; {about}</li>",
                    ladder.ladder
                );
            }
        }
        if !in_vain.is_empty() {
            in_vain = format!(
                "<p>Wrong in vain, since they are no faster than the rung in use; the pictures below show where:</p>\n<ul>\n{in_vain}</ul>\n"
            );
        }
        let named = |which: &dyn Fn(&LadderReport, &RungReport) -> bool| -> Vec<String> {
            let all = self.report.ladders.iter().flat_map(|ladder| ladder.rungs.iter().map(move |rung| (ladder, rung)));
            all.filter(|(ladder, rung)| which(ladder, rung))
                .map(|(ladder, rung)| format!("{}={}", ladder.ladder, rung.rung))
                .collect()
        };
        let line = |words: &str, names: Vec<String>| match names.as_slice() {
            [] => String::new(),
            names => format!("<p>{words}: {}.</p>\n", escaped(&names.join(", "))),
        };
        let beaten = line("Slower and worse than what is in use", named(&|ladder, rung| ladder.beats(rung)));
        let late = line("No time for", named(&|_, rung| rung.measured.is_none()));
        let absent = match self.report.not_called_for.as_slice() {
            [] => String::new(),
            names => format!("<p class=\"soft\">Not called for by this scene, and not measured: {}.</p>\n", names.join(", ")),
        };
        format!(
            "<h2>Every rung, one at a time</h2>\n<p class=\"soft\">Times are those of all threads at the scene's \
             own size. Error: root relMSE, the root of the mean of (I − R)² / (R² + 0.01). Alone: root mean square difference to the ladder's most exact rung with \
             the same random numbers. &lt;: too small to be told from the reference's noise.</p>\n\
             <div class=\"wide\"><table><thead><tr><th>rung</th>{HEADS}</tr></thead><tbody>\n{rows}</tbody></table></div>\n{beaten}{late}{in_vain}{absent}"
        )
    }

    /// A ladder with the rungs that have something to say: measured, and not slower and worse than the one in use.
    fn rows_of(&self, ladder: &LadderReport) -> String {
        let shown = ladder.rungs.iter().filter(|rung| !ladder.beats(rung));
        let rows: String = shown.filter_map(|rung| Some(self.row(rung, rung.measured.as_ref()?))).collect();
        let others = ladder.rungs.iter().filter(|rung| !rung.in_use && !ladder.beats(rung) && rung.measured.is_some());
        if others.count() == 0 {
            return String::new();
        }
        format!("<tr class=\"ladder\"><td colspan=\"9\">{}</td></tr>\n{rows}", ladder.ladder)
    }

    fn row(&self, rung: &RungReport, of: &Measured) -> String {
        let own = if rung.in_use { " class=\"own\"" } else { "" };
        let (name, about) = (escaped(&rung.rung), escaped(rung.about));
        format!("<tr{own}><td title=\"{about}\">{name}</td>{}</tr>\n", self.cells(of, rung.own_error))
    }

    fn cells(&self, of: &Measured, own_error: Option<f64>) -> String {
        let errors = &of.errors;
        let bias = if errors.rmse.is_lost_in_noise() { String::new() } else { number(errors.bias) };
        let list = [
            self.time(&of.seconds),
            number(of.ratio.median),
            interval(errors.relmse, f64::sqrt),
            interval(errors.rmse, |x| x),
            bias,
            errors.noise.map(number).unwrap_or_default(),
            number(of.flip),
            own_error.map(number).unwrap_or_default(),
        ];
        list.iter().map(|cell| format!("<td>{cell}</td>")).collect()
    }

    /// Of a render at the scene's own size.
    fn time(&self, of: &Spread) -> String {
        format!("{} ±{:.0} %", spoken(of.median * self.report.enlargement()), of.relative() * 100.0)
    }

    fn paid(&self, of: &RungCost) -> String {
        let bits = if of.same_bits { "" } else { ", ANOTHER PICTURE" };
        let memory = human_bytes(of.geometry) + bits;
        let list = [self.time(&of.seconds), number(of.ratio.median), spoken(of.preparing.median), memory];
        list.iter().map(|cell| format!("<td>{cell}</td>")).collect()
    }

    /// Rungs that no picture depends on.
    pub(super) fn prices(&self) -> String {
        let mut rows = String::new();
        for ladder in &self.report.prices {
            let _ = writeln!(rows, "<tr class=\"ladder\"><td colspan=\"5\">{}</td></tr>", ladder.ladder);
            for price in &ladder.rungs {
                let own = if price.in_use { " class=\"own\"" } else { "" };
                let cells = price.paid.as_ref().map_or_else(|| late(4), |of| self.paid(of));
                let (name, about) = (escaped(&price.rung), escaped(price.about));
                let _ = writeln!(rows, "<tr{own}><td title=\"{about}\">{name}</td>{cells}</tr>");
            }
        }
        if rows.is_empty() {
            return rows;
        }
        format!(
            "<h2>What changes no picture</h2>\n<p class=\"soft\">RungCost in time and memory alone; that the pictures are the same bits is \
             checked.</p>\n<div class=\"wide\"><table><thead><tr><th>rung</th><th>CPU time</th><th>× in use</th><th>preparing</th>\
             <th>memory</th></tr></thead><tbody>\n{rows}</tbody></table></div>\n"
        )
    }

    /// What files keep of the picture.
    pub(super) fn outputs(&self) -> String {
        let row = |of: &OutputReport| {
            let own = if of.in_use { " class=\"own\"" } else { "" };
            let coding = of.seconds.map(|seconds| number(seconds.median * 1e3)).unwrap_or_default();
            let figures = [of.rmse, of.greatest, of.flip].map(number);
            let cells = [of.bytes_per_pixel.to_string(), coding].into_iter().chain(figures);
            let cells: String =
                cells.chain([format!("{:.1} %", 100.0 * of.clipped)]).map(|cell| format!("<td>{cell}</td>")).collect();
            format!("<tr{own}><td title=\"{}\">{}</td>{cells}</tr>\n", escaped(of.about), escaped(of.rung))
        };
        let rows: String = self.report.outputs.iter().map(row).collect();
        format!(
            "<h2>What a file keeps</h2>\n<p class=\"soft\">Differences of display values, 0 to 1, from those that were computed. Clipped: \
             pixels with a channel as bright as can be, which is lost where the picture is exposed again.</p>\n<div class=\"wide\">\
             <table><thead><tr><th>rung</th><th>bytes a pixel</th><th>coding, CPU ms</th><th>RMSE</th><th>greatest</th><th>FLIP</th>\
             <th>clipped</th></tr></thead><tbody>\n{rows}</tbody></table></div>\n"
        )
    }

    /// What the scene calls for, and what each effect that can be switched off adds.
    pub(super) fn effects(&self) -> String {
        let costs = self.report.costs.as_ref();
        let mut rows = String::new();
        for finding in &self.effects.effects {
            let status = match finding.status {
                Status::Simulated => "simulated",
                Status::LeftOut => "left out",
                Status::Absent => continue,
            };
            let (name, because) = (escaped(finding.effect.name()), escaped(&finding.because));
            let cost = costs.and_then(|costs| costs.effects.iter().find(|cost| cost.effect == finding.effect.name()));
            let _ = writeln!(
                rows,
                "<tr><td>{name}</td>{}<td class=\"text\">{status}: {because}</td></tr>",
                cost.map_or_else(|| "<td></td>".repeat(4), added)
            );
        }
        format!(
            "<h2>What the scene calls for</h2>\n<p class=\"soft\">{}</p>\n<div class=\"wide\"><table><thead><tr><th>effect</th>\
             <th>adds to time</th><th>to rays</th><th>changes, RMSE</th><th>FLIP</th><th>status</th></tr></thead><tbody>\n{rows}</tbody>\
             </table></div>\n",
            costs.map_or_else(|| "There was no time to measure what each costs.".to_owned(), how_measured)
        )
    }
}

/// What an effect adds: median and range of its rounds.
fn added(of: &EffectCost) -> String {
    let percent = |ratio: f64| format!("{:+.0} %", 100.0 * (ratio - 1.0));
    let time = format!("{} ({} to {})", percent(of.ratio.median), percent(of.ratio.min), percent(of.ratio.max));
    [time, percent(of.rays), number(of.rmse), number(of.flip)].iter().map(|cell| format!("<td>{cell}</td>")).collect()
}

fn how_measured(costs: &EffectCosts) -> String {
    let [width, height] = costs.size;
    let late = if costs.late.is_empty() { String::new() } else { format!("; no time for {}", costs.late.join(", ")) };
    format!(
        "Rendered with and without each effect that can be switched off, in turns and with the same random numbers, at \
         {width}×{height}: what the effect adds{late}."
    )
}

const HEADS: &str =
    "<th>CPU time</th><th>× in use</th><th>error</th><th>RMSE</th><th>bias</th><th>noise</th><th>FLIP</th><th>alone</th>";

/// A time with three digits.
fn spoken(seconds: f64) -> String {
    if seconds < 0.9995 { format!("{} ms", number(1e3 * seconds)) } else { format!("{} s", number(seconds)) }
}

/// What stands in so many columns of a rung without figures.
fn late(columns: u32) -> String {
    format!("<td colspan=\"{columns}\" class=\"text\">no time</td>")
}
