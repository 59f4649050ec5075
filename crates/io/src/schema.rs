//! The JSON Schema of scene files, for editors and generators: what the structs say, and that numbers may be expressions.

use raywright_core::Scene;
use raywright_core::scene::FORMAT;
use serde_json::{Map, Value, json};

/// The schema (JSON Schema draft 2020-12) as indented text. It describes TOML and JSON scenes alike.
pub fn schema() -> String {
    let mut schema = schemars::schema_for!(Scene).to_value();
    allow_expressions(&mut schema);
    if let Value::Object(root) = &mut schema {
        root.insert("title".to_owned(), json!("Raywright scene"));
        // The one number that is not evaluated: it says how to read the others.
        if let Some(format) = root.get_mut("properties").and_then(|properties| properties.get_mut("format")) {
            *format = json!({ "description": "Version of the format; the first key of a scene.", "const": FORMAT });
        }
    }
    let mut text = format!("{schema:#}");
    text.push('\n');
    text
}

/// Every number may also be a text that holds an expression.
fn allow_expressions(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(allow_expressions),
        Value::Object(members) => {
            allow_expression(members);
            members.values_mut().for_each(allow_expressions);
        }
        _ => {}
    }
}

fn allow_expression(members: &mut Map<String, Value>) {
    let is_number = |kind: &Value| matches!(kind.as_str(), Some("number" | "integer"));
    // A property may be called `type`, so only what a schema can say there counts.
    match members.get_mut("type") {
        Some(Value::Array(kinds)) if kinds.iter().any(is_number) && !kinds.contains(&json!("string")) => {
            kinds.push(json!("string"))
        }
        Some(kind) if is_number(kind) => *kind = json!([kind.clone(), "string"]),
        _ => {}
    }
}
