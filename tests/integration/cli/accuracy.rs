//! `accuracy`: contents of its table, JSON and CSV, equivalence of its flags with those of
//! `render`, and its usage errors. No measured time is judged.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::support::Sandbox;

/// A mirror ball over a floor, under a lamp.
pub const SCENE: &str = r#"
format = 1
render = { size = [64, 48], samples = 4, max_depth = 4 }
cameras = [{ name = "front", pose.look_at = { eye = [0, 1, 5], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 40 } }]
lights = [{ kind.directional = { to_light = [1, 2, 1] }, colour = 2 }]
sky.constant = [0.3, 0.4, 0.5]
materials = [{ name = "mirror", model.classic = { reflection = { weight = 0.5 } } }, { name = "floor", model.classic = {} }]
objects = [
  { shape.sphere = { centre = [0, 0, 0], radius = 1 }, material = "mirror" },
  { shape.plane = { point = [0, -1, 0], normal = [0, 1, 0] }, material = "floor" },
]
"#;

fn quick(more: &[&'static str]) -> Vec<&'static str> {
    [
        &[
            "accuracy",
            "ball.scene.toml",
            "--size",
            "16x12",
            "--budget",
            "10min",
            "--rounds",
            "2",
        ],
        more,
    ]
    .concat()
}

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("ball.scene.toml", SCENE);
    sandbox
}

/// Protects: the summary and the settings worth their time come first, then the conditions of the
/// comparison; each rung has a row, except those slower and worse; the current rung is marked;
/// ladders without effect on the scene are named instead of measured.
#[test]
fn every_rung_has_a_row() {
    let sandbox = sandbox();
    let run = sandbox.run(&quick(&["--rung", "precision=robust"]));
    run.exits_with(0);
    let text = run.text();
    for words in [
        "ball.scene.toml\nSetting in use: error ",
        "of CPU time",
        "measured at the size of the render, 16x12 pixels: the whole picture",
        "reference picture: double precision (f64)",
        "standard error",
        "  robust *",
        "  reference ",
        "  4 *",
        "  1024 ",
        "Without effect on this scene, and not measured: integrator, light-sampling, sky-choice, fresnel, microfacets, colour, texture-filter",
        "Effects of the scene",
        "\nmirror reflection",
        "Worth their time",
    ] {
        assert!(text.contains(words), "no `{words}` in\n{text}");
    }
    let place = |words: &str| {
        text.find(words)
            .unwrap_or_else(|| panic!("no `{words}` in\n{text}"))
    };
    assert!(
        place("Setting in use") < place("Worth their time")
            && place("Worth their time") < place("measured at the size"),
        "{text}"
    );
    // The common part of all commands appears once; the number of rungs in each depends on measured
    // times.
    assert_eq!(
        text.matches("raywright render ball.scene.toml --size 16x12")
            .count(),
        1,
        "{text}"
    );
    // Rows of figures are short; paragraphs are wrapped by the terminal alone.
    let figures = |line: &&str| line.starts_with("  ") && !line.contains(": ");
    let is_short = |line: &str| line.chars().count() <= 200;
    assert!(text.lines().filter(figures).all(is_short), "{text}");
    assert!(!text.lines().any(|line| line.ends_with(' ')), "{text}");
}

/// Protects: a report fits the terminal's reported width.
#[test]
fn reports_fit_the_terminal() {
    let sandbox = sandbox();
    for width in ["60", "80", "120"] {
        let output = sandbox
            .command(&quick(&["-q"]))
            .env("COLUMNS", width)
            .output()
            .expect("the program starts");
        let text = String::from_utf8_lossy(&output.stdout);
        let maximum = width.parse::<usize>().expect("a number");
        assert!(text.lines().count() > 30, "{text}");
        for line in text.lines() {
            assert!(
                line.chars().count() <= maximum,
                "{} of {maximum}: {line}",
                line.chars().count()
            );
        }
    }
}

/// Protects: JSON and CSV have the same figures; each setting on the frontier can be rendered with
/// its listed flags.
#[test]
fn files_hold_the_figures() {
    let sandbox = sandbox();
    let run = sandbox.run(&quick(&["--json", "-o", "a.csv", "-o", "b.json", "-q"]));
    run.exits_with(0).prints("");
    let json: Value = serde_json::from_str(run.text()).expect("JSON");
    let file: Value =
        serde_json::from_slice(&std::fs::read(sandbox.path("b.json")).expect("a file"))
            .expect("JSON");
    assert_eq!(json, file);
    assert_eq!(
        (&json["format"], &json["scene"], &json["size"]),
        (&6.into(), &"ball.scene.toml".into(), &vec![16, 12].into())
    );
    let list = |of: &str| {
        json[of]
            .as_array()
            .cloned()
            .unwrap_or_else(|| panic!("no {of}"))
    };
    let rungs = |of: &str| {
        list(of)
            .iter()
            .map(|ladder| ladder["rungs"].as_array().map_or(0, Vec::len))
            .sum::<usize>()
    };
    let effects = json["costs"]["effects"]
        .as_array()
        .expect("effects")
        .clone();
    let frontier = list("frontier");
    let csv = std::fs::read_to_string(sandbox.path("a.csv")).expect("a file");
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let rows = rungs("ladders")
        + list("outputs").len()
        + effects.len()
        + frontier.len()
        + list("combinations").len();
    assert_eq!(lines.len(), 2 + rows, "{csv}");
    assert!(
        lines.iter().all(|line| line.len() == lines[0].len()),
        "{csv}"
    );
    let figure = |ladder: &str, rung: &str, column: &str| {
        let line = lines
            .iter()
            .find(|line| line[0] == ladder && line[1] == rung)
            .expect("a line");
        line[lines[0]
            .iter()
            .position(|name| *name == column)
            .expect("a column")]
        .parse::<f64>()
        .ok()
    };
    let same = |ladder: &str, rung: &Value, columns: &[(&str, &Value)]| {
        for &(column, value) in columns {
            assert!(value.is_number(), "{rung}, {column}");
            let (found, reported) = (
                figure(ladder, rung.as_str().expect("a name"), column),
                value.as_f64().expect("a number"),
            );
            // JSON parsers may differ in the rounding of the last digit.
            assert!(
                found.is_some_and(|found| (found - reported).abs() <= 1e-15 * reported.abs()),
                "{ladder} {rung}, {column}: {found:?}"
            );
        }
    };
    let precision = list("ladders")
        .into_iter()
        .find(|ladder| ladder["ladder"] == "precision")
        .expect("every scene reaches it");
    let robust = &precision["rungs"][0];
    let errors = &robust["measured"]["errors"];
    same(
        "precision",
        &robust["rung"],
        &[
            ("rmse", &errors["rmse"]["value"]),
            ("root_relmse_high", &errors["root_relmse"]["high"]),
        ],
    );
    same(
        "own",
        &"".into(),
        &[
            ("seconds", &json["own"]["seconds"]["value"]),
            ("rays", &json["own"]["rays"]),
        ],
    );
    let priced = list("ladders");
    let is_priced = |ladder: &&Value| {
        ["build", "accelerator"]
            .iter()
            .any(|name| ladder["ladder"] == **name)
    };
    let priced: Vec<&Value> = priced.iter().filter(is_priced).collect();
    assert_eq!(priced.len(), 2);
    for ladder in priced {
        for rung in ladder["rungs"].as_array().expect("rungs") {
            let cost = &rung["cost"];
            let columns = [
                ("preparing_seconds", &cost["preparing"]),
                ("geometry_bytes", &cost["geometry"]),
            ];
            same(
                ladder["ladder"].as_str().expect("a name"),
                &rung["rung"],
                &columns,
            );
        }
    }
    for of in list("outputs") {
        let columns = ["bytes_per_pixel", "rmse", "greatest", "flip", "clipped"]
            .map(|column| (column, &of[column]));
        same("output", &of["rung"], &columns);
    }
    for of in &effects {
        let columns = [
            ("seconds", &of["seconds_without"]["median"]),
            ("ratio", &of["ratio"]["median"]),
            ("rmse", &of["rmse"]),
        ];
        same("effect", &of["effect"], &columns);
    }
    for candidate in &frontier {
        let flags = candidate["flags"]
            .as_array()
            .expect("flags")
            .iter()
            .filter_map(Value::as_str);
        let words: Vec<&str> = ["render", "ball.scene.toml", "--size", "8x6", "-q"]
            .into_iter()
            .chain(flags.flat_map(str::split_whitespace))
            .collect();
        sandbox.run(&words).exits_with(0);
    }
}

/// Protects: the page is self-contained, shows first the picture and its magnified part with the
/// setting in use, recommended and exact, each with its error, then the plot and the tables. It gives
/// each setting on the frontier as a command, and escapes special characters in names; its plot is
/// the same as the separate one.
#[test]
fn the_page_stands_alone() {
    let sandbox = Sandbox::new();
    sandbox.write("a&b<c.scene.toml", SCENE);
    let words = [
        "accuracy",
        "a&b<c.scene.toml",
        "--size",
        "96x72",
        "--budget",
        "10min",
        "--rounds",
        "2",
        "-o",
        "a.html",
        "-o",
        "a.svg",
        "-q",
    ];
    let run = sandbox.run(&words);
    run.exits_with(0);
    let page = std::fs::read_to_string(sandbox.path("a.html")).expect("a page");
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    assert!(!page.contains("b<c") && page.contains("a&amp;b&lt;c.scene.toml"));
    for from_elsewhere in ["src=\"http", "href=", "url(", "@import", "fetch("] {
        assert!(!page.contains(from_elsewhere), "{from_elsewhere}");
    }
    let place = |words: &str| page.find(words).unwrap_or_else(|| panic!("no {words}"));
    let order = [
        "<p class=\"answer\">",
        "<rect class=\"detail\"",
        "data-name=\"in use\"",
        "data-name=\"reference\"",
        "<h2>Error against time</h2>",
        "<h2>Worth their time</h2>",
    ];
    assert!(order.map(place).is_sorted(), "{:?}", order.map(place));
    let names = page.matches("<img data-name=\"").count();
    assert!(names >= 3, "{names} magnified pictures");
    assert_eq!(page.matches("<br>error ").count(), names - 1);
    // Ladders that change no picture have prices, each effect has its cost, and all rows of a table
    // have the same width.
    for words in [
        "<p class=\"answer\">Setting in use: error ",
        "<h2>Rungs that change no picture</h2>",
        "<h2>Precision of the file formats</h2>",
        "16-bit</td><td>6</td>",
        "<td>mirror reflection</td><td>",
        "<th>added time</th>",
    ] {
        assert!(page.contains(words), "no {words}");
    }
    assert!(
        page.contains("raywright render &#39;a&amp;b&lt;c.scene.toml&#39;")
            || page.contains("raywright render 'a&amp;b&lt;c.scene.toml'")
    );
    let svg = std::fs::read_to_string(sandbox.path("a.svg")).expect("a plot");
    assert!(
        svg.starts_with("<svg")
            && svg.contains(">settings worth their time<")
            && svg.contains("<title>--spp ")
    );
    assert_eq!(
        page.matches("What accuracy costs in time: ").count(),
        2,
        "the title of the page and its heading"
    );
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

/// Protects: a reference is kept in a file and used by the next run; a film of another kind or
/// scene is refused by name, and left unchanged.
#[test]
fn a_reference_is_kept() {
    let sandbox = sandbox();
    let words = quick(&["--reference", "ball.film"]);
    let first = sandbox.run(&words);
    first.exits_with(0);
    assert!(
        first
            .text()
            .contains("\nreference picture: double precision (f64)")
            && first.stderr.contains("ball.film"),
        "{}",
        first.stderr
    );
    let kept = std::fs::read(sandbox.path("ball.film")).expect("a file");
    let second = sandbox.run(&words);
    second.exits_with(0);
    assert!(
        second
            .text()
            .contains("\nreference picture (of an earlier run): double precision (f64)"),
        "{}",
        second.text()
    );
    sandbox.write(
        "other.scene.toml",
        SCENE.replace("radius = 1", "radius = 2"),
    );
    let other = [
        "accuracy",
        "other.scene.toml",
        "--size",
        "16x12",
        "--budget",
        "10min",
        "--reference",
        "ball.film",
    ];
    let run = sandbox.run(&other);
    run.exits_with(3);
    assert!(
        run.stderr.contains("ball.film") && run.stderr.contains("the scene differs"),
        "{}",
        run.stderr
    );
    assert!(std::fs::read(sandbox.path("ball.film")).expect("a file") == kept);
    sandbox
        .run(&[
            "render",
            "ball.scene.toml",
            "--size",
            "8x6",
            "--spp",
            "8",
            "--checkpoint",
            "render.film",
            "-q",
        ])
        .exits_with(0);
    let run = sandbox.run(&quick(&["--reference", "render.film"]));
    run.exits_with(3);
    assert!(
        run.stderr.contains("the file is not a reference"),
        "{}",
        run.stderr
    );
}

/// Protects: an unwritable output, an unreadable input and an unmeasurable setting are reported
/// before any render.
#[test]
fn mistakes_are_said_at_once() {
    let sandbox = sandbox();
    let refused = |words: &[&str], code, message: &str| {
        let run = sandbox.run(words);
        run.exits_with(code);
        assert!(run.stderr.contains(message), "{}", run.stderr);
    };
    refused(&quick(&["-o", "a.txt"]), 2, ".json");
    refused(
        &["accuracy", "ball.scene.toml", "--budget", "0s"],
        2,
        "expected a time from 1s to 24h",
    );
    refused(
        &["accuracy", "ball.scene.toml", "--rounds", "1"],
        2,
        "--rounds",
    );
    refused(&["accuracy", "none.scene.toml"], 4, "none.scene.toml");
    refused(
        &["accuracy", "ball.scene.toml", "-o", "a.csv", "-o", "a.csv"],
        2,
        "twice",
    );
    refused(&["accuracy", "preset:none"], 2, "none");
    refused(
        &quick(&["--max-memory", "1K"]),
        5,
        "raise the limit with --max-memory",
    );
}

/// Protects: a picture that shows nothing has no error: `render` and `accuracy` state that it is not
/// known and why, in text and JSON, and no error counts as reached.
#[test]
fn a_black_picture_has_no_error() {
    let sandbox = Sandbox::new();
    let dark = SCENE
        .replace("colour = 2", "colour = 2e-3")
        .replace("[0.3, 0.4, 0.5]", "[3e-4, 4e-4, 5e-4]")
        .replace("samples = 4,", "samples = 16, integrator = \"path\",");
    sandbox.write("dark.scene.toml", dark);
    let run = sandbox.run(&[
        "render",
        "dark.scene.toml",
        "--max-error",
        "0.5",
        "--stats",
        "s.json",
        "-o",
        "a.png",
    ]);
    run.exits_with(6);
    assert!(
        run.stderr.contains("the picture is nearly black"),
        "{}",
        run.stderr
    );
    let stats = std::fs::read(sandbox.path("s.json")).expect("a report");
    let stats: Value = serde_json::from_slice(&stats).expect("JSON");
    assert_eq!(stats["error"]["doubt"], "nearly-black");
    let words = [
        "accuracy",
        "dark.scene.toml",
        "--size",
        "32x24",
        "--budget",
        "10min",
        "--rounds",
        "2",
        "-o",
        "a.json",
        "-q",
    ];
    let run = sandbox.run(&words);
    run.exits_with(0);
    assert!(
        run.text()
            .contains("error not known (the picture is nearly black)"),
        "{}",
        run.text()
    );
    let report = std::fs::read(sandbox.path("a.json")).expect("a report");
    let report: Value = serde_json::from_slice(&report).expect("JSON");
    let error = &report["own"]["errors"]["root_relmse"];
    assert_eq!(
        (&error["known"], &report["doubt"]),
        (&false.into(), &"nearly-black".into())
    );
    for advice in ["half_the_error", "same_error", "biased"] {
        assert!(report["recommendations"][advice].is_null(), "{advice}");
    }
}

/// A rough glass ball on a floor, with more samples than the budget allows.
const SLOW: &str = r#"
format = 1
render = { size = [640, 480], samples = 64, max_depth = 16 }
sky.constant = 1
cameras = [{ name = "front", pose.look_at = { eye = [0, 1, 4], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 60 } }]
materials = [{ name = "white", model.physical = { base_colour = 0.9 } }, { name = "glass", model.physical = { transmission = 1, roughness = 0.2 } }]
objects = [
  { shape.plane = { point = [0, -1, 0], normal = [0, 1, 0] }, material = "white" },
  { shape.sphere = { centre = [0, 0, 0], radius = 1 }, material = "glass" },
]
"#;

/// Protects: a budget too small for everything, on all but the fastest machines, still gives a
/// report, with the scene's own picture and rungs of the most informative ladder. The end of the
/// budget itself is tested elsewhere with an artificial clock.
#[test]
fn a_short_budget_is_kept_and_gives_a_report() {
    let sandbox = Sandbox::new();
    sandbox.write("slow.scene.toml", SLOW);
    let effort = ["--size", "16x12", "--budget", "8s", "--threads", "1"];
    let run = sandbox.run(
        &[
            &["accuracy", "slow.scene.toml"],
            &effort[..],
            &["-o", "a.json", "-q"],
        ]
        .concat(),
    );
    run.exits_with(0);
    let report: Value =
        serde_json::from_slice(&std::fs::read(sandbox.path("a.json")).expect("a report"))
            .expect("JSON");
    let samples = &report["ladders"][0];
    assert_eq!(samples["ladder"], "samples");
    let known = samples["rungs"]
        .as_array()
        .expect("rungs")
        .iter()
        .filter(|rung| !rung["measured"].is_null())
        .count();
    assert!(
        known >= 1 && report["own"]["renders"].as_u64() >= Some(1),
        "{}",
        run.text()
    );
}

/// Protects: Ctrl-C ends a measurement with a report of its figures so far: printed, and in a file
/// whose name marks it as partial.
#[cfg(unix)]
#[test]
fn an_interrupted_measurement_keeps_what_it_has() {
    let sandbox = sandbox();
    let words = [
        "accuracy",
        "ball.scene.toml",
        "--size",
        "128x96",
        "--budget",
        "60s",
        "-o",
        "a.json",
    ];
    let mut child = sandbox
        .command(&words)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut said = BufReader::new(child.stderr.take().expect("a pipe"))
        .lines()
        .map_while(Result::ok);
    let is_of_a_setting = |line: String| line.contains('=') || line.contains("as it is");
    assert!(said.any(is_of_a_setting), "it comes to the settings");
    std::thread::sleep(Duration::from_millis(1500));
    assert!(
        Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status()
            .expect("kill runs")
            .success()
    );
    let rest: Vec<String> = said.collect();
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{rest:?}");
    assert_eq!(
        sandbox.names(),
        ["a.partial.json", "ball.scene.toml"],
        "{rest:?}"
    );
    let report: Value =
        serde_json::from_slice(&std::fs::read(sandbox.path("a.partial.json")).expect("a report"))
            .expect("JSON");
    assert!(report["own"]["renders"].as_u64() >= Some(1) && report["cut_short"] == true);
    assert!(String::from_utf8_lossy(&output.stdout).contains("as it is"));
}
