//! Error for an unknown name: the closest known name, or all of them.

use raywright_core::suggest::closest;
use raywright_io::Error;

/// Returns the error for an unknown name, with the closest known name or, without a close name, the
/// list of known names.
pub fn unknown(label: &str, name: &str, known: &[&str]) -> Error {
    let error = Error::usage(format_args!("there is no {label} `{name}`"));
    match closest(name, known.iter().copied()) {
        Some(candidate) => error.with_hint(format!("did you mean `{candidate}`?")),
        None if known.is_empty() => error,
        None => error.with_hint(format!("known: {}", known.join(", "))),
    }
}
