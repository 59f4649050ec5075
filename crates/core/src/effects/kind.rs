//! Effects: the fixed set of features that a scene may need, with their names and roles.

use serde::{Serialize, Serializer};

use super::table::effects;

/// Role of an effect in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EffectRole {
    /// Essential part of the scene, which cannot be switched off.
    Scene,
    /// Effect that can be switched off.
    Switch,
    /// Effect that can be switched off, and that is a layer over, under or in the
    /// metallic-roughness model.
    Layer,
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $role:ident, $source:expr, $readings:expr;)*) => {
        /// Effect: a feature that a scene may need and a render may simulate, such as soft shadows
        /// or refraction.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Effect {
            $($(#[$doc])* $variant,)*
        }

        impl Effect {
            /// Every effect, in the order of reports.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Returns the name in reports and on the command line.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// Returns the role of the effect in a scene.
            pub(super) const fn role(self) -> EffectRole {
                match self {
                    $(Self::$variant => EffectRole::$role,)*
                }
            }
        }
    };
}
effects!(kinds);

impl Effect {
    /// Returns the effect with this name, or `None`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .copied()
            .find(|effect| effect.name() == name)
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}
