//! A rung that was asked for.

use core::fmt;

use super::{Ladder, Rung, RungValue};
use crate::effects::{Effect, EffectSet};
use crate::material::FresnelRule;
use crate::scene::Scene;
use crate::settings::{AreaShadows, Settings};
use crate::suggest::closest;

/// A rung of a ladder that was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    pub(super) ladder: Ladder,
    pub(super) rung: &'static Rung,
}

/// Why a text names no rung.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnknownRung(String);

impl Choice {
    /// Reads `LADDER=RUNG`.
    ///
    /// # Errors
    /// What is wrong with the text, with the nearest word or all of them.
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

    /// The ladder.
    pub fn ladder(&self) -> Ladder {
        self.ladder
    }

    /// Name of the rung.
    pub fn rung(&self) -> &'static str {
        self.rung.name
    }

    /// What the rung is, and what it gets wrong.
    pub fn about(&self) -> &'static str {
        self.rung.about
    }

    /// What the rung sets.
    pub fn value(&self) -> RungValue {
        self.rung.value
    }

    /// Whether the rung is another picture than its neighbour to a scene that calls for these
    /// effects: without lamps of a size there are no penumbras to lose, and without lights of none
    /// nothing that passes everything.
    pub fn differs(&self, present: EffectSet) -> bool {
        match self.value() {
            RungValue::Shadows(Some(AreaShadows::Hard)) => present.has(Effect::SoftShadows),
            RungValue::Shadows(None) => present.has(Effect::Shadows),
            _ => true,
        }
    }

    /// Whether it can be what the others of its ladder are compared with: what makes light can't.
    pub fn can_be_reference(&self) -> bool {
        self.value() != RungValue::Fresnel(FresnelRule::Model)
    }

    /// Puts scene and settings on the rung.
    pub fn apply(&self, scene: &mut Scene, settings: &mut Settings) {
        self.value().apply(scene, settings);
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.ladder.name(), self.rung.name)
    }
}

fn unknown(what: &str, name: &str, known: &[&str]) -> UnknownRung {
    let hint = match closest(name, known.iter().copied()) {
        Some(word) => format!("did you mean `{word}`?"),
        None => format!("known: {}", known.join(", ")),
    };
    UnknownRung(format!("there is no {what} `{name}`; {hint}"))
}
