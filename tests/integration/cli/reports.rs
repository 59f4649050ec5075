//! `explain` and `--stats`: reports of a render, for people and for scripts.

use serde_json::Value;

use crate::support::{Sandbox, carried};

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

/// Protects: the table and the JSON list the same effects, each in exactly one group.
#[test]
fn explain_says_the_same_twice() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    let table = sandbox.run(&["explain", "preset:whitted", "-v"]);
    table.exits_with(0).prints("");
    let report = json(
        sandbox
            .run(&["explain", "preset:whitted", "--json"])
            .exits_with(0)
            .text(),
    );
    assert_eq!(report["integrator"], "whitted");
    let effects = report["effects"].as_array().expect("a list");
    let (listed, rungs) = table.text().split_once("rungs in use").expect("both lists");
    let once = |text: &str, start: &str| {
        let lines = text
            .lines()
            .filter(|line| line.trim_start().starts_with(start))
            .count();
        assert_eq!(lines, 1, "{start} in\n{text}");
    };
    for ladder in report["ladders"].as_array().expect("a list") {
        let (name, rung) = (
            ladder["ladder"].as_str().expect("a name"),
            ladder["rung"].as_str().expect("a rung"),
        );
        once(rungs, &format!("{name} "));
        assert!(rungs.contains(&format!(" {rung} ")), "{rung} in\n{rungs}");
    }
    for effect in effects {
        let name = effect["name"].as_str().expect("a name");
        once(listed, &format!("{name}  "));
        assert!(
            !effect["because"].as_str().expect("a reason").is_empty(),
            "{name}"
        );
        assert_eq!(
            effect["source"].is_null(),
            effect["status"] == "absent",
            "{name}"
        );
    }
    let preset = sandbox.run(&["presets", "whitted"]);
    let before = preset
        .text()
        .split("transmission")
        .next()
        .expect("the glass");
    let place = format!(
        "from materials[1].model.classic.transmission, preset:whitted:{}:",
        before.matches('\n').count() + 1
    );
    assert!(
        table.text().contains(&place),
        "{place} in\n{}",
        table.text()
    );
    let status = |name: &str| {
        effects
            .iter()
            .find(|effect| effect["name"] == name)
            .map(|effect| effect["status"].clone())
    };
    assert_eq!(status("refraction"), Some("simulated".into()));
    assert_eq!(status("depth of field"), Some("absent".into()));
}

/// Protects: a scene with unsupported parts is rendered, with one warning that names the missing
/// parts.
#[test]
fn what_is_left_out_is_a_warning() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "rough.scene.toml",
        r#"
format = 1
sky.constant = 1
[render]
size = [16, 9]
samples = 1
integrator = "whitted"
[[cameras]]
pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0] }
projection.pinhole = { vertical_fov = 40 }
[[materials]]
name = "matte"
model.physical = { roughness = 0.6, metallic = 1 }
[[objects]]
shape.sphere = { centre = [0, 0, 0], radius = 1 }
material = "matte"
"#,
    );
    let run = sandbox.run(&["render", "rough.scene.toml"]);
    run.exits_with(0);
    let (warning, rest) = run.stderr.split_once('\n').expect("two messages");
    assert_eq!(
        warning,
        "warning: effects left out: glossy reflection (reasons and remedies: raywright explain rough.scene.toml)"
    );
    assert!(rest.starts_with("wrote rough.png"), "{rest}");
    let report = json(
        sandbox
            .run(&["explain", "rough.scene.toml", "--json"])
            .exits_with(0)
            .text(),
    );
    let left_out: Vec<&Value> = report["effects"]
        .as_array()
        .expect("a list")
        .iter()
        .filter(|effect| effect["status"] == "left-out")
        .collect();
    assert!(
        left_out.iter().all(|effect| effect["hint"].is_string()),
        "{left_out:?}"
    );
    assert_eq!(left_out.len(), 1);
}

/// Protects: meshes that vanish by rounding of stored coordinates are named, with advice; in f64 no
/// warning appears.
#[test]
fn what_vanishes_is_a_warning() {
    let sandbox = Sandbox::new();
    let object = |name: &str, x: &str| {
        format!(
            "[[objects]]\nname = \"{name}\"\nshape.mesh = \"{name}\"\nmaterial = \"matte\"\ntransform = [{{ translate = [{x}, 0, 0] }}]\n"
        )
    };
    let mesh = |name: &str| {
        let inline = "{ positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], indices = [[0, 1, 2]] }";
        format!("[[meshes]]\nname = \"{name}\"\nsource.inline = {inline}\n")
    };
    let scene = |objects: &[(&str, &str)]| {
        let parts: Vec<String> = objects
            .iter()
            .map(|(name, x)| mesh(name) + &object(name, x))
            .collect();
        let head = "format = 1\n[render]\nsize = [8, 8]\nsamples = 1\n[[materials]]\nname = \"matte\"\nmodel.physical = {}\n";
        head.to_owned() + &parts.concat()
    };
    sandbox.write("one.scene.toml", scene(&[("near", "0"), ("far", "1e9")]));
    sandbox.write(
        "three.scene.toml",
        scene(&[
            ("far", "1e9"),
            ("farther", "1e10"),
            ("near", "0"),
            ("beyond", "-1e9"),
        ]),
    );
    let warning = |arguments: &[&str]| {
        let run = sandbox.run(&[arguments, &["--allow-empty"]].concat());
        run.exits_with(0);
        run.stderr
            .lines()
            .filter(|line| line.contains("nothing is left of it"))
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let advice = "it is so far from the rest of the scene that rounding merges all corners of its triangles, so that nothing is left of it; \
                  move the object nearer to the rest of the scene, or render with --precision reference";
    assert_eq!(
        warning(&["render", "one.scene.toml", "-v"]),
        [format!("warning: object `far`: {advice}")]
    );
    assert_eq!(
        warning(&["render", "three.scene.toml", "-v"]),
        [format!(
            "warning: object `far`, object `farther`, object `beyond`: {advice}"
        )]
    );
    assert!(warning(&["render", "one.scene.toml", "--precision", "reference"]).is_empty());
}

/// Protects: a gap beside glass that single precision closes gives a warning with both names, a
/// sufficient distance and advice, also in the statistics; in f64 no warning appears.
#[test]
fn closed_gaps_are_a_warning() {
    let sandbox = Sandbox::new();
    let ball = |name: &str, radius: &str| {
        format!(
            "[[objects]]\nname = \"{name}\"\nshape.sphere = {{ centre = [0, 0, 0], radius = {radius} }}\nmaterial = \"{name}\"\n"
        )
    };
    let head = "format = 1\n[render]\nsize = [8, 8]\nsamples = 1\n[sky]\nconstant = 1\n\
                [[materials]]\nname = \"shell\"\nmodel.physical = { transmission = 1, roughness = 0 }\n\
                [[materials]]\nname = \"core\"\nmodel.physical = {}\n";
    sandbox.write(
        "a.scene.toml",
        head.to_owned() + &ball("shell", "1.00000012") + &ball("core", "1"),
    );
    let run = sandbox.run(&["render", "a.scene.toml", "-v", "--stats", "a.json"]);
    let message = "object `shell`: it touches object `core`, or is less than ";
    let warning = run
        .exits_with(0)
        .stderr
        .lines()
        .find(|line| line.contains(message))
        .unwrap_or_else(|| panic!("{}", run.stderr));
    assert!(
        warning.starts_with("warning: ")
            && warning.ends_with(" metres or more, or render with --precision reference")
    );
    let stats: Value =
        serde_json::from_slice(&std::fs::read(sandbox.path("a.json")).expect("statistics"))
            .expect("JSON");
    assert!(
        stats["warnings"]
            .to_string()
            .contains("object `shell`: it touches object `core`"),
        "{}",
        stats["warnings"]
    );
    let exact = sandbox.run(&["render", "a.scene.toml", "--precision", "reference"]);
    assert!(
        !exact.exits_with(0).stderr.contains("it touches"),
        "{}",
        exact.stderr
    );
}

/// Protects: partly transparent surfaces in one place are a warning with both names, also in a
/// scene without a closed gap.
#[test]
fn coincident_surfaces_are_a_warning() {
    let sandbox = Sandbox::new();
    let head = "format = 1\n[render]\nsize = [8, 8]\nsamples = 1\n[sky]\nconstant = 1\n\
                [[materials]]\nname = \"veil\"\nmodel.physical = { alpha = \"blend\", opacity = 0.5 }\n";
    let quad = |name: &str| {
        format!(
            "[[objects]]\nname = \"{name}\"\nshape.quad = {{ corner = [-1, -1, 0], edge_u = [2, 0, 0], edge_v = [0, 2, 0] }}\nmaterial = \"veil\"\n"
        )
    };
    sandbox.write(
        "a.scene.toml",
        head.to_owned() + &quad("one") + &quad("other"),
    );
    sandbox
        .run(&["render", "a.scene.toml"])
        .exits_with(0)
        .prints_like("warning: object `one`: it lies in one place with object `other`");
}

/// Protects: a lamp that shines through a cover within rounding error gives a warning with both
/// names, a distance at which the cover is dark, as verified, and advice, also in the statistics;
/// in f64 no warning appears.
#[test]
fn light_leaks_are_a_warning() {
    let sandbox = Sandbox::new();
    let quad = |name: &str, y: f64| {
        format!(
            "[[objects]]\nname = \"{name}\"\nshape.quad = {{ corner = [-1, {y}, -1], edge_u = [2, 0, 0], edge_v = [0, 0, 2] }}\n\
             material = \"{name}\"\n"
        )
    };
    let head = "format = 1\n[render]\nsize = [8, 8]\nsamples = 4\nintegrator = \"path\"\n\
                [[cameras]]\npose.look_at = { eye = [0.5, 0.5, 0.5], target = [0, 0, 0] }\nprojection.pinhole = { vertical_fov = 40 }\n\
                [[materials]]\nname = \"floor\"\nmodel.classic = { colour = 0.6 }\n\
                [[materials]]\nname = \"lid\"\nmodel.classic = { colour = 0 }\n\
                [[materials]]\nname = \"lamp\"\nmodel.classic = { local = 0, emission = 4 }\n\
                [[objects]]\nshape.plane = { point = [0, 0, 0], normal = [0, 1, 0] }\nmaterial = \"floor\"\n";
    let scene = |gap: f64| format!("{head}{}{}", quad("lamp", 1.0), quad("lid", 1.0 - gap));
    sandbox.write("a.scene.toml", scene(1e-7));
    let run = sandbox.run(&["render", "a.scene.toml", "-v", "--stats", "a.json"]);
    let head = "warning: object `lamp`: it is so close to object `lid`, which is opaque, that the precision does not tell which of the two is in front: its light passes through that object, or the lamp itself is not seen; move it ";
    let tail = " metres or more away from that object, to the side to which it should shine, or render with --precision reference";
    let said = run
        .exits_with(0)
        .stderr
        .lines()
        .find_map(|line| line.strip_prefix(head)?.strip_suffix(tail));
    let leave: f64 = said
        .unwrap_or_else(|| panic!("{}", run.stderr))
        .parse()
        .expect("a distance");
    let stats: Value =
        serde_json::from_slice(&std::fs::read(sandbox.path("a.json")).expect("statistics"))
            .expect("JSON");
    assert!(
        stats["warnings"]
            .to_string()
            .contains("object `lamp`: it is so close to object `lid`"),
        "{}",
        stats["warnings"]
    );
    sandbox.write("b.scene.toml", scene(leave));
    for (name, precision) in [("a", "reference"), ("b", "robust")] {
        let run = sandbox.run(&[
            "render",
            &format!("{name}.scene.toml"),
            "--precision",
            precision,
        ]);
        assert!(
            !run.exits_with(0).stderr.contains("it is so close to"),
            "{}",
            run.stderr
        );
    }
}

/// Protects: `--stats` has the fields that scripts rely on, and its figures are those of the
/// render.
#[test]
fn stats_have_their_fields() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox
        .run(&[
            "render",
            "preset:whitted",
            "--size",
            "40x30",
            "--spp",
            "1",
            "--stats",
            "s.json",
            "-o",
            "a.png",
            "-q",
        ])
        .exits_with(0)
        .prints("");
    let text = std::fs::read_to_string(sandbox.path("s.json")).expect("a file");
    let stats = json(&text);
    let names: Vec<&String> = stats.as_object().expect("an object").keys().collect();
    let expected = [
        "format",
        "version",
        "command",
        "scene_hash",
        "seconds",
        "rays",
        "samples",
        "dropped",
        "cut_short",
        "effects",
        "memory",
        "accelerator",
        "warnings",
    ];
    assert_eq!(names, expected);
    assert_eq!(
        (&stats["format"], &stats["accelerator"]),
        (&2.into(), &"bvh".into())
    );
    assert_eq!(
        stats["command"],
        "raywright render preset:whitted --size 40x30 --spp 1 --stats s.json -o a.png -q"
    );
    assert_eq!(
        (stats["samples"].as_u64(), stats["rays"]["camera"].as_u64()),
        (Some(1200), Some(1200))
    );
    assert_eq!(stats["rays"]["scatter"], 0);
    // Neighbours share the samples at their corners: each pixel uses four, and the render traces
    // one per lattice point of the tile.
    sandbox
        .run(&[
            "render",
            "preset:whitted",
            "--size",
            "20x10",
            "--stats",
            "c.json",
            "-o",
            "a.png",
            "-q",
        ])
        .exits_with(0);
    let corners = json(&std::fs::read_to_string(sandbox.path("c.json")).expect("a file"));
    assert_eq!(
        (
            corners["samples"].as_u64(),
            corners["rays"]["camera"].as_u64()
        ),
        (Some(4 * 20 * 10), Some(21 * 11))
    );
    for kind in ["reflection", "refraction", "shadow"] {
        assert!(
            stats["rays"][kind].as_u64().is_some_and(|n| n > 0),
            "{kind}"
        );
    }
    let seconds = |name: &str| stats["seconds"][name].as_f64().expect(name);
    let stages: f64 = ["load", "prepare", "render", "write"]
        .into_iter()
        .map(seconds)
        .sum();
    assert!(
        stages > 0.0 && stages <= seconds("total"),
        "{stages} of {}",
        seconds("total")
    );
    let fields = |value: &Value| {
        value
            .as_object()
            .map(|object| object.keys().cloned().collect::<Vec<_>>())
    };
    assert_eq!(
        fields(&stats["effects"][0]).expect("effects"),
        ["name", "status", "because", "source", "hint"]
    );
    assert_eq!(
        fields(&stats["memory"]).expect("memory"),
        ["peak_bytes", "geometry_bytes", "texture_bytes"]
    );
    assert!(
        stats["memory"]["geometry_bytes"]
            .as_u64()
            .is_some_and(|bytes| bytes > 0)
    );
    // Images by their content: the first render's picture, with four bytes per pixel.
    let sky = "format = 1\nimages = [{ name = \"a\", path = \"a.png\" }]\nsky.map.image = \"a\"\n";
    sandbox.write("sky.scene.toml", sky);
    sandbox
        .run(&[
            "render",
            "sky.scene.toml",
            "--size",
            "4x3",
            "--spp",
            "1",
            "--stats",
            "d.json",
            "-o",
            "b.png",
            "-q",
        ])
        .exits_with(0);
    let sky = json(&std::fs::read_to_string(sandbox.path("d.json")).expect("a file"));
    assert_eq!(sky["memory"]["texture_bytes"], 20 * 10 * 4);
}

/// Protects: the statistics are written to a JSON file of their own, and never over the scene.
#[test]
fn stats_are_checked_before_the_render() {
    let sandbox = Sandbox::new();
    sandbox
        .run(&["render", "--stats", "s.png"])
        .exits_with(2)
        .prints("error: s.png: the statistics are a JSON file; use a name that ends in .json\nhelp: --stats s.json");
    sandbox
        .run(&["render", "--stats", "no/s.json"])
        .exits_with(4);
    sandbox.write("a.scene.json", r#"{"format": 1}"#);
    sandbox.run(&["render", "a.scene.json", "--stats", "./a.scene.json"])
        .exits_with(2)
        .prints("error: cannot write ./a.scene.json: this run reads it\nhelp: name another file with --stats");
    assert_eq!(sandbox.names(), ["a.scene.json"]);
}

/// Protects: a scene without camera and light is rendered, with a note about the additions.
#[test]
fn what_is_added_to_a_scene_is_said() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "bare.scene.toml",
        r#"
format = 1
[[materials]]
name = "plain"
model.physical = {}
[[objects]]
shape.sphere = { centre = [3, 4, 5], radius = 2 }
material = "plain"
"#,
    );
    let run = sandbox.run(&["render", "bare.scene.toml", "--size", "32x18", "--spp", "1"]);
    run.exits_with(0);
    let messages: Vec<&str> = run.stderr.lines().collect();
    assert_eq!(
        messages[0],
        "note: the scene has no light: a neutral grey sky is added; the file has no camera: the whole scene is shown"
    );
    assert!(
        messages.len() == 2 && messages[1].starts_with("wrote bare.png (32x18, 1 sample"),
        "{messages:?}"
    );
    let framed = sandbox.picture("bare.png");
    assert!(
        framed.rgb.iter().any(|&pixel| pixel != framed.rgb[0]),
        "the sphere is in sight"
    );
    let nearer = sandbox.run(&[
        "render",
        "bare.scene.toml",
        "--size",
        "32x18",
        "--spp",
        "1",
        "--fov",
        "20",
        "-o",
        "near.png",
    ]);
    nearer.exits_with(0);
    assert!(
        sandbox.picture("near.png").rgb != framed.rgb,
        "flags change the framed camera too"
    );
}
