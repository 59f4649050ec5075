//! The command `stress`: faults of a scene, with place, reason and remedy.

use std::path::{Path, PathBuf};
use std::time::Duration;

use raywright::core::display::Display;
use raywright::core::fault::{FaultKind, Severity};
use raywright::core::picture::Picture;
use raywright::core::settings::{Sampling, Settings};
use raywright::io::output::{PictureMetadata, write_picture};
use raywright::io::{Input, LoadOptions, load, presets};
use raywright::stress::{StressEffort, stress};
use serde_json::Value;

use crate::support::{ProgramRun, Sandbox, shared};

/// A paint of albedo above 1, a light beyond the range of every object, and a duplicated ball.
const FAULTS: &str = r#"format = 1
render = { size = [96, 64], samples = 8, integrator = "path" }
cameras = [{ pose.look_at = { eye = [0, 1, 5], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 40 } }]
sky.constant = 0.5

[[lights]]
name = "far"
kind.point = { position = [0, 90, 0], range = 10 }
colour = 5

[[materials]]
name = "white"
model.physical = { base_colour = 1.5 }

[[materials]]
name = "pane"
model.physical = { transmission = 1, roughness = 0 }

[[objects]]
name = "left"
shape.sphere = { centre = [-1, 0, 0], radius = 0.8 }
material = "white"

[[objects]]
shape.sphere = { centre = [-1, 0, 0], radius = 0.8 }
material = "white"

[[objects]]
name = "window"
shape.quad = { corner = [0.2, -0.8, 0], edge_u = [1.4, 0, 0], edge_v = [0, 1.6, 0] }
material = "pane"
"#;

fn json(run: &ProgramRun) -> Value {
    serde_json::from_str(run.text()).unwrap_or_else(|e| panic!("{e}\n{}", run.stderr))
}

/// Protects: findings have their place in the file and a remedy, worst first, in lines of 60
/// characters; only a finding of a denied severity ends with exit code 1.
#[test]
fn findings_are_told_in_words() {
    let sandbox = Sandbox::new();
    sandbox.write("faults.scene.toml", FAULTS);
    let arguments = ["stress", "faults.scene.toml", "--budget", "10min"];
    let output = sandbox
        .command(&arguments)
        .env("COLUMNS", "60")
        .output()
        .expect("the program starts");
    let text = String::from_utf8(output.stdout).expect("text");
    assert_eq!(output.status.code(), Some(1), "{text}");
    let long: Vec<&str> = text
        .lines()
        .filter(|line| line.chars().count() > 60)
        .collect();
    assert!(long.is_empty(), "{long:?}");
    let at = |word: &str| text.find(word).unwrap_or_else(|| panic!("{word}:\n{text}"));
    let order = [
        "picture wrong\n",
        "object `window` - open-body",
        "slow or noisy\n",
        "light `far` - light-misses-scene",
        "harmless\n",
        "duplicate-object",
    ];
    assert!(order.map(at).is_sorted(), "{text}");
    assert!(
        text.contains("material `white` - energy-made")
            && text.contains("faults.scene.toml:11:1")
            && text.contains("do: "),
        "{text}"
    );
    sandbox.write(
        "fine.scene.toml",
        FAULTS
            .replace("1.5", "0.5")
            .replace("transmission = 1", "transmission = 0"),
    );
    let fine = ["stress", "fine.scene.toml", "--budget", "10min", "-q"];
    sandbox.run(&fine).exits_with(0);
    sandbox
        .run(&[&fine[..], &["--deny", "slow-or-noisy"]].concat())
        .exits_with(1)
        .prints_like("1 of 2 findings");
    sandbox.write(
        "finer.scene.toml",
        FAULTS
            .replace("range = 10", "range = 1000")
            .replace("1.5", "0.5")
            .replace("transmission = 1", "transmission = 0"),
    );
    sandbox
        .run(&[
            "stress",
            "finer.scene.toml",
            "--budget",
            "10min",
            "-q",
            "--deny",
            "slow-or-noisy",
        ])
        .exits_with(0);
    sandbox
        .run(&[
            "stress",
            "finer.scene.toml",
            "--budget",
            "10min",
            "-q",
            "--deny",
            "harmless",
        ])
        .exits_with(1);
}

/// Protects: each count is followed by words for what it counts, indices count from 0, and checks
/// without anything to examine are left out.
#[test]
fn numbers_say_what_they_count() {
    let sandbox = Sandbox::new();
    sandbox.write("faults.scene.toml", FAULTS);
    let run = sandbox.run(&["stress", "faults.scene.toml", "--budget", "10min", "-q"]);
    let text = run.text();
    for words in [
        "rays enter it without leaving, or leave it without entering",
        "objects[1] - duplicate-object",
        "energy of materials (2)",
        " metres, pixel ",
        "pixels are those of a picture of 96 x 64",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
    assert!(!text.contains("(0 rays)"), "{text}");
}

/// Protects: warnings of reading are counted and do not set the exit code; a model without any
/// object left shows nothing.
#[test]
fn warnings_of_reading_are_counted() {
    let Some(folder) = shared("assets/malformed") else {
        return;
    };
    let sandbox = Sandbox::new();
    let of = |model: &str| {
        let path = folder.join(model);
        let run = sandbox.run(&["stress", &path.to_string_lossy(), "--budget", "10min"]);
        (run.code, run.text().to_owned())
    };
    let (code, text) = of("geometry/nan_positions.gltf");
    assert!(code == Some(1) && text.contains("nothing-seen"), "{text}");
    for words in [
        "the scene has no object",
        "2 warnings of reading the file, the worst of them above (all: -v)",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
    for model in [
        "images/texture_without_texcoords.gltf",
        "obj/mtl_missing_texture.obj",
        "obj/huge_coordinates.obj",
    ] {
        let (code, text) = of(model);
        assert!(
            code == Some(0) && text.contains("of reading the file"),
            "{model}: {text}"
        );
    }
    // Numbers out of range are a note.
    let (code, text) = of("materials/out_of_range_factors.gltf");
    assert!(
        code == Some(0) && text.contains("no faults found\n"),
        "{text}"
    );
    let (code, text) = of("nodes/zero_scale.gltf");
    assert!(code == Some(1) && text.contains("1 finding,"), "{text}");
    assert!(text.contains("look for a scale of 0"), "{text}");
}

/// Protects: the text names findings with overlapping marks, even in a picture smaller than a mark.
#[test]
fn marks_in_one_place_are_named() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "tiny.scene.toml",
        FAULTS.replace("size = [96, 64]", "size = [8, 6]"),
    );
    let arguments = ["stress", "tiny.scene.toml", "--budget", "10min"];
    let run = sandbox.run(&[&arguments[..], &["-o", "m.png"]].concat());
    let text = run.text();
    assert!(text.contains("lie over each other"), "{text}");
}

/// Protects: the text names the findings without a mark.
#[test]
fn findings_without_a_mark_are_named() {
    let sandbox = Sandbox::new();
    sandbox.write("faults.scene.toml", FAULTS);
    let run = sandbox.run(&[
        "stress",
        "faults.scene.toml",
        "--budget",
        "10min",
        "-o",
        "m.png",
    ]);
    let text = run.text();
    // The light is above the picture.
    assert!(text.contains("m.png: no mark for "), "{text}");
    assert!(text.contains("seen by no camera"), "{text}");
}

/// Protects: the JSON has each finding with name, place and pixel, and is the same for the same
/// seed. The marked picture must be a PNG, and must not replace the scene file.
#[test]
fn findings_are_told_to_programs_and_marked() {
    let sandbox = Sandbox::new();
    sandbox.write("faults.scene.toml", FAULTS);
    let run = || {
        sandbox.run(&[
            "stress",
            "faults.scene.toml",
            "--budget",
            "10min",
            "--json",
            "-q",
            "-o",
            "marks.png",
            "--seed",
            "5",
        ])
    };
    let (first, again) = (run(), run());
    first.exits_with(1);
    let (first, again) = (json(&first), json(&again));
    assert_eq!(first["findings"], again["findings"]);
    assert_eq!(
        (&first["seed"], &first["cut_short"]),
        (&5.into(), &false.into())
    );
    let findings = first["findings"].as_array().expect("findings");
    let pane = findings
        .iter()
        .find(|found| found["code"] == "open-body")
        .expect("an open body");
    assert_eq!(
        (&pane["severity"], &pane["about"], &pane["path"]),
        (
            &"picture-wrong".into(),
            &"object `window`".into(),
            &"objects[2]".into()
        )
    );
    let pixel: Vec<f64> = pane["pixel"]
        .as_array()
        .expect("a pixel")
        .iter()
        .filter_map(Value::as_f64)
        .collect();
    assert!(
        (48.0..90.0).contains(&pixel[0]) && (10.0..60.0).contains(&pixel[1]),
        "{pane}"
    );
    let marked = sandbox.picture("marks.png");
    let is_red = |rgb: &&[f32; 3]| rgb[0] > 0.9 && rgb[1] < 0.5;
    assert!(
        [marked.width, marked.height] == [96, 64] && marked.rgb.iter().filter(is_red).count() > 20
    );
    sandbox
        .run(&["stress", "faults.scene.toml", "-o", "marks.exr"])
        .exits_with(2);
    sandbox.write("x.png", FAULTS);
    sandbox
        .run(&["stress", "x.png", "-o", "x.png"])
        .exits_with(2)
        .prints_like("this run reads it");
}

/// Protects: a budget that ends before the rays reports the finished and the planned number: here
/// eight cameras in a white room with many bounces.
#[test]
fn a_budget_that_ends_is_told() {
    let camera = "{ pose.look_at = { eye = [0, 1, 4], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 40 } }";
    let room = format!(
        "format = 1\nrender = {{ size = [1280, 720], samples = 64, max_depth = 64, integrator = \"path\" }}\ncameras = [{}]\n\
         materials = [{{ name = \"white\", model.physical = {{ base_colour = 0.999 }} }}, {{ name = \"lamp\", model.physical = {{ emission = 1 }} }}]\n\
         objects = [{{ shape.box = {{ min = [-5, -5, -5], max = [5, 5, 5] }}, material = \"white\" }},\n\
         {{ shape.sphere = {{ centre = [0, 3, 0], radius = 0.5 }}, material = \"lamp\" }}]\n",
        [camera; 8].join(", ")
    );
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", room);
    let arguments = [
        "stress",
        "room.scene.toml",
        "--budget",
        "1s",
        "--threads",
        "1",
        "-q",
    ];
    assert_eq!(
        json(&sandbox.run(&[&arguments[..], &["--json"]].concat()))["cut_short"],
        true
    );
    let run = sandbox.run(&arguments);
    assert!(
        run.text().contains("larger --budget finds more"),
        "{}",
        run.text()
    );
}

/// Protects: a sky file with invalid texels is a finding, although loading replaces them.
#[test]
fn files_with_texels_that_are_no_light() {
    let sandbox = Sandbox::new();
    let mut sky = Picture {
        rgb: (0..512).map(|i| [0.2, 0.3, 0.001 * i as f32]).collect(),
        ..Picture::new(32, 16)
    };
    sky.rgb[100] = [f32::NAN, 0.3, 0.2];
    write_picture(
        &sandbox.path("sky.exr"),
        &sky,
        Display::PLAIN,
        &PictureMetadata::default(),
    )
    .expect("a file");
    let scene = FAULTS.replace(
        "sky.constant = 0.5",
        "sky.map = { image = \"sky\" }\nimages = [{ name = \"sky\", path = \"sky.exr\" }]",
    );
    sandbox.write(
        "sky.scene.toml",
        scene
            .replace("1.5", "0.5")
            .replace("transmission = 1", "transmission = 0"),
    );
    let found = wrong(&sandbox, "sky.scene.toml");
    let of = |found: &Value| {
        (
            found["code"].clone(),
            found["about"].clone(),
            found["count"].clone(),
        )
    };
    assert_eq!(
        found.iter().map(of).collect::<Vec<_>>(),
        [("image-not-light".into(), "image `sky`".into(), 1.into())]
    );
}

/// Returns the findings that make the picture of a scene wrong.
#[track_caller]
fn wrong(sandbox: &Sandbox, scene: &str) -> Vec<Value> {
    let run = sandbox.run(&["stress", scene, "--budget", "10min", "--json", "-q"]);
    let report = json(&run);
    let of = |found: &&Value| found["severity"] == "picture-wrong";
    let wrong: Vec<Value> = report["findings"]
        .as_array()
        .expect("findings")
        .iter()
        .filter(of)
        .cloned()
        .collect();
    assert_eq!(
        run.code,
        Some(i32::from(!wrong.is_empty())),
        "{scene}: {}",
        run.stderr
    );
    wrong
}

/// Protects: no preset has a finding that makes its picture wrong. To save time, the small pictures
/// have fewer pixels and samples than those of the command; rays and furnace tests are the same.
#[test]
fn no_preset_is_wrong() {
    for preset in presets::names() {
        let scene = load(&Input::Preset(preset.to_owned()), &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{e}"))
            .scene;
        let own = Settings::from_scene(&scene);
        let sampling = if own.sampling.is_fixed() {
            own.sampling
        } else {
            Sampling::General(4)
        };
        let settings = Settings {
            size: own.size.map(|edge| edge.div_ceil(8)),
            sampling,
            ..own
        };
        let effort = StressEffort {
            budget: Duration::from_secs(600),
        };
        let report =
            stress(&scene, &settings, &effort, &()).unwrap_or_else(|e| panic!("{preset}: {e}"));
        assert_ne!(
            report.worst_severity(),
            Some(Severity::PictureWrong),
            "{preset}: {:?}",
            report.findings
        );
        assert!(!report.is_cut_short(), "{preset}");
    }
}

/// Protects: none of twenty faultless public models has a finding that makes its picture wrong.
#[test]
fn no_clean_model_is_wrong() {
    let Some(folder) = shared("assets") else {
        return;
    };
    let models = [
        "gltf/AnimatedCube/AnimatedCube.gltf",
        "gltf/AnimatedMorphCube/AnimatedMorphCube.gltf",
        "gltf/AnisotropyDiscTest/AnisotropyDiscTest.glb",
        "gltf/BoxInterleaved/BoxInterleaved.glb",
        "gltf/BoxTextured-Embedded/BoxTextured.gltf",
        "gltf/BoxVertexColors/BoxVertexColors.glb",
        "gltf/Cameras/Cameras.gltf",
        "gltf/ClearCoatTest/ClearCoatTest.glb",
        "gltf/Duck/Duck.glb",
        "gltf/Fox/Fox.glb",
        "gltf/InterpolationTest/InterpolationTest.gltf",
        "gltf/RiggedFigure/RiggedFigure.glb",
        "gltf/SunglassesKhronos/SunglassesKhronos.glb",
        "gltf/Suzanne/Suzanne.gltf",
        "gltf/TextureSettingsTest/TextureSettingsTest.gltf",
        "gltf/TextureTransformTest/TextureTransformTest.gltf",
        "gltf/TwoSidedPlane/TwoSidedPlane.glb",
        "gltf/bio-15_transmission/15_transmission.gltf",
        "gltf/crafted/volume_row.glb",
        "obj/common/fandisk.obj",
        "obj/common/spot.obj",
        "obj/common/suzanne.obj",
        "obj/tinyobj/cornell_box.obj",
    ];
    let sandbox = Sandbox::new();
    let path = |model: &&str| -> PathBuf { folder.join(model) };
    let there: Vec<PathBuf> = models
        .iter()
        .map(path)
        .filter(|path| path.exists())
        .collect();
    assert!(there.len() >= 20, "{there:?}");
    for path in there {
        let name = path.to_string_lossy();
        assert_eq!(wrong(&sandbox, &name), Vec::<Value>::new(), "{name}");
    }
}

/// Protects: the documentation page lists each kind of fault as the table of kinds describes it.
#[test]
fn every_finding_is_explained() {
    let page =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/stress.md"))
            .expect("the page");
    for kind in FaultKind::ALL {
        let [severity, fault] = [kind.severity().description(), kind.description()];
        let row = format!("| `{}` | {severity} | {fault} |", kind.name());
        assert!(page.contains(&row), "{row}");
    }
}
