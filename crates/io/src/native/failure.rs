//! Failure of deserialization. Each enclosing value adds its key or index to the failure's path.

use std::fmt;
use std::ops::{Deref, DerefMut, Range};

use raywright_core::suggest::{find_synonym, most_similar_word};
use serde::de::{self, Expected, Unexpected};

use crate::diagnostic::Diagnostic;

/// A step of a path from the root to a value: a key of a table or an index of an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum PathStep {
    Key(String),
    Index(usize),
}

/// Failure to read a value as its type. The details are boxed, because every step of serde passes
/// the failure by value.
#[derive(Debug)]
pub(crate) struct ReadFailure(Box<FailureDetails>);

#[derive(Debug, Default)]
pub(crate) struct FailureDetails {
    pub message: String,
    pub label: String,
    pub hint: Option<String>,
    /// Position in the text; `None` until an enclosing value sets the position.
    pub span: Option<Range<usize>>,
    /// Key that the value lacks.
    pub missing: Option<&'static str>,
    /// Key whose position is shown; without a key, the position of the whole value is shown.
    pub key: Option<String>,
    /// Steps of the path from the value up to the root.
    pub path: Vec<PathStep>,
}

impl Deref for ReadFailure {
    type Target = FailureDetails;

    fn deref(&self) -> &FailureDetails {
        &self.0
    }
}

impl DerefMut for ReadFailure {
    fn deref_mut(&mut self) -> &mut FailureDetails {
        &mut self.0
    }
}

impl ReadFailure {
    pub fn new(message: impl Into<String>) -> Self {
        Self(Box::new(FailureDetails {
            message: message.into(),
            ..FailureDetails::default()
        }))
    }

    pub fn with_span(mut self, span: Range<usize>) -> Self {
        self.span = Some(span);
        self
    }

    pub fn with_label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    pub fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds a step to the path.
    pub fn with_step(mut self, step: PathStep) -> Self {
        self.path.push(step);
        self
    }

    pub fn into_diagnostic(self) -> Diagnostic {
        let FailureDetails {
            message,
            span,
            label,
            hint,
            ..
        } = *self.0;
        Diagnostic {
            message,
            span,
            label,
            hint,
        }
    }
}

impl fmt::Display for ReadFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for ReadFailure {}

impl de::Error for ReadFailure {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(message.to_string())
    }

    fn invalid_type(unexpected: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::new(format!("expected {expected}, found {unexpected}"))
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> Self {
        Self::new(format!(
            "expected {expected}, found an array of length {length}"
        ))
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        Self::new(format!("unknown value `{variant}`")).with_hint(did_you_mean(
            variant,
            expected,
            "allowed values",
        ))
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        let hint = did_you_mean(field, expected, "allowed keys");
        let mut failure = Self::new(format!("unknown key `{field}`")).with_hint(hint);
        failure.key = Some(field.to_owned());
        failure
    }

    fn missing_field(field: &'static str) -> Self {
        let mut failure = Self::new(format!("missing key `{field}`"));
        failure.missing = Some(field);
        failure
    }
}

/// Returns advice for an unknown word: the most similar known word, or a list of all known words.
pub(crate) fn did_you_mean(wrong: &str, known: &[&str], label: &str) -> String {
    let synonym = find_synonym(wrong, |word| known.contains(&word));
    match synonym.or_else(|| most_similar_word(wrong, known.iter().copied())) {
        Some(word) => format!("did you mean `{word}`?"),
        None => format!("{label}: {}", known.join(", ")),
    }
}
