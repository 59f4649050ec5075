//! `bench`: contents of its table, JSON, Markdown and plot, and its usage errors. No figure is
//! judged.

use serde_json::Value;

use crate::support::Sandbox;

const SPHERE: &str = r#"
format = 1
render = { size = [64, 48] }
cameras = [{ name = "front", pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 40 } }]
materials = [{ name = "m", model.classic = {} }]
objects = [
  { shape.sphere = { centre = [0, 0, 0], radius = 1 }, material = "m" },
  { shape.plane = { point = [0, -1, 0], normal = [0, 1, 0] }, material = "m" },
]
"#;

/// A quick run: every row is measured, with low accuracy.
fn quick(more: &[&'static str]) -> Vec<&'static str> {
    [
        &[
            "bench",
            "--max-n",
            "20",
            "--repeats",
            "2",
            "--seconds",
            "0.01",
            "--shape",
            "spheres",
        ],
        more,
    ]
    .concat()
}

/// Protects: the table has a row for every N, its conditions and its results.
#[test]
fn table_has_a_row_for_each_size() {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&quick(&[]));
    run.exits_with(0).prints("");
    let text = run.text();
    for words in [
        "thread",
        "median of 2 interleaved repeats",
        "\nSpheres\n",
        "scan, ns/ray",
        "scan : tree",
        "tree",
    ] {
        assert!(text.contains(words), "no `{words}` in\n{text}");
    }
    let sizes: Vec<&str> = text
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .filter(|w| w.parse::<u32>().is_ok())
        .collect();
    // Once with times, once with build time and memory.
    assert_eq!(sizes, ["1", "2", "4", "8", "16", "20"].repeat(2), "{text}");
}

/// Protects: JSON has all figures for comparing runs; missing fits are null.
#[test]
fn json_has_every_figure() {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&quick(&["--json"]));
    run.exits_with(0).prints("");
    let report: Value = serde_json::from_str(run.text()).expect("JSON");
    assert_eq!(
        (&report["format"], &report["threads"], &report["repeats"]),
        (&2.into(), &1.into(), &2.into())
    );
    let series = &report["generated"][0];
    assert_eq!(
        (series["kind"].as_str(), &series["tree_growth"]),
        (Some("spheres"), &Value::Null)
    );
    let row = &series["rows"][5];
    assert_eq!(
        (
            row["primitives"].as_u64(),
            row["scan"]["tests_per_ray"].as_f64()
        ),
        (Some(20), Some(20.0))
    );
    assert!(
        series["crossover"] != Value::Null && series["scan_growth"] == Value::Null,
        "{series}"
    );
    for figure in ["median", "lower_quartile", "upper_quartile", "min", "max"] {
        let costs = ["scan", "tree"].map(|who| &row[who]);
        let spreads = costs
            .iter()
            .flat_map(|cost| [&cost["nanoseconds"], &cost["build_milliseconds"]]);
        for spread in spreads.chain([&row["ratio"]]) {
            assert!(
                spread[figure].as_f64().is_some_and(|x| x > 0.0),
                "{figure} in {row}"
            );
        }
    }
    assert!(
        row["tree"]["bytes"].as_u64() > row["scan"]["bytes"].as_u64(),
        "{row}"
    );
}

/// Protects: Markdown output is a valid table: every line has as many cells as the head.
#[test]
fn markdown_is_a_table() {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&quick(&["--markdown"]));
    run.exits_with(0);
    let cells: Vec<usize> = run
        .text()
        .lines()
        .filter(|line| line.starts_with('|'))
        .map(|line| line.matches('|').count())
        .collect();
    assert_eq!(cells, [[8; 8], [6; 8]].concat(), "{}", run.text());
}

/// Protects: the plot is written beside the table as a complete SVG; another file format is refused
/// before any measurement.
#[test]
fn plot_is_an_svg_file() {
    let sandbox = Sandbox::new();
    sandbox
        .run(&quick(&["--plot", "n.svg"]))
        .exits_with(0)
        .prints("n.svg");
    let svg = std::fs::read_to_string(sandbox.path("n.svg")).expect("the plot");
    assert!(
        svg.starts_with("<svg") && svg.ends_with("</svg>\n") && svg.contains("scan, spheres"),
        "{svg}"
    );
    assert!(!svg.contains("NaN"), "{svg}");
    assert!(
        svg.contains("prefers-color-scheme"),
        "the plot reads in light and dark:\n{svg}"
    );
    sandbox.run(&quick(&["-o", "n.png"])).exits_with(2).prints(
        "error: n.png: the plot is an SVG file; use a name that ends in .svg\nhelp: -o n.svg",
    );
    sandbox.run(&quick(&["-q", "-o", "no/n.svg"])).exits_with(4);
}

/// Protects: a given scene is measured with camera rays and bounces, and with the changes of its
/// flags.
#[test]
fn given_scenes_are_measured() {
    let sandbox = Sandbox::new();
    sandbox.write("s.scene.toml", SPHERE);
    let run = sandbox.run(&[
        "bench",
        "s.scene.toml",
        "--repeats",
        "1",
        "--seconds",
        "0.01",
        "--json",
    ]);
    run.exits_with(0).prints("");
    let report: Value = serde_json::from_str(run.text()).expect("JSON");
    let given = &report["given"];
    assert_eq!(
        (
            given["scene"].as_str(),
            given["camera"]["primitives"].as_u64()
        ),
        (Some("s.scene.toml"), Some(2))
    );
    assert!(
        given["bounce"]["tree"]["rays"]
            .as_u64()
            .is_some_and(|rays| rays > 0),
        "{given}"
    );
    let table = sandbox.run(&[
        "bench",
        "s.scene.toml",
        "--repeats",
        "1",
        "--seconds",
        "0.01",
    ]);
    assert!(
        table.text().contains("camera") && table.text().contains("2 primitives"),
        "{}",
        table.text()
    );
    sandbox
        .run(&["bench", "s.scene.toml", "--set", "q=1"])
        .exits_with(2);
}

/// Protects: each usage error has its promised exit code.
#[test]
fn mistakes_have_their_codes() {
    let sandbox = Sandbox::new();
    sandbox.write("s.scene.toml", SPHERE);
    sandbox.write("empty.scene.toml", "format = 1\n");
    sandbox.run(&["bench", "--max-n", "0"]).exits_with(2);
    sandbox
        .run(&["bench", "--json", "--markdown"])
        .exits_with(2);
    sandbox
        .run(&["bench", "s.scene.toml", "--max-n", "10"])
        .exits_with(2);
    sandbox.run(&["bench", "--seconds", "0"]).exits_with(2);
    sandbox.run(&["bench", "missing.glb"]).exits_with(4);
    let empty = sandbox.run(&["bench", "empty.scene.toml"]);
    empty.exits_with(3).prints(
        "error: empty.scene.toml: the scene has no object, so no ray can be timed; add an object",
    );
}

/// Protects: the tree is built as `--build` says, and the report names it; an unknown rung is
/// refused with the known ones. Sizes of the triangles differ by up to three hundred times, because
/// a tree over even ones is the same in each quality.
#[test]
fn the_tree_is_built_as_asked() {
    let sandbox = Sandbox::new();
    let mut state = 1_u32;
    let mut number = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24)
    };
    let mut model = String::new();
    for triangle in 0..600 {
        let size = if triangle % 8 == 0 {
            10_f64.powf(2.5 * number() - 2.0)
        } else {
            0.02
        };
        let centre = [number(), number(), number()];
        for _ in 0..3 {
            let [x, y, z] = centre.map(|middle| middle + size * (number() - 0.5));
            model += &format!("v {x} {y} {z}\n");
        }
        model += "f -3 -2 -1\n";
    }
    sandbox.write("uneven.obj", &model);
    let report = |quality: &str| -> Value {
        let run = sandbox.run(&[
            "bench",
            "uneven.obj",
            "--repeats",
            "1",
            "--seconds",
            "0.01",
            "--json",
            "--build",
            quality,
        ]);
        run.exits_with(0);
        serde_json::from_str(run.text()).expect("JSON")
    };
    let bytes = ["fast", "medium", "high"].map(|quality| {
        let report = report(quality);
        assert_eq!(report["builder"], quality);
        report["given"]["camera"]["tree"]["bytes"]
            .as_u64()
            .expect("bytes")
    });
    assert!(
        bytes[0] != bytes[1] && bytes[1] != bytes[2] && bytes[0] != bytes[2],
        "{bytes:?}"
    );
    sandbox
        .run(&quick(&["--build", "slow"]))
        .exits_with(2)
        .prints_like("expected one of fast, medium, high");
}
