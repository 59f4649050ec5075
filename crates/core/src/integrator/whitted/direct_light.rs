//! Direct light: shadow rays to light samples, and samples of emitters.

use raywright_bvh::{Real, Vector};

use super::WhittedTracer;
use crate::integrator::shadow::ShadowResult;
use crate::interaction::Interaction;
use crate::light::{LightId, LightSample};
use crate::sampler::{SampleAddress, SamplePurpose, sample_2d};

impl<R: Real> WhittedTracer<'_, R> {
    /// Traces and counts a shadow ray from a surface to a light sample.
    #[inline]
    pub(super) fn trace_shadow_ray(
        &mut self,
        light: &LightSample<R>,
        interaction: &Interaction<R>,
        want_distance: bool,
    ) -> ShadowResult<R> {
        match self.scene.shadow_ray(light, interaction) {
            Some((ray, range)) => {
                self.counters.shadow += 1;
                self.scene.trace_shadow(
                    (&ray.with_time(interaction.time), range),
                    &light.target,
                    want_distance,
                )
            }
            // The light lies at the ray's origin: nothing blocks it.
            None => ShadowResult {
                share: R::ONE,
                distance: R::INFINITY,
            },
        }
    }

    /// Samples a point of an emitter chosen by power. Returns the light sample and the
    /// transmittance of its shadow ray, 0 to 1; `None` if no light arrives.
    pub(super) fn sample_emitter(
        &mut self,
        interaction: &Interaction<R>,
        address: SampleAddress,
    ) -> Option<(LightSample<R>, R)> {
        let emitters = &self.scene.lights.emitters;
        if emitters.is_empty() {
            return None;
        }
        let pick = sample_2d(address, SamplePurpose::Emitter);
        let position = sample_2d(address, SamplePurpose::EmitterPoint);
        let (index, probability) = emitters.sample_emitter(pick)?;
        let light_sample =
            emitters.sample(index, interaction.surface.point, position, probability)?;
        if interaction.normal.dot(light_sample.direction) <= R::ZERO {
            return None;
        }
        let aimed = self.scene.aim_at_lamp_centre(
            LightId::Emitter(index),
            light_sample,
            interaction.surface.point,
        )?;
        let (ray, range) = self.scene.shadow_ray(&aimed, interaction)?;
        self.counters.shadow += 1;
        let share = self
            .scene
            .trace_shadow(
                (&ray.with_time(interaction.time), range),
                &aimed.target,
                false,
            )
            .share;
        (share > R::ZERO).then_some((light_sample, share))
    }
}
