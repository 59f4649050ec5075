//! A chosen rung.

use core::fmt;

use super::{Ladder, Rung, RungValue};
use crate::effects::{Effect, EffectSet};
use crate::material::FresnelRule;
use crate::scene::Scene;
use crate::settings::{AreaShadows, Settings};
use crate::suggest::closest;

/// A chosen rung of a ladder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RungChoice {
    pub(super) ladder: Ladder,
    pub(super) rung: &'static Rung,
}

/// Error of a text that names no rung.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnknownRung(String);

impl RungChoice {
    /// Parses `LADDER=RUNG`.
    ///
    /// # Errors
    /// [`UnknownRung`] with the mistake, and the nearest word or all of them.
    pub fn parse(text: &str) -> Result<Self, UnknownRung> {
        let (ladder, rung) = text.split_once('=').ok_or_else(|| {
            UnknownRung("expected LADDER=RUNG, such as precision=reference".to_owned())
        })?;
        let found = Ladder::ALL.into_iter().find(|known| known.name() == ladder);
        let ladder =
            found.ok_or_else(|| unknown("ladder", ladder, &Ladder::ALL.map(Ladder::name)))?;
        let names = || {
            ladder
                .rungs()
                .iter()
                .map(|rung| rung.name)
                .collect::<Vec<_>>()
        };
        let rung = ladder
            .rung(rung)
            .ok_or_else(|| unknown(&format!("rung of {}", ladder.name()), rung, &names()))?;
        Ok(Self { ladder, rung })
    }

    /// Returns the ladder.
    pub fn ladder(&self) -> Ladder {
        self.ladder
    }

    /// Returns the name of the rung.
    pub fn rung(&self) -> &'static str {
        self.rung.name
    }

    /// Returns the description of the rung, with its error.
    pub fn about(&self) -> &'static str {
        self.rung.about
    }

    /// Returns the values that the rung sets.
    pub fn value(&self) -> RungValue {
        self.rung.value
    }

    /// Whether the rung gives another picture than its neighbour for a scene with these effects.
    /// Without area lights hard shadows change nothing, and without lights of zero size neither
    /// does switching their shadows off.
    pub fn differs(&self, present: EffectSet) -> bool {
        match self.value() {
            RungValue::Shadows(Some(AreaShadows::Hard)) => present.has(Effect::SoftShadows),
            RungValue::Shadows(None) => present.has(Effect::Shadows),
            _ => true,
        }
    }

    /// Whether the rung can be the reference of its ladder: a rung that creates energy cannot.
    pub fn can_be_reference(&self) -> bool {
        self.value() != RungValue::Fresnel(FresnelRule::Model)
    }

    /// Sets scene and settings to the rung.
    pub fn apply(&self, scene: &mut Scene, settings: &mut Settings) {
        self.value().apply(scene, settings);
    }
}

impl fmt::Display for RungChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.ladder.name(), self.rung.name)
    }
}

fn unknown(label: &str, name: &str, known: &[&str]) -> UnknownRung {
    let hint = match closest(name, known.iter().copied()) {
        Some(word) => format!("did you mean `{word}`?"),
        None => format!("known: {}", known.join(", ")),
    };
    UnknownRung(format!("there is no {label} `{name}`; {hint}"))
}
