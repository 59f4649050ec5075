//! The one error of the expression language: what is wrong, where in the text, and what to write
//! instead.

use std::ops::Range;

/// What is wrong with an expression. `Display` gives the message alone; the caller knows the file
/// and shows the place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ExprError {
    /// One sentence without a full stop.
    pub message: String,
    /// Bytes of the source that the message is about; both ends are character boundaries within the
    /// source.
    pub span: Range<usize>,
    /// What to do about it, where there is something to say.
    pub hint: Option<String>,
}

impl ExprError {
    pub(super) fn new(message: impl Into<String>, span: Range<usize>) -> Self {
        Self {
            message: message.into(),
            span,
            hint: None,
        }
    }

    pub(super) fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

pub(super) type Result<T> = core::result::Result<T, ExprError>;
