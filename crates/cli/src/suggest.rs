//! The error for a name that does not exist: which one was probably meant, or which there are.

use raywright_core::suggest::closest;
use raywright_io::Error;

/// Says that there is no such thing and suggests the nearest one or, where none is near, lists what
/// there is.
pub fn unknown(what: &str, name: &str, known: &[&str]) -> Error {
    let error = Error::usage(format_args!("there is no {what} `{name}`"));
    match closest(name, known.iter().copied()) {
        Some(candidate) => error.with_hint(format!("did you mean `{candidate}`?")),
        None if known.is_empty() => error,
        None => error.with_hint(format!("known: {}", known.join(", "))),
    }
}
