//! Effects: the features that a scene needs, which of them a render simulates, and the reasons.
//!
//! [`assess_effects`] depends only on the scene and the settings. An effect has one of three states:
//!
//! - **Simulated**: the render simulates it.
//! - **Absent**: the scene does not need it, so nothing is built, traced or sampled for it.
//! - **Left out**: the scene needs it, but the render does not simulate it. A hint is always given.
//!
//! Only features of visible objects count: an unused material needs no effect. Preparation builds
//! data only for the simulated effects, and the render uses the smallest kernel that contains them.

mod detect;
mod facts;
mod kind;
mod lighting;
mod setup;
mod switch;
mod table;

pub(crate) use facts::MIRROR_ROUGHNESS;
pub use kind::{Effect, EffectSet};
#[doc(hidden)]
pub use kind::{MATERIAL_LAYERS, SWITCHABLE_EFFECTS};
#[doc(hidden)]
pub use lighting::{are_objects_lit_by_lights, emits_light, neutral_sky};
#[doc(hidden)]
pub use setup::assess_effects;
pub(crate) use setup::{RenderSetup, chosen_integrator};

use serde::Serialize;

/// Status of an effect in a render: simulated, absent or left out.
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

/// Status of one effect in a render, with the reason, and with a hint if the effect is left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EffectAssessment {
    /// The effect.
    #[serde(rename = "name")]
    pub effect: Effect,
    /// Status of the effect.
    pub status: EffectStatus,
    /// Reason for the status.
    pub because: String,
    /// Path in the scene file of the object or setting that needs the effect, such as
    /// `materials[1].model.classic.transmission`; `None` for an absent effect.
    pub source: Option<String>,
    /// Command-line flag, or change of the scene, that makes the render simulate the effect. Every
    /// effect that is left out has a hint.
    pub hint: Option<String>,
}

/// Status of every effect in a render, and the chosen integrator, each with the reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EffectReport {
    /// Name of the integrator.
    pub integrator: &'static str,
    /// Reason for the choice of the integrator.
    pub because: String,
    /// One assessment for each of [`Effect::ALL`], in that order.
    pub effects: Vec<EffectAssessment>,
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
    pub fn left_out(&self) -> impl Iterator<Item = &EffectAssessment> {
        self.effects
            .iter()
            .filter(|f| f.status == EffectStatus::LeftOut)
    }
}
