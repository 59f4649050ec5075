//! Sets of effects.

use super::kind::{Effect, Role};

/// A set of effects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct EffectSet(u64);

impl EffectSet {
    /// No effect.
    pub const EMPTY: Self = Self(0);
    /// Every effect.
    pub const ALL: Self = Self::of(Effect::ALL);

    /// These effects.
    pub const fn of(effects: &[Effect]) -> Self {
        let (mut bits, mut i) = (0, 0);
        while i < effects.len() {
            bits |= 1 << effects[i] as u8;
            i += 1;
        }
        Self(bits)
    }

    /// Whether it is in the set.
    pub const fn has(self, effect: Effect) -> bool {
        self.0 >> effect as u8 & 1 == 1
    }

    /// This set without those of another.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// What either has.
    pub const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// What both have.
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether nothing is in it.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// What is in it, in the order of reports.
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

/// The effects of a role.
const fn of_role(role: Role) -> EffectSet {
    let (mut set, mut i) = (EffectSet::EMPTY, 0);
    while i < Effect::ALL.len() {
        if Effect::ALL[i].role() as u8 == role as u8 {
            set = set.or(EffectSet::of(&[Effect::ALL[i]]));
        }
        i += 1;
    }
    set
}

/// Effects of what lies over, under and in the metallic-roughness model: surfaces that have one are
/// prepared as layered.
pub const LAYERS: EffectSet = of_role(Role::Layer);

/// What can be switched off. The rest is what the scene is made of: without it there would be
/// another scene to see.
pub const SWITCHABLE: EffectSet = of_role(Role::Switch).or(LAYERS);

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: every name means one effect, sets hold what was put in and nothing else, and there
    /// is room for all.
    #[test]
    fn names_and_sets() {
        assert!(Effect::ALL.len() <= 64);
        for (place, &effect) in Effect::ALL.iter().enumerate() {
            assert_eq!(
                (effect as usize, Effect::named(effect.name())),
                (place, Some(effect))
            );
            let (one, others) = (
                EffectSet::of(&[effect]),
                EffectSet::ALL.without(EffectSet::of(&[effect])),
            );
            assert!(one.has(effect) && !others.has(effect) && one.and(others).is_empty());
            assert_eq!(
                (one.iter().collect::<Vec<_>>(), others.iter().count()),
                (vec![effect], Effect::ALL.len() - 1)
            );
            assert_eq!([effect, effect].into_iter().collect::<EffectSet>(), one);
        }
        assert_eq!(Effect::named("magic"), None);
    }
}
