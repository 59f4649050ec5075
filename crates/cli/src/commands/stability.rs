//! `stability`: the hard cases, measured on this machine.

use std::time::Instant;

use raywright_core::stability::{HardCase, Measurement, hard_cases, measure};
use raywright_io::{Error, output};
use serde::Serialize;

use crate::args::StabilityArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::progress::Steps;
use crate::table::{Align, lay_out_aligned, significant};
use crate::targets::Outputs;

/// A case in one setting.
#[derive(Debug, Serialize)]
struct Row {
    case: &'static str,
    hard: &'static str,
    bound: &'static str,
    /// Precision and kernel.
    setting: String,
    judged: u64,
    wrong: u64,
    /// How many times its worst error the bound is; none where only right and wrong are told.
    margin: Option<f64>,
    /// Share that the textbook's formulas get wrong.
    textbook_wrong: Option<f64>,
    /// The first that is wrong, with its bits.
    first_wrong: Option<String>,
}

/// What a run measured.
#[derive(Debug, Serialize)]
struct StabilityReport {
    version: &'static str,
    rows: Vec<Row>,
    /// Numbers that are held to their bounds by tests alone.
    tested_only: Vec<&'static str>,
    /// What of a case this program has no such thing for, or does not reach.
    left_out: Vec<[&'static str; 2]>,
    seconds: f64,
}

/// Measures, and prints a table or JSON; fails where a bound is broken.
pub fn run(args: &StabilityArgs, verbosity: Verbosity) -> Result<(), Failure> {
    if let Some(path) = &args.output {
        Outputs::default().add(path, "-o")?;
    }
    let report = measured(args, chosen(&args.cases)?, verbosity);
    if let Some(path) = &args.output {
        output::write_atomically(path, markdown(&report).as_bytes())?;
        verbosity.say(path.display());
    }
    console::print(if args.json { console::json(&report) } else { plain(&report) })?;
    let broken: Vec<&Row> = report.rows.iter().filter(|row| row.wrong > 0).collect();
    match broken.first() {
        None => Ok(()),
        Some(row) => {
            let first = row.first_wrong.as_deref().unwrap_or_default();
            let message = format!(
                "{} of {} rows break their bound; {} in {}: {first}",
                broken.len(),
                report.rows.len(),
                row.case,
                row.setting
            );
            Err(Failure::new(Exit::Failed, message))
        }
    }
}

/// The cases of these numbers; all where none is named.
fn chosen(numbers: &[String]) -> Result<Vec<HardCase>, Failure> {
    let known = |number: &String| hard_cases().find(|case| case.number.eq_ignore_ascii_case(number.trim()));
    if numbers.is_empty() {
        return Ok(hard_cases().collect());
    }
    let of = |number: &String| {
        known(number)
            .ok_or_else(|| Error::usage(format_args!("there is no hard case {number}; they are named as T01 or P21 are")).into())
    };
    numbers.iter().map(of).collect()
}

fn measured(args: &StabilityArgs, cases: Vec<HardCase>, verbosity: Verbosity) -> StabilityReport {
    let (start, mut steps) = (Instant::now(), Steps::start(verbosity));
    let mut report =
        StabilityReport { version: env!("CARGO_PKG_VERSION"), rows: vec![], tested_only: vec![], left_out: vec![], seconds: 0.0 };
    let count = cases.len() as f64;
    for (index, case) in cases.into_iter().enumerate() {
        steps.show(case.number, index as f64 / count);
        match measure(case.number, args.rays.into()) {
            Some(measurements) => report.rows.extend(measurements.into_iter().map(|measurement| row(&case, measurement))),
            None => report.tested_only.push(case.number),
        }
        report.left_out.extend(case.left_out.map(|reason| [case.number, reason]));
    }
    report.seconds = start.elapsed().as_secs_f64();
    report
}

fn row(&HardCase { number, hard, bound, .. }: &HardCase, Measurement { setting, outcome, textbook }: Measurement) -> Row {
    Row {
        case: number,
        hard,
        bound,
        setting,
        judged: outcome.judged,
        wrong: outcome.wrong,
        margin: (outcome.worst > 0.0).then(|| outcome.worst.recip()),
        textbook_wrong: textbook.map(|textbook| textbook.wrong_share()),
        first_wrong: outcome.first.map(|(_, message)| message),
    }
}

/// The cells of a row but for what is hard and its bound.
fn cells(row: &Row) -> [String; 6] {
    let number = |value: Option<f64>, of: &dyn Fn(f64) -> String| value.map_or_else(|| "-".to_owned(), of);
    [
        row.case.to_owned(),
        row.setting.clone(),
        row.judged.to_string(),
        row.wrong.to_string(),
        number(row.margin, &|margin| significant(margin, 3)),
        number(row.textbook_wrong, &|share| format!("{} %", significant(100.0 * share, 3))),
    ]
}

const HEADS: [&str; 6] = ["case", "setting", "judged", "wrong", "margin", "textbook wrong"];

fn plain(report: &StabilityReport) -> String {
    let rows: Vec<[String; 6]> = core::iter::once(HEADS.map(str::to_owned)).chain(report.rows.iter().map(cells)).collect();
    let columns = [Align::Left, Align::Left, Align::Right, Align::Right, Align::Right, Align::Right];
    format!("{}{}", lay_out_aligned(columns, &rows), rest(report, "\n"))
}

/// What the table does not have.
fn rest(report: &StabilityReport, gap: &str) -> String {
    let mut text = String::new();
    if !report.tested_only.is_empty() {
        text += &format!("{gap}Held to their bounds by tests alone: {}.\n", report.tested_only.join(", "));
    }
    for [number, reason] in &report.left_out {
        text += &format!("{gap}{number}: {reason}\n");
    }
    text
}

fn markdown(report: &StabilityReport) -> String {
    let mut text = "| case | what is hard | bound | setting | judged | wrong | margin | textbook wrong |\n|---|---|---|---|---|---|---|---|\n".to_owned();
    for row in &report.rows {
        let [case, cells @ ..] = cells(row);
        let bound = row.bound.replace('|', "\\|");
        text += &format!("| {case} | {} | {bound} | {} |\n", row.hard, cells.join(" | "));
    }
    text + &rest(report, "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: numbers are found whatever their case is, and a wrong one is a usage error that says how they are named.
    #[test]
    fn cases_are_chosen_by_number() {
        let numbers = |list: &[&str]| chosen(&list.iter().map(|&word| word.to_owned()).collect::<Vec<_>>());
        let found: Vec<_> = numbers(&["t01", "P21"]).expect("two cases").iter().map(|case| case.number).collect();
        assert_eq!(found, ["T01", "P21"]);
        assert_eq!(numbers(&[]).expect("all").len(), 89);
        let unknown = numbers(&["T99"]).expect_err("none");
        assert!(unknown.exit == Exit::Usage && unknown.message.contains("T99"), "{}", unknown.message);
    }

    /// Protects: tables say what was measured, what tests alone hold and what is left out; a bar in a bound ends no cell.
    #[test]
    fn tables_say_everything() {
        let row = Row {
            case: "P07",
            hard: "Planes.",
            bound: "4u/|n·d|",
            setting: "robust".to_owned(),
            judged: 1000,
            wrong: 0,
            margin: Some(2.5),
            textbook_wrong: Some(0.25),
            first_wrong: None,
        };
        let report = StabilityReport {
            version: "1",
            rows: vec![row],
            tested_only: vec!["S07"],
            left_out: vec![["S21", "No fog."]],
            seconds: 1.0,
        };
        for text in [plain(&report), markdown(&report)] {
            assert!(
                ["P07", "robust", "1000", "2.5", "25 %", "S07", "S21: No fog."].iter().all(|word| text.contains(word)),
                "{text}"
            );
        }
        assert!(markdown(&report).contains("4u/\\|n·d\\|"));
    }
}
