//! Cells of the tables: an artificial report, and its figures in text tables and on the page.

use raywright_core::accuracy::{
    AccuracyReport, ConfidenceInterval, LadderInUse, MeasuredSetting, Recommendations,
    ReferenceReport, ReportPictures, RungSetting, SettingErrors, TileReport,
};
use raywright_core::bench::SampleQuantiles;
use raywright_core::effect_costs::{EffectCost, EffectCosts};
use raywright_core::ladder::RungChoice;
use raywright_io::LoadedScene;

use super::*;

/// Returns quantiles whose half interquartile range is a tenth of the median.
fn spread(median: f64) -> SampleQuantiles {
    SampleQuantiles {
        median,
        lower_quartile: 0.9 * median,
        upper_quartile: 1.1 * median,
        min: 0.7 * median,
        max: 1.6 * median,
    }
}

fn interval(value: f64, low: f64, high: f64) -> ConfidenceInterval {
    ConfidenceInterval { value, low, high }
}

/// Creates a measurement of rungs in which all figures differ.
fn measured(rungs: &[&str], square: ConfidenceInterval) -> MeasuredSetting {
    let choice = |rung: &&str| RungChoice::parse(rung).expect("a rung");
    let choices: Vec<RungChoice> = rungs.iter().map(choice).collect();
    MeasuredSetting {
        setting: RungSetting::from_rungs(&choices),
        flags: Vec::new(),
        seconds: interval(25.0, 22.5, 27.5),
        ratio: interval(1.75, 1.7499, 1.7501),
        errors: SettingErrors {
            root_relmse: square.map(f64::sqrt),
            bias: Some(interval(0.011, 0.01, 0.012)),
            light: interval(0.919, 0.918, 0.92),
        },
        error_ratio: ConfidenceInterval::from_exact(0.9),
    }
}

fn seen(rungs: &[&str]) -> MeasuredSetting {
    measured(rungs, interval(0.09, 0.04, 0.16))
}

pub fn report() -> AccuracyReport {
    let lost = measured(&["samples=16"], interval(0.01, 0.0, 0.04));
    AccuracyReport {
        size: [640, 360],
        tiles: TileReport {
            edge: 32,
            measured: 9,
            all: 240,
        },
        reference: ReferenceReport {
            samples: 64,
            rungs: RungSetting::default(),
            error: 0.001,
            seconds: 3.0,
        },
        settings: vec![seen(&[]), seen(&["samples=4"]), lost],
        frontier: vec![0],
        recommendations: Recommendations::default(),
        doubt: None,
        ladders: vec![LadderInUse {
            ladder: "samples",
            in_use: "64".to_owned(),
        }],
        unmeasured: vec!["--spp 1024".to_owned()],
        sufficient_budget: None,
        seconds: 12.0,
        cut_short: false,
        pictures: ReportPictures::default(),
    }
}

/// Returns the line of `text` that begins with `start`, with single spaces between its words.
#[track_caller]
fn words(text: &str, start: &str) -> String {
    let line = text
        .lines()
        .find(|line| line.trim_start().starts_with(start))
        .unwrap_or_else(|| panic!("{start} in {text}"));
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns a scene file without content.
fn loaded() -> LoadedScene {
    let input = raywright_io::Input::Bytes {
        name: "x.scene.toml".to_owned(),
        bytes: b"format = 1".to_vec(),
        resolver: None,
    };
    raywright_io::load(&input, &raywright_io::LoadOptions::default()).expect("a scene")
}

/// Combines a measurement with a scene without content.
fn document<'a>(
    loaded: &'a LoadedScene,
    requested: &[String],
    report: &'a mut AccuracyReport,
) -> AccuracyDocument<'a> {
    let settings = raywright_core::Settings::from_scene(&loaded.scene);
    AccuracyDocument::new(loaded, requested, &settings, 1, report)
}

/// Formats a measurement for the terminal.
fn text_of(report: &AccuracyReport) -> String {
    format_report(&document(&loaded(), &[], &mut report.clone()))
}

/// Protects: each figure of a rung is in its column: time, ratio, roots of relMSE and bias, and
/// light. An uncertainty below the last digit is not shown; a
/// larger uncertainty is shown in percent or by both ends of the interval. Settings of several
/// rungs follow below the table.
#[test]
fn figures_of_rungs() {
    let mut report = report();
    let text = text_of(&report);
    assert_eq!(
        words(&text, "rung"),
        "rung CPU time × in use error bias light"
    );
    let figures = "25.0 s ±10 % 1.75 0.300 (0.200 to 0.400) 0.0110 ±9 % -8.1 %";
    let (_, rungs) = text.split_once("changed one at a time").expect("a title");
    assert_eq!(words(rungs, "in use"), format!("in use {figures}"));
    assert_eq!(words(rungs, "samples"), "samples (in use: 64)");
    assert_eq!(words(rungs, "4 "), format!("4 {figures}"));
    assert_eq!(
        words(rungs, "16 "),
        "16 25.0 s ±10 % 1.75 <0.200 0.0110 ±9 % -8.1 %"
    );
    assert_eq!(
        words(&text, "Not measured for lack"),
        "Not measured for lack of time: `--spp 1024`."
    );
    assert!(
        !text.contains("Slower and less") && !text.contains("several rungs"),
        "{text}"
    );
    report.settings[1].error_ratio = ConfidenceInterval::from_exact(1.2);
    report.settings.push(seen(&["samples=4", "clamp=1"]));
    let text = text_of(&report);
    assert_eq!(
        words(&text, "Slower and less"),
        "Slower and less accurate than the rung in use: `--spp 4`."
    );
    assert!(!text.contains("\n  4 "), "{text}");
    let (_, together) = text.split_once("of several rungs\n").expect("a title");
    assert_eq!(
        words(together, "--spp"),
        format!("--spp 4 --rung clamp=1 {figures}")
    );
}

/// Protects: the summary comes first, and the settings on the Pareto frontier before everything
/// else. Each setting has only its own flags, and the part that all commands have in common appears
/// once.
#[test]
fn what_to_do_comes_first() {
    let (loaded, mut report) = (loaded(), report());
    report.frontier = vec![1, 0];
    let text = format_report(&document(&loaded, &["--at 2".to_owned()], &mut report));
    let lines: Vec<&str> = text.lines().collect();
    assert!(
        lines[1].starts_with("Setting in use: error 0.3 (0.2 to 0.4), 25.0 s ±10 % of CPU time."),
        "{text}"
    );
    let place = |words: &str| {
        lines
            .iter()
            .position(|line| line.contains(words))
            .unwrap_or_else(|| panic!("no {words} in {text}"))
    };
    assert!(
        place("Worth their time") < place("measured at the size of the render")
            && place("measured at the size of the render") < place("changed one at a time"),
        "{text}"
    );
    assert_eq!(text.matches("raywright render").count(), 1, "{text}");
    let row = |line: &&str| {
        line.split_whitespace().collect::<Vec<_>>().join(" ")
            == "(1) 25.0 s ±10 % 1.75 0.300 (0.200 to 0.400) -8.1 % --spp 4"
    };
    assert_eq!(lines.iter().filter(|line| row(line)).count(), 1, "{text}");
}

/// Protects: the setting in use stands in the table of settings worth their time, in the plot and on the
/// page, whether it is one of them or not, and the reason stands beside it.
#[test]
fn the_setting_in_use_is_always_shown() {
    let (loaded, mut report) = (loaded(), report());
    let told = |report: &AccuracyReport, reason: &str, is_drawn: bool| {
        let mut report = report.clone();
        let document = document(&loaded, &["--rung clamp=10".to_owned()], &mut report);
        let text = format_report(&document);
        let (table, _) = text.split_once("measured at the size").expect("conditions");
        let named = format!("in use (--rung clamp=10){reason}");
        let row = table.lines().find(|line| line.contains("in use ("));
        let words: Vec<&str> = text.split_whitespace().collect();
        assert!(words.join(" ").contains(&named), "{named} in\n{text}");
        assert!(row.is_some_and(|row| row.contains("25.0 s")), "{text}");
        let page = document.page.to_html();
        let (_, caption) = page.split_once("less error below.").expect("a caption");
        let caption = caption.replace("<code>", "").replace("</code>", "");
        assert!(
            caption.starts_with(&format!(" Setting {named}.")),
            "{caption}"
        );
        assert_eq!(page.contains("<title>in use</title>"), is_drawn, "{page}");
    };
    told(&report, "", true);
    let mut better = seen(&["samples=4"]);
    better.seconds = interval(12.0, 11.0, 13.0);
    report.settings.push(better.clone());
    report.frontier = vec![3];
    told(
        &report,
        "; --spp 4 --rung clamp=10 has the same error in less time",
        true,
    );
    report.settings[3].errors.root_relmse = interval(0.1, 0.09, 0.11);
    told(
        &report,
        "; --spp 4 --rung clamp=10 has less error in less time",
        true,
    );
    report.settings[3].seconds = report.settings[0].seconds;
    told(
        &report,
        "; --spp 4 --rung clamp=10 has less error in the same time",
        true,
    );
    report.settings[3].seconds = interval(23.0, 22.0, 24.0);
    told(
        &report,
        "; --spp 4 --rung clamp=10 has less error in a little less time",
        true,
    );
    report.frontier = vec![3, 0];
    report.settings[0].errors.root_relmse = ConfidenceInterval::UNKNOWN;
    told(
        &report,
        "; its error is not known, so that it cannot be compared",
        false,
    );
}

/// Protects: a page without a known error says so in place of a plot without points.
#[test]
fn a_page_without_errors_has_no_plot() {
    let (loaded, mut report) = (loaded(), report());
    for row in &mut report.settings {
        row.errors.root_relmse = ConfidenceInterval::UNKNOWN;
    }
    let page = document(&loaded, &[], &mut report).page.to_html();
    assert!(
        page.contains("nothing can be drawn") && !page.contains("role=\"group\""),
        "{page}"
    );
}

/// Protects: the page has the table's figures, and a line that lists slower and worse settings. The
/// plot has an arrow for a value known only by its upper bound, and the setting numbers of the
/// table.
#[test]
fn the_page_says_the_same() {
    let (loaded, mut report) = (loaded(), report());
    report.frontier = vec![1, 2];
    let mut slow = seen(&["clamp=1"]);
    slow.error_ratio = ConfidenceInterval::from_exact(1.2);
    report.settings.push(slow);
    let document = document(&loaded, &[], &mut report);
    let page = document.page.to_html();
    for words in [
        "<p class=\"answer\">Setting in use: error 0.3 (0.2 to 0.4), ",
        "<td>25.0\u{a0}s ±10\u{a0}%</td><td>1.75</td><td>0.300 (0.200\u{a0}to 0.400)</td>",
        "<td>-8.1\u{a0}%</td><td class=\"text\"><code>--spp 4</code></td>",
        "<p>Slower and less accurate than the rung in use: <code>--rung clamp=1</code>.</p>",
        "<p>Not measured for lack of time: <code>--spp 1024</code>.</p>",
    ] {
        assert!(page.contains(words), "no {words} in {page}");
    }
    assert!(!page.contains(">1</td>"), "{page}");
    assert!(
        page.contains(">(1)</text>") && page.contains(">an upper bound, within noise<"),
        "{page}"
    );
    // All points lie between ten and a hundred seconds, which are the ends of the axis.
    assert!(
        page.contains(">10 s</text>")
            && page.contains(">100 s</text>")
            && !page.contains(">1 s</text>"),
        "{page}"
    );
}

/// Protects: each figure of an effect's cost is in its column: the time that it adds, not the total.
#[test]
fn figures_of_effects() {
    let cost = EffectCost {
        effect: "shadows",
        ratio: spread(1.5),
        rays: 2.25,
        rmse: 0.0125,
    };
    let costs = EffectCosts {
        size: [64, 36],
        seconds: spread(0.75),
        effects: vec![cost],
        late: vec!["sky"],
    };
    let text = crate::commands::explain::effect_section(&costs).to_text(None);
    assert!(
        text.contains("at 64x36 pixels, in 750 ms of CPU time with all effects")
            && text.contains("lack of time (give a larger --budget): sky."),
        "{text}"
    );
    assert_eq!(
        words(&text, "effect"),
        "effect added time added rays change of picture, RMSE"
    );
    assert_eq!(
        words(&text, "shadows"),
        "shadows +50 % (+5 % to +140 %) +125 % 0.0125"
    );
}
