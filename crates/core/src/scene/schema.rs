//! JSON Schema of scene files, derived from the scene types. It also permits expressions in place
//! of numbers, as the loader does. The module is compiled only for tests, which compare the derived
//! schema with the shipped file.

use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value as Json, json};

use super::{
    Checker, Colour, FORMAT, Input, InputValue, Parameter, SCHEMA, ScalarFactor, Scene, TextureRef,
    Triple, parameter::ParameterTable,
};
use crate::expr::{ExprScope, constant_names, function_names};

/// Protects: the shipped schema matches the scene types. `TAKE_SCHEMA=1 cargo test -p
/// raywright-core --lib scene::schema` rewrites the file.
#[test]
fn the_shipped_schema_is_that_of_the_types() {
    let schema = build_schema();
    if std::env::var_os("TAKE_SCHEMA").is_some() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene/schema.json");
        std::fs::write(file, schema).expect("the file can be written");
        return;
    }
    assert!(
        schema == SCHEMA,
        "scene/schema.json is out of date: `TAKE_SCHEMA=1 cargo test -p raywright-core --lib scene::schema` renews it"
    );
}

fn build_schema() -> String {
    let mut schema = schemars::schema_for!(Scene).to_value();
    allow_expressions(&mut schema);
    join_lines(&mut schema);
    if let Json::Object(root) = &mut schema {
        root.insert("title".to_owned(), json!("Raywright scene"));
        // The only number that cannot be an expression: it selects the reader of the others.
        if let Some(format) = root
            .get_mut("properties")
            .and_then(|properties| properties.get_mut("format"))
        {
            *format = json!({ "description": "Version of the format; the first key of a scene.", "const": FORMAT });
        }
    }
    format!("{schema:#}\n")
}

/// Allows every number to be a string with an expression.
fn allow_expressions(schema: &mut Json) {
    match schema {
        Json::Array(items) => items.iter_mut().for_each(allow_expressions),
        Json::Object(members) => {
            allow_expression(members);
            members.values_mut().for_each(allow_expressions);
        }
        _ => {}
    }
}

/// Joins the source lines of each description into paragraphs; an empty line separates paragraphs.
fn join_lines(schema: &mut Json) {
    match schema {
        Json::Array(items) => items.iter_mut().for_each(join_lines),
        Json::Object(members) => {
            if let Some(Json::String(text)) = members.get_mut("description") {
                let paragraphs = text
                    .split("\n\n")
                    .map(|paragraph| paragraph.replace('\n', " "));
                *text = paragraphs.collect::<Vec<_>>().join("\n\n");
            }
            members.values_mut().for_each(join_lines);
        }
        _ => {}
    }
}

fn allow_expression(members: &mut Map<String, Json>) {
    let is_number = |kind: &Json| matches!(kind.as_str(), Some("number" | "integer"));
    // A property may be called `type`, so only the values that a schema allows count.
    match members.get_mut("type") {
        Some(Json::Array(kinds))
            if kinds.iter().any(is_number) && !kinds.contains(&json!("string")) =>
        {
            kinds.push(json!("string"))
        }
        Some(kind) if is_number(kind) => *kind = json!([kind.clone(), "string"]),
        _ => {}
    }
}

impl JsonSchema for Parameter {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Parameter".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (number, table) = (
            generator.subschema_for::<f64>(),
            generator.subschema_for::<ParameterTable>(),
        );
        json_schema!({ "description": "A number, or a number with a range.", "anyOf": [number, table] })
    }
}

impl JsonSchema for Colour {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Colour".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (one, three) = (
            generator.subschema_for::<f64>(),
            generator.subschema_for::<Triple>(),
        );
        json_schema!({ "description": "Linear red, green, blue; a single number means grey.", "anyOf": [one, three] })
    }
}

/// Describes the names that an expression may use, for authors who have the schema alone.
fn describe_expressions(scope: ExprScope) -> String {
    let list = |names: &mut dyn Iterator<Item = &'static str>| names.collect::<Vec<_>>().join(", ");
    let place = match scope {
        ExprScope::Light => {
            ", of which l, shadow and occluder_distance exist only in the weight of a light"
        }
        _ => "; in the sky only d and o",
    };
    format!(
        "Vectors are [x, y, z]. Variables: {}{place}. Constants: t, the parameters, {}. Functions: {}. Their meanings: \
         docs/scene-format.md, in the source of the program.",
        list(&mut scope.variables().iter().map(|variable| variable.name())),
        list(&mut constant_names()),
        list(&mut function_names()),
    )
}

impl JsonSchema for ScalarFactor {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Weight".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let description = format!(
            "A number, or the text of an expression that is a number at each hit. {}",
            describe_expressions(ExprScope::Light)
        );
        json_schema!({ "description": description, "type": ["number", "string"] })
    }
}

/// Value type of an input, with the input's name in the schema.
trait NamedInputValue: InputValue + JsonSchema {
    const NAME: &'static str;
}

impl NamedInputValue for f64 {
    const NAME: &'static str = "NumberInput";
}

impl NamedInputValue for Colour {
    const NAME: &'static str = "ColourInput";
}

impl<T: NamedInputValue> JsonSchema for Input<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        T::NAME.into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let constant = generator.subschema_for::<T>();
        let texture = generator.subschema_for::<TextureRef>();
        let checker = generator.subschema_for::<Checker>();
        json_schema!({
            "description": "A constant, the text of an expression evaluated at each hit, a texture or a checkerboard.",
            "anyOf": [
                constant,
                { "description": describe_expressions(ExprScope::Surface), "type": "string" },
                { "type": "object", "properties": { "texture": texture }, "required": ["texture"], "additionalProperties": false },
                { "type": "object", "properties": { "checker": checker }, "required": ["checker"], "additionalProperties": false }
            ]
        })
    }
}
