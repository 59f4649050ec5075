//! Common input of all steps that prepare a scene. With it, each step takes a single argument.

use std::collections::BTreeMap;

use raywright_bvh::Real;

use super::emitter_filter::EmitterFilter;
use crate::effects::{EffectSet, chosen_integrator};
use crate::lookup::SceneLookup;
use crate::observer::Observer;
use crate::scene::{Integrator, Scene};
use crate::settings::Settings;
use crate::storage_origin::StorageOrigin;

/// The common input of all steps of a preparation.
#[derive(Clone, Copy)]
pub(super) struct PrepareContext<'a> {
    /// The scene. If motion is not simulated, its objects are static.
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    /// The simulated effects. Tables of other effects stay empty.
    pub simulated: EffectSet,
    /// Lookup of the scene's parts by name.
    pub lookup: &'a SceneLookup<'a>,
    /// Names that expressions may read as constants.
    pub constants: &'a BTreeMap<String, f64>,
    /// Storage origin of all coordinates.
    pub origin: StorageOrigin,
    /// Whether the integrator is the path tracer.
    pub is_path_tracing: bool,
    pub observer: &'a dyn Observer,
}

impl<'a> PrepareContext<'a> {
    /// Creates the context of a scene whose coordinates are stored as the scalar `R`.
    pub fn new<R: Real>(
        (scene, settings, simulated): (&'a Scene, &'a Settings, EffectSet),
        lookup: &'a SceneLookup<'a>,
        constants: &'a BTreeMap<String, f64>,
        observer: &'a dyn Observer,
    ) -> Self {
        Self {
            scene,
            settings,
            simulated,
            lookup,
            constants,
            origin: StorageOrigin::from_scene::<R>(scene, lookup),
            is_path_tracing: chosen_integrator(scene, settings) == Integrator::Path,
            observer,
        }
    }

    /// Returns which emissive materials make their objects area lights.
    pub fn emitter_filter(&self) -> EmitterFilter {
        EmitterFilter::from_effects(self.simulated, self.is_path_tracing)
    }
}
