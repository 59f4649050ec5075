//! Light found by BSDF sampling: emission of hit surfaces, and radiance of the sky. Weights of
//! multiple importance sampling are included.

use raywright_bvh::{Hit, Real, Vector};

use super::light::power_heuristic;
use super::{LightKinds, MIRROR_DENSITY, PathState, PathTracer, PreviousVertex};
use crate::counters::add_power;
use crate::interaction::Interaction;
use crate::light::{LightId, ShadowRayTarget, SkySample};
use crate::settings::LightSampling;

impl<R: Real> PathTracer<'_, R> {
    /// Adds the emission of a hit surface, times its weight of multiple importance sampling, to the
    /// path's radiance.
    #[inline]
    pub(super) fn add_emission(
        &mut self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
        emission: R::Vec3,
    ) {
        // Partly emissive surfaces are mostly dark, and zero emission needs no weight.
        if emission == Vector::ZERO || !self.scene.is_emissive_side(interaction) {
            return;
        }
        let share = match self
            .scene
            .lights
            .emitters
            .emitter_index_of(interaction.object, hit.primitive)
        {
            Some(emitter) => {
                let light = LightId::Emitter(emitter);
                self.usage.count_ray(light, true);
                let (lights, from, direction) = (
                    &self.scene.lights,
                    path.previous.from,
                    path.segment.ray.direction,
                );
                self.bsdf_sampling_mis_weight(path, light, |probability| {
                    lights.density(
                        light,
                        from,
                        direction,
                        &ShadowRayTarget::Surface(interaction.surface),
                        probability,
                    )
                })
            }
            None => R::ONE,
        };
        self.counters.found += u64::from(self.hits_lights_by_chance(path));
        let emitted = path.throughput * emission * share;
        self.count_narrow_hit(path, emitted);
        path.radiance += emitted;
        self.add_directly_visible_radiance(path.segments_traced == 1, emitted);
    }

    /// Adds `radiance` to the emission seen directly by the camera, if layers need it and `camera`
    /// is set. `camera`: whether the radiance arrives along the camera ray.
    #[inline(always)]
    pub(super) fn add_directly_visible_radiance(&mut self, camera: bool, radiance: R::Vec3) {
        if camera && self.keeps_first {
            self.direct += radiance;
        }
    }

    /// Ends the path of a camera ray on a wireframe edge, with the colour of the edge. The stored
    /// albedo of the pixel is black, to keep the edge in denoising.
    pub(super) fn end_on_wireframe_edge(&mut self, path: &mut PathState<R>, edge: R::Vec3) {
        let shown = path.throughput * edge;
        path.radiance += shown;
        self.add_directly_visible_radiance(true, shown);
        self.first_hit
            .iter_mut()
            .for_each(|first| first.albedo = [0.0; 3]);
    }

    /// Returns the sky's radiance along an escaped ray, times its weight of multiple importance
    /// sampling.
    #[inline(always)]
    pub(super) fn weighted_sky_radiance(
        &mut self,
        path: &PathState<R>,
        sky_sample: &SkySample<R>,
    ) -> R::Vec3 {
        let direction = path.segment.ray.direction;
        let lights = &self.scene.lights;
        if self.hits_lights_by_chance(path)
            && let Some(sampler) = lights.sky_sampler()
            && let Some(density) = sampler.bright_region_density()
        {
            self.counters.unaided += 1;
            self.counters.found +=
                u64::from(sampler.density::<R>(direction, sky_sample.image_coordinates) >= density);
        }
        let radiance = sky_sample.radiance
            * self.bsdf_sampling_mis_weight(path, LightId::Sky, |probability| {
                let receiver = (path.previous.from, path.previous.normal);
                lights.sky_density(
                    receiver,
                    direction,
                    sky_sample.image_coordinates,
                    probability,
                )
            });
        self.count_narrow_hit(path, path.throughput * radiance);
        radiance
    }

    /// Counts the light that a path found by chance alone.
    #[inline(always)]
    fn count_narrow_hit(&mut self, path: &PathState<R>, radiance: R::Vec3) {
        if path.is_narrow {
            let found = radiance.to_f64().max_element();
            add_power(&mut self.counters.narrow_found, found);
        }
    }

    /// Whether the path was scattered diffusely before, and its last direction came from a mirror.
    /// No light sample stands in for a light that such a path hits.
    #[inline(always)]
    pub(super) fn hits_lights_by_chance(&self, path: &PathState<R>) -> bool {
        path.min_pdf < MIRROR_DENSITY && path.previous.density >= MIRROR_DENSITY
    }

    /// Returns the weight of BSDF sampling for a light that the path hit. `drawn` maps the
    /// probability of choosing that light to the density with which light sampling samples the hit
    /// point.
    #[inline(always)]
    fn bsdf_sampling_mis_weight(
        &self,
        path: &PathState<R>,
        light: LightId,
        drawn: impl FnOnce(f64) -> f64,
    ) -> R {
        let PreviousVertex {
            from,
            normal,
            density,
            lights: kinds,
        } = path.previous;
        if density == f64::INFINITY || kinds == LightKinds::None {
            return R::ONE;
        }
        let lights = &self.scene.lights;
        let sampling = self.scene.light_sampling_strategy(light);
        if sampling == LightSampling::Scattering {
            return R::ONE;
        }
        let probability = if kinds == LightKinds::All {
            lights.light_sampler().probability::<R>(light, from, normal)
        } else {
            lights.probability_in_medium(light, from)
        };
        let other = if probability > 0.0 {
            drawn(probability)
        } else {
            0.0
        };
        match sampling {
            LightSampling::Lights if other > 0.0 => R::ZERO,
            LightSampling::Lights => R::ONE,
            _ => R::from_f64(power_heuristic(density, other)),
        }
    }
}
