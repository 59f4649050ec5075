//! Parser from strict JSON to a syntax tree with positions.

use jsonc_parser::ast;
use jsonc_parser::common::Ranged;
use jsonc_parser::errors::ParseErrorKind;
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};

use super::node::{Entry, Value, ValueNode};
use crate::diagnostic::Diagnostic;

/// JSON by RFC 8259, without the parser's extensions.
const STRICT: ParseOptions = ParseOptions {
    allow_comments: false,
    allow_loose_object_property_names: false,
    allow_trailing_commas: false,
    allow_missing_commas: false,
    allow_single_quoted_strings: false,
    allow_hexadecimal_numbers: false,
    allow_unary_plus_numbers: false,
    allow_bare_decimal_point_numbers: false,
    allow_non_finite_numbers: false,
    allow_extended_string_escapes: false,
};

/// Parses a whole file; the parser stops at its first error.
pub(crate) fn parse(text: &str) -> Result<ValueNode, Vec<Diagnostic>> {
    let parsed = parse_to_ast(text, &CollectOptions::default(), &STRICT).map_err(|error| {
        let range = error.range();
        vec![syntax(error.kind(), range.start..range.end)]
    })?;
    let Some(value) = parsed.value else {
        return Err(vec![plain("the file is empty".to_owned(), 0..0)]);
    };
    let mut wrong = Vec::new();
    let root = convert(&value, &mut wrong);
    if wrong.is_empty() {
        Ok(root)
    } else {
        Err(wrong)
    }
}

fn syntax(kind: &ParseErrorKind, span: std::ops::Range<usize>) -> Diagnostic {
    if matches!(kind, ParseErrorKind::NestingDepthExceeded) {
        let hint = Some("a scene needs about ten levels".to_owned());
        let span = Some(span.start..span.start + 1);
        return Diagnostic {
            message: "nested too deeply".to_owned(),
            span,
            label: "the 512th level".to_owned(),
            hint,
        };
    }
    let message = kind.to_string();
    let mut letters = message.chars();
    let first = letters.next().map(|c| c.to_ascii_lowercase());
    plain(
        format!(
            "not valid JSON: {}{}",
            first.map(String::from).unwrap_or_default(),
            letters.as_str()
        ),
        span,
    )
}

fn plain(message: String, span: std::ops::Range<usize>) -> Diagnostic {
    Diagnostic {
        message,
        span: Some(span),
        label: String::new(),
        hint: None,
    }
}

fn convert(value: &ast::Value<'_>, wrong: &mut Vec<Diagnostic>) -> ValueNode {
    let range = value.range();
    let span = range.start..range.end;
    let value = match value {
        ast::Value::NullKeyword(_) => Value::Null,
        ast::Value::BooleanLit(literal) => Value::Boolean(literal.value),
        ast::Value::StringLit(literal) => Value::Text(literal.value.to_string()),
        ast::Value::NumberLit(literal) => number(literal.value).unwrap_or_else(|| {
            wrong.push(plain("this is not a number".to_owned(), span.clone()));
            Value::Integer(0)
        }),
        ast::Value::Array(array) => Value::Array(
            array
                .elements
                .iter()
                .map(|item| convert(item, wrong))
                .collect(),
        ),
        ast::Value::Object(object) => Value::Table(table(object, wrong)),
    };
    ValueNode { span, value }
}

fn number(text: &str) -> Option<Value> {
    let signed = text.parse().ok().map(Value::Integer);
    signed
        .or_else(|| text.parse().ok().map(Value::Unsigned))
        .or_else(|| text.parse().ok().map(Value::Float))
}

fn table(object: &ast::Object<'_>, wrong: &mut Vec<Diagnostic>) -> Vec<Entry> {
    let mut seen = std::collections::HashSet::new();
    let mut entries = Vec::with_capacity(object.properties.len());
    for property in &object.properties {
        let range = property.name.range();
        let key_span = range.start..range.end;
        if !seen.insert(property.name.as_str()) {
            wrong.push(plain(
                format!("duplicate key `{}`", property.name.as_str()),
                key_span.clone(),
            ));
        }
        entries.push(Entry {
            key: property.name.as_str().to_owned(),
            key_span,
            node: convert(&property.value, wrong),
        });
    }
    entries
}
