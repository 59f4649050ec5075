//! What the native format promises, by example.

mod reading;

use raywright_core::Scene;

use super::{Notation, Overrides, parse};
use crate::error::Error;

/// Reads a TOML scene named `x.scene.toml`.
fn toml(text: &str) -> Result<Scene, Error> {
    parse("x.scene.toml", text, Notation::Toml, &Overrides::default()).map(|parsed| parsed.scene)
}

/// Reads a TOML scene that must be right.
fn good(text: &str) -> Scene {
    toml(text).unwrap_or_else(|error| panic!("{error}"))
}
