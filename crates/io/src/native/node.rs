//! Syntax tree shared by TOML and JSON, in which every value and key has its position.

use std::ops::Range;

use raywright_core::fault::Fault;

use crate::diagnostic::Diagnostic;

/// A value and its byte range in the text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ValueNode {
    /// Byte range in the text; for a table under a `[header]`, the range of the header.
    pub span: Range<usize>,
    pub value: TextValue,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum TextValue {
    /// JSON's `null`: the key is treated as absent.
    Null,
    Boolean(bool),
    Integer(i64),
    /// A whole number above [`i64::MAX`].
    Unsigned(u64),
    Float(f64),
    Text(String),
    /// A TOML date or time, which a scene never uses.
    Date,
    Array(Vec<ValueNode>),
    /// A table, in the order of the text and with unique keys.
    Table(Vec<TableEntry>),
}

/// A key with its value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TableEntry {
    pub key: String,
    pub key_span: Range<usize>,
    pub node: ValueNode,
}

impl ValueNode {
    /// Returns the value of a key; `None` if this is no table or lacks the key.
    pub fn get(&self, key: &str) -> Option<&ValueNode> {
        self.entry(key).map(|entry| &entry.node)
    }

    /// Returns the entry of a key; `None` if this is no table or lacks the key.
    pub fn entry(&self, key: &str) -> Option<&TableEntry> {
        match &self.value {
            TextValue::Table(entries) => entries.iter().find(|entry| entry.key == key),
            _ => None,
        }
    }

    /// Returns the value of a key for modification; `None` if this is no table or lacks the key.
    pub fn get_mut(&mut self, key: &str) -> Option<&mut ValueNode> {
        match &mut self.value {
            TextValue::Table(entries) => entries
                .iter_mut()
                .find(|entry| entry.key == key)
                .map(|entry| &mut entry.node),
            _ => None,
        }
    }

    /// Returns the type of the value in words for messages, such as "a number" or "an array".
    pub fn describe_type(&self) -> &'static str {
        match self.value {
            TextValue::Null => "null",
            TextValue::Boolean(_) => "true or false",
            TextValue::Integer(_) | TextValue::Unsigned(_) | TextValue::Float(_) => "a number",
            TextValue::Text(_) => "text",
            TextValue::Date => "a date",
            TextValue::Array(_) => "an array",
            TextValue::Table(_) => "a table",
        }
    }

    /// Returns the byte range in `source` of a part of this text value. If escapes or line breaks
    /// make the value differ from its spelling in the source, returns the range of the whole value.
    pub fn span_of_text_part(&self, source: &str, part: &Range<usize>) -> Range<usize> {
        let TextValue::Text(text) = &self.value else {
            return self.span.clone();
        };
        let raw = source.get(self.span.clone()).unwrap_or_default();
        match raw.find(text.as_str()) {
            Some(offset)
                if !text.is_empty() && raw.len() - text.len() <= 6 && part.end <= text.len() =>
            {
                let start = self.span.start + offset;
                start + part.start..start + part.end
            }
            _ => self.span.clone(),
        }
    }
}

// Conversion of a problem's path (`objects[3].shape.sphere.radius`) to its position in the text.

/// Range of entries, in a list of the scene, that come from a model file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ModelEntries {
    /// Key of the list in the scene, such as `objects`.
    pub list: &'static str,
    pub range: Range<usize>,
    /// Index of the model in the text's list `models`.
    pub model: usize,
}

/// Creates a diagnostic at the position of a problem.
pub(crate) fn diagnostic_from_problem(root: &ValueNode, text: &str, problem: Fault) -> Diagnostic {
    let (node, whole) = find_value(root, &problem.path);
    let span = match problem.span {
        Some(part) if whole => node.span_of_text_part(text, &part),
        _ => node.span.clone(),
    };
    // Problems of the root have no position; they belong to the file.
    let span = (!std::ptr::eq(node, root)).then_some(span);
    Diagnostic {
        message: problem.message,
        span,
        label: String::new(),
        hint: Some(problem.remedy).filter(|remedy| !remedy.is_empty()),
    }
}

/// Returns the deepest value on a path that exists in the text, and whether the whole path exists.
/// A problem in a value that the text omits is therefore reported at the enclosing value.
fn find_value<'a>(root: &'a ValueNode, path: &str) -> (&'a ValueNode, bool) {
    let mut node = root;
    for step in path.split(['.', '[']).filter(|step| !step.is_empty()) {
        let next = match (&node.value, step.strip_suffix(']')) {
            (TextValue::Array(items), Some(index)) => {
                index.parse().ok().and_then(|index: usize| items.get(index))
            }
            (TextValue::Table(_), None) => node.get(step),
            _ => None,
        };
        match next {
            Some(next) => node = next,
            None => return (node, false),
        }
    }
    (node, true)
}

/// Returns the byte range of the deepest value on a path that exists in the text; `None` if only
/// the root exists.
pub(crate) fn value_span(root: &ValueNode, path: &str) -> Option<Range<usize>> {
    let (node, _) = find_value(root, path);
    (!std::ptr::eq(node, root)).then(|| node.span.clone())
}
