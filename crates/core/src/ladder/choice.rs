//! A rung (quality level) together with its ladder (quality setting), as users name it:
//! `samples=16`.

use core::fmt;

use super::{Ladder, Rung, RungValue};
use crate::effects::{Effect, EffectSet};
use crate::scene::Scene;
use crate::settings::{AreaShadows, Settings};
use crate::suggest::most_similar_word;

/// A rung (quality level) together with its ladder (quality setting), such as `samples=16`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RungChoice {
    pub(super) ladder: Ladder,
    pub(super) rung: &'static Rung,
}

/// Error: a text names an unknown ladder, or an unknown rung of a ladder. Contains the message for
/// users, with a hint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnknownRungError(String);

impl RungChoice {
    /// Parses a rung in the form `LADDER=RUNG`, such as `samples=16`.
    ///
    /// # Errors
    /// [`UnknownRungError`] for an unknown ladder or rung, with the nearest known name or all known
    /// names.
    pub fn parse(text: &str) -> Result<Self, UnknownRungError> {
        let (ladder, rung) = text.split_once('=').ok_or_else(|| {
            UnknownRungError("expected LADDER=RUNG, such as precision=reference".to_owned())
        })?;
        let found = Ladder::ALL.into_iter().find(|known| known.name() == ladder);
        let ladder = found
            .ok_or_else(|| unknown_rung_error("ladder", ladder, &Ladder::ALL.map(Ladder::name)))?;
        let names = || {
            ladder
                .rungs()
                .iter()
                .map(|rung| rung.name)
                .collect::<Vec<_>>()
        };
        let rung = ladder.rung_by_name(rung).ok_or_else(|| {
            unknown_rung_error(&format!("rung of {}", ladder.name()), rung, &names())
        })?;
        Ok(Self { ladder, rung })
    }

    /// Returns the ladder of the rung.
    pub fn ladder(&self) -> Ladder {
        self.ladder
    }

    /// Returns the name of the rung.
    pub fn rung(&self) -> &'static str {
        self.rung.name
    }

    /// Returns the description of the rung for users, which names its error.
    pub fn rung_description(&self) -> &'static str {
        self.rung.about
    }

    /// Returns the value that the rung sets in scene and settings.
    pub fn value(&self) -> RungValue {
        self.rung.value
    }

    /// Whether the rung can change the picture of a scene with the effects `present`. Only two
    /// rungs depend on effects. Hard shadows change only scenes with area lights. Without shadows,
    /// only scenes with shadows of lights without size change.
    pub fn changes_picture(&self, present: EffectSet) -> bool {
        match self.value() {
            RungValue::Shadows(Some(AreaShadows::Hard)) => present.has(Effect::SoftShadows),
            RungValue::Shadows(None) => present.has(Effect::Shadows),
            _ => true,
        }
    }

    /// Returns the flag of `render` that chooses the rung: `--rung LADDER=RUNG`, or the ladder's own, such
    /// as `--spp 16`.
    pub fn flag(&self) -> String {
        let flag = match self.value() {
            RungValue::Denoised(true) => return "--denoise".to_owned(),
            RungValue::Denoised(false) => return "--no-denoise".to_owned(),
            RungValue::Samples(_) => "--spp",
            RungValue::PathLength(_) => "--max-depth",
            RungValue::Integrator(_) => "--integrator",
            RungValue::Precision(_) => "--precision",
            _ => return format!("--rung {self}"),
        };
        format!("{flag} {}", self.rung.name)
    }

    /// Sets the rung's value in scene and settings.
    pub fn apply(&self, scene: &mut Scene, settings: &mut Settings) {
        self.value().apply(scene, settings);
    }
}

impl fmt::Display for RungChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.ladder.name(), self.rung.name)
    }
}

/// Returns the error for an unknown name. `label` says what the name stands for. The hint is the
/// nearest known name, or all known names.
fn unknown_rung_error(label: &str, name: &str, known: &[&str]) -> UnknownRungError {
    let hint = match most_similar_word(name, known.iter().copied()) {
        Some(word) => format!("did you mean `{word}`?"),
        None => format!("known: {}", known.join(", ")),
    };
    UnknownRungError(format!("unknown {label} `{name}`; {hint}"))
}
