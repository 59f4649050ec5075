//! Problems in a text, shown with file, line, column, the line itself and a caret.

use std::ops::Range;
use std::sync::Arc;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use crate::error_kind::ErrorKind;

/// Problems shown in full; a text that was never a scene can have thousands.
const SHOWN: usize = 20;

/// Bytes shown of a long line on each side of the place.
const MARGIN: usize = 60;

/// One problem of a text.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Diagnostic {
    /// What is wrong, in one sentence.
    pub message: String,
    /// Bytes of the text that are wrong; none: the text as a whole.
    pub span: Option<Range<usize>>,
    /// A few words beside the caret; may be empty.
    pub label: String,
    /// What to do about it.
    pub hint: Option<String>,
}

/// The problems of one text, in the order of their places.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostics {
    /// Name of the file as the user gave it.
    pub file: String,
    /// The whole text.
    pub text: Arc<str>,
    /// At least one.
    pub problems: Vec<Diagnostic>,
    /// What they mean for the caller.
    pub kind: ErrorKind,
}

impl Diagnostics {
    /// Sorts the problems by place; they mean that the content is wrong.
    pub fn new(file: impl Into<String>, text: impl Into<Arc<str>>, mut problems: Vec<Diagnostic>) -> Self {
        problems.sort_by_key(|problem| problem.span.as_ref().map_or(0, |span| span.start));
        Self { file: file.into(), text: text.into(), problems, kind: ErrorKind::Input }
    }

    /// All problems as text, at most twenty in full.
    pub(crate) fn render(&self, renderer: &Renderer) -> String {
        let mut blocks: Vec<String> = self.problems.iter().take(SHOWN).map(|problem| self.block(problem, renderer)).collect();
        if let Some(more) = self.problems.len().checked_sub(SHOWN).filter(|&more| more > 0) {
            let noun = if more == 1 { "problem" } else { "problems" };
            blocks.push(format!("{}: {more} more {noun} not shown", self.file));
        }
        blocks.join("\n\n")
    }

    fn block(&self, problem: &Diagnostic, renderer: &Renderer) -> String {
        let Some(span) = &problem.span else {
            return plain(&format!("{}: {}", self.file, problem.message), problem.hint.as_deref(), renderer);
        };
        let hint = problem.hint.as_ref().map(|hint| Level::HELP.message(hint));
        let title = Level::ERROR.primary_title(&problem.message);
        renderer.render(&[Group::with_title(title).element(self.snippet(span, &problem.label)).elements(hint)])
    }

    /// Only the line of the place goes to the renderer, so that a long file costs no more than a short one.
    fn snippet<'a>(&'a self, span: &Range<usize>, label: &'a str) -> Snippet<'a, annotate_snippets::Annotation<'a>> {
        let place = Place::of(&self.text, span);
        let annotation = AnnotationKind::Primary.span(place.within.clone()).label((!label.is_empty()).then_some(label));
        let path = if place.cut { format!("{}:{}:{}", self.file, place.line, place.column) } else { self.file.clone() };
        Snippet::source(&self.text[place.shown]).line_start(place.line).path(path).annotation(annotation)
    }
}

/// A message without a place, and its advice.
pub(crate) fn plain(message: &str, hint: Option<&str>, renderer: &Renderer) -> String {
    let error = renderer.render(&[Group::with_title(Level::ERROR.primary_title(message))]);
    let help = hint.map(|hint| renderer.render(&[Group::with_title(Level::HELP.secondary_title(hint))]));
    // Two reports, because one would put an empty gutter between them.
    help.map_or_else(|| error.clone(), |help| format!("{error}\n{help}"))
}

/// Where a span lies in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Bytes of the text that are shown: the line, or a piece of a long one.
    shown: Range<usize>,
    /// The span within what is shown.
    within: Range<usize>,
    /// Whether the shown piece starts after the line does.
    cut: bool,
}

impl Place {
    /// The place of a span; out-of-range and mid-character offsets are moved to the nearest sensible ones.
    pub fn of(text: &str, span: &Range<usize>) -> Self {
        let mut start = text.floor_char_boundary(span.start.min(text.len()));
        // The end of a text that ends with a line break belongs to its last line.
        if start == text.len() && text.ends_with('\n') {
            start = text.len() - 1;
        }
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |at| start + at);
        let first_line = text[start..line_end].trim_end().len();
        let end = text.floor_char_boundary(span.end.clamp(start, start + first_line));
        let line = text[..line_start].matches('\n').count() + 1;
        let column = text[line_start..start].chars().count() + 1;
        let cut = start - line_start > 4 * MARGIN;
        let from = if cut { text.ceil_char_boundary(start - MARGIN) } else { line_start };
        let to = line_end.min(text.floor_char_boundary(end.min(start + MARGIN) + 2 * MARGIN));
        let end = end.min(to);
        Self { line, column, shown: from..to, within: start - from..end - from, cut }
    }
}
