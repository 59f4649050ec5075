//! A scene that uses the whole format, and tests that it is read, written and described
//! consistently.

use std::collections::BTreeSet;

use raywright_core::scene::SCHEMA;
use serde_json::Value;

use super::read_scene;
use crate::native::{ParameterOverrides, SceneNotation, parse};
use crate::presets;

/// A scene with every key of the format.
pub(super) const EVERYTHING: &str = include_str!("everything.scene.toml");

/// Keys and words that exclude others in the scene above.
const ALTERNATIVES: &str = "constant = expression = map = { image = rotation = strength = } studio = backdrop = ground = file = blend opaque blinn \
    blinn_reflected grazing error_bound first_in_order drop scene = time = corners whitted path none aces aces-hill khronos-neutral 2.2 bilinear mipmaps \
    repeat both culled split normal gaussian blackman-harris tent contain stretch surface";

/// Protects: the scene with every key is valid.
#[test]
fn the_scene_of_everything_is_right() {
    assert_eq!(read_scene(EVERYTHING).title, "Everything");
}

/// Protects: every addition to the format is also added to the scene with every key, because the
/// other tests here depend on its completeness.
#[test]
fn the_scene_of_everything_is_complete() {
    let schema: Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
    let mut words = BTreeSet::new();
    collect(&schema, &mut words);
    let written = format!("{EVERYTHING} {ALTERNATIVES}");
    let used: BTreeSet<&str> = written
        .split(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '-')))
        .collect();
    let dotted: BTreeSet<&str> = written.split([' ', '"', '\n']).collect();
    let missing: Vec<_> = words
        .iter()
        .filter(|word| !used.contains(word.as_str()) && !dotted.contains(word.as_str()))
        .collect();
    assert!(words.len() > 150, "only {} words were found", words.len());
    assert!(
        missing.is_empty(),
        "the scene of everything lacks {missing:?}"
    );
}

/// Collects property names and constant words of a schema.
fn collect(schema: &Value, words: &mut BTreeSet<String>) {
    match schema {
        Value::Array(items) => items.iter().for_each(|item| collect(item, words)),
        Value::Object(members) => {
            for (key, member) in members {
                match (key.as_str(), member) {
                    ("properties", Value::Object(properties)) => {
                        words.extend(properties.keys().cloned());
                        properties
                            .values()
                            .for_each(|property| collect(property, words));
                    }
                    ("const", Value::String(word)) => _ = words.insert(word.clone()),
                    ("enum", Value::Array(list)) => {
                        words.extend(list.iter().filter_map(Value::as_str).map(str::to_owned));
                    }
                    ("default" | "description", _) => {}
                    _ => collect(member, words),
                }
            }
        }
        _ => {}
    }
}

/// Protects: a scene written as JSON is read back unchanged.
#[test]
fn a_scene_written_as_json_is_read_back_the_same() {
    let mut texts: Vec<&str> = presets::list()
        .into_iter()
        .map(|preset| preset.text)
        .collect();
    texts.push(EVERYTHING);
    for text in texts {
        let scene = read_scene(text);
        let json = serde_json::to_string(&scene).expect("a scene is plain data");
        let again = parse(
            "x.scene.json",
            &json,
            SceneNotation::Json,
            &ParameterOverrides::default(),
        );
        assert_eq!(
            again.unwrap_or_else(|error| panic!("{error}")).scene,
            scene,
            "{}",
            scene.title
        );
    }
}
