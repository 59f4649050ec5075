//! The known effects as a closed set, with the same names in reports, preparation and kernels.

use serde::{Serialize, Serializer};

use super::table::effects;

/// Role of an effect in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EffectRole {
    /// The effect is an essential part of the scene and cannot be switched off.
    Scene,
    /// The effect can be switched off.
    Switch,
    /// The effect can be switched off, and is a layer over, under or in the metallic-roughness
    /// model.
    Layer,
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $role:ident, $source:expr, $readings:expr;)*) => {
        /// A feature that a scene may need.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Effect {
            $($(#[$doc])* $variant,)*
        }

        impl Effect {
            /// Every effect, in the order of reports.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Name in reports and on the command line.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// Returns the role in a scene.
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
    /// Returns the effect with this name.
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
