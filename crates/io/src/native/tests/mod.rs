//! Tests of the native format.

mod everything;
mod hostile;
mod messages_expressions;
mod messages_rules;
mod messages_syntax;
mod messages_types;
mod numbers;
mod reading;
mod schema;

use raywright_core::Scene;

use super::{ParameterOverrides, SceneNotation, parse};
use crate::error::Error;
use crate::error_kind::ErrorKind;

/// Reads a TOML scene named `x.scene.toml`.
fn toml(text: &str) -> Result<Scene, Error> {
    parse(
        "x.scene.toml",
        text,
        SceneNotation::Toml,
        &ParameterOverrides::default(),
    )
    .map(|parsed| parsed.scene)
}

/// Reads a TOML scene that must be valid.
fn read_scene(text: &str) -> Scene {
    toml(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Checks that a wrong scene is refused with exactly this message, given between line breaks.
fn expect_message(file: &str, text: &str, message: &str) {
    let notation = if file.ends_with("json") {
        SceneNotation::Json
    } else {
        SceneNotation::Toml
    };
    match parse(file, text, notation, &ParameterOverrides::default()) {
        Ok(_) => panic!("this was accepted:\n{text}"),
        Err(error) => {
            assert_eq!(error.kind(), ErrorKind::Input);
            assert_eq!(
                format!("\n{error}\n"),
                message,
                "the message changed; it is now:\n{error}\n"
            );
        }
    }
}
