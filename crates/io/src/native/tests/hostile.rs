//! Tests of truncated, damaged and malicious texts: always a message or a scene, never a panic,
//! never a long wait.

use std::sync::LazyLock;

use proptest::prelude::*;

use super::everything::EVERYTHING;
use super::schema::to_json;
use super::toml;
use crate::error::Error;
use crate::error_kind::ErrorKind;
use crate::native::node::{TextValue, ValueNode};
use crate::native::{
    ParameterOverrides, SceneNotation, UnreadParts, decode_utf8, deserialize_scene, parse,
    parse_tree,
};
use crate::presets;

/// Reads bytes as a scene; a failure must have a message.
fn survive(bytes: &[u8], notation: SceneNotation) {
    let result: Result<(), Error> = decode_utf8("x", bytes.to_vec(), u64::MAX).and_then(|text| {
        parse("x", &text, notation, &ParameterOverrides::default())?;
        Ok(())
    });
    if let Err(error) = result {
        assert!(error.to_string().starts_with("error: "), "{error}");
    }
}

/// The scene with every key, and every built-in scene.
fn texts() -> impl Iterator<Item = &'static str> {
    presets::list()
        .into_iter()
        .map(|preset| preset.text)
        .chain([EVERYTHING])
}

/// The same texts in both notations.
static SCENES: LazyLock<Vec<(Vec<u8>, SceneNotation)>> = LazyLock::new(|| {
    let both = texts().flat_map(|text| {
        let json = to_json(&parse_tree(text, SceneNotation::Toml).expect("valid TOML")).to_string();
        [
            (text.as_bytes().to_vec(), SceneNotation::Toml),
            (json.into_bytes(), SceneNotation::Json),
        ]
    });
    both.collect()
});

/// Protects: no truncation of any scene causes a panic.
#[test]
fn every_truncation_of_every_scene_is_survived() {
    for (bytes, notation) in &*SCENES {
        for end in 0..bytes.len() {
            survive(&bytes[..end], *notation);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    /// Protects: damaged bytes cause no panic.
    #[test]
    fn damaged_bytes_are_survived(at in any::<prop::sample::Index>(), which in any::<prop::sample::Index>(), bytes: [u8; 3], count in 1..4_usize) {
        let (mut scene, notation) = which.get(&SCENES).clone();
        let start = at.index(scene.len());
        let end = (start + count).min(scene.len());
        scene.splice(start..end, bytes);
        survive(&scene, notation);
    }

    /// Protects: well-formed texts with unexpected values cause no panic.
    #[test]
    fn any_value_anywhere_is_survived(at in any::<prop::sample::Index>(), which in any::<prop::sample::Index>(), value in strange()) {
        let texts: Vec<_> = texts().collect();
        let text = which.get(&texts);
        let mut root = parse_tree(text, SceneNotation::Toml).expect("valid TOML");
        let nodes = count(&root);
        *nth(&mut root, &mut at.index(nodes)).expect("within the tree") = value;
        let names = [("t".to_owned(), 0.0)].into();
        let (unread, mut problems) = (UnreadParts::default(), Vec::new());
        if let (Some(scene), _) = deserialize_scene(&mut root, text, &names, unread, &mut problems) {
            raywright_core::validate::validate(&scene);
        }
    }
}

/// Values that are wrong almost everywhere.
fn strange() -> impl Strategy<Value = TextValue> {
    let node = |value| ValueNode { span: 0..1, value };
    prop_oneof![
        Just(TextValue::Null),
        Just(TextValue::Date),
        any::<bool>().prop_map(TextValue::Boolean),
        any::<i64>().prop_map(TextValue::Integer),
        Just(TextValue::Unsigned(u64::MAX)),
        any::<f64>().prop_map(TextValue::Float),
        Just(TextValue::Float(f64::NAN)),
        "[a-z0-9+*/(), ]{0,12}".prop_map(TextValue::Text),
        Just(TextValue::Array(Vec::new())),
        proptest::collection::vec(any::<f64>(), 0..5).prop_map(move |numbers| TextValue::Array(
            numbers
                .into_iter()
                .map(|x| node(TextValue::Float(x)))
                .collect()
        )),
        Just(TextValue::Table(Vec::new())),
    ]
}

fn count(node: &ValueNode) -> usize {
    1 + match &node.value {
        TextValue::Array(items) => items.iter().map(count).sum(),
        TextValue::Table(entries) => entries.iter().map(|entry| count(&entry.node)).sum(),
        _ => 0,
    }
}

/// Returns the value of the nth node in the order of [`count`].
fn nth<'a>(node: &'a mut ValueNode, n: &mut usize) -> Option<&'a mut TextValue> {
    if *n == 0 {
        return Some(&mut node.value);
    }
    *n -= 1;
    match &mut node.value {
        TextValue::Array(items) => items.iter_mut().find_map(|item| nth(item, n)),
        TextValue::Table(entries) => entries.iter_mut().find_map(|entry| nth(&mut entry.node, n)),
        _ => None,
    }
}

/// Returns the message for a text that must be refused as wrong input.
fn refused(text: &str, notation: SceneNotation) -> String {
    let error = parse("x", text, notation, &ParameterOverrides::default())
        .err()
        .expect("this is no scene");
    assert_eq!(error.kind(), ErrorKind::Input);
    error.to_string()
}

/// Protects: unbounded nesting gives a single message.
#[test]
fn nesting_without_end_is_one_message() {
    const DEPTH: usize = 100_000;
    let deep = |open: &str, close: &str| format!("{}{}", open.repeat(DEPTH), close.repeat(DEPTH));
    let toml = [
        format!("format = 1\na = {}", deep("[", "]")),
        format!("format = 1\na = {}", deep("{ a = ", "}")),
        format!("format = 1\na = {}", "[".repeat(DEPTH)),
        format!("format = 1\n{} = 1", deep("a.", "") + "a"),
        format!("format = 1\n[{}]", deep("a.", "") + "a"),
    ];
    for text in &toml {
        let message = refused(text, SceneNotation::Toml);
        assert!(
            message.starts_with("error: ")
                && message.contains("arrays and tables are nested too deeply"),
            "{message:.300}"
        );
        assert_eq!(message.matches("error: ").count(), 1, "{message:.300}");
    }
    for text in [deep("[", "]"), "[".repeat(DEPTH), deep("{\"a\":", "}")] {
        let message = refused(&text, SceneNotation::Json);
        assert!(
            message.starts_with("error: arrays and objects are nested too deeply"),
            "{message:.300}"
        );
    }
}

/// Protects: an endless line is shown in part.
#[test]
fn a_line_without_end_is_shown_in_part() {
    let text = format!(
        "format = 1\ntitle = \"{}\"\nt = [{}]",
        "x".repeat(100_000),
        "1, ".repeat(100_000)
    );
    let message = toml(&text).expect_err("t is no number").to_string();
    assert!(message.len() < 1000, "{} bytes", message.len());
}

/// Protects: thousands of problems are truncated and counted.
#[test]
fn thousands_of_problems_are_cut_off_and_counted() {
    let text = format!("format = 1\n{}", "[[lights]]\ncolor = 1\n".repeat(3000));
    let started = std::time::Instant::now();
    let message = toml(&text).expect_err("no light is right").to_string();
    assert!(
        message.lines().count() < 200
            && message.ends_with("more problems not shown; mend the problems above first"),
        "{message}"
    );
    // Each pass covers the whole text: the number of passes must not grow with the text.
    assert!(
        started.elapsed().as_secs() < 20,
        "took {:?}",
        started.elapsed()
    );
}

/// Protects: control characters do not reach the terminal.
#[test]
fn control_characters_do_not_reach_the_terminal() {
    let message = toml("format = 1\n\"\u{1b}[31m\" = 1")
        .err()
        .map(|error| error.to_string())
        .unwrap_or_default();
    let json = refused("{ \"format\": 1, \"\\u001b[31m\": 1 }", SceneNotation::Json);
    assert!(
        !message.contains('\u{1b}') && !json.contains('\u{1b}'),
        "{message:?} {json:?}"
    );
    assert!(
        message.contains("unknown key") || message.contains("not valid TOML"),
        "{message}"
    );
    assert!(json.contains("unknown key"), "{json}");
}
