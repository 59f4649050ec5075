//! Error for an unknown name, with the closest known name or with all known names.

use raywright_core::suggest::most_similar_word;
use raywright_io::Error;

/// Creates the error for an unknown name. The hint is the closest known name or, if no name is
/// close, the list of known names. `label` is the kind of name, such as `camera`.
pub fn unknown_name_error(label: &str, name: &str, known: &[&str]) -> Error {
    let error = Error::invalid_usage(format_args!("there is no {label} `{name}`"));
    match most_similar_word(name, known.iter().copied()) {
        Some(candidate) => error.with_hint(format!("did you mean `{candidate}`?")),
        None if known.is_empty() => error,
        None => error.with_hint(format!("known: {}", known.join(", "))),
    }
}
