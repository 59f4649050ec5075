//! Conversion of a problem's path (`objects[3].shape.sphere.radius`) to its position in the text.

use std::ops::Range;

use raywright_core::fault::Fault;

use super::node::{TextValue, ValueNode};
use crate::diagnostic::Diagnostic;

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
pub(crate) fn find_value<'a>(root: &'a ValueNode, path: &str) -> (&'a ValueNode, bool) {
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
