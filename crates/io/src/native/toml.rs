//! Parser from TOML 1.1 to a syntax tree with positions.

use toml::de::{DeTable, DeValue};

use super::node::{TableEntry, TextValue, ValueNode};
use crate::diagnostic::Diagnostic;

/// Largest number of reported syntax errors. Later errors are mostly consequences of the first.
const MAX_KEPT: usize = 5;

/// Parses a whole file to a syntax tree. On failure, returns the first errors of the parser in the
/// order of the text.
pub(crate) fn parse(text: &str) -> Result<ValueNode, Vec<Diagnostic>> {
    let (table, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        return Err(convert_errors(text, &errors));
    }
    let mut wrong = Vec::new();
    let root = ValueNode {
        span: 0..0,
        value: convert_table(table.get_ref(), &mut wrong),
    };
    if wrong.is_empty() {
        Ok(root)
    } else {
        Err(wrong)
    }
}

fn convert_table(table: &DeTable<'_>, wrong: &mut Vec<Diagnostic>) -> TextValue {
    let mut entries: Vec<TableEntry> = table
        .iter()
        .map(|(key, value)| TableEntry {
            key: key.get_ref().to_string(),
            key_span: key.span(),
            node: ValueNode {
                span: value.span(),
                value: convert_value(value.get_ref(), value.span(), wrong),
            },
        })
        .collect();
    // The parser sorts keys by name, but a parameter may use the parameters before it in the text.
    entries.sort_by_key(|entry| entry.key_span.start);
    TextValue::Table(entries)
}

fn convert_value(
    value: &DeValue<'_>,
    span: std::ops::Range<usize>,
    wrong: &mut Vec<Diagnostic>,
) -> TextValue {
    match value {
        DeValue::String(text) => TextValue::Text(text.to_string()),
        DeValue::Boolean(value) => TextValue::Boolean(*value),
        DeValue::Datetime(_) => TextValue::Date,
        DeValue::Table(table) => convert_table(table, wrong),
        DeValue::Array(items) => TextValue::Array(
            items
                .iter()
                .map(|item| ValueNode {
                    span: item.span(),
                    value: convert_value(item.get_ref(), item.span(), wrong),
                })
                .collect(),
        ),
        DeValue::Integer(digits) => {
            let signed =
                i64::from_str_radix(digits.as_str(), digits.radix()).map(TextValue::Integer);
            let any = signed.or_else(|_| {
                u64::from_str_radix(digits.as_str(), digits.radix()).map(TextValue::Unsigned)
            });
            any.unwrap_or_else(|_| {
                wrong.push(oversized_number_diagnostic(span));
                TextValue::Integer(0)
            })
        }
        DeValue::Float(digits) => digits.as_str().parse().map_or_else(
            |_| {
                wrong.push(oversized_number_diagnostic(span));
                TextValue::Float(0.0)
            },
            TextValue::Float,
        ),
    }
}

fn oversized_number_diagnostic(span: std::ops::Range<usize>) -> Diagnostic {
    let message = "this number is too large".to_owned();
    let hint = Some(
        "whole numbers go up to 18446744073709551615; numbers with a decimal point have no such limit"
            .to_owned(),
    );
    Diagnostic {
        message,
        span: Some(span),
        label: String::new(),
        hint,
    }
}

fn convert_errors(text: &str, errors: &[toml::de::Error]) -> Vec<Diagnostic> {
    let deep = errors
        .iter()
        .find(|error| error.message().contains("recur"));
    if let Some(error) = deep {
        return vec![Diagnostic {
            message: "arrays and tables are nested too deeply".to_owned(),
            span: error.span(),
            label: "the 80th level of nesting".to_owned(),
            hint: Some("a scene needs about ten levels of nesting".to_owned()),
        }];
    }
    let mut list: Vec<Diagnostic> = errors
        .iter()
        .map(|error| convert_error(text, error))
        .collect();
    list.sort_by_key(|problem| problem.span.as_ref().map_or(usize::MAX, |span| span.start));
    list.dedup();
    list.truncate(MAX_KEPT);
    list
}

fn convert_error(text: &str, error: &toml::de::Error) -> Diagnostic {
    let message = error.message().replace('\n', ", ");
    let hint = if text.trim_start().starts_with('{') {
        Some("this looks like JSON: name the file NAME.scene.json")
    } else if message == "duplicate key" {
        Some("a table may contain each key only once: remove or rename one of the two")
    } else if message.starts_with("string values must be quoted") {
        Some("write texts in quotes, but numbers, true and false without quotes")
    } else if message.starts_with("invalid basic string, expected") {
        Some("a text must end on the line on which it starts, with the same quotation mark")
    } else if message.starts_with("invalid mantissa") {
        Some("a number has digits before and after its point: 0.5 and 5.0, not .5 and 5.")
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
