//! `stability`: errors and cost of the library in hard numerical cases, measured on this machine.

mod page;
mod text;

use std::path::Path;
use std::time::Instant;

use raywright_core::bench::SampleQuantiles;
use raywright_core::stability::{
    CaseCost, HardCase, Measurement, hard_cases, measure_case, time_case_formulas,
};
use raywright_io::{Error, output};
use serde::Serialize;

use crate::args::StabilityArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::machine::processor_name;
use crate::progress::StepProgress;
use crate::targets::OutputFiles;

/// Result of a numerically hard case in one setting: a precision, and a kernel (the instruction set
/// of the traversal code).
#[derive(Clone, Debug, Serialize)]
struct HardCaseResult {
    /// Number of the case, such as `T01`.
    case: &'static str,
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

/// Content of an output file of `stability`, selected by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StabilityFileKind {
    Markdown,
    /// An HTML page with plot and table.
    Html,
    /// An SVG plot of the margins: ratios of the error bound to the worst error.
    Svg,
    Json,
}

impl StabilityFileKind {
    fn from_path(path: &Path) -> Result<Self, Failure> {
        let ending = path
            .extension()
            .map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("md") => Ok(Self::Markdown),
            Some("html") => Ok(Self::Html),
            Some("svg") => Ok(Self::Svg),
            Some("json") => Ok(Self::Json),
            _ => Err(Error::invalid_usage(format_args!(
                "{}: the extension of this name is no known output format",
                path.display()
            ))
            .with_hint("use a name that ends in .html, .svg, .md or .json")
            .into()),
        }
    }
}

/// Runs `stability`: measures, writes the requested file, and prints a table or JSON.
///
/// Fails if a result exceeds its bound.
pub fn run(args: &StabilityArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let target = args
        .output
        .as_ref()
        .map(|path| Ok::<_, Failure>((path, StabilityFileKind::from_path(path)?)))
        .transpose()?;
    if let Some((path, _)) = target {
        OutputFiles::default().add_output(path, "-o")?;
    }
    let report = measure_cases(args, select_cases(&args.cases)?, verbosity);
    if let Some((path, kind)) = target {
        let text = match kind {
            StabilityFileKind::Markdown => text::format_markdown(&report),
            StabilityFileKind::Html => page::build_page(&report),
            StabilityFileKind::Svg => page::build_margin_plot(&report).to_svg(),
            StabilityFileKind::Json => console::format_json(&report),
        };
        output::write_atomically(path, text.as_bytes())?;
        verbosity.print_result_message(path.display());
    }
    console::print(if args.json {
        console::format_json(&report)
    } else {
        text::format_plain(&report)
    })?;
    let broken: Vec<&HardCaseResult> = report.rows.iter().filter(|row| row.wrong > 0).collect();
    match broken.first() {
        None => Ok(()),
        Some(row) => {
            let first = row.first_wrong.as_deref().unwrap_or_default();
            let message = format!(
                "{} of {} results exceed their error bound; the first is case {} in {}: {first}",
                broken.len(),
                report.rows.len(),
                row.case,
                row.setting
            );
            let known =
                |row: &&HardCaseResult| report.left_out.iter().any(|[case, _]| *case == row.case);
            let known = if broken.iter().all(known) {
                " (all of these cases are known, and the report states the reasons)"
            } else {
                ""
            };
            Err(Failure::new(Exit::Failed, message + known))
        }
    }
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
                report.rows.extend(
                    measurements
                        .into_iter()
                        .map(|measurement| build_case_result(&case, measurement, price.as_ref())),
                );
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
    &HardCase {
        number,
        difficulty: hard,
        bound,
        ..
    }: &HardCase,
    Measurement {
        setting,
        outcome,
        textbook,
    }: Measurement,
    price: Option<&CaseCost>,
) -> HardCaseResult {
    let price = price.map(
        |&CaseCost {
             label,
             textbook,
             overhead: more,
         }| {
            let more: SampleQuantiles = more[usize::from(setting.starts_with("reference"))];
            FormulaCost {
                what: label,
                textbook: textbook.median,
                more: more.median,
                spread: 0.5 * (more.upper_quartile - more.lower_quartile),
            }
        },
    );
    HardCaseResult {
        case: number,
        hard,
        bound,
        setting,
        judged: outcome.judged,
        wrong: outcome.wrong,
        margin: (outcome.worst > 0.0).then(|| outcome.worst.recip()),
        textbook_wrong: textbook.map(|textbook| textbook.wrong_fraction()),
        price,
        first_wrong: outcome.first_wrong.map(|(_, message)| message),
    }
}

#[cfg(test)]
mod tests {
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
        let kind = |name: &str| StabilityFileKind::from_path(Path::new(name));
        assert_eq!(
            ["a.md", "b.HTML", "c.svg", "d.json"].map(|name| kind(name).ok()),
            [
                Some(StabilityFileKind::Markdown),
                Some(StabilityFileKind::Html),
                Some(StabilityFileKind::Svg),
                Some(StabilityFileKind::Json)
            ]
        );
        let unknown = kind("page.txt").expect_err("no such kind");
        assert!(
            unknown.exit == Exit::Usage && unknown.message.contains("page.txt"),
            "{}",
            unknown.message
        );
    }
}
