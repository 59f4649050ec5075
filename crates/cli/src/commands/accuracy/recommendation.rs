//! Summary of `accuracy` in sentences: time and error of the scene as it is, and recommended
//! settings.

use raywright_core::accuracy::{AccuracyReport, MeasuredSetting, Recommendation, Recommendations};
use raywright_io::report::{
    format_budget, format_duration, format_significant_digits, format_uncertain,
};

use crate::commands::render::messages::unknown_error_reason;

/// Formats the summary: error and time of the setting in use, then the recommended settings.
pub fn format_recommendation(report: &AccuracyReport) -> String {
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
        let time = match row.ratio.is_known() {
            true => format_uncertain(&row.ratio, |value| format_significant_digits(value, 2)),
            false => format!("about {}", format_significant_digits(row.ratio.value, 2)),
        };
        format!("`{}` {error} {time} x the time", row.name())
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
    let none = "as little error in clearly less time";
    match (half_the_error, same_error) {
        // One setting is both.
        (Some(half), Some(same)) if half.row == same.row => {
            text += &advice(half_the_error, "half the error in less time", "");
        }
        _ => {
            text += &advice(half_the_error, "half the error", "half the error");
            text += &advice(same_error, "no more error", none);
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
    use raywright_core::accuracy::{ConfidenceInterval, RungSetting};
    use raywright_core::film::EstimateDoubt;
    use raywright_core::ladder::RungChoice;

    use super::super::text::tests::report;
    use super::*;

    /// Protects: the summary has the current error and time, and the error and time of each
    /// recommended setting, as in the tables, with its doubt and its change of light. If no setting
    /// qualifies, the summary states this, and names a budget if an error is not known.
    #[test]
    fn the_recommendation_is_a_sentence() {
        let mut report = report();
        let value_of = |value: f64| ConfidenceInterval {
            value,
            low: 0.9 * value,
            high: 1.1 * value,
        };
        let mut advice = |rung: &str, time: f64, square: f64, certain: bool| {
            let mut row = report.own().clone();
            row.setting = RungSetting::from_rung(RungChoice::parse(rung).expect("a rung"));
            row.flags = row.setting.flags();
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
            format_recommendation(&report),
            format!(
                "{own} Half the error: `--spp 256` has the error 0.15 ±5 % for 3.9 ±10 % x the time. Probably no more error: `--rung roulette=early` has the error 0.28 ±5 % for 0.76 \
                 ±10 % x the time. Faster, with bias: `--rung clamp=10` has the error 0.28 ±5 % for 0.26 ±10 % x the time, and -8.1 % light."
            )
        );
        // One setting that is both is told once.
        report.recommendations.same_error = report.recommendations.half_the_error;
        report.recommendations.biased = None;
        assert_eq!(
            format_recommendation(&report),
            format!(
                "{own} Half the error in less time: `--spp 256` has the error 0.15 ±5 % for 3.9 ±10 % x the time."
            )
        );
        report.recommendations = Recommendations::default();
        report.sufficient_budget = Some(61.0);
        report.settings[0].errors.root_relmse.low = 0.004;
        report.doubt = Some(EstimateDoubt::FewPixels);
        assert_eq!(
            format_recommendation(&report),
            "Setting in use: error not known (too few samples found light), 25.0 s ±10 % of CPU time. No setting is known to have half the error. No setting is known to have as little error in clearly less time. \
             A longer measurement, `--budget 2min`, would probably make the unknown errors known."
        );
        report.settings[0].errors.root_relmse.low = 0.0;
        assert_eq!(
            format_recommendation(&report),
            "Setting in use: 25.0 s ±10 % of CPU time, and an error of at most 0.4, which is too small to be distinguished from the noise of the reference."
        );
    }
}
