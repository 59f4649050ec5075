//! Problems in a text, rendered with file, line, column, the source line and a caret.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use crate::error_kind::ErrorKind;

/// Largest number of problems rendered in full; a text in another format can have thousands.
const MAX_SHOWN: usize = 20;

/// Largest number of bytes of a long line that are shown before a problem. Up to three times this
/// number of bytes are shown from the start of the problem on.
const MARGIN: usize = 60;

/// A problem in the text of a native scene file: message, position and advice.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Diagnostic {
    /// Description in one sentence.
    pub message: String,
    /// Byte range of the problem; `None` if the problem concerns the whole text.
    pub span: Option<Range<usize>>,
    /// Short label beside the caret; may be empty.
    pub label: String,
    /// Advice.
    pub hint: Option<String>,
}

/// All problems in the text of a native scene file, ordered by position. They form the error
/// message of a scene that cannot be parsed or is invalid.
#[derive(Clone, PartialEq, Eq)]
pub struct Diagnostics {
    /// Name of the file, as given by the user.
    pub file: String,
    /// The whole text.
    pub text: Arc<str>,
    /// The problems, at least one.
    pub problems: Vec<Diagnostic>,
    /// Kind of the failure, which callers map to an exit code.
    pub kind: ErrorKind,
}

/// Leaves out the text, which may be a large file.
impl fmt::Debug for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Diagnostics")
            .field("file", &self.file)
            .field("problems", &self.problems)
            .finish_non_exhaustive()
    }
}

impl Diagnostics {
    /// Creates the list of problems, sorted by position, with the kind [`ErrorKind::Input`].
    pub fn new(
        file: impl Into<String>,
        text: impl Into<Arc<str>>,
        mut problems: Vec<Diagnostic>,
    ) -> Self {
        problems.sort_by_key(|problem| problem.span.as_ref().map_or(0, |span| span.start));
        Self {
            file: file.into(),
            text: text.into(),
            problems,
            kind: ErrorKind::Input,
        }
    }

    /// Renders all problems as text, at most twenty in full.
    pub(crate) fn render(&self, renderer: &Renderer) -> String {
        let mut blocks: Vec<String> = self
            .problems
            .iter()
            .take(MAX_SHOWN)
            .map(|problem| self.render_problem(problem, renderer))
            .collect();
        if let Some(more) = self
            .problems
            .len()
            .checked_sub(MAX_SHOWN)
            .filter(|&more| more > 0)
        {
            let noun = if more == 1 { "problem" } else { "problems" };
            blocks.push(format!(
                "{}: {more} more {noun} not shown; mend the problems above first",
                self.file
            ));
        }
        blocks.join("\n\n")
    }

    fn render_problem(&self, problem: &Diagnostic, renderer: &Renderer) -> String {
        let Some(span) = &problem.span else {
            return render_message(
                &format!("{}: {}", self.file, problem.message),
                problem.hint.as_deref(),
                renderer,
            );
        };
        let hint = problem.hint.as_ref().map(|hint| Level::HELP.message(hint));
        let title = Level::ERROR.primary_title(&problem.message);
        // The renderer gets only the line of the problem, or a piece of that line: a long file
        // costs no more than a short one.
        let place = TextPosition::from_span(&self.text, span);
        let label = Some(problem.label.as_str()).filter(|label| !label.is_empty());
        let annotation = AnnotationKind::Primary
            .span(place.span_in_shown.clone())
            .label(label);
        let snippet = Snippet::source(&self.text[place.shown_range.clone()])
            .line_start(place.line)
            .path(&self.file)
            .annotation(annotation);
        let shown = renderer.render(&[Group::with_title(title).element(snippet).elements(hint)]);
        // The renderer counts columns from the beginning of the piece.
        let [within, of_text] = [place.column_in_shown, place.column]
            .map(|column| format!("{}:{}:{column}", self.file, place.line));
        if within == of_text {
            shown
        } else {
            shown.replacen(&within, &of_text, 1)
        }
    }
}

/// Renders a message without a position, and the advice, if any.
pub(crate) fn render_message(message: &str, hint: Option<&str>, renderer: &Renderer) -> String {
    let error = renderer.render(&[Group::with_title(Level::ERROR.primary_title(message))]);
    let help =
        hint.map(|hint| renderer.render(&[Group::with_title(Level::HELP.secondary_title(hint))]));
    // Two reports, because a single report would put an empty gutter between them.
    help.map_or_else(|| error.clone(), |help| format!("{error}\n{help}"))
}

/// Position of a problem in a scene's text: line and column, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextPosition {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Byte range of the text that is shown: the whole line, or only the surroundings of the
    /// problem in a long line.
    shown_range: Range<usize>,
    /// Byte range of the problem, relative to the start of the shown range.
    span_in_shown: Range<usize>,
    /// Column of the problem within the shown range, in characters from 1.
    column_in_shown: usize,
}

impl TextPosition {
    /// Computes the position of a byte span. An offset beyond the text is moved to the end of the
    /// text, and an offset inside a character to the start of that character.
    pub fn from_span(text: &str, span: &Range<usize>) -> Self {
        let mut start = text.floor_char_boundary(span.start.min(text.len()));
        // The end of a text with a final line break belongs to its last line.
        if start == text.len() && text.ends_with('\n') {
            start = text.len() - 1;
        }
        let line_start = text[..start].rfind('\n').map_or(0, |position| position + 1);
        let line_end = text[start..]
            .find('\n')
            .map_or(text.len(), |position| start + position);
        let first_line = text[start..line_end].trim_end().len();
        let end = text.floor_char_boundary(span.end.clamp(start, start + first_line));
        let line = text[..line_start].matches('\n').count() + 1;
        let column = text[line_start..start].chars().count() + 1;
        let cut = start - line_start > 4 * MARGIN;
        let from = if cut {
            text.ceil_char_boundary(start - MARGIN)
        } else {
            line_start
        };
        let to = line_end.min(text.floor_char_boundary(end.min(start + MARGIN) + 2 * MARGIN));
        let end = end.min(to);
        let column_within = text[from..start].chars().count() + 1;
        Self {
            line,
            column,
            shown_range: from..to,
            span_in_shown: start - from..end - from,
            column_in_shown: column_within,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the debug form of an error, which `unwrap` prints, names the file and the problem
    /// without the text of the file.
    #[test]
    fn debug_form_leaves_out_the_text() {
        let problem = Diagnostic {
            message: "wrong".into(),
            span: None,
            label: String::new(),
            hint: None,
        };
        let error = Diagnostics::new("a.json", "the whole scene", vec![problem]);
        let shown = format!("{error:?}");
        assert!(
            shown.contains("a.json") && shown.contains("wrong"),
            "{shown}"
        );
        assert!(!shown.contains("the whole scene"), "{shown}");
    }

    fn shown(text: &str, span: Range<usize>) -> String {
        let problem = Diagnostic {
            message: "m".into(),
            span: Some(span),
            label: String::new(),
            hint: None,
        };
        Diagnostics::new("a.json", text, vec![problem]).render(&Renderer::plain())
    }

    /// Protects: a message has its position once, as line and column of the text, in short lines
    /// and far along long ones, in any line, and in lines with multi-byte characters.
    #[test]
    fn messages_have_one_position() {
        let place = |text: &str, span| {
            let message = shown(text, span);
            let line = message.lines().nth(1).expect("a place");
            line.trim_start().trim_start_matches("--> ").to_owned()
        };
        assert_eq!(place("abc\ndef", 5..6), "a.json:2:2");
        let long = "x".repeat(1000);
        for position in [0, 239, 240, 241, 500, 999] {
            assert_eq!(
                place(&long, position..position + 1),
                format!("a.json:1:{}", position + 1)
            );
            assert_eq!(
                place(&format!("\n\n{long}\n"), position + 2..position + 3),
                format!("a.json:3:{}", position + 1)
            );
        }
        assert_eq!(place(&"é".repeat(500), 800..802), "a.json:1:401");
    }
}
