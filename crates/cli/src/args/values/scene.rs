//! Parsers of changes to a scene: its up direction, surroundings, materials and effects, and of the
//! warnings about it.

use std::path::{Path, PathBuf};

use clap::builder::{OsStringValueParser, TypedValueParser};
use raywright_core::effects::{Effect, SWITCHABLE_EFFECTS};
use raywright_core::scene::Studio;
use raywright_core::suggest::most_similar_word;
use raywright_io::{EnvironmentSource, GroundRule, SectionPlane, UpAxis, WarningCode};

use super::numbers::parse_triple;

/// Up direction: an axis of a model or a direction of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UpDirection {
    /// The axis of a model that is turned to +y.
    Axis(UpAxis),
    /// The up vector of the camera.
    Direction([f64; 3]),
}

/// Parses an up direction: an axis of a model, such as `-z`, or three numbers.
pub fn parse_up_direction(text: &str) -> Result<UpDirection, String> {
    match (text.parse::<UpAxis>(), parse_triple(text)) {
        (Ok(axis), _) => Ok(UpDirection::Axis(axis)),
        (_, Ok(direction)) => Ok(UpDirection::Direction(direction)),
        _ => Err("expected an axis of the model (y, z, x, -y, -z, -x) or a direction x,y,z, such as 0,0,1".to_owned()),
    }
}

/// Returns a clap parser of environments: `none`, `default`, or a file with any other name.
pub fn environment_parser() -> impl TypedValueParser<Value = EnvironmentSource> {
    OsStringValueParser::new().try_map(|text| match text.to_str() {
        Some("none") => Ok(EnvironmentSource::None),
        Some("default") => Ok(EnvironmentSource::Default),
        Some("studio") if !Path::new(&text).exists() => {
            Err("the studio is no environment; use --studio in place of --env")
        }
        // A word without dot and slash that is no existing file is probably a misspelled name.
        Some(word) if !word.contains(['.', '/']) && !Path::new(&text).exists() => {
            Err("expected `none`, `default` or the file of an equirectangular picture (.hdr, .exr, .png, .jpg)")
        }
        _ => Ok(EnvironmentSource::File(PathBuf::from(text))),
    })
}

/// Parses the ground of a studio, `auto` or `none`.
pub fn parse_ground(text: &str) -> Result<GroundRule, String> {
    match text {
        "auto" => Ok(GroundRule::Auto),
        "none" => Ok(GroundRule::None),
        _ => Err("expected `auto` or `none`".to_owned()),
    }
}

/// Material that replaces the material of every surface, from `--material`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialChoice {
    /// A matte neutral grey.
    Clay,
}

/// Parses the name of a material, `clay`.
pub fn parse_material(text: &str) -> Result<MaterialChoice, String> {
    if text == "clay" {
        Ok(MaterialChoice::Clay)
    } else {
        Err("expected clay".to_owned())
    }
}

/// Parses a cut across an axis, such as `x=0.3` or `-x=30%`.
pub fn parse_section(text: &str) -> Result<SectionPlane, String> {
    text.parse()
}

/// Backdrop of a studio, from `--backdrop`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackdropChoice {
    /// Dark behind a bright first model of the run, light behind a dark first model, unless the
    /// file sets the backdrop.
    Auto,
    /// The dark backdrop, which suits bright models.
    Dark,
    /// The light backdrop, which suits dark models.
    Light,
}

impl BackdropChoice {
    /// All backdrops with their names.
    const NAMED: [(&'static str, Self); 3] = [
        ("auto", Self::Auto),
        ("dark", Self::Dark),
        ("light", Self::Light),
    ];

    /// Returns the backdrop's name on the command line.
    pub fn name(self) -> &'static str {
        Self::NAMED
            .iter()
            .find(|(_, backdrop)| *backdrop == self)
            .map_or("auto", |(name, _)| name)
    }

    /// Returns the radiance of the backdrop; `None` for `auto`.
    pub fn radiance(self) -> Option<f64> {
        match self {
            Self::Auto => None,
            Self::Dark => Some(Studio::DARK_BACKDROP),
            Self::Light => Some(Studio::LIGHT_BACKDROP),
        }
    }
}

/// Parses the name of a backdrop, `auto`, `dark` or `light`.
pub fn parse_backdrop(text: &str) -> Result<BackdropChoice, String> {
    let found = BackdropChoice::NAMED.iter().find(|(name, _)| *name == text);
    found
        .map(|(_, backdrop)| *backdrop)
        .ok_or_else(|| "expected `auto`, `dark` or `light`".to_owned())
}

/// Parses the name of an effect that can be switched off, with hyphens in place of blanks.
pub fn parse_effect(text: &str) -> Result<Effect, String> {
    if let Some(effect) = Effect::from_name(&text.replace('-', " ")) {
        return if SWITCHABLE_EFFECTS.has(effect) {
            Ok(effect)
        } else {
            Err("this effect is part of the scene itself and cannot be switched off; change the scene instead".to_owned())
        };
    }
    let known = list_switchable_effects();
    Err(match most_similar_word(text, known.split(", ")) {
        Some(word) => format!("no effect has this name; did you mean `{word}`?"),
        None => format!("no effect has this name; effects that can be switched off: {known}"),
    })
}

/// Returns the names of all effects that can be switched off, as on the command line: separated by
/// commas, with hyphens in place of blanks.
pub fn list_switchable_effects() -> String {
    SWITCHABLE_EFFECTS
        .iter()
        .map(|effect| effect.name().replace(' ', "-"))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Parses the code of a warning, such as `nothing-to-see`.
pub fn parse_warning_code(text: &str) -> Result<WarningCode, String> {
    let names = WarningCode::ALL.map(WarningCode::name);
    WarningCode::from_name(text).ok_or_else(|| match most_similar_word(text, names) {
        Some(name) => format!("no warning has this code; did you mean `{name}`?"),
        None => format!("no warning has this code; the codes: {}", names.join(", ")),
    })
}
