//! Messages about values of the wrong kind, unknown words and missing keys, each read from a
//! newcomer's point of view.

use super::expect_message;
use crate::error::Error;
use crate::native::{ParameterOverrides, SceneNotation, parse};

/// Protects: the message for an unknown section, word for word: place, cause and remedy.
#[test]
fn an_unknown_section() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[camera]
name = "a"
"#,
        r#"
error: unknown key `camera`
 --> x.scene.toml:2:2
  |
2 | [camera]
  |  ^^^^^^ not a key of a scene
  |
  = help: did you mean `cameras`?
"#,
    );
}

/// Protects: the message for an unknown key, word for word: place, cause and remedy.
#[test]
fn an_unknown_key() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
sampels = 4
"#,
        r#"
error: unknown key `sampels`
 --> x.scene.toml:3:1
  |
3 | sampels = 4
  | ^^^^^^^ not a key of `render`
  |
  = help: did you mean `samples`?
"#,
    );
}

/// Protects: the message for another spelling, word for word: place, cause and remedy.
#[test]
fn message_for_another_spelling() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[lights]]
kind.directional.to_light = [0, 1, 0]
color = 1
"#,
        r#"
error: `lights[0]`: missing key `colour`
 --> x.scene.toml:2:1
  |
2 | [[lights]]
  | ^^^^^^^^^^
  |
  = help: for example `colour = [1, 1, 1]`

error: unknown key `color`
 --> x.scene.toml:4:1
  |
4 | color = 1
  | ^^^^^ not a key of `lights[0]`
  |
  = help: did you mean `colour`?
"#,
    );
}

/// Protects: the message for a missing key, word for word: place, cause and remedy.
#[test]
fn a_missing_key() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[objects]]
shape.sphere = { centre = [0, 0, 0], radius = 1 }
"#,
        r#"
error: `objects[0]`: missing key `material`
 --> x.scene.toml:2:1
  |
2 | [[objects]]
  | ^^^^^^^^^^^
  |
  = help: for example `material = "polished brass"`
"#,
    );
}

/// Protects: the message for one table where many are possible, word for word: place, cause and
/// remedy.
#[test]
fn one_table_where_many_are_possible() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[materials]
name = "red"
"#,
        r#"
error: `materials` must be an array, not a table
 --> x.scene.toml:2:1
  |
2 | [materials]
  | ^^^^^^^^^^^
  |
  = help: `materials` is a list: write `[[materials]]` with double brackets
"#,
    );
}

/// Protects: the message for many tables where one is possible, word for word: place, cause and
/// remedy.
#[test]
fn many_tables_where_one_is_possible() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[render]]
samples = 4
"#,
        r#"
error: `render` must be a table with keys, not an array
 --> x.scene.toml:2:1
  |
2 | [[render]]
  | ^^^^^^^^^^
  |
  = help: `render` is a single table: write `[render]` with single brackets
"#,
    );
}

/// Protects: the message for text where a number is needed, word for word: place, cause and remedy.
#[test]
fn text_where_a_number_is_needed() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
samples = true
"#,
        r#"
error: `samples` must be a number, or an expression in quotes, not true or false
 --> x.scene.toml:3:11
  |
3 | samples = true
  |           ^^^^
"#,
    );
}

/// Protects: the message for a fraction where a whole number is needed, word for word: place, cause
/// and remedy.
#[test]
fn a_fraction_where_a_whole_number_is_needed() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
samples = 4.5
"#,
        r#"
error: `samples` must be a whole number, not 4.5
 --> x.scene.toml:3:11
  |
3 | samples = 4.5
  |           ^^^
"#,
    );
}

/// Protects: the message for a negative count, word for word: place, cause and remedy.
#[test]
fn a_negative_count() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
samples = -4
"#,
        r#"
error: `samples` must be a whole number from 0 to 4294967295, not -4
 --> x.scene.toml:3:11
  |
3 | samples = -4
  |           ^^
"#,
    );
}

/// Protects: the message for two numbers for a point, word for word: place, cause and remedy.
#[test]
fn two_numbers_for_a_point() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[objects]]
material = "m"
shape.sphere = { centre = [0, 0], radius = 1 }
"#,
        r#"
error: `centre` must be an array of 3 values, not of 2
 --> x.scene.toml:4:27
  |
4 | shape.sphere = { centre = [0, 0], radius = 1 }
  |                           ^^^^^^
"#,
    );
}

/// Protects: the message for an unknown word, word for word: place, cause and remedy.
#[test]
fn an_unknown_word() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
tone_map = "filmic"
"#,
        r#"
error: `tone_map` cannot be `filmic`
 --> x.scene.toml:3:12
  |
3 | tone_map = "filmic"
  |            ^^^^^^^^
  |
  = help: it can be: none, aces, aces-hill, agx, khronos-neutral
"#,
    );
}

/// Protects: the message for a mistyped word, word for word: place, cause and remedy.
#[test]
fn a_mistyped_word() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
gamma = "sRGB"
"#,
        r#"
error: `gamma` cannot be `sRGB`
 --> x.scene.toml:3:9
  |
3 | gamma = "sRGB"
  |         ^^^^^^
  |
  = help: did you mean `srgb`?
"#,
    );
}

/// Protects: the message for an unknown shape, word for word: place, cause and remedy.
#[test]
fn an_unknown_shape() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[objects]]
material = "m"
shape.spere = { centre = [0, 0, 0], radius = 1 }
"#,
        r#"
error: `shape` cannot be `spere`
 --> x.scene.toml:4:7
  |
4 | shape.spere = { centre = [0, 0, 0], radius = 1 }
  |       ^^^^^
  |
  = help: did you mean `sphere`?
"#,
    );
}

/// Protects: the message for two shapes at once, word for word: place, cause and remedy.
#[test]
fn two_shapes_at_once() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[objects]]
material = "m"
shape = { mesh = "a", sphere = { centre = [0, 0, 0], radius = 1 } }
"#,
        r#"
error: `shape` must have exactly one key, which names its kind, not 2 keys
 --> x.scene.toml:4:23
  |
4 | shape = { mesh = "a", sphere = { centre = [0, 0, 0], radius = 1 } }
  |                       ^^^^^^ one key too many
"#,
    );
}

/// Protects: the message for a shape without its keys, word for word: place, cause and remedy.
#[test]
fn a_shape_without_its_keys() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[objects]]
material = "m"
shape = "sphere"
"#,
        r#"
error: `sphere` needs a value
 --> x.scene.toml:4:9
  |
4 | shape = "sphere"
  |         ^^^^^^^^
  |
  = help: write `shape = { sphere = … }` with centre, radius
"#,
    );
}

/// Protects: the message for a word that takes no keys, word for word: place, cause and remedy.
#[test]
fn a_word_that_takes_no_keys() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[materials]]
name = "m"
model.physical.alpha = { blend = 0.5 }
"#,
        r#"
error: `blend` takes no value
 --> x.scene.toml:4:34
  |
4 | model.physical.alpha = { blend = 0.5 }
  |                                  ^^^
  |
  = help: write `alpha = "blend"`
"#,
    );
}

/// Protects: the message for a colour that is none, word for word: place, cause and remedy.
#[test]
fn a_colour_that_is_none() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[sky]
constant = [1, 1]
"#,
        r#"
error: `constant`: expected a colour: [red, green, blue] or one number for grey, found an array of length 2
 --> x.scene.toml:3:12
  |
3 | constant = [1, 1]
  |            ^^^^^^
"#,
    );
}

/// Protects: the message for an unknown input, word for word: place, cause and remedy.
#[test]
fn an_unknown_input() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[materials]]
name = "m"
model.classic.colour = { image = "wood" }
"#,
        r#"
error: `colour`: unknown key `image`
 --> x.scene.toml:4:26
  |
4 | model.classic.colour = { image = "wood" }
  |                          ^^^^^
  |
  = help: allowed keys: texture, checker
"#,
    );
}

/// Returns the messages and hints of a wrong scene, a line each.
fn advice(file: &str, text: &str) -> Vec<String> {
    let notation = match file.ends_with("json") {
        true => SceneNotation::Json,
        false => SceneNotation::Toml,
    };
    match parse(file, text, notation, &ParameterOverrides::default()) {
        Err(Error::Scene(found)) => (found.problems.into_iter())
            .map(|problem| format!("{}: {}", problem.message, problem.hint.unwrap_or_default()))
            .collect(),
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("this was accepted:\n{text}"),
    }
}

/// Protects: a scene written from memory is answered in one round: words of other programs, missing
/// keys of one table, wrong values and what does not fit together, each once, and nothing that only
/// follows from another problem.
#[test]
fn a_scene_from_memory_is_answered_in_one_round() {
    let text = r#"
[[cameras]]
fov = 40
[render]
resolution = [640, 360]
[[materials]]
name = "steel"
model.physical = { metalness = 1, base_color = [0.9, 0.9, 0.9], roughness = 3 }
[[materials]]
name = "paint"
model.physical = { base_colour = "sin(iTime)" }
[[materials]]
name = "broken"
model.principled = {}
[[lights]]
kind.sun = { to_light = [0, 1, 0] }
[[objects]]
shape.sphere = { center = [0, 0, 0], radius = -1 }
material = "stel"
[[objects]]
shape.cube = { min = [0, 0, 0], max = [1, 1, 1] }
material = "broken"
[[objects]]
shape.disk = { centre = [0, 0, 0], normal = [0, 0, 0], radius = 1 }
material = "broken"
"#;
    let found = advice("x.scene.toml", text);
    let expected = [
        "this is no scene file: the key `format` is missing: a scene begins",
        "`cameras[0]`: missing key `pose`: for example `pose = { look_at = { eye = [0, 1, 5], target = [0, 0.5, 0] } }`",
        "`cameras[0]`: missing key `projection`: for example `projection = { pinhole = { vertical_fov = 40 } }`",
        "unknown key `fov`: did you mean `projection.pinhole.vertical_fov`?",
        "unknown key `resolution`: did you mean `size`?",
        "unknown key `metalness`: did you mean `metallic`?",
        "unknown key `base_color`: did you mean `base_colour`?",
        "`roughness` must be from 0 to 1, not 3: ",
        "in the expression of `base_colour`: unknown name `iTime`: did you mean `t`?",
        "`model` cannot be `principled`: did you mean `physical`?",
        "`kind` cannot be `sun`: did you mean `directional`?",
        "`sphere`: missing key `centre`: for example `centre = [0, 1, 0]`",
        "unknown key `center`: did you mean `centre`?",
        "`radius` must be above zero, not -1: ",
        "unknown material `stel`: did you mean `steel`?",
        "`shape` cannot be `cube`: did you mean `box`?",
        "`normal` has length zero, so it gives no direction: ",
    ];
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    for line in expected {
        assert!(
            found.iter().any(|found| found.starts_with(line)),
            "{line}\n{found:#?}"
        );
    }
}

/// Protects: a missing key in JSON shows its example as JSON.
#[test]
fn examples_are_in_the_notation_of_the_file() {
    let text = r#"{ "format": 1, "objects": [{ "material": "a" }], "lights": [{ "kind": { "spot": {} } }] }"#;
    let found = advice("x.scene.json", text).join("\n");
    for line in [
        r#"`"shape": { "sphere": { "centre": [0, 1, 0], "radius": 0.5 } }`"#,
        r#"`"position": [2, 4, 3]`"#,
        r#"`"colour": [1, 1, 1]`"#,
    ] {
        assert!(found.contains(line), "{line}\n{found}");
    }
}

/// Protects: every key that a table of the format must have has an example.
#[test]
fn every_needed_key_has_an_example() {
    fn keys(schema: &serde_json::Value, out: &mut Vec<String>) {
        match schema {
            serde_json::Value::Array(items) => items.iter().for_each(|item| keys(item, out)),
            serde_json::Value::Object(members) => {
                let properties = members.get("properties").and_then(|p| p.as_object());
                let needed = members.get("required").and_then(|r| r.as_array());
                // A table whose only key is the one that it needs is a choice among kinds.
                if properties.is_none_or(|all| all.len() > 1) {
                    let needed = needed.into_iter().flatten().filter_map(|key| key.as_str());
                    out.extend(needed.map(str::to_owned));
                }
                members.values().for_each(|member| keys(member, out));
            }
            _ => {}
        }
    }
    let schema = serde_json::from_str(raywright_core::scene::SCHEMA).expect("JSON");
    let mut needed = Vec::new();
    keys(&schema, &mut needed);
    let examples = crate::native::toml::parse(include_str!("../examples.toml")).expect("TOML");
    assert!(needed.len() > 60, "{}", needed.len());
    for key in needed.iter().filter(|key| *key != "format") {
        assert!(examples.get(key).is_some(), "{key}");
    }
}
