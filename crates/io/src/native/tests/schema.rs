//! Tests that the JSON Schema accepts what the loader accepts and refuses what it refuses, as far
//! as a schema can express it.

use raywright_core::scene::SCHEMA;
use serde_json::{Map, Value, json};

use super::everything::EVERYTHING;
use crate::native::node::{TextValue as Tree, ValueNode};
use crate::native::{SceneNotation, parse_tree};
use crate::presets;

/// Validator for the part of JSON Schema that the scene's schema uses. An unknown restricting
/// keyword fails the test.
fn accepts(root: &Value, schema: &Value, value: &Value) -> bool {
    let Value::Object(keywords) = schema else {
        return schema.as_bool().expect("a schema");
    };
    keywords
        .iter()
        .all(|(keyword, rule)| holds(root, keywords, keyword, rule, value))
}

fn holds(
    root: &Value,
    keywords: &Map<String, Value>,
    keyword: &str,
    rule: &Value,
    value: &Value,
) -> bool {
    let any = |rule: &Value| {
        rule.as_array()
            .expect("alternatives")
            .iter()
            .filter(|rule| accepts(root, rule, value))
            .count()
    };
    match keyword {
        "$ref" => {
            let pointer = rule
                .as_str()
                .and_then(|rule| rule.strip_prefix('#'))
                .expect("a reference within the schema");
            accepts(
                root,
                root.pointer(pointer).expect("the definition exists"),
                value,
            )
        }
        "type" => match rule {
            Value::Array(kinds) => kinds.iter().any(|kind| is_kind(kind, value)),
            kind => is_kind(kind, value),
        },
        "const" => value == rule,
        "enum" => rule.as_array().expect("values").contains(value),
        "anyOf" => any(rule) > 0,
        "oneOf" => any(rule) == 1,
        "minimum" => value
            .as_f64()
            .is_none_or(|number| number >= rule.as_f64().expect("a number")),
        "maximum" => value
            .as_f64()
            .is_none_or(|number| number <= rule.as_f64().expect("a number")),
        "minItems" => value
            .as_array()
            .is_none_or(|items| items.len() as u64 >= rule.as_u64().expect("a count")),
        "maxItems" => value
            .as_array()
            .is_none_or(|items| items.len() as u64 <= rule.as_u64().expect("a count")),
        "items" => value
            .as_array()
            .is_none_or(|items| items.iter().all(|item| accepts(root, rule, item))),
        "required" => value.as_object().is_none_or(|members| {
            rule.as_array()
                .expect("keys")
                .iter()
                .all(|key| members.contains_key(key.as_str().expect("a key")))
        }),
        "properties" => value.as_object().is_none_or(|members| {
            members
                .iter()
                .all(|(key, member)| rule.get(key).is_none_or(|rule| accepts(root, rule, member)))
        }),
        "additionalProperties" => value.as_object().is_none_or(|members| {
            let known = keywords.get("properties");
            let mut others = members
                .iter()
                .filter(|(key, _)| known.is_none_or(|known| known.get(key).is_none()));
            others.all(|(_, member)| accepts(root, rule, member))
        }),
        "$schema" | "$defs" | "title" | "description" | "default" | "format" => true,
        other => panic!("the schema uses `{other}`"),
    }
}

fn is_kind(kind: &Value, value: &Value) -> bool {
    match kind.as_str().expect("a type") {
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|number| number.fract() == 0.0),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        "null" => value.is_null(),
        other => panic!("the schema knows a type `{other}`"),
    }
}

pub(super) fn to_json(node: &ValueNode) -> Value {
    match &node.value {
        Tree::Null | Tree::Date => Value::Null,
        Tree::Boolean(value) => json!(value),
        Tree::Integer(value) => json!(value),
        Tree::Unsigned(value) => json!(value),
        Tree::Float(value) => json!(value),
        Tree::Text(text) => json!(text),
        Tree::Array(items) => items.iter().map(to_json).collect(),
        Tree::Table(entries) => Value::Object(
            entries
                .iter()
                .map(|entry| (entry.key.clone(), to_json(&entry.node)))
                .collect(),
        ),
    }
}

fn schema_accepts(text: &str) -> bool {
    let schema: Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
    accepts(
        &schema,
        &schema,
        &to_json(&parse_tree(text, SceneNotation::Toml).expect("valid TOML")),
    )
}

/// Protects: the shipped scenes conform to the schema.
#[test]
fn the_shipped_scenes_fit_the_schema() {
    for preset in presets::list() {
        assert!(schema_accepts(preset.text), "{}", preset.name);
    }
    assert!(schema_accepts(EVERYTHING));
}

/// Protects: any number except the format may be an expression.
#[test]
fn any_number_may_be_an_expression_but_the_format() {
    assert!(schema_accepts(
        "format = 1\nt = \"pi\"\n[render]\nsize = [\"2 * 3\", 5]\nsamples = \"4\"\nseed = 0\nveil = \"0.1\""
    ));
    assert!(schema_accepts(
        "format = 1\n[classic]\nshadow_max_distance = \"2 * 3\"\n[parameters]\na = \"2 * 3\""
    ));
    assert!(!schema_accepts("format = \"1\""));
}

/// Protects: the schema refuses what the loader refuses for its form.
#[test]
fn what_the_loader_refuses_for_its_form_the_schema_refuses() {
    let wrong = [
        "title = \"x\"",
        "format = 2",
        "format = 1\n[camera]",
        "format = 1\n[render]\nsampels = 4",
        "format = 1\n[render]\nsamples = true",
        "format = 1\n[render]\nsamples = 4.5",
        "format = 1\n[render]\nsamples = -4",
        "format = 1\n[render]\nsize = [1]",
        "format = 1\n[render]\ntone_map = \"filmic\"",
        "format = 1\n[materials]\nname = \"m\"",
        "format = 1\n[[objects]]\nshape.sphere = { centre = [0, 0, 0], radius = 1 }",
        "format = 1\n[[objects]]\nmaterial = \"m\"\nshape = \"sphere\"",
        "format = 1\n[[objects]]\nmaterial = \"m\"\nshape = { mesh = \"a\", sphere = { centre = [0, 0, 0], radius = 1 } }",
        "format = 1\n[[materials]]\nname = \"m\"\nmodel.physical.alpha = { blend = 0.5 }",
        "format = 1\n[[materials]]\nname = \"m\"\nmodel.classic.colour = { image = \"wood\" }",
        "format = 1\n[sky]\nconstant = [1, 1]",
        "format = 1\n[[lights]]\nkind.directional.to_light = [0, 1, 0]\ncolor = 1",
    ];
    for text in wrong {
        assert!(super::toml(text).is_err(), "the loader accepts:\n{text}");
        assert!(!schema_accepts(text), "the schema accepts:\n{text}");
    }
}
