//! Selection of the emissive materials whose objects become area lights. It is made before any
//! material is prepared.

use crate::effects::{Effect, EffectSet};
use crate::scene::{Colour, Material};

/// Selection of the emissive materials whose objects become area lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmitterFilter {
    /// Whether materials of uniform emission are selected.
    pub uniform: bool,
    /// Whether materials of varying emission are selected.
    pub varying: bool,
    /// Whether partly transparent and coated surfaces of uniform emission count as varying. A path
    /// tracer evaluates their emission, times alpha and below the coat, at each hit.
    pub evaluated_at_hits: bool,
}

/// Emission of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MaterialEmission {
    /// Uniform radiance.
    Uniform(Colour),
    /// Radiance evaluated at each point.
    Varying,
}

impl EmitterFilter {
    /// Returns the selection that fits the simulated effects and the integrator.
    pub fn from_effects(simulated: EffectSet, is_path_tracing: bool) -> Self {
        Self {
            uniform: simulated.has(Effect::SoftShadows),
            varying: is_path_tracing && simulated.has(Effect::TexturedEmitters),
            evaluated_at_hits: is_path_tracing,
        }
    }

    /// Returns the emission of a selected material. `None` if the material does not emit or is not
    /// selected.
    pub fn selected_emission(self, material: &Material) -> Option<MaterialEmission> {
        match material.uniform_emission() {
            Some(_)
                if self.uniform
                    && self.evaluated_at_hits
                    && (material.is_partly_transparent() || material.is_coated()) =>
            {
                Some(MaterialEmission::Varying)
            }
            Some(radiance) if self.uniform => Some(MaterialEmission::Uniform(radiance)),
            None if self.varying && material.emits() => Some(MaterialEmission::Varying),
            _ => None,
        }
    }
}
