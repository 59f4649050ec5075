//! `stability`: errors and cost of the library in hard numerical cases, measured on this machine.

mod text;

use std::collections::BTreeMap;
use std::mem;
use std::time::Instant;

use raywright_core::bench::SampleQuantiles;
use raywright_core::stability::{
    CaseCost, CaseOutcome, HardCase, TEXTBOOK, hard_cases, measure_case, time_case_formulas,
};
use raywright_io::Error;
use serde::Serialize;

use crate::args::StabilityArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::machine::processor_name;
use crate::progress::StepProgress;
use crate::session::Session;
use crate::targets::select_by_extension;

/// Results of a numerically hard case.
#[derive(Clone, Debug, Serialize)]
struct CaseReport {
    /// Number of the case, such as `T01`.
    case: &'static str,
    /// Short name.
    name: &'static str,
    /// Description of the numerical difficulty.
    hard: &'static str,
    /// Description of the error bound.
    bound: &'static str,
    /// Number of results of a setting that are known to exceed the bound, for a documented reason.
    known_wrong: u64,
    /// Share of results, 0 to 1, that the textbook's formulas get wrong.
    textbook_wrong: Option<f64>,
    /// Cost of both formulas; `None` where the textbook has no formula for the case.
    price: Option<FormulaCost>,
    settings: Vec<SettingResult>,
}

/// Result of a case in one setting.
#[derive(Clone, Debug, Serialize)]
struct SettingResult {
    /// Precision, followed by the kernel (the instruction set of the traversal code) of a tree, such
    /// as `robust, avx2`.
    setting: String,
    /// Number of results that were compared with exact results.
    judged: u64,
    /// Number of results that exceed the bound.
    wrong: u64,
    /// Ratio of the error bound to the worst error; `None` for cases whose results are only right
    /// or wrong.
    margin: Option<f64>,
    /// Description of the first wrong result, with its numbers.
    first_wrong: Option<String>,
}

/// Cost of the library's formula and of the textbook's formula, in nanoseconds of CPU time per ray
/// or sample.
#[derive(Clone, Copy, Debug, Serialize)]
struct FormulaCost {
    /// Name of the timed operation, such as an intersection.
    what: &'static str,
    /// Median time of the textbook's formula.
    textbook: f64,
    /// Median of the additional time of the library's formula over the textbook's, in `robust` and
    /// in `reference`.
    more: [f64; 2],
    /// Half the interquartile range of the additional time.
    spread: [f64; 2],
}

/// Report of `stability`: the results of a run.
#[derive(Clone, Debug, Serialize)]
struct StabilityReport {
    version: &'static str,
    /// Name of the processor; `None` where the system does not report it.
    processor: Option<String>,
    /// Results of each case.
    cases: Vec<CaseReport>,
    /// Numbers of the cases whose bounds only the test suite verifies.
    tested_only: Vec<&'static str>,
    /// Parts of cases that are not measured: number of the case, and reason.
    left_out: Vec<[&'static str; 2]>,
    /// Duration of the measurement in seconds.
    seconds: f64,
}

/// Function that formats the report.
type ReportFormat = fn(&StabilityReport) -> String;

/// Formats of the report for a file, each with the extension that selects it.
const FORMATS: [(&str, ReportFormat); 4] = [
    ("html", text::build_page),
    ("svg", |report| text::build_margin_plot(report).to_svg()),
    ("md", text::format_markdown),
    ("json", console::format_json),
];

/// Runs `stability`: measures, writes the requested file, and prints a table or JSON.
///
/// Fails if a case has more wrong results than the list states, or any with `--strict`.
pub fn run(mut session: Session, args: &StabilityArgs) -> Result<(), Failure> {
    let target = args.output.as_ref();
    let format = target
        .map(|path| select_by_extension(path, &FORMATS))
        .transpose()?;
    if let Some(path) = target {
        session.outputs.add_output(path, "-o")?;
    }
    let cases = select_cases(&args.cases)?;
    let report = session.run(|| measure_cases(args, cases, session.verbosity));
    if let (Some(path), Some(format)) = (target, format) {
        session.write_report(path, &format(&report))?;
    }
    console::print_report(args.json, &report, || text::format_plain(&report))?;
    check_bounds(&report, args.strict)
}

/// Fails if a result exceeds its bound and is not known, or is known and `is_strict`.
fn check_bounds(report: &StabilityReport, is_strict: bool) -> Result<(), Failure> {
    for case in &report.cases {
        let most = if is_strict { 0 } else { case.known_wrong };
        let Some(result) = case.settings.iter().find(|result| result.wrong > most) else {
            continue;
        };
        let first = result.first_wrong.as_deref().unwrap_or_default();
        let (wrong, setting) = (result.wrong, &result.setting);
        let message = format!(
            "{wrong} results of case {} in {setting} exceed their error bound: {first}",
            case.case
        );
        return Err(Failure::new(Exit::Failed, message));
    }
    Ok(())
}

/// Returns the hard cases with these numbers, or all cases for an empty list. Fails on an unknown
/// number.
fn select_cases(numbers: &[String]) -> Result<Vec<HardCase>, Failure> {
    let known =
        |number: &String| hard_cases().find(|case| case.number.eq_ignore_ascii_case(number.trim()));
    if numbers.is_empty() {
        return Ok(hard_cases().collect());
    }
    let value_of = |number: &String| {
        known(number).ok_or_else(|| {
            Error::invalid_usage(format_args!(
                "there is no hard case {number}; docs/stability.md lists all cases, such as T01 and P21"
            ))
            .into()
        })
    };
    numbers.iter().map(value_of).collect()
}

fn measure_cases(
    args: &StabilityArgs,
    cases: Vec<HardCase>,
    verbosity: Verbosity,
) -> StabilityReport {
    let (start, mut steps) = (Instant::now(), StepProgress::start(verbosity));
    let mut report = StabilityReport {
        version: env!("CARGO_PKG_VERSION"),
        processor: processor_name(),
        cases: vec![],
        tested_only: vec![],
        left_out: vec![],
        seconds: 0.0,
    };
    let count = cases.len() as f64;
    for (index, case) in cases.into_iter().enumerate() {
        steps.show_step(case.number, index as f64 / count);
        match measure_case(case.number, args.rays.into()) {
            Some(outcomes) => report.cases.push(build_case_report(&case, outcomes)),
            None => report.tested_only.push(case.number),
        }
        let left_out = case.left_out.map(|reason| [case.number, reason]);
        report.left_out.extend(left_out);
    }
    report.seconds = start.elapsed().as_secs_f64();
    report
}

fn build_case_report(case: &HardCase, outcomes: Vec<CaseOutcome>) -> CaseReport {
    let mut settings = BTreeMap::<_, CaseOutcome>::new();
    for outcome in outcomes {
        let whole = settings.entry(outcome.setting.clone()).or_default();
        *whole = mem::take(whole).merge(outcome);
    }
    let textbook = settings.remove(TEXTBOOK);
    let results = settings
        .into_iter()
        .map(|(setting, outcome)| SettingResult {
            setting,
            judged: outcome.judged,
            wrong: outcome.wrong,
            margin: (outcome.worst > 0.0).then(|| outcome.worst.recip()),
            first_wrong: outcome.first_wrong.map(|(_, message)| message),
        });
    CaseReport {
        case: case.number,
        name: case.name,
        hard: case.difficulty,
        bound: case.bound,
        known_wrong: case.known_wrong,
        textbook_wrong: textbook.map(|outcome| outcome.wrong_fraction()),
        price: time_case_formulas(case.number).as_ref().map(summarise_cost),
        settings: results.collect(),
    }
}

fn summarise_cost(cost: &CaseCost) -> FormulaCost {
    let quantiles = |of: &dyn Fn(&[f64; 3]) -> f64| {
        SampleQuantiles::from_samples(&cost.rounds.iter().map(of).collect::<Vec<_>>())
    };
    let more = [1, 2].map(|selected| quantiles(&|round| round[selected] - round[0]));
    FormulaCost {
        what: cost.label,
        textbook: quantiles(&|round| round[0]).median,
        more: more.map(|more| more.median),
        spread: more.map(|more| 0.5 * (more.upper_quartile - more.lower_quartile)),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Protects: numbers are found in upper or lower case, and a wrong number is a usage error that
    /// explains the numbering.
    #[test]
    fn cases_are_chosen_by_number() {
        let numbers = |list: &[&str]| {
            select_cases(&list.iter().map(|&word| word.to_owned()).collect::<Vec<_>>())
        };
        let found: Vec<_> = numbers(&["t01", "P21"])
            .expect("two cases")
            .iter()
            .map(|case| case.number)
            .collect();
        assert_eq!(found, ["T01", "P21"]);
        assert_eq!(numbers(&[]).expect("all").len(), 89);
        let unknown = numbers(&["T99"]).expect_err("none");
        assert!(
            unknown.exit == Exit::Usage && unknown.message.contains("T99"),
            "{}",
            unknown.message
        );
    }

    /// Protects: the extension of a file selects its content, and an unknown one is a usage error
    /// that lists the known ones.
    #[test]
    fn endings_say_what_is_written() {
        let report = text::tests::report();
        let start = |name: &str| {
            let text = select_by_extension(Path::new(name), &FORMATS).expect("a format")(&report);
            text.trim_start_matches(['<', '!', '{', '\n', ' '])
                .chars()
                .take(3)
                .collect::<String>()
        };
        assert_eq!(
            ["a.md", "b.HTML", "c.svg", "d.json"].map(start),
            ["###", "doc", "svg", "\"ve"]
        );
        let unknown =
            select_by_extension(Path::new("page.txt"), &FORMATS).expect_err("no such kind");
        assert!(
            unknown.exit == Exit::Usage && unknown.message.contains("page.txt"),
            "{}",
            unknown.message
        );
    }

    /// Protects: results that are known to exceed their bound fail with `--strict` alone, and one
    /// more than are known always does.
    #[test]
    fn known_results_fail_when_strict() {
        let mut report = text::tests::report();
        assert!(check_bounds(&report, true).is_ok());
        (
            report.cases[0].settings[1].wrong,
            report.cases[0].known_wrong,
        ) = (9, 9);
        assert!(check_bounds(&report, false).is_ok());
        let strict = check_bounds(&report, true).expect_err("a broken bound");
        assert!(strict.exit == Exit::Failed && strict.message.contains("P07"));
        report.cases[0].settings[1].wrong = 10;
        assert!(check_bounds(&report, false).is_err());
    }
}
