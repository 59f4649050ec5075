//! `stability`: errors and cost of the library in hard numerical cases, measured on this machine.

use core::cmp::Ordering;
use std::collections::BTreeMap;
use std::mem;
use std::time::Instant;

use raywright_core::bench::SampleQuantiles;
use raywright_core::stability::{
    CaseCost, CaseOutcome, HardCase, TEXTBOOK, hard_cases, measure_case, time_case_formulas,
};
use raywright_io::Error;
use raywright_io::report::{
    ErrorMarginPlot, ErrorMarginRow, ReportSection, ThemeColour, escape_xml, format_percent,
    format_significant_digits, html_document,
};
use serde::Serialize;

use crate::args::StabilityArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::machine::processor_name;
use crate::origin::command_line;
use crate::progress::StepProgress;
use crate::session::Session;
use crate::table::{ColumnAlignment, Table};
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
    ("html", build_page),
    ("svg", |report| build_margin_plot(report).to_svg()),
    ("md", format_markdown),
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
    console::print_report(args.json, &report, || format_plain(&report))?;
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
        match measure_case(case.number, args.rays) {
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

// Report of `stability`: tables as plain text and as Markdown, a plot of margins, and an HTML page
// with plot and table.

const TITLE: &str = "Margins of the hard cases: error bound over worst error";

/// Explanation of the columns of the table.
const COLUMN_LEGEND: &str = "For each precision: number of wrong results and of judged results, for all kernels of the processor together, and the margin, bound divided by worst \
     error, unless results are only right or wrong. Textbook: share of results that its formulas get wrong. ns: CPU time of one thread for an ordinary \
     ray or sample by the textbook's formula in f32, and the additional time in `robust` and in `reference`.";

/// Names of the precisions, and their colours in the plot.
const PRECISIONS: [(&str, ThemeColour); 2] = [
    ("robust", ThemeColour::First),
    ("reference", ThemeColour::Second),
];

impl CaseReport {
    /// Returns the numbers of wrong and of judged results of all settings that begin with a
    /// precision, and their least margin.
    fn results(&self, precision: &str) -> (u64, u64, Option<f64>) {
        let settings = self.settings.iter();
        let of = settings.filter(|result| result.setting.starts_with(precision));
        of.fold((0, 0, None), |(wrong, judged, margin), result| {
            let margins = [margin, result.margin].into_iter().flatten();
            let margin = margins.reduce(f64::min);
            (wrong + result.wrong, judged + result.judged, margin)
        })
    }

    fn format_results(&self, precision: &str) -> String {
        let (wrong, judged, margin) = self.results(precision);
        let margin = margin.map(|margin| format!(", {}", format_significant_digits(margin, 3)));
        format!("{wrong} of {judged}{}", margin.unwrap_or_default())
    }

    /// Formats the cost in nanoseconds: the textbook's time in single precision, and the additional
    /// time of the library's formula, with its spread, in both precisions.
    fn format_costs(&self) -> String {
        let Some(price) = &self.price else {
            return String::new();
        };
        let more = [0, 1].map(|i| format!(", {:+.1} ± {:.1}", price.more[i], price.spread[i]));
        format!("{:.1}{}", price.textbook, more.concat())
    }

    fn format_textbook(&self) -> String {
        self.textbook_wrong.map(format_percent).unwrap_or_default()
    }

    /// Builds the line of the case in the plot. The margin in a precision is absent if a result
    /// exceeds the bound.
    fn margin_row(&self) -> ErrorMarginRow {
        let (wrong, judged, _) = self.results("");
        let margins = PRECISIONS.into_iter().filter_map(|(name, colour)| {
            let (wrong, _, margin) = self.results(name);
            Some((colour, margin.filter(|_| wrong == 0)?))
        });
        let margins: Vec<_> = margins.collect();
        ErrorMarginRow {
            name: self.case.to_owned(),
            description: self.hard.trim_end_matches('.').to_owned(),
            message: match wrong {
                0 if margins.is_empty() => format!("none of {judged} wrong"),
                0 => String::new(),
                _ => format!("{wrong} of {judged} beyond the bound"),
            },
            margins,
            is_broken: wrong > 0,
            right_text: self.format_textbook(),
        }
    }
}

/// Builds the section with a line for each case, described by `words` below the heading
/// `words_heading`, and notes: cases that only tests verify, and parts that are not measured.
fn build_section(
    report: &StabilityReport,
    words_heading: &str,
    words: fn(&CaseReport) -> String,
) -> ReportSection {
    use ColumnAlignment::{Left, Right};
    let row = |case: &CaseReport| {
        let results = PRECISIONS.map(|(precision, _)| case.format_results(precision));
        let cells = [[case.case.to_owned(), words(case)], results];
        let last = [case.format_textbook(), case.format_costs()];
        cells.into_iter().flatten().chain(last).collect()
    };
    let heads = [
        "case",
        words_heading,
        "robust",
        "reference",
        "textbook",
        "ns",
    ];
    let columns = [Left, Left, Right, Right, Right, Right];
    let left_out = report.left_out.iter();
    let mut notes: Vec<_> = left_out
        .map(|[number, reason]| format!("{number}: {reason}"))
        .collect();
    if !report.tested_only.is_empty() {
        let cases = report.tested_only.join(", ");
        notes.insert(
            0,
            format!("Cases whose bounds only the test suite verifies: {cases}."),
        );
    }
    ReportSection {
        title: "Results".to_owned(),
        explanation: COLUMN_LEGEND.to_owned(),
        table: Table::new(columns, heads, report.cases.iter().map(row)),
        notes,
    }
}

/// Builds the section for Markdown and HTML.
fn build_page_section(report: &StabilityReport) -> ReportSection {
    build_section(report, "what is hard, and the bound", |case| {
        format!("{} Bound: {}", case.hard, case.bound)
    })
}

/// Formats the report as plain text: a line for each case with its name, the worst first.
fn format_plain(report: &StabilityReport) -> String {
    let mut report = report.clone();
    let rank = |case: &CaseReport| {
        let (wrong, _, margin) = case.results("");
        let is_known = case
            .settings
            .iter()
            .all(|result| result.wrong <= case.known_wrong);
        (is_known, wrong == 0, margin.unwrap_or(f64::INFINITY))
    };
    report
        .cases
        .sort_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(Ordering::Equal));
    build_section(&report, "name", |case| case.name.to_owned()).to_text(console::line_width())
}

/// Formats the report as Markdown.
fn format_markdown(report: &StabilityReport) -> String {
    build_page_section(report).to_markdown()
}

/// Builds the plot of margins, with a line for each case.
fn build_margin_plot(report: &StabilityReport) -> ErrorMarginPlot {
    let processor = report.processor.iter().map(|name| format!(" · {name}"));
    ErrorMarginPlot {
        title: TITLE.to_owned(),
        circumstances: format!(
            "Margin: error bound divided by worst error; a bound is kept where the margin is above 1{}",
            processor.collect::<String>()
        ),
        right_heading: "textbook wrong".to_owned(),
        legend: PRECISIONS
            .map(|(name, colour)| (colour, name.to_owned()))
            .to_vec(),
        rows: report.cases.iter().map(CaseReport::margin_row).collect(),
    }
}

/// Builds the HTML page with plot and table.
fn build_page(report: &StabilityReport) -> String {
    let mut plot = build_margin_plot(report);
    let circumstances = escape_xml(&plot.circumstances);
    plot.title.clear();
    let body = format!(
        "<p class=\"answer\">{circumstances}</p>\n<figure><div class=\"wide\" tabindex=\"0\">{}</div></figure>\n{}\
         <p class=\"soft\">Made by <code>{}</code></p>\n",
        plot.to_svg(),
        build_page_section(report).to_html(),
        escape_xml(&command_line()),
    );
    html_document(TITLE, &body, "")
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
        let report = text_tests::report();
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
        let mut report = text_tests::report();
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

#[cfg(test)]
mod text_tests {
    use super::*;
    use crate::commands::stability::{FormulaCost, SettingResult};

    /// Creates a report of a single case in both precisions, for tests.
    pub(crate) fn report() -> StabilityReport {
        let result = |setting: &str, margin| SettingResult {
            setting: setting.to_owned(),
            judged: 1000,
            wrong: 0,
            margin: Some(margin),
            first_wrong: None,
        };
        let case = CaseReport {
            case: "P07",
            name: "planes",
            hard: "Planes.",
            bound: "4u/|n·d|",
            known_wrong: 0,
            textbook_wrong: Some(0.25),
            price: Some(FormulaCost {
                what: "a test",
                textbook: 4.0,
                more: [1.25, 2.0],
                spread: [0.5, 0.25],
            }),
            settings: vec![
                result("robust, avx2", 2.5),
                result("robust, portable", 3.0),
                result("reference", 50.0),
            ],
        };
        StabilityReport {
            version: "1",
            processor: None,
            cases: vec![case],
            tested_only: vec!["S07"],
            left_out: vec![["S21", "No fog."]],
            seconds: 1.0,
        }
    }

    /// Protects: tables have the measured values, their costs, the cases verified by tests alone
    /// and the parts left out; a vertical bar in a bound does not end its cell.
    #[test]
    fn tables_say_everything() {
        let report = report();
        for text in [format_plain(&report), format_markdown(&report)] {
            let words = [
                "P07",
                "robust",
                "of 1000",
                "2.5",
                "25 %",
                "+1.2 ± 0.5, +2.0 ± 0.2",
                "S07",
                "S21: No fog.",
            ];
            assert!(words.iter().all(|word| text.contains(word)), "{text}");
        }
        let page = format_markdown(&report);
        assert!(
            page.contains("4u/\\|n·d\\|") && page.contains("| 0 of 2000, 2.5 | 0 of 1000, 50 |"),
            "{page}"
        );
    }

    /// Protects: the plain table has a line a case with its name; the worst is first, and a known
    /// broken bound comes before those that are held.
    #[test]
    fn the_worst_case_is_first() {
        let report = report();
        let with = |case, margin, wrong, known_wrong| {
            let mut own = report.cases[0].clone();
            (own.case, own.name, own.known_wrong) = (case, case, known_wrong);
            own.settings.truncate(1);
            (own.settings[0].margin, own.settings[0].wrong) = (margin, wrong);
            own
        };
        let cases = vec![
            with("exact", None, 0, 0),
            with("wide", Some(9.0), 0, 0),
            with("known", Some(5.0), 9, 9),
            with("narrow", Some(1.5), 0, 0),
            with("broken", Some(7.0), 1, 0),
        ];
        let text = format_plain(&StabilityReport { cases, ..report });
        let names = ["broken", "known", "narrow", "wide", "exact"];
        let places = names.map(|name| text.find(name).expect("a line"));
        assert!(places.is_sorted(), "{text}");
    }

    /// Protects: the place of a case in the plain table follows its least margin of all settings.
    #[test]
    fn the_worst_setting_places_its_case() {
        let report = report();
        let with = |name, margins: &[f64]| {
            let mut own = report.cases[0].clone();
            own.name = name;
            own.settings.truncate(margins.len());
            for (result, margin) in own.settings.iter_mut().zip(margins) {
                result.margin = Some(*margin);
            }
            own
        };
        let cases = vec![with("even", &[2.0]), with("worse", &[1.5, 9.0])];
        let text = format_plain(&StabilityReport { cases, ..report });
        assert!(text.find("worse") < text.find("even"), "{text}");
    }
}

#[cfg(test)]
mod page_tests {
    use super::text_tests::report;
    use super::*;

    /// Protects: a case has a single line with its least margin in each precision, and shows
    /// results beyond the bound; the page has plot, table and notes.
    #[test]
    fn margins_are_the_least() {
        let mut report = report();
        let plot = build_margin_plot(&report);
        assert_eq!(
            plot.rows[0].margins,
            [(ThemeColour::First, 2.5), (ThemeColour::Second, 50.0)]
        );
        assert!(
            !plot.rows[0].is_broken
                && plot.rows[0].message.is_empty()
                && plot.rows[0].right_text == "25 %"
        );
        report.cases[0].settings[1].wrong = 3;
        let broken = report.cases[0].margin_row();
        assert!(
            broken.is_broken && broken.message == "3 of 3000 beyond the bound",
            "{}",
            broken.message
        );
        assert_eq!(broken.margins, [(ThemeColour::Second, 50.0)]);
        let page = build_page(&report);
        assert!(
            page.contains("<svg")
                && page.contains("4u/|n·d|")
                && page.contains("S21: No fog.")
                && page.contains("not held"),
            "{page}"
        );
    }
}
