//! `info`, `check` and `presets`: reports about scenes without a render.

use crate::support::Sandbox;

const TWO_SPHERES: &str = r#"
format = 1
title = "Two"
[parameters]
r = 0.5
[render]
size = [320, 200]
pattern = "corners"
[[cameras]]
name = "front"
pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0] }
projection.pinhole = { vertical_fov = 40 }
[[materials]]
name = "red"
model.classic = {}
[[objects]]
shape.sphere = { centre = [0, 0, 0], radius = "r" }
material = "red"
[[objects]]
shape.plane = { point = [0, -1, 0], normal = [0, 1, 0] }
material = "red"
[[generators]]
kind.grid = { counts = [3, 2, 1], origin = [0, 0, 0], step = [4, 3, 1] }
object = { shape.disk = { centre = [0, 0, 0], normal = [0, 0, 1], radius = 1 }, material = "red" }
"#;

/// Protects: the table of `info` counts the scene's items, and leaves out empty rows.
#[test]
fn info_shows_what_is_in_a_scene() {
    let sandbox = Sandbox::new();
    sandbox.write("two.scene.toml", TWO_SPHERES);
    let run = sandbox.run(&["info", "two.scene.toml", "--set", "r=0.25"]);
    run.exits_with(0).prints("");
    let expected = "\
file        two.scene.toml
format      Raywright scene (TOML)
title       Two
picture     320x200 pixels, 4 samples (corners), paths of at most 8 ray segments
parameters  r = 0.25
cameras     1: front
objects     2: 1 plane, 1 sphere
generated   6 disk
materials   1 classic
";
    let (table, rest) = run.text().split_at(expected.len().min(run.text().len()));
    assert_eq!(table, expected);
    let rest: Vec<(&str, &str)> = rest.lines().map(|line| line.split_at(12)).collect();
    assert_eq!(
        rest.iter()
            .map(|(name, _)| name.trim_end())
            .collect::<Vec<_>>(),
        ["bounds", "memory", "hash"]
    );
    assert_eq!(
        rest[0].1,
        "-1, -1, -0.25  to  9, 4, 0.25, and 1 without bounds"
    );
    assert!(
        rest[1].1.starts_with("geometry ") && rest[1].1.contains("picture "),
        "{}",
        rest[1].1
    );
    assert_eq!(rest[2].1.len(), 64);
}

/// Protects: `check` accepts a valid file, and refuses an invalid one with the exit code for
/// scripts.
#[test]
fn check_tells_good_files_from_bad_ones() {
    let sandbox = Sandbox::new();
    sandbox.write("two.scene.toml", TWO_SPHERES);
    let good = sandbox.run(&["check", "two.scene.toml"]);
    good.exits_with(0).prints("");
    assert_eq!(good.text(), "two.scene.toml: ok\n");
    for (images, message) in [(1, "1 warning"), (2, "2 warnings")] {
        let image = |i: u32| format!("\n[[images]]\nname = \"{i}\"\npath = \"{i}.png\"\n");
        sandbox.write(
            "bare.scene.toml",
            TWO_SPHERES.to_owned() + &(0..images).map(image).collect::<String>(),
        );
        assert_eq!(
            sandbox.run(&["check", "bare.scene.toml"]).text(),
            format!("bare.scene.toml: ok, {message}\n")
        );
    }
    sandbox.write("bad.scene.toml", TWO_SPHERES.replace("radius", "raduis"));
    sandbox.run(&["check", "bad.scene.toml"]).exits_with(3);
    sandbox
        .run(&["check", "missing.scene.toml"])
        .exits_with(4)
        .prints("error: cannot read missing.scene.toml: no such file or folder");
}

/// Protects: an unknown parameter is an error of the command line, not of the file.
#[test]
fn unknown_parameters_are_wrong_use() {
    let sandbox = Sandbox::new();
    sandbox.write("two.scene.toml", TWO_SPHERES);
    sandbox
        .run(&["check", "two.scene.toml", "--set", "q=1"])
        .exits_with(2);
}

/// Protects: the text of a preset is a scene file that the program accepts.
#[test]
fn presets_are_scene_files() {
    let sandbox = Sandbox::new();
    let table = sandbox.run(&["presets"]);
    table.exits_with(0).prints("");
    for line in table.text().lines() {
        let name = line
            .split_whitespace()
            .next()
            .and_then(|word| word.strip_prefix("preset:"))
            .expect("a preset's name");
        let text = sandbox.run(&["presets", name]);
        text.exits_with(0).prints("");
        sandbox.write("copy.scene.toml", text.text());
        sandbox.run(&["check", "copy.scene.toml"]).exits_with(0);
    }
    sandbox.run(&["presets", "no-such-preset"]).exits_with(2);
}

/// Protects: the schema is JSON that describes every part of a scene.
#[test]
fn the_schema_describes_scenes() {
    let run = Sandbox::new().run(&["schema"]);
    run.exits_with(0).prints("");
    let schema: serde_json::Value = serde_json::from_str(run.text()).expect("JSON");
    for part in [
        "format",
        "render",
        "cameras",
        "sky",
        "lights",
        "materials",
        "meshes",
        "objects",
    ] {
        assert!(schema["properties"][part].is_object(), "{part}");
    }
}

/// Protects: all problems of keys are reported together, each with its line, a caret and advice.
#[test]
fn problems_of_a_scene_are_shown_where_they_are() {
    let sandbox = Sandbox::new();
    let wrong = TWO_SPHERES
        .replace("radius = \"r\"", "raduis = -2")
        .replace("vertical_fov = 40", "vertical_fov = 400");
    sandbox.write(
        "two.scene.toml",
        wrong.replace(
            "material = \"red\"\n[[generators]]",
            "material = \"rde\"\n[[generators]]",
        ),
    );
    let run = sandbox.run(&["check", "two.scene.toml"]);
    run.exits_with(3).prints(PROBLEMS);
    assert_eq!(run.text(), "");
    sandbox
        .run(&["render", "two.scene.toml"])
        .exits_with(3)
        .prints(PROBLEMS);
}

const PROBLEMS: &str = "\
error: `vertical_fov` must be above 0 and below 180, not 400
  --> two.scene.toml:12:39
   |
12 | projection.pinhole = { vertical_fov = 400 }
   |                                       ^^^

error: `sphere`: missing key `radius`
  --> two.scene.toml:17:16
   |
17 | shape.sphere = { centre = [0, 0, 0], raduis = -2 }
   |                ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
   |
   = help: for example `radius = 0.5`

error: unknown key `raduis`
  --> two.scene.toml:17:38
   |
17 | shape.sphere = { centre = [0, 0, 0], raduis = -2 }
   |                                      ^^^^^^ not a key of `sphere`
   |
   = help: did you mean `radius`?

error: unknown material `rde`
  --> two.scene.toml:21:12
   |
21 | material = \"rde\"
   |            ^^^^^
   |
   = help: did you mean `red`?
";
