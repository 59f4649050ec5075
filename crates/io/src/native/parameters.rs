//! Evaluation of the time `t` and of the parameters of a native scene, in the order of the text.
//! Both are evaluated before all other numbers, because every other number may use them.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap, HashSet};

use raywright_core::expr;
use raywright_core::suggest::most_similar_word;

use super::de::{ReadContext, ValueReader};
use super::failure::ReadFailure;
use super::node::{TableEntry, TextValue, ValueNode};
use crate::diagnostic::Diagnostic;
use crate::error::Error;

/// Values from the command line that replace a native scene's time `t` and its named parameters,
/// the variables of the scene's expressions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterOverrides {
    /// Time in seconds in place of the file's time; `None` keeps the file's time.
    pub time: Option<f64>,
    /// Names of parameters with their new values.
    pub set: Vec<(String, f64)>,
}

/// Evaluates `t` and `[parameters]`, writes the values into the tree and returns them as the
/// variables of all expressions.
///
/// A parameter may use `t` and earlier parameters. A value from `overrides` replaces the text,
/// which is then not evaluated.
pub(crate) fn evaluate_parameters(
    root: &mut ValueNode,
    text: &str,
    overrides: &ParameterOverrides,
    problems: &mut Vec<Diagnostic>,
) -> Result<BTreeMap<String, f64>, Error> {
    check_overrides(root, overrides)?;
    let mut names = BTreeMap::new();
    let mut t = overrides.time.unwrap_or(0.0);
    if let Some(node) = root.get_mut("t") {
        if overrides.time.is_none() {
            t = evaluate_number(node, "t", text, &names, problems);
        }
        node.value = TextValue::Float(t);
    } else if let (Some(at), TextValue::Table(entries)) = (overrides.time, &mut root.value) {
        let node = ValueNode {
            span: 0..0,
            value: TextValue::Float(at),
        };
        entries.push(TableEntry {
            key: "t".to_owned(),
            key_span: 0..0,
            node,
        });
    }
    names.insert("t".to_owned(), t);
    // Of two values for the same name, the later applies.
    let set: HashMap<&str, f64> = overrides
        .set
        .iter()
        .map(|(name, value)| (name.as_str(), *value))
        .collect();
    if let Some(ValueNode {
        value: TextValue::Table(parameters),
        ..
    }) = root.get_mut("parameters")
    {
        for entry in parameters {
            if let Some(problem) = check_parameter_name(entry) {
                problems.push(problem);
                continue;
            }
            let overridden = set.get(entry.key.as_str()).copied();
            if let Some(value) = overridden {
                check_range(entry, value, text, &names)?;
            }
            // A table states a range; its other keys are numbers like all others in the file.
            let node = match &mut entry.node.value {
                TextValue::Table(table) => match table.iter_mut().find(|e| e.key == "value") {
                    Some(value) => &mut value.node,
                    None => continue,
                },
                _ => &mut entry.node,
            };
            let value = match overridden {
                Some(value) => value,
                None => evaluate_number(node, &entry.key, text, &names, problems),
            };
            node.value = TextValue::Float(value);
            names.insert(entry.key.clone(), value);
        }
    }
    Ok(names)
}

fn check_overrides(root: &ValueNode, overrides: &ParameterOverrides) -> Result<(), Error> {
    let known: Vec<&str> = match root.get("parameters").map(|node| &node.value) {
        Some(TextValue::Table(entries)) => entries.iter().map(|entry| entry.key.as_str()).collect(),
        _ => Vec::new(),
    };
    let names: HashSet<&str> = known.iter().copied().collect();
    if let Some((name, _)) = overrides
        .set
        .iter()
        .find(|(name, _)| !names.contains(name.as_str()))
    {
        let hint = match most_similar_word(name, known.iter().copied()) {
            Some(word) => format!("did you mean `{word}`?"),
            None if name == "t" => "the time `t` is set with --at".to_owned(),
            None if known.is_empty() => "this scene has no parameters".to_owned(),
            None => format!("the parameters of the scene: {}", known.join(", ")),
        };
        return Err(
            Error::invalid_usage(format!("the scene has no parameter `{name}`")).with_hint(hint),
        );
    }
    Ok(())
}

/// Refuses a value of `--set` outside of the parameter's range.
fn check_range(
    entry: &TableEntry,
    value: f64,
    text: &str,
    names: &BTreeMap<String, f64>,
) -> Result<(), Error> {
    let end = |key: &str| {
        let node = entry.node.get(key)?;
        // A problem of the range itself is found when the table is read.
        Some(evaluate_number(node, key, text, names, &mut Vec::new()))
    };
    match (end("min"), end("max")) {
        (Some(min), Some(max)) if value < min || value > max => Err(Error::invalid_usage(format!(
            "the parameter `{}` must be from {min} to {max}, not {value}",
            entry.key
        ))),
        _ => Ok(()),
    }
}

/// Evaluates a number or an expression. A problem is added to the list of problems, and 1 is
/// returned.
fn evaluate_number(
    node: &ValueNode,
    name: &str,
    text: &str,
    names: &BTreeMap<String, f64>,
    problems: &mut Vec<Diagnostic>,
) -> f64 {
    let context = ReadContext {
        text,
        variables: names,
        failures: RefCell::default(),
    };
    let reader = ValueReader {
        name,
        ..ValueReader::from_root(node, &context)
    };
    let value = reader.evaluate_number();
    let failures = context.failures.into_inner();
    problems.extend(failures.into_iter().map(ReadFailure::into_diagnostic));
    value
}

fn check_parameter_name(entry: &TableEntry) -> Option<Diagnostic> {
    let reason = expr::find_parameter_name_problem(&entry.key)?;
    let message = format!("`{}` cannot be the name of a parameter", entry.key);
    Some(Diagnostic {
        message,
        span: Some(entry.key_span.clone()),
        label: String::new(),
        hint: Some(reason),
    })
}
