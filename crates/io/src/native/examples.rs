//! Examples of keys, which show what a table lacks.

use std::fmt::Write as _;
use std::ops::Range;

use super::failure::{PathStep, ReadFailure};
use super::node::{TableEntry, TextValue, ValueNode};
use super::toml;

/// Adds the example of the key that the table of a failure lacks, as advice to the failure and as
/// an entry to the table, so that the next pass can go on. Returns whether the table has changed.
pub(super) fn add_example(root: &mut ValueNode, text: &str, failure: &mut ReadFailure) -> bool {
    let Some((key, mut example)) = failure
        .missing
        .and_then(|key| Some((key, find_example(key, &failure.path)?)))
    else {
        return false;
    };
    let is_json = text.trim_start().starts_with('{');
    let mut line = String::new();
    write_key(key, is_json, &mut line);
    write_value(&example, is_json, &mut line);
    failure.hint = Some(format!("for example `{line}`"));
    let Some(table) = table_at_path(root, &failure.path) else {
        return false;
    };
    let span = failure.span.clone().unwrap_or_default();
    move_to_span(&mut example, &span);
    table.push(TableEntry {
        key: key.to_owned(),
        key_span: span,
        node: example,
    });
    true
}

/// Returns the example of a key in the table at a path.
fn find_example(key: &str, path: &[PathStep]) -> Option<ValueNode> {
    let examples = toml::parse(include_str!("examples.toml")).ok()?;
    let narrow = path.iter().find_map(|step| match step {
        PathStep::Key(parent) => examples.get(parent)?.get(key),
        PathStep::Index(_) => None,
    });
    narrow.or_else(|| examples.get(key)).cloned()
}

/// Returns the entries of the table at a path from the value up to the root.
fn table_at_path<'a>(
    root: &'a mut ValueNode,
    path: &[PathStep],
) -> Option<&'a mut Vec<TableEntry>> {
    let node = path
        .iter()
        .rev()
        .try_fold(root, |node, step| match (step, &mut node.value) {
            (PathStep::Key(key), TextValue::Table(entries)) => entries
                .iter_mut()
                .find(|entry| entry.key == *key)
                .map(|entry| &mut entry.node),
            (PathStep::Index(index), TextValue::Array(items)) => items.get_mut(*index),
            _ => None,
        })?;
    match &mut node.value {
        TextValue::Table(entries) => Some(entries),
        _ => None,
    }
}

/// Sets the place of a value and of all values in it.
fn move_to_span(node: &mut ValueNode, span: &Range<usize>) {
    node.span = span.clone();
    match &mut node.value {
        TextValue::Array(items) => items.iter_mut().for_each(|item| move_to_span(item, span)),
        TextValue::Table(entries) => {
            for entry in entries {
                entry.key_span = span.clone();
                move_to_span(&mut entry.node, span);
            }
        }
        _ => {}
    }
}

fn write_key(key: &str, is_json: bool, out: &mut String) {
    match is_json {
        true => _ = write!(out, "\"{key}\": "),
        false => _ = write!(out, "{key} = "),
    }
}

/// Writes a value of the examples in one line.
fn write_value(node: &ValueNode, is_json: bool, out: &mut String) {
    match &node.value {
        TextValue::Text(text) => _ = write!(out, "\"{text}\""),
        TextValue::Integer(value) => _ = write!(out, "{value}"),
        TextValue::Float(value) => _ = write!(out, "{value}"),
        TextValue::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                *out += if i == 0 { "[" } else { ", " };
                write_value(item, is_json, out);
            }
            *out += "]";
        }
        TextValue::Table(entries) => {
            for (i, entry) in entries.iter().enumerate() {
                *out += if i == 0 { "{ " } else { ", " };
                write_key(&entry.key, is_json, out);
                write_value(&entry.node, is_json, out);
            }
            *out += " }";
        }
        TextValue::Null | TextValue::Boolean(_) | TextValue::Unsigned(_) | TextValue::Date => {}
    }
}
