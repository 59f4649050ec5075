//! Effects: the features that a scene needs, those that a render simulates, and the reasons.
//!
//! [`detect`] depends on the scene and the settings alone. An effect is **simulated**, **absent**
//! (the scene has none of it, and nothing is built, traced or sampled for it) or **left out** (the
//! scene has it, this render does not simulate it; a hint is always given). Only features of
//! visible objects count: an unused material needs nothing.
//!
//! The findings decide the later stages: preparation builds data for the simulated effects alone,
//! and the kernel is the smallest one that contains them.

mod detect;
mod facts;
mod kind;
mod lit;
mod set;
mod setup;
mod switch;
mod table;

pub(crate) use facts::MIRROR_ROUGHNESS;
pub use kind::Effect;
pub use lit::{has_light, lights_reach, neutral_sky};
pub use set::{EffectSet, LAYERS, SWITCHABLE};
pub use setup::detect;
pub(crate) use setup::{RenderSetup, chosen};

use serde::Serialize;

/// Status of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EffectStatus {
    /// The scene needs the effect, and the render simulates it.
    Simulated,
    /// The scene does not need the effect.
    Absent,
    /// The scene needs the effect, and the render does not simulate it.
    LeftOut,
}

/// An effect with its status and reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EffectFinding {
    /// The effect.
    #[serde(rename = "name")]
    pub effect: Effect,
    /// Status of the effect.
    pub status: EffectStatus,
    /// Reason for the status.
    pub because: String,
    /// Path of the scene's part that needs the effect (`materials[1].model.classic.transmission`);
    /// `None` for an absent effect.
    pub source: Option<String>,
    /// Hint; always given for an effect that is left out.
    pub hint: Option<String>,
}

/// Findings for every known effect, in a fixed order.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EffectReport {
    /// Name of the integrator.
    pub integrator: &'static str,
    /// Reason for its choice.
    pub because: String,
    /// One finding for each of [`Effect::ALL`], in that order.
    pub effects: Vec<EffectFinding>,
}

impl EffectReport {
    /// Returns the status of an effect.
    pub fn status(&self, effect: Effect) -> EffectStatus {
        self.effects[effect as usize].status
    }

    /// Returns the simulated effects.
    pub fn simulated(&self) -> EffectSet {
        self.effects
            .iter()
            .filter(|f| f.status == EffectStatus::Simulated)
            .map(|f| f.effect)
            .collect()
    }

    /// Iterates over the effects that are left out.
    pub fn left_out(&self) -> impl Iterator<Item = &EffectFinding> {
        self.effects
            .iter()
            .filter(|f| f.status == EffectStatus::LeftOut)
    }
}
