//! Effects: what a scene calls for, what this render simulates, and why.
//!
//! [`detect`] reads the scene and the settings and nothing else. An effect is **simulated**,
//! **absent** (the scene has none of it, and then nothing is built, traced or sampled for it) or
//! **left out** (the scene has it, this render does not do it; there is always a hint). Only what
//! an object can show counts: an unused material calls for nothing.
//!
//! What is found decides what comes after: preparation builds for the simulated effects alone, and
//! the kernel is the smallest one that contains them.

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

/// What happens to an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// The scene calls for it and the render does it.
    Simulated,
    /// The scene does not call for it.
    Absent,
    /// The scene calls for it and the render does not do it.
    LeftOut,
}

/// One effect with its reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Which.
    #[serde(rename = "name")]
    pub effect: Effect,
    /// What happens to it.
    pub status: Status,
    /// Why.
    pub because: String,
    /// Path of what calls for it in the scene (`materials[1].model.classic.transmission`); none
    /// where nothing does.
    pub source: Option<String>,
    /// What to do about it; always there when it is left out.
    pub hint: Option<String>,
}

/// Every effect the program knows, in a fixed order.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EffectReport {
    /// Name of the integrator that runs.
    pub integrator: &'static str,
    /// Why it was chosen.
    pub because: String,
    /// One finding for each of [`Effect::ALL`], in that order.
    pub effects: Vec<Finding>,
}

impl EffectReport {
    /// What happens to an effect.
    pub fn status(&self, effect: Effect) -> Status {
        self.effects[effect as usize].status
    }

    /// The effects that the scene has and the render does.
    pub fn simulated(&self) -> EffectSet {
        self.effects
            .iter()
            .filter(|f| f.status == Status::Simulated)
            .map(|f| f.effect)
            .collect()
    }

    /// The effects that the scene has and the render does not do.
    pub fn left_out(&self) -> impl Iterator<Item = &Finding> {
        self.effects.iter().filter(|f| f.status == Status::LeftOut)
    }
}
