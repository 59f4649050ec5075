//! Failures of a run: the exit codes that scripts rely on, and the single message of each failure.

use std::process::ExitCode;
use std::{fmt, io};

use raywright_io::{Error, ErrorKind};

/// Exit code of the program. Scripts rely on the numbers, which never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// All requested work was done.
    Done = 0,
    /// The work itself failed, or a measured value exceeds its threshold.
    Failed = 1,
    /// The command line is malformed, or names a flag, a preset, a camera or a value that does not
    /// exist.
    Usage = 2,
    /// The content of a scene, model or picture cannot be used.
    Input = 3,
    /// A file cannot be read or written.
    File = 4,
    /// The work needs more memory or time than a limit allows.
    Limit = 5,
    /// The picture was written, but its error is above the requested limit.
    Unreached = 6,
    /// The run ended by Ctrl-C or by a request to terminate.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit as u8)
    }
}

impl From<ErrorKind> for Exit {
    fn from(kind: ErrorKind) -> Self {
        match kind {
            ErrorKind::Input => Self::Input,
            ErrorKind::File => Self::File,
            ErrorKind::Limit => Self::Limit,
            ErrorKind::Usage => Self::Usage,
        }
    }
}

/// Failure of a run: its exit code and its message to the user.
#[derive(Debug)]
pub struct Failure {
    /// Exit code of the program.
    pub exit: Exit,
    /// The whole message: the label `error: ` and the problem with its file or flag, then each
    /// advice in a line of its own.
    pub message: String,
}

impl Failure {
    /// Creates a failure. The label `error: ` is put before the message.
    pub fn new(exit: Exit, message: impl fmt::Display) -> Self {
        Self {
            exit,
            message: format!("error: {message}"),
        }
    }

    /// Creates the failure of a command line that cannot be run, with advice.
    pub fn usage(message: impl fmt::Display, advice: impl fmt::Display) -> Self {
        Self::new(Exit::Usage, message).with_hint(advice)
    }

    /// Refuses a command line with advice if `is_wrong`.
    pub fn refuse_if(
        is_wrong: bool,
        message: impl fmt::Display,
        advice: impl fmt::Display,
    ) -> Result<(), Self> {
        match is_wrong {
            true => Err(Self::usage(message, advice)),
            false => Ok(()),
        }
    }

    /// Adds advice to the message, in a line of its own with the label `help: `.
    pub fn with_hint(mut self, advice: impl fmt::Display) -> Self {
        self.message += &format!("\nhelp: {advice}");
        self
    }

    /// Adds the message of another failure, which has another cause.
    pub fn with_failure(mut self, other: Option<Self>) -> Self {
        self.message
            .extend(other.map(|other| format!("\n{}", other.message)));
        self
    }

    /// Creates the failure for an error of writing to standard output.
    pub fn from_stdout_error(cause: &io::Error) -> Self {
        Self::new(
            Exit::File,
            format_args!("cannot write to standard output: {cause}"),
        )
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self {
            exit: error.kind().into(),
            message: error.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: each kind of error has the exit code that the command line promises.
    #[test]
    fn each_failure_has_its_code() {
        let code = |error: Error| Failure::from(error).exit as u8;
        assert_eq!(code(Error::invalid_usage("x")), 2);
        assert_eq!(code(Error::invalid_input("x", "y")), 3);
        assert_eq!(
            code(Error::unreadable(
                std::path::Path::new("x"),
                &io::Error::other("y")
            )),
            4
        );
        assert_eq!(code(Error::over_limit("x", "y")), 5);
        assert_eq!(
            Failure::from_stdout_error(&io::Error::other("y")).exit as u8,
            4
        );
        assert_eq!(
            (
                Exit::Done as u8,
                Exit::Failed as u8,
                Exit::Interrupted as u8
            ),
            (0, 1, 130)
        );
    }
}
