//! Python exceptions for failures. Each exit code of the program has a class of exceptions; the
//! message is the program's.

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyType;
use raywright_cli::failure::{Exit, Failure};

/// Converts a failure to the exception for its exit code.
pub fn to_exception(py: Python<'_>, Failure { exit, message }: Failure) -> PyErr {
    let name = match exit {
        Exit::Usage => "UsageError",
        Exit::Input => "InputError",
        Exit::File => "FileError",
        Exit::Limit => "LimitError",
        Exit::Interrupted => return PyKeyboardInterrupt::new_err(()),
        Exit::Done | Exit::Failed | Exit::Unreached => "Error",
    };
    let message = message
        .strip_prefix("error: ")
        .unwrap_or(&message)
        .trim_end()
        .to_owned();
    let class = py.import("raywright._errors").and_then(|module| {
        module
            .getattr(name)?
            .cast_into::<PyType>()
            .map_err(PyErr::from)
    });
    match class {
        Ok(class) => PyErr::from_type(class, message),
        Err(error) => error,
    }
}

/// Creates the failure for an array of unsuitable shape or type.
pub fn invalid_array(message: impl std::fmt::Display) -> Failure {
    Failure::new(Exit::Input, message)
}
