//! Effects: what a scene calls for, what this render simulates, and why.
//!
//! [`detect`] reads the scene and the settings and nothing else. An effect is **simulated**, **absent** (the scene has none of
//! it, and then nothing is built, traced or sampled for it) or **left out** (the scene has it, this render does not do it;
//! there is always a hint). Only what an object can show counts: an unused material calls for nothing.

mod detect;
mod facts;

pub use detect::detect;
pub(crate) use facts::MIRROR_ROUGHNESS;

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
pub struct Effect {
    /// Name, always the same.
    pub name: &'static str,
    /// What happens to it.
    pub status: Status,
    /// Why.
    pub because: String,
    /// Path of what calls for it in the scene (`materials[1].model.classic.transmission`); none where nothing does.
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
    /// The effects.
    pub effects: Vec<Effect>,
}

impl EffectReport {
    /// The status of an effect by name.
    pub fn status(&self, name: &str) -> Option<Status> {
        self.effects.iter().find(|e| e.name == name).map(|e| e.status)
    }

    /// The effects that the scene has and the render does not do.
    pub fn left_out(&self) -> impl Iterator<Item = &Effect> {
        self.effects.iter().filter(|e| e.status == Status::LeftOut)
    }
}
