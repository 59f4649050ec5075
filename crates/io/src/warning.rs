//! Warnings: what a user should know of a picture although it is made, each with a code that
//! scripts rely on and a severity by which the worst is said first.

use std::fmt;

use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

/// How bad a warning is. What is worse is greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The picture is as the file says, or as near as makes no difference; something was chosen or
    /// read in a certain way.
    Note,
    /// Something that the file has is not in the picture, or not as it was meant.
    LeftOut,
    /// Something that the file names is not there.
    Missing,
    /// Nothing is to be seen.
    Empty,
}

/// Declares the codes with their names and severities in one table.
macro_rules! codes {
    ($($(#[$doc:meta])* $code:ident $name:literal $severity:ident,)*) => {
        /// What a warning is about. Names are part of the command line's contract:
        /// `raywright check --allow NAME`.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum WarningCode {
            $($(#[$doc])* $code,)*
        }

        impl WarningCode {
            /// All of them, the worst first.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$code),*];

            /// As scripts name it.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$code => $name,)* }
            }

            /// How bad it is.
            pub const fn severity(self) -> Severity {
                match self { $(Self::$code => Severity::$severity,)* }
            }
        }
    };
}

codes! {
    /// There is nothing to see.
    NothingToSee "nothing-to-see" Empty,
    /// A texture, a sky or another picture is not there, or can't be read.
    Picture "picture" Missing,
    /// A material or a library of materials is not there.
    Material "material" Missing,
    /// A mesh lacks texture coordinates that its material asks for.
    TextureCoordinates "texture-coordinates" Missing,
    /// Objects, triangles or gaps are lost to rounding.
    Precision "precision" LeftOut,
    /// Samples are dropped, dimmed or cut short.
    Samples "samples" LeftOut,
    /// Triangles without area to render, of too few corners or with numbers that are not finite.
    Geometry "geometry" LeftOut,
    /// Shapes that a section does not cut, cuts without a cap, and sections that leave nothing.
    Section "section" LeftOut,
    /// Points and lines.
    PointsAndLines "points-and-lines" LeftOut,
    /// An extension, a statement or a chunk that is not known.
    Unsupported "unsupported" LeftOut,
    /// A property that no animation moves here.
    Animation "animation" LeftOut,
    /// Colours that are most likely codes from 0 to 255.
    ColourCodes "colour-codes" LeftOut,
    /// Texels that are no light: NaN, infinite or below zero.
    Texels "texels" LeftOut,
    /// A camera or light that makes no sense.
    CameraOrLight "camera-or-light" LeftOut,
    /// More warnings than are listed.
    More "more" LeftOut,
    /// A number out of range: another is taken.
    Range "range" Note,
    /// A file that breaks a rule of its format and can be read in one way alone.
    Format "format" Note,
    /// One of several scenes, variants or readings is chosen.
    Choice "choice" Note,
    /// A material is converted to what this program has.
    Conversion "conversion" Note,
    /// Animations are there, and none is asked for.
    AtRest "at-rest" Note,
}

impl WarningCode {
    /// The code of what is said of an image, so many texels of which were mended.
    pub(crate) fn of_image(mended: impl Into<u64>) -> Self {
        if mended.into() > 0 {
            Self::Texels
        } else {
            Self::Conversion
        }
    }

    /// The code of a name.
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|code| code.name() == name)
    }
}

impl Serialize for WarningCode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// Something that a user should know and that does not stop the work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What it is about.
    pub code: WarningCode,
    /// One sentence that names the file where there is one.
    pub message: String,
}

impl Warning {
    /// A warning about a file.
    pub fn new(code: WarningCode, path: impl fmt::Display, message: impl fmt::Display) -> Self {
        Self {
            code,
            message: format!("{path}: {message}"),
        }
    }

    /// How bad it is.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}

/// Code, severity and message.
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

    /// Protects: names are found again and are of one kind, and the worst come first, so that lists
    /// of them need no order of their own.
    #[test]
    fn codes_have_names_in_order() {
        let names: Vec<&str> = WarningCode::ALL.iter().map(|code| code.name()).collect();
        assert!(
            WarningCode::ALL
                .iter()
                .all(|code| WarningCode::of(code.name()) == Some(*code))
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
