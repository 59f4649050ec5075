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

// Sets of effects.

/// Set of effects, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct EffectSet(u64);

impl EffectSet {
    /// The empty set.
    pub const EMPTY: Self = Self(0);
    /// The set of all effects.
    pub const ALL: Self = Self::from_effects(Effect::ALL);

    /// Returns the set of the listed effects.
    pub const fn from_effects(effects: &[Effect]) -> Self {
        let (mut bits, mut i) = (0, 0);
        while i < effects.len() {
            bits |= 1 << effects[i] as u8;
            i += 1;
        }
        Self(bits)
    }

    /// Whether the set contains the effect.
    pub const fn has(self, effect: Effect) -> bool {
        self.0 >> effect as u8 & 1 == 1
    }

    /// Returns the effects of this set that are not in `other`.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Returns the union of this set and `other`.
    pub const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns the intersection of this set and `other`.
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Iterates over the effects of the set, in the order of reports.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL
            .iter()
            .copied()
            .filter(move |&effect| self.has(effect))
    }
}

impl FromIterator<Effect> for EffectSet {
    fn from_iter<I: IntoIterator<Item = Effect>>(effects: I) -> Self {
        effects
            .into_iter()
            .fold(Self::EMPTY, |set, effect| Self(set.0 | 1 << effect as u8))
    }
}

/// Returns all effects with this role.
const fn effects_of_role(role: EffectRole) -> EffectSet {
    let (mut set, mut i) = (EffectSet::EMPTY, 0);
    while i < Effect::ALL.len() {
        if Effect::ALL[i].role() as u8 == role as u8 {
            set = set.or(EffectSet::from_effects(&[Effect::ALL[i]]));
        }
        i += 1;
    }
    set
}

/// Effects of material layers, such as clearcoat and sheen: they extend the metallic-roughness
/// model. Surfaces with one of these effects are prepared as layered materials.
pub const MATERIAL_LAYERS: EffectSet = effects_of_role(EffectRole::Layer);

/// Effects that can be switched off. All other effects are essential parts of the scene.
pub const SWITCHABLE_EFFECTS: EffectSet = effects_of_role(EffectRole::Switch).or(MATERIAL_LAYERS);

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: every name denotes one effect, sets contain exactly their effects, and all effects
    /// fit.
    #[test]
    fn names_and_sets() {
        assert!(Effect::ALL.len() <= 64);
        for (index, &effect) in Effect::ALL.iter().enumerate() {
            assert_eq!(
                (effect as usize, Effect::from_name(effect.name())),
                (index, Some(effect))
            );
            let (effects, others) = (
                EffectSet::from_effects(&[effect]),
                EffectSet::ALL.without(EffectSet::from_effects(&[effect])),
            );
            assert!(effects.has(effect) && !others.has(effect) && effects.and(others).is_empty());
            assert_eq!(
                (effects.iter().collect::<Vec<_>>(), others.iter().count()),
                (vec![effect], Effect::ALL.len() - 1)
            );
            assert_eq!([effect, effect].into_iter().collect::<EffectSet>(), effects);
        }
        assert_eq!(Effect::from_name("magic"), None);
    }
}
