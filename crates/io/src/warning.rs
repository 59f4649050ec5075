//! Warnings, which do not prevent a picture. Each warning has a code for scripts, and a severity by
//! which warnings are sorted, worst first.

use std::fmt;

use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

/// Severity of a warning; worse is greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The program had to make a choice, but the picture follows the file or differs negligibly.
    Note,
    /// A part of the file is absent from the picture or shown differently.
    LeftOut,
    /// A part named by the file does not exist.
    Missing,
    /// Nothing is visible.
    Empty,
}

/// Declares the codes with their names and severities in a single table.
macro_rules! codes {
    ($($(#[$doc:meta])* $code:ident $name:literal $severity:ident,)*) => {
        /// Kind of a warning. The names are used on the command line, in `raywright check --allow
        /// NAME`, and therefore stay the same in later versions.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum WarningCode {
            $($(#[$doc])* $code,)*
        }

        impl WarningCode {
            /// All codes, worst first.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$code),*];

            /// Name for scripts.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$code => $name,)* }
            }

            /// Severity of all warnings of this kind.
            pub const fn severity(self) -> Severity {
                match self { $(Self::$code => Severity::$severity,)* }
            }
        }
    };
}

codes! {
    /// Nothing is visible.
    NothingToSee "nothing-to-see" Empty,
    /// A missing or unreadable texture, sky or other picture.
    Picture "picture" Missing,
    /// A missing material or material library.
    Material "material" Missing,
    /// A mesh without the texture coordinates that its material needs.
    TextureCoordinates "texture-coordinates" Missing,
    /// Objects, triangles or gaps lost to rounding.
    Precision "precision" LeftOut,
    /// Samples dropped, dimmed or cut short.
    Samples "samples" LeftOut,
    /// Degenerate triangles: zero area, too few corners or non-finite coordinates.
    Geometry "geometry" LeftOut,
    /// Shapes that a section does not cut, cuts that stay open, and sections that remove
    /// everything.
    Section "section" LeftOut,
    /// Points and lines.
    PointsAndLines "points-and-lines" LeftOut,
    /// An unknown extension, statement or chunk.
    Unsupported "unsupported" LeftOut,
    /// An animated property that is not supported.
    Animation "animation" LeftOut,
    /// Colours that are probably codes from 0 to 255.
    ColourCodes "colour-codes" LeftOut,
    /// Invalid texels: NaN, infinite or negative.
    Texels "texels" LeftOut,
    /// An invalid camera or light.
    CameraOrLight "camera-or-light" LeftOut,
    /// The file has more warnings than are listed.
    More "more" LeftOut,
    /// A number out of range, replaced by another.
    Range "range" Note,
    /// A file that breaks a rule of its format and still has a single interpretation.
    Format "format" Note,
    /// A choice among several scenes, variants or interpretations.
    Choice "choice" Note,
    /// A material that was converted to the closest supported material.
    Conversion "conversion" Note,
    /// Animations exist, and none was requested.
    AtRest "at-rest" Note,
}

impl WarningCode {
    /// Returns the code of a remark about an image. `repaired` is the number of replaced texels.
    pub(crate) fn from_repaired_texels(repaired: impl Into<u64>) -> Self {
        if repaired.into() > 0 {
            Self::Texels
        } else {
            Self::Conversion
        }
    }

    /// Returns the code with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|code| code.name() == name)
    }
}

impl Serialize for WarningCode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A warning about a scene or model that could be loaded, with its kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Subject of the warning.
    pub code: WarningCode,
    /// One sentence that names the file, if any.
    pub message: String,
}

impl Warning {
    /// Creates a warning about a file.
    pub fn new(code: WarningCode, path: impl fmt::Display, message: impl fmt::Display) -> Self {
        Self {
            code,
            message: format!("{path}: {message}"),
        }
    }

    /// Severity of the warning, which follows from its code.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}

/// Serializes code, severity and message.
impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("Warning", 3)?;
        fields.serialize_field("code", &self.code)?;
        fields.serialize_field("severity", &self.severity())?;
        fields.serialize_field("message", &self.message)?;
        fields.end()
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: each name is unique, in kebab case, and finds its code; the worst codes come
    /// first.
    #[test]
    fn codes_have_names_in_order() {
        let names: Vec<&str> = WarningCode::ALL.iter().map(|code| code.name()).collect();
        assert!(
            WarningCode::ALL
                .iter()
                .all(|code| WarningCode::from_name(code.name()) == Some(*code))
        );
        assert!(
            names.iter().all(|name| name
                .bytes()
                .all(|byte| byte.is_ascii_lowercase() || byte == b'-')),
            "{names:?}"
        );
        assert!(
            WarningCode::ALL
                .windows(2)
                .all(|pair| pair[0].severity() >= pair[1].severity())
        );
    }
}
