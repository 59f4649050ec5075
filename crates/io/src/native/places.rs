//! From the path of a problem (`objects[3].shape.sphere.radius`) to its place in the text.

use std::ops::Range;

use raywright_core::validate::Problem;

use super::node::{Node, Value};
use crate::diagnostic::Diagnostic;

/// A problem at its place.
pub(crate) fn diagnostic(root: &Node, text: &str, problem: Problem) -> Diagnostic {
    let (node, whole) = find(root, &problem.path);
    let span = match problem.within {
        Some(part) if whole => node.span_within(text, &part),
        _ => node.span.clone(),
    };
    // The root has no place of its own: what is wrong with it is said of the file.
    let span = (!std::ptr::eq(node, root)).then_some(span);
    Diagnostic {
        message: problem.message,
        span,
        label: String::new(),
        hint: problem.hint,
    }
}

/// The deepest value on a path that the text has, and whether that is the end of the path: what is
/// left out of a text has its default, and what is wrong then stands where it would have been
/// written.
pub(crate) fn find<'a>(root: &'a Node, path: &str) -> (&'a Node, bool) {
    let mut node = root;
    for step in path.split(['.', '[']).filter(|step| !step.is_empty()) {
        let next = match (&node.value, step.strip_suffix(']')) {
            (Value::Array(items), Some(index)) => {
                index.parse().ok().and_then(|index: usize| items.get(index))
            }
            (Value::Table(_), None) => node.get(step),
            _ => None,
        };
        match next {
            Some(next) => node = next,
            None => return (node, false),
        }
    }
    (node, true)
}

/// The place of the deepest value on a path that the text has; none for the root.
pub(crate) fn span(root: &Node, path: &str) -> Option<Range<usize>> {
    let (node, _) = find(root, path);
    (!std::ptr::eq(node, root)).then(|| node.span.clone())
}
