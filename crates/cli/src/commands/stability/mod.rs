//! `stability`: errors and cost of the library in hard numerical cases, measured on this machine.

mod text;

use std::time::Instant;

use raywright_core::stability::{
    CaseCost, HardCase, Measurement, hard_cases, measure_case, time_case_formulas,
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

/// Result of a numerically hard case in one setting: a precision, and a kernel (the instruction set
/// of the traversal code).
#[derive(Clone, Debug, Serialize)]
struct HardCaseResult {
    /// Number of the case, such as `T01`.
    case: &'static str,
    /// Short name.
    name: &'static str,
    /// Description of the numerical difficulty.
    hard: &'static str,
    /// Description of the error bound.
    bound: &'static str,
    /// Precision, followed by the kernel or by the part of the case, such as `robust, avx2`.
    setting: String,
    /// Number of results that were compared with exact results.
    judged: u64,
    /// Number of results that exceed the bound.
    wrong: u64,
    /// Number of results that are known to exceed the bound, for a documented reason.
    known_wrong: u64,
    /// Ratio of the error bound to the worst error; `None` for cases whose results are only right
    /// or wrong.
    margin: Option<f64>,
    /// Share of results, 0 to 1, that the textbook's formulas get wrong.
    textbook_wrong: Option<f64>,
    /// Cost of both formulas; `None` where the textbook has no formula for the case.
    price: Option<FormulaCost>,
    /// Description of the first wrong result, with its bits.
    first_wrong: Option<String>,
}

impl HardCaseResult {
    /// Whether more results exceed the bound than are known to.
    fn is_unknown(&self) -> bool {
        self.wrong > self.known_wrong
    }
}

/// Cost of the library's formula and of the textbook's formula, in nanoseconds of CPU time per ray
/// or sample.
#[derive(Clone, Copy, Debug, Serialize)]
struct FormulaCost {
    /// Name of the timed operation, such as an intersection.
    what: &'static str,
    /// Median time of the textbook's formula, in nanoseconds of CPU time per ray or sample.
    textbook: f64,
    /// Median of the additional time of the library's formula over the textbook's, in nanoseconds
    /// of CPU time per ray or sample.
    more: f64,
    /// Half the interquartile range of the additional time, in nanoseconds.
    spread: f64,
}

/// Report of `stability`: the results of a run.
#[derive(Debug, Serialize)]
struct StabilityReport {
    version: &'static str,
    /// Name of the processor; `None` where the system does not report it.
    processor: Option<String>,
    /// Results of each case in each setting.
    rows: Vec<HardCaseResult>,
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
    let is_broken = |row: &&HardCaseResult| row.is_unknown() || is_strict && row.wrong > 0;
    let broken: Vec<_> = report.rows.iter().filter(is_broken).collect();
    let Some(row) = broken.first() else {
        return Ok(());
    };
    let first = row.first_wrong.as_deref().unwrap_or_default();
    let message = format!(
        "{} of {} results exceed their error bound; the first is case {} in {}: {first}",
        broken.len(),
        report.rows.len(),
        row.case,
        row.setting
    );
    Err(Failure::new(Exit::Failed, message))
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
        rows: vec![],
        tested_only: vec![],
        left_out: vec![],
        seconds: 0.0,
    };
    let count = cases.len() as f64;
    for (index, case) in cases.into_iter().enumerate() {
        steps.show_step(case.number, index as f64 / count);
        match measure_case(case.number, args.rays.into()) {
            Some(measurements) => {
                let price = time_case_formulas(case.number);
                let build = |measurement| build_case_result(&case, measurement, price.as_ref());
                report.rows.extend(measurements.iter().map(build));
            }
            None => report.tested_only.push(case.number),
        }
        report
            .left_out
            .extend(case.left_out.map(|reason| [case.number, reason]));
    }
    report.seconds = start.elapsed().as_secs_f64();
    report
}

fn build_case_result(
    case: &HardCase,
    measurement: &Measurement,
    price: Option<&CaseCost>,
) -> HardCaseResult {
    let (setting, outcome) = (measurement.setting.clone(), measurement.outcome());
    let price = price.map(|price| {
        let more = price.overhead[usize::from(setting.starts_with("reference"))];
        FormulaCost {
            what: price.label,
            textbook: price.textbook.median,
            more: more.median,
            spread: 0.5 * (more.upper_quartile - more.lower_quartile),
        }
    });
    HardCaseResult {
        case: case.number,
        name: case.name,
        hard: case.difficulty,
        bound: case.bound,
        setting,
        judged: outcome.judged,
        wrong: outcome.wrong,
        known_wrong: case.known_wrong,
        margin: (outcome.worst > 0.0).then(|| outcome.worst.recip()),
        textbook_wrong: measurement.textbook_wrong(),
        price,
        first_wrong: outcome.first_wrong.map(|(_, message)| message),
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
            ["| c", "doc", "svg", "\"ve"]
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
        (report.rows[1].wrong, report.rows[1].known_wrong) = (9, 9);
        assert!(check_bounds(&report, false).is_ok());
        let strict = check_bounds(&report, true).expect_err("a broken bound");
        assert!(strict.exit == Exit::Failed && strict.message.contains("P07"));
        report.rows[1].wrong = 10;
        assert!(check_bounds(&report, false).is_err());
    }
}
