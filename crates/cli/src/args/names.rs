//! Parsers of flags whose values are the variants of an enum. The accepted names are the enum's
//! serde names, which scene files use too; no second table is kept by hand.

use std::fmt;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use raywright_core::settings::Aov;
use serde::de::{DeserializeOwned, IntoDeserializer};

/// Returns a clap parser that accepts the serde names of the unit variants of `T`. Clap lists the
/// names in the help and suggests the nearest name for a misspelled word.
pub fn variant_parser<T: DeserializeOwned + Clone + Send + Sync + 'static>()
-> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(variant_names::<T>())
        .try_map(|name| parse_variant::<T>(&name).map_err(|_| name))
}

/// Returns a clap parser for the names of layers of an EXR picture.
pub fn aov_parser() -> impl TypedValueParser<Value = Aov> {
    let find = |name: String| {
        let found = Aov::ALL.into_iter().find(|(known, _)| *known == name);
        found.map(|(_, aov)| aov).ok_or(name)
    };
    PossibleValuesParser::new(Aov::ALL.map(|(name, _)| name)).try_map(find)
}

/// Error for a name that is no variant of an enum. The field holds the names of all variants.
#[derive(Debug)]
pub(crate) struct RefusedVariant(&'static [&'static str]);

impl fmt::Display for RefusedVariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected one of {}", self.0.join(", "))
    }
}

impl std::error::Error for RefusedVariant {}

impl serde::de::Error for RefusedVariant {
    fn custom<M: fmt::Display>(_: M) -> Self {
        Self(&[])
    }
    fn unknown_variant(_: &str, expected: &'static [&'static str]) -> Self {
        Self(expected)
    }
}

/// Parses a variant of `T` by its serde name.
pub(crate) fn parse_variant<T: DeserializeOwned>(name: &str) -> Result<T, RefusedVariant> {
    T::deserialize(IntoDeserializer::<RefusedVariant>::into_deserializer(name))
}

/// Returns the serde names of all variants of `T`, in the order of their declaration.
fn variant_names<T: DeserializeOwned>() -> &'static [&'static str] {
    parse_variant::<T>("")
        .err()
        .map_or(&[], |RefusedVariant(names)| names)
}

#[cfg(test)]
mod tests {
    use raywright_core::scene::{ToneMap, TransferCurve};

    use super::*;

    /// Protects: the flags accept exactly what a scene file accepts.
    #[test]
    fn names_are_those_of_the_scene_format() {
        assert_eq!(
            variant_names::<ToneMap>(),
            ["none", "aces", "aces-hill", "agx", "khronos-neutral"]
        );
        assert_eq!(variant_names::<TransferCurve>(), ["srgb", "2.2", "none"]);
        assert_eq!(
            parse_variant::<ToneMap>("aces-hill").ok(),
            Some(ToneMap::AcesHill)
        );
        assert!(parse_variant::<ToneMap>("filmic").is_err());
    }
}
