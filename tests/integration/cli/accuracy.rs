//! `accuracy`: contents of its table, JSON and page, equivalence of its flags with those of
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
/// ladders without effect on the scene have none.
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
        "double precision (f64)",
        "subtracted",
        "precision (in use: robust)",
        "  reference ",
        "samples (in use: 4)",
        "  1024 ",
        "Worth their time",
    ] {
        assert!(text.contains(words), "no `{words}` in\n{text}");
    }
    for words in ["integrator (", "fresnel (", "texture-filter ("] {
        assert!(!text.contains(words), "`{words}` in\n{text}");
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

/// Protects: the JSON printed and that in a file are the same, each setting stands in it once, the
/// frontier and the recommendations are rows of it, and each setting on the frontier can be rendered
/// with its listed flags.
#[test]
fn files_hold_the_figures() {
    let sandbox = sandbox();
    let run = sandbox.run(&quick(&["--json", "-o", "b.json", "-q"]));
    run.exits_with(0).prints("");
    let json: Value = serde_json::from_str(run.text()).expect("JSON");
    let file: Value =
        serde_json::from_slice(&std::fs::read(sandbox.path("b.json")).expect("a file"))
            .expect("JSON");
    assert_eq!(json, file);
    assert_eq!(
        (&json["format"], &json["scene"], &json["size"]),
        (&8.into(), &"ball.scene.toml".into(), &vec![16, 12].into())
    );
    let settings = json["settings"].as_array().expect("settings");
    assert!(settings[0]["flags"].as_array().is_some_and(Vec::is_empty));
    for (row, setting) in settings.iter().enumerate() {
        let others = settings[..row].iter();
        assert!(others.clone().all(|of| of["flags"] != setting["flags"]));
        for figure in ["seconds", "ratio", "error_ratio"] {
            assert!(setting[figure]["known"].is_boolean(), "{setting}");
        }
        let error = &setting["errors"]["root_relmse"];
        assert!(error["value"].is_number() || error["known"] == false);
    }
    let named = |of: &str| {
        let precision = settings
            .iter()
            .find(|row| row["flags"] == serde_json::json!([of]));
        precision.is_some()
    };
    assert!(named("--precision reference") && !named("--precision robust"));
    let rows = json["frontier"].as_array().expect("rows").iter();
    let frontier: Vec<&Value> = rows
        .map(|row| &settings[row.as_u64().expect("a row") as usize])
        .collect();
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
/// each setting on the frontier as a command, and escapes special characters in names.
#[test]
fn the_page_stands_alone() {
    let sandbox = Sandbox::new();
    sandbox.write("a&b<c.scene.toml", SCENE);
    let words = [
        "accuracy",
        "a&b<c.scene.toml",
        "--size",
        "192x144",
        "--budget",
        "10min",
        "--rounds",
        "2",
        "-o",
        "a.html",
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
    for words in [
        "<p class=\"answer\">Setting in use: error ",
        ">samples (in use: 4)</td>",
        "<h2>Rungs, changed one at a time</h2>",
    ] {
        assert!(page.contains(words), "no {words}");
    }
    assert!(
        page.contains("raywright render &#39;a&amp;b&lt;c.scene.toml&#39;")
            || page.contains("raywright render 'a&amp;b&lt;c.scene.toml'")
    );
    assert_eq!(
        page.matches("What accuracy costs in time: ").count(),
        2,
        "the title of the page and its heading"
    );
    assert!(page.contains(">settings worth their time<") && page.contains("<title>--spp "));
    assert!(!page.contains("NaN") && !page.contains(">inf"));
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
        &[
            "accuracy",
            "ball.scene.toml",
            "-o",
            "a.html",
            "-o",
            "a.html",
        ],
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
    let words = "the picture is nearly black, and stays so with more samples";
    assert!(run.stderr.contains(words), "{}", run.stderr);
    let stats = std::fs::read(sandbox.path("s.json")).expect("a report");
    let stats: Value = serde_json::from_slice(&stats).expect("JSON");
    assert_eq!(stats["error"]["doubt"], "nearly-black");
    // The limit is 65536 samples a pixel.
    let rays = stats["rays"]["camera"].as_u64();
    assert!(rays.is_some_and(|rays| rays < 1024 * 64 * 48), "{stats}");
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
    let error = &report["settings"][0]["errors"]["root_relmse"];
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
    assert_eq!(report["ladders"][0]["ladder"], "samples");
    let settings = report["settings"].as_array().expect("settings");
    assert!(settings.len() > 1, "{}", run.text());
}

/// Protects: `accuracy` of a model measures what `render` of it does by default, 16 samples denoised,
/// and its commands give other samples and the noisy picture as `render` takes them.
#[test]
fn models_are_measured_as_they_are_rendered() {
    let sandbox = Sandbox::new();
    sandbox.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let words = ["accuracy", "a.obj", "--size", "32x24", "--budget", "10min"];
    let run = sandbox.run(&[&words[..], &["--rounds", "2", "--json", "-q"]].concat());
    run.exits_with(0);
    let report: Value = serde_json::from_str(run.text()).expect("JSON");
    let in_use = |ladder: &str| {
        let ladders = report["ladders"].as_array().expect("ladders").iter();
        let mut found = ladders.filter(|of| of["ladder"] == ladder);
        found.next().expect("a ladder")["in_use"].clone()
    };
    assert_eq!(
        [in_use("samples"), in_use("reconstruction")],
        ["16", "denoised"]
    );
    let settings = report["settings"].as_array().expect("settings");
    // A rung is measured beside a denoised picture, too.
    for flags in [&["--spp 16", "--no-denoise"][..], &["--max-depth 2"]] {
        let is_row = |row: &&Value| row["flags"] == serde_json::json!(flags);
        assert_eq!(settings.iter().filter(is_row).count(), 1, "{flags:?}");
    }
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
    let is_of_a_setting = |line: String| line.contains("--") || line.contains("in use");
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
    assert!(!report["settings"].is_null() && report["cut_short"] == true);
    assert!(String::from_utf8_lossy(&output.stdout).contains("Setting in use"));
}
