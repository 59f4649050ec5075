//! Failures of loading a scene and of reading or writing a picture, each as one complete message.

use std::fmt;
use std::path::Path;

use annotate_snippets::Renderer;

use crate::diagnostic::{Diagnostics, render_message};
use crate::error_kind::ErrorKind;

/// A failure, whose `Display` is the complete message for a user in plain text: position, cause and
/// advice.
#[derive(Debug)]
pub enum Error {
    /// Problems in the text of a native scene, each with its position.
    Scene(Diagnostics),
    /// Any other failure.
    Plain {
        /// Kind of the failure.
        kind: ErrorKind,
        /// One sentence that names the file, if any.
        message: String,
        /// Advice.
        hint: Option<String>,
    },
}

impl Error {
    /// Creates the error for wrong content in a file other than a native scene.
    pub fn invalid_input(path: impl fmt::Display, message: impl fmt::Display) -> Self {
        Self::with_kind(ErrorKind::Input, format!("{path}: {message}"))
    }

    /// Creates the error for a file beyond a limit.
    pub fn over_limit(path: impl fmt::Display, message: impl fmt::Display) -> Self {
        Self::with_kind(ErrorKind::Limit, format!("{path}: {message}"))
    }

    /// Creates the error for a wrong use of the program: a name that does not exist, or flags that
    /// contradict each other or the input.
    pub fn invalid_usage(message: impl fmt::Display) -> Self {
        Self::with_kind(ErrorKind::Usage, message.to_string())
    }

    /// Creates the error for a file that cannot be read, or that exceeds the available memory.
    pub fn unreadable(path: &Path, cause: &std::io::Error) -> Self {
        if cause.kind() == std::io::ErrorKind::OutOfMemory {
            return Self::over_limit(
                path.display(),
                "the system does not have enough memory for the whole file; close other programs, or use a smaller file",
            );
        }
        Self::with_kind(
            ErrorKind::File,
            format!(
                "cannot read {}: {}",
                path.display(),
                describe_io_error(cause)
            ),
        )
    }

    /// Creates the error for a file that cannot be written.
    pub fn unwritable(path: &Path, cause: &std::io::Error) -> Self {
        Self::with_kind(
            ErrorKind::File,
            format!(
                "cannot write {}: {}",
                path.display(),
                describe_io_error(cause)
            ),
        )
    }

    /// Creates the error of a kind with a complete message.
    pub(crate) fn with_kind(kind: ErrorKind, message: String) -> Self {
        Self::Plain {
            kind,
            message,
            hint: None,
        }
    }

    /// Adds advice to a plain error. A scene error is unchanged, because each of its problems has
    /// its own advice.
    #[must_use]
    pub fn with_hint(mut self, advice: impl Into<String>) -> Self {
        if let Self::Plain { hint, .. } = &mut self {
            *hint = Some(advice.into());
        }
        self
    }

    /// Kind of the failure, which callers map to an exit code.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Scene(diagnostics) => diagnostics.kind,
            Self::Plain { kind, .. } => *kind,
        }
    }

    /// Message without position and advice; for a scene error, the message of the first problem.
    pub fn message(&self) -> &str {
        match self {
            Self::Scene(diagnostics) => diagnostics
                .problems
                .first()
                .map_or("", |problem| &problem.message),
            Self::Plain { message, .. } => message,
        }
    }

    /// Renders the complete message; `colour` adds the colours of a terminal.
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour {
            Renderer::styled()
        } else {
            Renderer::plain()
        };
        match self {
            Self::Scene(diagnostics) => diagnostics.render(&renderer),
            Self::Plain { message, hint, .. } => {
                render_message(message, hint.as_deref(), &renderer)
            }
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Error {}

/// Describes the cause of a failed file operation in plain words. Rare causes are described in the
/// operating system's words, with the number of the error.
pub(crate) fn describe_io_error(cause: &std::io::Error) -> String {
    use std::io::ErrorKind as Cause;
    match cause.kind() {
        Cause::NotFound => "no such file or folder".to_owned(),
        Cause::PermissionDenied => "permission denied".to_owned(),
        Cause::IsADirectory => "the path is a folder".to_owned(),
        Cause::StorageFull => "the disk is full".to_owned(),
        Cause::QuotaExceeded => {
            "the disk quota is exhausted; delete files, or write to another disk".to_owned()
        }
        Cause::FileTooLarge => {
            "the file would be larger than the file system allows; write it to another disk"
                .to_owned()
        }
        Cause::InvalidFilename => {
            "the file name is too long or invalid; choose another name".to_owned()
        }
        _ => cause.to_string(),
    }
}
