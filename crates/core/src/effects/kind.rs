//! The effects that the program knows, as a closed set: reports, preparation and kernels all mean
//! the same thing by a name.

use serde::{Serialize, Serializer};

use super::table::effects;

/// What an effect is to a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The scene is made of it: without it there would be another one to see.
    Scene,
    /// It can be switched off.
    Switch,
    /// It can be switched off, and lies over, under or in the metallic-roughness model.
    Layer,
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $role:ident, $source:expr, $readings:expr;)*) => {
        /// One thing that a scene may call for.
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

            /// What it is to a scene.
            pub(super) const fn role(self) -> Role {
                match self {
                    $(Self::$variant => Role::$role,)*
                }
            }
        }
    };
}
effects!(kinds);

impl Effect {
    /// The effect of a name.
    pub fn named(name: &str) -> Option<Self> {
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
