//! Summary of `accuracy` in sentences: time and error of the scene as it is, and recommended
//! settings.

use raywright_core::accuracy::{AccuracyReport, MeasuredSetting, Recommendation, Recommendations};
use raywright_io::report::{format_duration, format_significant_digits, format_uncertain};

use crate::origin::quote_for_shell;

/// Command line of `render` for a scene, in two parts: the part common to all settings, and the
/// flags of a setting.
pub struct RenderCommand {
    /// Command with all flags of the measurement except `--rung`.
    pub base: String,
    /// Rungs (quality levels of settings) among the flags of the measurement, as `LADDER=RUNG`.
    measurement_rungs: Vec<String>,
}

/// Returns the text `LADDER=RUNG` of a `--rung` flag; `None` for any other flag.
fn parse_rung_flag(flag: &str) -> Option<&str> {
    flag.strip_prefix("--rung ")
}

fn parse_ladder_name(rung: &str) -> Option<&str> {
    rung.split_once('=').map(|(ladder, _)| ladder)
}

impl RenderCommand {
    /// Splits the flags of a measurement into `--rung` flags and all others, and adds the others to
    /// the `render` command for `scene`.
    pub fn new(scene: &str, requested: &[String]) -> Self {
        let others = requested
            .iter()
            .filter(|flag| parse_rung_flag(flag).is_none())
            .cloned();
        let words: Vec<String> = ["raywright render".to_owned(), quote_for_shell(scene)]
            .into_iter()
            .chain(others)
            .collect();
        Self {
            base: words.join(" "),
            measurement_rungs: requested
                .iter()
                .filter_map(|flag| parse_rung_flag(flag))
                .map(str::to_owned)
                .collect(),
        }
    }

    /// Formats the rungs of the measurement and of a setting as flags of `render`. A rung (quality
    /// level) of the setting replaces the measurement's rung of the same ladder. Each rung has a
    /// flag of its own, so that the line can be broken between flags.
    pub fn format_flags(&self, setting: &[String]) -> String {
        let chosen: Vec<&str> = setting
            .iter()
            .filter_map(|flag| parse_rung_flag(flag))
            .collect();
        let stays = |requested: &&str| {
            !chosen
                .iter()
                .any(|other| parse_ladder_name(other) == parse_ladder_name(requested))
        };
        let all: Vec<&str> = self
            .measurement_rungs
            .iter()
            .map(String::as_str)
            .filter(stays)
            .chain(chosen.iter().copied())
            .collect();
        let short = |rung: &str| match rung.split_once('=') {
            Some(("samples", samples)) => Some(format!("--spp {samples}")),
            Some(("reconstruction", "denoised")) => Some("--denoise".to_owned()),
            _ => None,
        };
        let rest = all
            .iter()
            .filter(|rung| short(rung).is_none())
            .map(|rung| format!("--rung {rung}"));
        all.iter()
            .filter_map(|rung| short(rung))
            .chain(rest)
            .collect::<Vec<_>>()
            .join(" ")
    }
}

/// Formats the summary: error and time of the scene as it is, then the setting with half the error,
/// and the setting with the same error in less time.
pub fn format_recommendation(report: &AccuracyReport, command: &RenderCommand) -> String {
    let measured = &report.own;
    let time = format!(
        "{} of CPU time",
        format_uncertain(&measured.seconds, format_duration)
    );
    if !measured.errors.relmse.high.is_finite() {
        return "The time was too short to measure the error of the setting in use: give a larger --budget.".to_owned();
    }
    if measured.errors.relmse.includes_zero() {
        let most = format_significant_digits(measured.errors.relmse.high.sqrt(), 2);
        return format!(
            "Setting in use: {time}, and an error of at most {most}, which is too small to be distinguished from the noise of the reference."
        );
    }
    format!(
        "Setting in use: error {}, {time}. {} {}",
        format_error(measured),
        recommend_half_error(report, command),
        recommend_same_error(report, command)
    )
}

/// Formats the error of a measured setting (root relMSE) with its interval.
fn format_error(measured: &MeasuredSetting) -> String {
    format_uncertain(&measured.errors.relmse.map(f64::sqrt), |value| {
        format_significant_digits(value, 2)
    })
}

/// Recommends the setting with half the error of the setting in use, or more samples or a larger
/// budget where no such setting was measured.
fn recommend_half_error(report: &AccuracyReport, command: &RenderCommand) -> String {
    let Recommendations {
        half_the_error,
        half_needs,
        ..
    } = &report.recommendations;
    match (half_the_error, half_needs, suggest_sample_count(report)) {
        (Some(advice), ..) => format!("Half the error: {}.", format_advice(advice, command)),
        (None, Some(seconds), _) => format!(
            "The measurements are too uncertain to name a setting with half the error: {}.",
            suggest_budget(*seconds)
        ),
        (None, None, Some(samples)) => {
            format!(
                "No setting with half the error was measured; `--spp {samples}` should reach half the error for 4 x the time."
            )
        }
        (None, None, None) => "No measured setting has half the error.".to_owned(),
    }
}

/// Recommends the setting with the error of the setting in use in less time, or a larger budget
/// where no such setting is certain.
fn recommend_same_error(report: &AccuracyReport, command: &RenderCommand) -> String {
    let Recommendations {
        same_error,
        same_needs,
        ..
    } = &report.recommendations;
    match (same_error, same_needs) {
        (Some(advice), _) => format!("The same error: {}.", format_advice(advice, command)),
        (None, Some(seconds)) => format!(
            "The measurements are too uncertain to name a setting with the same error in less time: {}.",
            suggest_budget(*seconds)
        ),
        (None, None) => "No measured setting has the same error in clearly less time.".to_owned(),
    }
}

/// Formats a recommended setting: its flags, its error, and its time relative to the setting in
/// use.
fn format_advice(advice: &Recommendation, command: &RenderCommand) -> String {
    format!(
        "`{}` has the error {} for {} x the time",
        command.format_flags(&advice.flags),
        format_error(&advice.measured),
        format_uncertain(&advice.time, |value| format_significant_digits(value, 2))
    )
}

/// Suggests the budget in seconds that may make a setting certain.
fn suggest_budget(seconds: f64) -> String {
    format!(
        "`--budget {}` may find such a setting",
        format_budget_flag(seconds)
    )
}

/// Formats seconds as a value of `--budget`, rounded up to tens of seconds, or to minutes from one
/// minute on.
fn format_budget_flag(seconds: f64) -> String {
    let step = if seconds < 60.0 { 10.0 } else { 60.0 };
    let rounded = (seconds / step).ceil() * step;
    if rounded < 60.0 {
        format!("{rounded}s")
    } else {
        format!("{}min", (rounded / 60.0).ceil())
    }
}

/// Returns four times the current number of samples, which halve an error that is pure noise;
/// `None` if a setting with as many samples was measured.
fn suggest_sample_count(report: &AccuracyReport) -> Option<u32> {
    let samples = report
        .ladders
        .iter()
        .find(|ladder| ladder.ladder == "samples")?;
    let requested = samples.in_use.parse::<u32>().ok()?.checked_mul(4)?;
    let was_measured = |rung: &raywright_core::accuracy::RungReport| {
        rung.measured.is_some()
            && rung
                .rung
                .parse::<u32>()
                .is_ok_and(|samples| samples >= requested)
    };
    (!samples.rungs.iter().any(was_measured)).then_some(requested)
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use raywright_core::accuracy::{ConfidenceInterval, RungSetting};
    use raywright_core::ladder::Ladder;
    use raywright_core::scene::Scene;

    use super::super::text::tests::report;
    use super::*;
    use crate::args::{Arguments, Command};
    use crate::plan::RenderTask;

    fn words(list: &[&str]) -> Vec<String> {
        list.iter().map(|&word| word.to_owned()).collect()
    }

    /// Protects: a command repeats the flags of the measurement, except for ladders whose rung the
    /// setting changes. Samples and denoising have flags of their own, and no ladder is named
    /// twice.
    #[test]
    fn commands_ask_for_everything() {
        let command = RenderCommand::new(
            "a b.glb",
            &words(&["--integrator path", "--rung samples=16"]),
        );
        assert_eq!(command.base, "raywright render 'a b.glb' --integrator path");
        let flags = |list: &[&str]| command.format_flags(&words(list));
        assert_eq!(
            flags(&["--rung samples=64", "--rung precision=reference"]),
            "--spp 64 --rung precision=reference"
        );
        assert_eq!(
            flags(&["--rung clamp=10", "--rung reconstruction=denoised"]),
            "--spp 16 --denoise --rung clamp=10"
        );
        assert_eq!(
            flags(&["--rung clamp=10", "--rung roulette=off"]),
            "--spp 16 --rung clamp=10 --rung roulette=off"
        );
        assert_eq!(flags(&[]), "--spp 16");
        assert_eq!(RenderCommand::new("preset:x", &[]).format_flags(&[]), "");
    }

    /// Protects: the summary has the current error and time, and the error and time of each
    /// recommended setting, as in the tables. If no setting qualifies, the summary states this; it
    /// names more samples if they were not measured, and a budget if a setting is in doubt.
    #[test]
    fn the_recommendation_is_a_sentence() {
        let command = RenderCommand::new("x.glb", &[]);
        let mut report = report();
        let measured = report.own.clone();
        let value_of = |value: f64| ConfidenceInterval {
            value,
            low: 0.9 * value,
            high: 1.1 * value,
        };
        let advice = |flag: &str, time: f64, square: f64| {
            let mut measured = measured.clone();
            measured.errors.relmse = value_of(square);
            Some(Recommendation {
                flags: words(&[flag]),
                time: value_of(time),
                error: value_of(9.0),
                measured,
            })
        };
        let own = "Setting in use: error 0.3 (0.2 to 0.4), 25.0 s ±10 % of CPU time.";
        report.recommendations = Recommendations {
            half_the_error: advice("--rung samples=256", 3.9, 0.0225),
            same_error: advice("--rung clamp=10", 0.255, 0.08),
            half_needs: Some(1.0),
            same_needs: None,
        };
        assert_eq!(
            format_recommendation(&report, &command),
            format!(
                "{own} Half the error: `--spp 256` has the error 0.15 ±5 % for 3.9 ±10 % x the time. The same error: `--rung clamp=10` has the error 0.28 ±5 % for 0.26 \
                 ±10 % x the time."
            )
        );
        report.recommendations = Recommendations {
            half_needs: Some(41.0),
            same_needs: Some(61.0),
            ..Recommendations::default()
        };
        assert_eq!(
            format_recommendation(&report, &command),
            format!(
                "{own} The measurements are too uncertain to name a setting with half the error: `--budget 50s` may find such a setting. \
                 The measurements are too uncertain to name a setting with the same error in less time: `--budget 2min` may find such a setting."
            )
        );
        report.recommendations = Recommendations::default();
        assert_eq!(
            format_recommendation(&report, &command),
            format!(
                "{own} No measured setting has half the error. No measured setting has the same error in clearly less time."
            )
        );
        report.ladders[0].ladder = "samples";
        report.ladders[0].in_use = "64".to_owned();
        assert!(
            format_recommendation(&report, &command)
                .contains("No setting with half the error was measured; `--spp 256` should reach half the error for 4 x the time.")
        );
        report.ladders[0].rungs[0].rung = "256".to_owned();
        assert!(
            format_recommendation(&report, &command)
                .contains("No measured setting has half the error.")
        );
        report.own.errors.relmse.low = 0.0;
        assert_eq!(
            format_recommendation(&report, &command),
            "Setting in use: 25.0 s ±10 % of CPU time, and an error of at most 0.4, which is too small to be distinguished from the noise of the reference."
        );
        report.own.errors.relmse.high = f64::INFINITY;
        assert!(format_recommendation(&report, &command).starts_with("The time was too short"));
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
            let advised = RenderCommand::new("preset:cornell", &[])
                .format_flags(&RungSetting::from_rung(choice).flags());
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
