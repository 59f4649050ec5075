//! Summary of `accuracy` in sentences: time and error of the scene as it is, and recommended
//! settings.

use raywright_core::Settings;
use raywright_core::accuracy::{
    AccuracyReport, MeasuredSetting, Recommendation, Recommendations, RungSetting,
};
use raywright_io::report::{
    format_budget, format_duration, format_significant_digits, format_uncertain,
};

use crate::commands::render::messages::unknown_error_reason;
use crate::origin::quote_for_shell;

/// Command line of `render` for a scene, in two parts: the part common to all settings, and the
/// flags of a setting.
pub struct RenderCommand {
    /// Command with all flags of the measurement except `--rung`.
    pub base: String,
    /// Rungs (quality levels of settings) among the flags of the measurement, as `LADDER=RUNG`.
    measurement_rungs: Vec<String>,
}

/// Replaces the rung of a ladder among `LADDER=RUNG`, or adds it.
fn put_rung(rungs: &mut Vec<String>, rung: &str) {
    let ladder = |rung: &str| rung.split('=').next().map(str::to_owned);
    rungs.retain(|other| ladder(other) != ladder(rung));
    rungs.push(rung.to_owned());
}

impl RenderCommand {
    /// Splits the flags of a measurement into `--rung` flags and all others, and adds the others to
    /// the `render` command for `scene`. A model has 64 samples with `--no-denoise` and 16 without, so
    /// that its commands state the samples of the measured `settings`.
    pub fn new(scene: &str, is_model: bool, requested: &[String], settings: &Settings) -> Self {
        let samples = format!("samples={}", settings.samples());
        let mut measurement_rungs = Vec::from_iter(is_model.then_some(samples));
        let mut words = vec!["raywright render".to_owned(), quote_for_shell(scene)];
        for flag in requested {
            match flag.strip_prefix("--rung ") {
                Some(rung) => put_rung(&mut measurement_rungs, rung),
                None => words.push(flag.clone()),
            }
        }
        Self {
            base: words.join(" "),
            measurement_rungs,
        }
    }

    /// Formats the rungs of the measurement and of a setting as flags of `render`. A rung (quality
    /// level) of the setting replaces the measurement's rung of the same ladder. Each rung has a
    /// flag of its own, so that the line can be broken between flags.
    pub fn format_flags(&self, setting: &RungSetting) -> String {
        let mut all = self.measurement_rungs.clone();
        for choice in setting.choices() {
            put_rung(&mut all, &choice.to_string());
        }
        let flag = |rung: &String| match rung.split_once('=') {
            Some(("samples", samples)) => (0, format!("--spp {samples}")),
            Some(("reconstruction", "denoised")) => (0, "--denoise".to_owned()),
            Some(("reconstruction", "unbiased")) => (0, "--no-denoise".to_owned()),
            _ => (1, format!("--rung {rung}")),
        };
        let mut flags: Vec<_> = all.iter().map(flag).collect();
        flags.sort_by_key(|(place, _)| *place);
        let flags: Vec<String> = flags.into_iter().map(|(_, flag)| flag).collect();
        flags.join(" ")
    }
}

/// Formats the summary: error and time of the setting in use, then the recommended settings.
pub fn format_recommendation(report: &AccuracyReport, command: &RenderCommand) -> String {
    let measured = report.own();
    let time = format!(
        "{} of CPU time",
        format_uncertain(&measured.seconds, format_duration)
    );
    let error = measured.errors.root_relmse;
    if error.is_known() && error.includes_zero() {
        let most = format_significant_digits(error.high, 2);
        return format!(
            "Setting in use: {time}, and an error of at most {most}, which is too small to be distinguished from the noise of the reference."
        );
    }
    let Recommendations {
        half_the_error,
        same_error,
        biased,
    } = &report.recommendations;
    let format_advice = |advice: &Recommendation| {
        let row = &report.settings[advice.row];
        // The ratio of two errors may be known where neither is.
        let error = match row.errors.root_relmse.is_known() {
            true => format!("has the error {} for", format_error(row)),
            false => "takes".to_owned(),
        };
        let time = format_uncertain(&row.ratio, |value| format_significant_digits(value, 2));
        let flags = command.format_flags(&row.setting);
        format!("`{flags}` {error} {time} x the time")
    };
    let advice = |advice: &Option<Recommendation>, what: &str, none: &str| match advice {
        Some(advice) => {
            let doubt = if advice.certain { "" } else { "Probably " };
            let what = format!("{doubt}{what}");
            let (first, rest) = what.split_at(1);
            let first = first.to_uppercase();
            format!(" {first}{rest}: {}.", format_advice(advice))
        }
        None => format!(" No setting is known to have {none}."),
    };
    let reason = report.doubt.filter(|_| !error.is_known());
    let reason = reason.map(|doubt| format!(" ({})", unknown_error_reason(doubt)));
    let mut text = format!(
        "Setting in use: error {}{}, {time}.",
        format_error(measured),
        reason.unwrap_or_default()
    );
    let none = "the same error in clearly less time";
    match (half_the_error, same_error) {
        // One setting is both.
        (Some(half), Some(same)) if half.row == same.row => {
            text += &advice(half_the_error, "half the error in less time", "");
        }
        _ => {
            text += &advice(half_the_error, "half the error", "half the error");
            text += &advice(same_error, "the same error", none);
        }
    }
    if let Some(biased) = biased {
        let light = 100.0 * (report.settings[biased.row].errors.light.value - 1.0);
        text += &format!(
            " Faster, with bias: {}, and {light:+.1} % light.",
            format_advice(biased)
        );
    }
    if let Some(seconds) = report.sufficient_budget {
        text += &format!(
            " A longer measurement, `--budget {}`, would probably make the unknown errors known.",
            format_budget(seconds)
        );
    }
    text
}

/// Formats the error of a measured setting (root relMSE) with its interval.
fn format_error(measured: &MeasuredSetting) -> String {
    format_uncertain(&measured.errors.root_relmse, |value| {
        format_significant_digits(value, 2)
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use raywright_core::accuracy::ConfidenceInterval;
    use raywright_core::film::EstimateDoubt;
    use raywright_core::ladder::{Ladder, RungChoice};
    use raywright_core::scene::Scene;
    use raywright_core::settings::Sampling;

    use super::super::text::tests::report;
    use super::*;
    use crate::args::{Arguments, Command};
    use crate::plan::RenderTask;

    fn words(list: &[&str]) -> Vec<String> {
        list.iter().map(|&word| word.to_owned()).collect()
    }

    fn setting(rungs: &[&str]) -> RungSetting {
        let choices = rungs
            .iter()
            .map(|rung| RungChoice::parse(rung).expect("a rung"));
        RungSetting::from_rungs(&choices.collect::<Vec<_>>())
    }

    fn own_settings() -> Settings {
        Settings {
            sampling: Sampling::General(64),
            ..Settings::from_scene(&Scene::default())
        }
    }

    /// Protects: a command repeats the flags of the measurement, except for ladders whose rung the
    /// setting changes. Samples and denoising have flags of their own, and no ladder is named
    /// twice.
    #[test]
    fn commands_ask_for_everything() {
        let command = RenderCommand::new(
            "a b.glb",
            false,
            &words(&["--integrator path", "--rung samples=16"]),
            &own_settings(),
        );
        assert_eq!(command.base, "raywright render 'a b.glb' --integrator path");
        let flags = |list: &[&str]| command.format_flags(&setting(list));
        assert_eq!(
            flags(&["samples=64", "precision=reference"]),
            "--spp 64 --rung precision=reference"
        );
        assert_eq!(
            flags(&["clamp=10", "reconstruction=denoised"]),
            "--spp 16 --denoise --rung clamp=10"
        );
        assert_eq!(
            flags(&["clamp=10", "roulette=off"]),
            "--spp 16 --rung roulette=off --rung clamp=10"
        );
        assert_eq!(flags(&[]), "--spp 16");
        assert_eq!(
            RenderCommand::new("preset:x", false, &[], &own_settings()).format_flags(&setting(&[])),
            ""
        );
        let flags = |rungs: &[&str], chosen: &str| {
            let command = RenderCommand::new("x.glb", true, &words(rungs), &own_settings());
            command.format_flags(&setting(&[chosen]))
        };
        assert_eq!(
            flags(&[], "reconstruction=unbiased"),
            "--spp 64 --no-denoise"
        );
        assert_eq!(
            flags(&["--rung clamp=10"], "samples=4"),
            "--spp 4 --rung clamp=10"
        );
    }

    /// Protects: the summary has the current error and time, and the error and time of each
    /// recommended setting, as in the tables, with its doubt and its change of light. If no setting
    /// qualifies, the summary states this, and names a budget if an error is not known.
    #[test]
    fn the_recommendation_is_a_sentence() {
        let command = RenderCommand::new("x.glb", false, &[], &own_settings());
        let mut report = report();
        let value_of = |value: f64| ConfidenceInterval {
            value,
            low: 0.9 * value,
            high: 1.1 * value,
        };
        let mut advice = |rung: &str, time: f64, square: f64, certain: bool| {
            let mut row = report.own().clone();
            row.setting = RungSetting::from_rung(RungChoice::parse(rung).expect("a rung"));
            (row.ratio, row.errors.root_relmse) = (value_of(time), value_of(square).map(f64::sqrt));
            report.settings.push(row);
            let row = report.settings.len() - 1;
            Some(Recommendation { row, certain })
        };
        let own = "Setting in use: error 0.3 (0.2 to 0.4), 25.0 s ±10 % of CPU time.";
        let recommendations = Recommendations {
            half_the_error: advice("samples=256", 3.9, 0.0225, true),
            same_error: advice("roulette=early", 0.755, 0.08, false),
            biased: advice("clamp=10", 0.255, 0.08, true),
        };
        report.recommendations = recommendations;
        assert_eq!(
            format_recommendation(&report, &command),
            format!(
                "{own} Half the error: `--spp 256` has the error 0.15 ±5 % for 3.9 ±10 % x the time. Probably the same error: `--rung roulette=early` has the error 0.28 ±5 % for 0.76 \
                 ±10 % x the time. Faster, with bias: `--rung clamp=10` has the error 0.28 ±5 % for 0.26 ±10 % x the time, and -8.1 % light."
            )
        );
        // One setting that is both is told once.
        report.recommendations.same_error = report.recommendations.half_the_error;
        report.recommendations.biased = None;
        assert_eq!(
            format_recommendation(&report, &command),
            format!(
                "{own} Half the error in less time: `--spp 256` has the error 0.15 ±5 % for 3.9 ±10 % x the time."
            )
        );
        report.recommendations = Recommendations::default();
        report.sufficient_budget = Some(61.0);
        report.settings[0].errors.root_relmse.low = 0.004;
        report.doubt = Some(EstimateDoubt::FewPixels);
        assert_eq!(
            format_recommendation(&report, &command),
            "Setting in use: error not known (too few samples found light), 25.0 s ±10 % of CPU time. No setting is known to have half the error. No setting is known to have the same error in clearly less time. \
             A longer measurement, `--budget 2min`, would probably make the unknown errors known."
        );
        report.settings[0].errors.root_relmse.low = 0.0;
        assert_eq!(
            format_recommendation(&report, &command),
            "Setting in use: 25.0 s ±10 % of CPU time, and an error of at most 0.4, which is too small to be distinguished from the noise of the reference."
        );
    }

    /// Protects: the recommended flags select exactly the rungs (quality levels) of the measured
    /// setting.
    #[test]
    fn what_is_advised_is_what_was_measured() {
        let ladders = [
            Ladder::Samples,
            Ladder::Reconstruction,
            Ladder::Sampler,
            Ladder::Clamp,
        ];
        for choice in ladders.into_iter().flat_map(Ladder::choices) {
            let advised = RenderCommand::new("preset:cornell", false, &[], &own_settings())
                .format_flags(&RungSetting::from_rung(choice));
            let settings = |words: &str| {
                let words = ["raywright", "render", "preset:cornell"]
                    .into_iter()
                    .chain(words.split_whitespace());
                let Ok(Arguments {
                    command: Some(Command::Render(args)),
                    ..
                }) = Arguments::try_parse_from(words)
                else {
                    panic!("{advised}")
                };
                let (mut scene, task) = (
                    Scene::default(),
                    RenderTask::new(*args).expect("right words"),
                );
                task.resolve_plan(&mut scene, None, |_, _, _, _| panic!("nothing is framed"))
                    .expect("a plan")
                    .settings
            };
            assert_eq!(
                settings(&advised),
                settings(&format!("--rung {choice}")),
                "{advised}"
            );
        }
    }
}
