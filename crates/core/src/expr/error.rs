//! Error of an expression: message, span in the source, and hint.

use std::ops::Range;

/// Error of an expression. `Display` writes the message alone, because only the caller knows the
/// file and can show the span.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ExprError {
    /// Message: one sentence without a full stop.
    pub message: String,
    /// Byte range of the source that the message refers to; both ends are character boundaries.
    pub span: Range<usize>,
    /// Hint for a correction, if any.
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
