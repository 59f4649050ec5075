//! Cells of the tables: an artificial report, and its figures in text tables and CSV.

use raywright_core::accuracy::{
    AccuracyReport, ConfidenceInterval, EffectCost, EffectCosts, LadderReport, MeasuredSetting,
    OutputFormatReport, Recommendations, ReferenceReport, ReportPictures, RungCost, RungReport,
    SettingErrors, TileReport,
};
use raywright_core::bench::SampleQuantiles;
use raywright_io::LoadedScene;

use super::super::csv::format_csv;
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

/// Creates a measurement in which all figures differ.
fn measured(relmse: ConfidenceInterval, rmse: ConfidenceInterval) -> MeasuredSetting {
    let errors = SettingErrors {
        rmse,
        relmse,
        bias: Some(interval(1.21e-4, 1.0e-4, 1.44e-4)),
        light: interval(0.919, 0.918, 0.92),
    };
    let (seconds, ratio) = (interval(25.0, 22.5, 27.5), interval(1.75, 1.7499, 1.7501));
    MeasuredSetting {
        renders: 4,
        seconds,
        ratio,
        rays: 12_345,
        errors,
    }
}

fn seen() -> MeasuredSetting {
    measured(interval(0.09, 0.04, 0.16), interval(0.35, 0.3, 0.4))
}

fn rung_report(name: &str, in_use: bool, measured: Option<MeasuredSetting>) -> RungReport {
    RungReport {
        rung: name.to_owned(),
        about: "what it is",
        in_use,
        flag: Some(format!("--rung a={name}")),
        measured,
        cost: None,
    }
}

pub fn report() -> AccuracyReport {
    let lost = measured(interval(0.01, 0.0, 0.04), interval(0.02, 0.0, 0.3));
    let rungs = vec![
        rung_report("quick", false, Some(seen())),
        rung_report("plain", true, Some(lost)),
        rung_report("exact", false, None),
    ];
    let price = |name: &str, same_bits: bool| RungReport {
        cost: Some(RungCost {
            preparing: 0.5,
            geometry: 3 << 20,
            same_bits,
        }),
        ..rung_report(name, name == "tree", Some(seen()))
    };
    let output = |rung, bytes_per_pixel, seconds| OutputFormatReport {
        rung,
        about: "",
        in_use: rung == "8",
        bytes_per_pixel,
        seconds,
        rmse: 0.0012,
        greatest: 0.0034,
        flip: 0.0056,
        clipped: 0.125,
    };
    let cost = EffectCost {
        effect: "shadows",
        seconds_without: spread(0.5),
        ratio: spread(1.5),
        rays: 2.25,
        rmse: 0.0125,
        flip: 0.25,
    };
    let costs = EffectCosts {
        size: [64, 36],
        seconds: spread(0.75),
        effects: vec![cost],
        late: vec!["sky"],
    };
    AccuracyReport {
        size: [640, 360],
        tiles: TileReport {
            edge: 32,
            measured: 9,
            all: 240,
        },
        reference: ReferenceReport {
            samples: 64,
            rungs: vec![],
            standard_error: 0.001,
            seconds: 3.0,
            reused: false,
        },
        recommendations: Recommendations::default(),
        own: seen(),
        doubt: None,
        ladders: vec![
            LadderReport {
                ladder: "a",
                in_use: "plain".to_owned(),
                rungs,
            },
            LadderReport {
                ladder: "accelerator",
                in_use: "tree".to_owned(),
                rungs: vec![
                    price("tree", true),
                    price("scan", false),
                    rung_report("boxes", false, None),
                ],
            },
        ],
        combinations: vec![],
        outputs: vec![
            output("8", 3, Some(spread(0.004))),
            output("float", 12, None),
        ],
        inapplicable: vec![],
        costs: Some(costs),
        frontier: vec![],
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
    report: &'a AccuracyReport,
) -> AccuracyDocument<'a> {
    let settings = raywright_core::Settings::from_scene(&loaded.scene);
    AccuracyDocument::new(loaded, requested, &settings, 1, report)
}

/// Formats a measurement for the terminal.
fn text_of(report: &AccuracyReport) -> String {
    format_report(&document(&loaded(), &[], report))
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
        "rung CPU time × in use error RMSE bias light"
    );
    assert_eq!(
        words(&text, "as it is"),
        "as it is * 25.0 s ±10 % 1.75 0.300 (0.200 to 0.400) 0.350 ±14 % 0.0110 ±9 % -8.1 %"
    );
    assert_eq!(
        words(&text, "quick"),
        "quick 25.0 s ±10 % 1.75 0.300 (0.200 to 0.400) 0.350 ±14 % 0.0110 ±9 % -8.1 %"
    );
    assert_eq!(
        words(&text, "plain *"),
        "plain * 25.0 s ±10 % 1.75 <0.200 <0.300 0.0110 ±9 % -8.1 %"
    );
    assert_eq!(
        words(&text, "Not measured for lack"),
        "Not measured for lack of time: a=exact, accelerator=boxes."
    );
    assert!(
        !text.contains("Slower and less") && !text.contains("below:"),
        "{text}"
    );
    let quick = report.ladders[0].rungs[0]
        .measured
        .as_mut()
        .expect("figures");
    (quick.ratio, quick.errors.relmse.value) = (ConfidenceInterval::from_exact(1.9), 0.1);
    let text = text_of(&report);
    assert_eq!(
        words(&text, "Slower and less"),
        "Slower and less accurate than the rung in use: a=quick."
    );
    assert!(!text.contains("  quick"), "{text}");
    report.combinations = vec![MeasuredSettingWithFlags {
        flags: vec!["--rung samples=4".to_owned(), "--rung clamp=1".to_owned()],
        measured: seen(),
    }];
    let text = text_of(&report);
    let (_, together) = text.split_once("changed together\n").expect("a title");
    assert_eq!(
        words(together, "samples=4"),
        "samples=4 clamp=1 25.0 s ±10 % 1.75 0.300 (0.200 to 0.400) 0.350 ±14 % 0.0110 ±9 % -8.1 %"
    );
}

/// Protects: the summary comes first, and the settings on the Pareto frontier before everything
/// else. Each setting has only its own flags, and the part that all commands have in common appears
/// once.
#[test]
fn what_to_do_comes_first() {
    let (loaded, mut report) = (loaded(), report());
    let candidate = |flags: &[&str]| MeasuredSettingWithFlags {
        flags: flags.iter().map(|&flag| flag.to_owned()).collect(),
        measured: seen(),
    };
    report.frontier = vec![candidate(&["--rung samples=4"]), candidate(&[])];
    let text = format_report(&document(&loaded, &["--at 2".to_owned()], &report));
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
            && place("measured at the size of the render") < place("as it is *"),
        "{text}"
    );
    assert_eq!(text.matches("raywright render").count(), 1, "{text}");
    let row = |line: &&str| {
        line.split_whitespace().collect::<Vec<_>>().join(" ")
            == "(1) 25.0 s ±10 % 1.75 0.300 (0.200 to 0.400) -8.1 % --spp 4"
    };
    assert_eq!(lines.iter().filter(|line| row(line)).count(), 1, "{text}");
}

/// Protects: the page has the table's figures, and a line that lists slower and worse settings. The
/// plot has an arrow for a value known only by its upper bound, and the setting numbers of the
/// table.
#[test]
fn the_page_says_the_same() {
    let (loaded, mut report) = (loaded(), report());
    let mut lost = seen();
    lost.errors.relmse.low = 0.0;
    let candidate = |flag: &str, measured| MeasuredSettingWithFlags {
        flags: vec![flag.to_owned()],
        measured,
    };
    report.frontier = vec![
        candidate("--rung samples=4", seen()),
        candidate("--rung samples=16", lost),
    ];
    let rungs = &mut report.ladders[0].rungs;
    let mut slow = rungs[0].clone();
    slow.rung = "slow".to_owned();
    slow.measured.iter_mut().for_each(|each_measured| {
        (each_measured.ratio, each_measured.errors.relmse.value) =
            (ConfidenceInterval::from_exact(1.9), 0.1)
    });
    rungs.push(slow);
    let document = document(&loaded, &[], &report);
    let page = document.format_as(super::super::file::AccuracyFileKind::Html);
    for words in [
        "<p class=\"answer\">Setting in use: error 0.3 (0.2 to 0.4), ",
        "<td>25.0\u{a0}s ±10\u{a0}%</td><td>1.75</td><td>0.300 (0.200\u{a0}to 0.400)</td>",
        "<td>-8.1\u{a0}%</td><td class=\"text\"><code>--spp 4</code></td>",
        "<p>Slower and less accurate than the rung in use: a=slow.</p>",
        "<p>Not measured for lack of time: a=exact, accelerator=boxes.</p>",
    ] {
        assert!(page.contains(words), "no {words} in {page}");
    }
    assert!(!page.contains(">slow</td>"), "{page}");
    let svg = document.format_as(super::super::file::AccuracyFileKind::Svg);
    assert!(
        svg.contains(">(1)</text>")
            && svg.contains(">(1)  --spp 4<")
            && svg.contains(">an upper bound, within noise<"),
        "{svg}"
    );
    // All points lie between ten and a hundred seconds, which are the ends of the axis.
    assert!(
        svg.contains(">10 s</text>")
            && svg.contains(">100 s</text>")
            && !svg.contains(">1 s</text>"),
        "{svg}"
    );
}

/// Protects: each figure of a rung that changes no picture, of a file format and of an effect is in
/// its column: memory in its unit, shares in percent, and the time that an effect adds, not the
/// total.
#[test]
fn figures_of_prices_files_and_effects() {
    let text = text_of(&report());
    let (_, prices) = text
        .split_once("Rungs that change no picture")
        .expect("a title");
    assert_eq!(
        words(prices, "rung"),
        "rung CPU time × in use preparing memory"
    );
    assert_eq!(
        words(prices, "tree *"),
        "tree * 25.0 s ±10 % 1.75 500 ms 3 MiB"
    );
    assert_eq!(
        words(prices, "scan"),
        "scan 25.0 s ±10 % 1.75 500 ms 3 MiB, DIFFERENT PICTURE"
    );
    assert!(!prices.contains("boxes"), "{prices}");
    let (_, files) = prices
        .split_once("Precision of the file formats")
        .expect("a title");
    assert_eq!(
        words(files, "rung"),
        "rung bytes a pixel coding RMSE greatest FLIP clipped"
    );
    assert_eq!(
        words(files, "8 *"),
        "8 * 3 4 ms 0.00120 0.00340 0.00560 12.5 %"
    );
    assert_eq!(
        words(files, "float"),
        "float 12 0.00120 0.00340 0.00560 12.5 %"
    );
    // The effects of a lit scene, of which one has a cost.
    let mut effects = raywright_core::effects::assess_effects(
        &loaded().scene,
        &raywright_core::Settings::from_scene(&loaded().scene),
    );
    effects
        .effects
        .retain(|finding| finding.effect.name() == "shadows");
    effects.effects[0].status = raywright_core::effects::EffectStatus::Simulated;
    let costs = report().costs;
    let text = raywright_io::report::effect_section(costs.as_ref(), &effects, false).to_text(None);
    assert!(
        text.contains("at 64x36 pixels, in 750 ms of CPU time with all effects")
            && text.contains("lack of time (give a larger --budget): sky."),
        "{text}"
    );
    assert_eq!(
        words(&text, "effect"),
        "effect added time added rays change of picture, RMSE FLIP"
    );
    assert_eq!(
        words(&text, "shadows"),
        "shadows +50 % (+5 % to +140 %) +125 % 0.0125 0.250"
    );
}

/// Protects: each figure is in the CSV column of its name, as measured.
#[test]
fn figures_in_csv() {
    let text = format_csv(&report());
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().expect("names");
    let lines: Vec<Vec<&str>> = lines.collect();
    let at = |rung: &str, column: &str| {
        let line = lines
            .iter()
            .find(|line| line[1] == rung)
            .unwrap_or_else(|| panic!("{rung} in {text}"));
        line[names
            .iter()
            .position(|name| *name == column)
            .unwrap_or_else(|| panic!("{column} in {names:?}"))]
    };
    for (rung, column, value) in [
        ("", "ladder", "own"),
        ("quick", "ladder", "a"),
        ("quick", "in_use", "false"),
        ("plain", "in_use", "true"),
        ("quick", "flags", "--rung a=quick"),
        ("quick", "renders", "4"),
        ("quick", "seconds", "25"),
        ("quick", "seconds_low", "22.5"),
        ("quick", "seconds_high", "27.5"),
        ("quick", "ratio_high", "1.7501"),
        ("quick", "ratio", "1.75"),
        ("quick", "rays", "12345"),
        ("quick", "rmse", "0.35"),
        ("quick", "rmse_low", "0.3"),
        ("quick", "rmse_high", "0.4"),
        ("quick", "bias", "0.011"),
        ("quick", "bias_high", "0.012"),
        ("quick", "light", "0.919"),
        ("quick", "light_low", "0.918"),
        ("quick", "root_relmse", "0.3"),
        ("quick", "root_relmse_low", "0.2"),
        ("quick", "root_relmse_high", "0.4"),
        ("exact", "seconds", ""),
        ("tree", "preparing_seconds", "0.5"),
        ("tree", "geometry_bytes", "3145728"),
        ("tree", "same_bits", "true"),
        ("scan", "same_bits", "false"),
        ("8", "bytes_per_pixel", "3"),
        ("8", "seconds", "0.004"),
        ("8", "greatest", "0.0034"),
        ("8", "clipped", "0.125"),
        ("shadows", "seconds", "0.5"),
        ("shadows", "ratio", "1.5"),
        ("shadows", "rmse", "0.0125"),
    ] {
        // Quartiles are products and carry a rounding error.
        let found = at(rung, column);
        let near = || Some((found.parse::<f64>().ok()? - value.parse::<f64>().ok()?).abs() < 1e-12);
        assert!(
            found == value || near() == Some(true),
            "{rung}, {column}: {found}, not {value}"
        );
    }
}
