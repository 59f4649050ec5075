//! Light found by BSDF sampling: emission of surfaces that a path hits, and the sky, with the
//! weights of multiple importance sampling.

use raywright_bvh::{Hit, Real, Vector};

use super::light::weight;
use super::{NARROW, PathState, PathTracer, PreviousVertex};
use crate::interaction::Interaction;
use crate::light::{LightId, LightTarget, SkySample};
use crate::settings::LightSampling;

impl<R: Real> PathTracer<'_, R> {
    /// Adds the emission of a hit surface to the path's radiance, with its weight of multiple
    /// importance sampling.
    #[inline]
    pub(super) fn emits(
        &mut self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
        emission: R::Vec3,
    ) {
        // Partly emissive surfaces are mostly dark, and zero emission needs no weight.
        if emission == Vector::ZERO || !self.scene.shines(interaction) {
            return;
        }
        let share = match self
            .scene
            .lights
            .emitters
            .index_of(interaction.object, hit.primitive)
        {
            Some(emitter) => {
                let light = LightId::Emitter(emitter);
                self.usage.count(light, true);
                let (lights, from, direction) = (
                    &self.scene.lights,
                    path.previous.from,
                    path.segment.ray.direction,
                );
                self.found(path, light, |probability| {
                    lights.density(
                        light,
                        from,
                        direction,
                        &LightTarget::Surface(interaction.surface),
                        probability,
                    )
                })
            }
            None => R::ONE,
        };
        self.counters.found += u64::from(self.is_unaided(path));
        let emitted = path.throughput * emission * share;
        path.radiance += emitted;
        self.see(path.traced == 1, emitted);
    }

    /// Adds radiance to the directly visible radiance of a camera ray, if layers need it. `camera`:
    /// whether the radiance arrives along the camera ray.
    #[inline(always)]
    pub(super) fn see(&mut self, camera: bool, radiance: R::Vec3) {
        if camera && self.keeps_first {
            self.direct += radiance;
        }
    }

    /// Ends the path of a camera ray on a wireframe edge, with the colour of the edge. The stored
    /// albedo is black there, so that denoising keeps the edge.
    pub(super) fn draw_edge(&mut self, path: &mut PathState<R>, edge: R::Vec3) {
        let shown = path.throughput * edge;
        path.radiance += shown;
        self.see(true, shown);
        self.first
            .iter_mut()
            .for_each(|first| first.albedo = [0.0; 3]);
    }

    /// Returns the sky's radiance along a ray that escapes, with its weight of multiple importance
    /// sampling.
    #[inline(always)]
    pub(super) fn escaped(&mut self, path: &PathState<R>, sky_sample: &SkySample<R>) -> R::Vec3 {
        let direction = path.segment.ray.direction;
        let lights = &self.scene.lights;
        if self.is_unaided(path)
            && let Some(density) = lights.sky_sampler().and_then(|sampler| sampler.small())
        {
            self.counters.unaided += 1;
            self.counters.found +=
                u64::from(lights.density_of_sky(direction, sky_sample.place, 1.0) >= density);
        }
        sky_sample.radiance
            * self.found(path, LightId::Sky, |probability| {
                lights.density_of_sky(direction, sky_sample.place, probability)
            })
    }

    /// Whether a path was scattered diffusely before, and its last direction came from a mirror:
    /// such a path hits lights by chance alone.
    #[inline(always)]
    pub(super) fn is_unaided(&self, path: &PathState<R>) -> bool {
        path.min_pdf < NARROW && path.previous.density >= NARROW
    }

    /// Returns the weight of BSDF sampling for a light that a path hit. `drawn` returns the density
    /// of sampling the hit point by light sampling, given the probability of choosing the light.
    #[inline(always)]
    fn found(&self, path: &PathState<R>, light: LightId, drawn: impl FnOnce(f64) -> f64) -> R {
        let PreviousVertex {
            from,
            normal,
            density,
        } = path.previous;
        if density == f64::INFINITY {
            return R::ONE;
        }
        let lights = &self.scene.lights;
        let sampling = self.scene.sampling_of(light);
        if sampling == LightSampling::Scattering {
            return R::ONE;
        }
        let probability = lights.choice().probability::<R>(light, from, normal);
        let other = if probability > 0.0 {
            drawn(probability)
        } else {
            0.0
        };
        match sampling {
            LightSampling::Lights if other > 0.0 => R::ZERO,
            LightSampling::Lights => R::ONE,
            _ => R::from_f64(weight(density, other)),
        }
    }
}
