//! Parser from strict JSON to a syntax tree with positions.

use jsonc_parser::common::Ranged;
use jsonc_parser::errors::ParseErrorKind;
use jsonc_parser::{CollectOptions, ParseOptions, ast, parse_to_ast};

use super::node::{TableEntry, TextValue, ValueNode};
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
        vec![syntax_diagnostic(error.kind(), range.start..range.end)]
    })?;
    let Some(value) = parsed.value else {
        return Err(vec![diagnostic_at("the file is empty".to_owned(), 0..0)]);
    };
    let mut wrong = Vec::new();
    let root = convert_value(&value, &mut wrong);
    if wrong.is_empty() {
        Ok(root)
    } else {
        Err(wrong)
    }
}

fn syntax_diagnostic(kind: &ParseErrorKind, span: std::ops::Range<usize>) -> Diagnostic {
    if matches!(kind, ParseErrorKind::NestingDepthExceeded) {
        let hint = Some("a scene needs about ten levels of nesting".to_owned());
        let span = Some(span.start..span.start + 1);
        return Diagnostic {
            message: "arrays and objects are nested too deeply".to_owned(),
            span,
            label: "the 512th level of nesting".to_owned(),
            hint,
        };
    }
    let message = kind.to_string();
    let mut letters = message.chars();
    let first = letters.next().map(|c| c.to_ascii_lowercase());
    diagnostic_at(
        format!(
            "not valid JSON: {}{}",
            first.map(String::from).unwrap_or_default(),
            letters.as_str()
        ),
        span,
    )
}

fn diagnostic_at(message: String, span: std::ops::Range<usize>) -> Diagnostic {
    Diagnostic {
        message,
        span: Some(span),
        label: String::new(),
        hint: None,
    }
}

fn convert_value(value: &ast::Value<'_>, wrong: &mut Vec<Diagnostic>) -> ValueNode {
    let range = value.range();
    let span = range.start..range.end;
    let value = match value {
        ast::Value::NullKeyword(_) => TextValue::Null,
        ast::Value::BooleanLit(literal) => TextValue::Boolean(literal.value),
        ast::Value::StringLit(literal) => TextValue::Text(literal.value.to_string()),
        ast::Value::NumberLit(literal) => parse_number(literal.value).unwrap_or_else(|| {
            wrong.push(diagnostic_at(
                "this is not a valid number".to_owned(),
                span.clone(),
            ));
            TextValue::Integer(0)
        }),
        ast::Value::Array(array) => TextValue::Array(
            array
                .elements
                .iter()
                .map(|item| convert_value(item, wrong))
                .collect(),
        ),
        ast::Value::Object(object) => TextValue::Table(convert_table(object, wrong)),
    };
    ValueNode { span, value }
}

fn parse_number(text: &str) -> Option<TextValue> {
    let signed = text.parse().ok().map(TextValue::Integer);
    signed
        .or_else(|| text.parse().ok().map(TextValue::Unsigned))
        .or_else(|| text.parse().ok().map(TextValue::Float))
}

fn convert_table(object: &ast::Object<'_>, wrong: &mut Vec<Diagnostic>) -> Vec<TableEntry> {
    let mut seen = std::collections::HashSet::new();
    let mut entries = Vec::with_capacity(object.properties.len());
    for property in &object.properties {
        let range = property.name.range();
        let key_span = range.start..range.end;
        if !seen.insert(property.name.as_str()) {
            wrong.push(diagnostic_at(
                format!("duplicate key `{}`", property.name.as_str()),
                key_span.clone(),
            ));
        }
        entries.push(TableEntry {
            key: property.name.as_str().to_owned(),
            key_span,
            node: convert_value(&property.value, wrong),
        });
    }
    entries
}
