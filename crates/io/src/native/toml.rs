//! Parser from TOML 1.1 to a syntax tree with positions.

use toml::de::{DeTable, DeValue};

use super::node::{Entry, Value, ValueNode};
use crate::diagnostic::Diagnostic;

/// Largest number of reported syntax errors. After the first errors, the parser mostly repeats
/// itself.
const KEPT: usize = 5;

/// Parses a whole file. On failure, returns the first errors of the parser, in the order of the
/// text.
pub(crate) fn parse(text: &str) -> Result<ValueNode, Vec<Diagnostic>> {
    let (table, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        return Err(diagnostics(text, &errors));
    }
    let mut wrong = Vec::new();
    let root = ValueNode {
        span: 0..0,
        value: table_value(table.get_ref(), &mut wrong),
    };
    if wrong.is_empty() {
        Ok(root)
    } else {
        Err(wrong)
    }
}

fn table_value(table: &DeTable<'_>, wrong: &mut Vec<Diagnostic>) -> Value {
    let mut entries: Vec<Entry> = table
        .iter()
        .map(|(key, value)| Entry {
            key: key.get_ref().to_string(),
            key_span: key.span(),
            node: ValueNode {
                span: value.span(),
                value: convert(value.get_ref(), value.span(), wrong),
            },
        })
        .collect();
    // The parser sorts keys by name; parameters depend on each other in the order of the text.
    entries.sort_by_key(|entry| entry.key_span.start);
    Value::Table(entries)
}

fn convert(
    value: &DeValue<'_>,
    span: std::ops::Range<usize>,
    wrong: &mut Vec<Diagnostic>,
) -> Value {
    match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Boolean(value) => Value::Boolean(*value),
        DeValue::Datetime(_) => Value::Date,
        DeValue::Table(table) => table_value(table, wrong),
        DeValue::Array(items) => Value::Array(
            items
                .iter()
                .map(|item| ValueNode {
                    span: item.span(),
                    value: convert(item.get_ref(), item.span(), wrong),
                })
                .collect(),
        ),
        DeValue::Integer(digits) => {
            let signed = i64::from_str_radix(digits.as_str(), digits.radix()).map(Value::Integer);
            let any = signed.or_else(|_| {
                u64::from_str_radix(digits.as_str(), digits.radix()).map(Value::Unsigned)
            });
            any.unwrap_or_else(|_| {
                wrong.push(not_a_number(span));
                Value::Integer(0)
            })
        }
        DeValue::Float(digits) => digits.as_str().parse().map_or_else(
            |_| {
                wrong.push(not_a_number(span));
                Value::Float(0.0)
            },
            Value::Float,
        ),
    }
}

fn not_a_number(span: std::ops::Range<usize>) -> Diagnostic {
    let message = "this number is too large".to_owned();
    let hint = Some(
        "whole numbers go up to 18446744073709551615; with a decimal point there is no such limit"
            .to_owned(),
    );
    Diagnostic {
        message,
        span: Some(span),
        label: String::new(),
        hint,
    }
}

fn diagnostics(text: &str, errors: &[toml::de::Error]) -> Vec<Diagnostic> {
    let deep = errors
        .iter()
        .find(|error| error.message().contains("recur"));
    if let Some(error) = deep {
        return vec![Diagnostic {
            message: "nested too deeply".to_owned(),
            span: error.span(),
            label: "the 80th level".to_owned(),
            hint: Some("a scene needs about ten levels".to_owned()),
        }];
    }
    let mut list: Vec<Diagnostic> = errors.iter().map(|error| diagnostic(text, error)).collect();
    list.sort_by_key(|problem| problem.span.as_ref().map_or(usize::MAX, |span| span.start));
    list.dedup();
    list.truncate(KEPT);
    list
}

fn diagnostic(text: &str, error: &toml::de::Error) -> Diagnostic {
    let message = error.message().replace('\n', ", ");
    let hint = if text.trim_start().starts_with('{') {
        Some("this looks like JSON: name the file NAME.scene.json")
    } else if message == "duplicate key" {
        Some("each key may be given once in a table")
    } else if message.starts_with("string values must be quoted") {
        Some("text stands in quotes; numbers, true and false do not")
    } else if message.starts_with("invalid basic string, expected") {
        Some("text ends with the quote it began with, in the same line")
    } else {
        None
    };
    let (message, hint) = (
        format!("not valid TOML: {message}"),
        hint.map(str::to_owned),
    );
    Diagnostic {
        message,
        span: error.span(),
        label: String::new(),
        hint,
    }
}
