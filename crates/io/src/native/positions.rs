//! Conversion of a problem's path (`objects[3].shape.sphere.radius`) to its position in the text.

use std::ops::Range;

use raywright_core::validate::Problem;

use super::node::{TextValue, ValueNode};
use crate::diagnostic::Diagnostic;

/// Entries of a list of the scene that a model has brought.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ModelEntries {
    /// Key of the list in the scene: `objects`.
    pub list: &'static str,
    pub range: Range<usize>,
    /// Index of the model in the text.
    pub model: usize,
}

/// Creates a diagnostic at the position of a problem.
pub(crate) fn diagnostic_from_problem(
    root: &ValueNode,
    text: &str,
    problem: Problem,
) -> Diagnostic {
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
        hint: problem.hint,
    }
}

/// Returns the deepest existing value on a path, and whether the whole path exists in the text. If
/// the text omits a value, a problem in its default is reported at the value that would contain it.
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

/// Returns the byte range of the deepest existing value on a path; `None` if that is the root.
pub(crate) fn value_span(root: &ValueNode, path: &str) -> Option<Range<usize>> {
    let (node, _) = find_value(root, path);
    (!std::ptr::eq(node, root)).then(|| node.span.clone())
}
