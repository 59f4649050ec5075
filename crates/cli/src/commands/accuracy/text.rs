//! A measurement as a table for the terminal, with a small plot of the frontier.

use raywright_core::accuracy::{Interval, LadderReport, Measured, OutputReport, Price, PriceReport, Report, RungReport};
use raywright_core::bench::Spread;
use raywright_io::human_bytes;

use super::file::Document;
use crate::clock::spoken;
use crate::commands::explain::dear;
use crate::scatter::scatter;
use crate::table::{Align, lay_out, lay_out_aligned, significant};

const RIGHT: Align = Align::Right;
const COLUMNS: [Align; 10] = [Align::Left, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT];

/// All of it.
pub fn table(document: &Document<'_>) -> String {
    let report = document.report;
    let mut text = format!("{}\n{}\n", document.scene, document.circumstances.join("\n"));
    text += &rungs(report);
    text += &prices(report);
    text += &files(report);
    text += &report.costs.as_ref().map(dear).unwrap_or_default();
    if !report.not_called_for.is_empty() {
        text += &format!("\nnot called for by this scene, and not measured: {}\n", report.not_called_for.join(", "));
    }
    text += &frontier(document);
    text
}

/// Every rung under its ladder.
fn rungs(report: &Report) -> String {
    let heads = ["", "time", "", "x own", "√relMSE", "RMSE", "bias", "noise", "FLIP", "alone"];
    let mut rows = vec![heads.map(str::to_owned), row("as it is".to_owned(), Some(&report.own), None)];
    for LadderReport { ladder, rungs, in_use } in &report.ladders {
        let stands = rungs.iter().any(|rung| rung.in_use);
        let title = if stands { (*ladder).to_owned() } else { format!("{ladder} (in use: {in_use})") };
        rows.push(title_row(title));
        rows.extend(rungs.iter().map(rung));
    }
    let notes = "* in use\n\
                 √relMSE: root of the mean of (I - R)² / (R² + 0.01); bias is what more samples don't lower of the RMSE, noise what they do\n\
                 alone: root mean square difference to the ladder's most exact rung with the same random numbers\n\
                 <: too small to be told from the reference's noise; the number is the upper end of the interval\n";
    let mut in_vain = String::new();
    for ladder in &report.ladders {
        for (rung, [error, own]) in ladder.in_vain() {
            let (error, own) = (significant(error, 2), significant(own, 2));
            in_vain +=
                &format!("  {}={}: alone {error} beside {own} of {}; {}\n", ladder.ladder, rung.rung, ladder.in_use, rung.about);
        }
    }
    if !in_vain.is_empty() {
        in_vain.insert_str(0, "\nwrong in vain, since they are no faster than the rung in use:\n");
    }
    format!("\n{}{notes}{in_vain}", lay_out_aligned(COLUMNS, &rows))
}

/// A row of one cell.
fn title_row<const N: usize>(title: String) -> [String; N] {
    let mut row = std::array::from_fn(|_| String::new());
    row[0] = title;
    row
}

fn rung(of: &RungReport) -> [String; 10] {
    let mark = if of.in_use { " *" } else { "" };
    row(format!("  {}{mark}", of.rung), of.measured.as_ref(), of.own_error)
}

fn row(name: String, of: Option<&Measured>, own_error: Option<f64>) -> [String; 10] {
    let Some(of) = of else {
        let mut row = title_row(name);
        row[1] = "no time".to_owned();
        return row;
    };
    let errors = &of.errors;
    [
        name,
        time(&of.seconds),
        spread(&of.seconds),
        significant(of.ratio.median, 3),
        root(&errors.relmse),
        interval(&errors.rmse),
        if errors.rmse.is_lost_in_noise() { String::new() } else { significant(errors.bias, 2) },
        errors.noise.map(|noise| significant(noise, 2)).unwrap_or_default(),
        significant(of.flip, 2),
        own_error.map(|own| significant(own, 2)).unwrap_or_default(),
    ]
}

/// The number, or the upper end of what it may be.
fn interval(of: &Interval) -> String {
    if of.is_lost_in_noise() { format!("<{}", significant(of.high, 2)) } else { significant(of.value, 2) }
}

fn time(of: &Spread) -> String {
    spoken_finely(of.median)
}

/// Times shorter than a second with three digits.
fn spoken_finely(seconds: f64) -> String {
    if seconds < 0.9995 { format!("{} ms", significant(seconds * 1e3, 3)) } else { spoken(seconds) }
}

fn spread(of: &Spread) -> String {
    format!("±{:.0} %", 100.0 * of.relative())
}

/// Ladders without error.
fn prices(report: &Report) -> String {
    if report.prices.is_empty() {
        return String::new();
    }
    let mut rows = vec![["no picture changes", "time", "", "x own", "preparing", "memory"].map(str::to_owned)];
    for PriceReport { ladder, rungs, in_use } in &report.prices {
        let stands = rungs.iter().any(|rung| rung.in_use);
        let title = if stands { (*ladder).to_owned() } else { format!("{ladder} (in use: {in_use})") };
        rows.push(title_row(title));
        rows.extend(rungs.iter().map(price));
    }
    let columns = [Align::Left, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT];
    format!("\n{}", lay_out_aligned(columns, &rows))
}

fn price(of: &Price) -> [String; 6] {
    let name = format!("  {}{}", of.rung, if of.in_use { " *" } else { "" });
    let Some(paid) = &of.paid else {
        let mut row = title_row(name);
        row[1] = "no time".to_owned();
        return row;
    };
    let bits = if paid.same_bits { "" } else { "; OTHER PICTURE" };
    [
        name,
        time(&paid.seconds),
        spread(&paid.seconds),
        significant(paid.ratio.median, 3),
        spoken_finely(paid.preparing.median),
        format!("{}{bits}", human_bytes(paid.geometry)),
    ]
}

/// What files keep of the picture.
fn files(report: &Report) -> String {
    let heads = ["what a file keeps", "bytes a pixel", "coding", "RMSE", "greatest", "FLIP", "clipped"].map(str::to_owned);
    let row = |of: &OutputReport| {
        let name = format!("  {}{}", of.rung, if of.in_use { " *" } else { "" });
        let coding = of.seconds.as_ref().map(time).unwrap_or_default();
        let errors = [of.rmse, of.greatest, of.flip].map(|error| significant(error, 2));
        let [rmse, greatest, flip] = errors;
        [name, of.bytes_per_pixel.to_string(), coding, rmse, greatest, flip, format!("{:.1} %", 100.0 * of.clipped)]
    };
    let rows: Vec<[String; 7]> = [heads].into_iter().chain(report.outputs.iter().map(row)).collect();
    let columns = [Align::Left, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT];
    let note =
        "of display values, 0 to 1, against those that were computed; clipped: pixels with a channel as bright as can be\n";
    format!("\n{}{note}", lay_out_aligned(columns, &rows))
}

/// The settings worth their time, as commands, and as a plot.
fn frontier(document: &Document<'_>) -> String {
    let points: Vec<&Measured> = document.report.frontier.iter().map(|candidate| &candidate.measured).collect();
    if points.is_empty() {
        return String::new();
    }
    let rows = document.report.frontier.iter().zip(&document.commands).map(|(candidate, command)| {
        let of = &candidate.measured;
        let flags = command.strip_prefix("raywright render ").unwrap_or(command).to_owned();
        [time(&of.seconds), significant(of.ratio.median, 3), root(&of.errors.relmse), interval(&of.errors.rmse), flags]
    });
    let heads = ["time", "x own", "√relMSE", "RMSE", "raywright render ..."].map(str::to_owned);
    let rows: Vec<[String; 5]> = [heads].into_iter().chain(rows).collect();
    let place = |of: &&Measured| (of.seconds.median, of.errors.relmse.value.sqrt());
    format!(
        "\nworth their time: no setting measured is both faster and nearer to the reference\n{}\n{}",
        lay_out(&rows),
        scatter(&points.iter().map(place).collect::<Vec<_>>(), "√relMSE", "time")
    )
}

/// The root of a mean square, or of the upper end of what it may be.
fn root(of: &Interval) -> String {
    if of.is_lost_in_noise() { format!("<{}", significant(of.high.sqrt(), 2)) } else { significant(of.value.sqrt(), 2) }
}

#[cfg(test)]
mod tests;
