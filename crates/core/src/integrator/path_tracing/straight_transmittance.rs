//! Light that arrives straight through surfaces: through thin walls, through boundaries hidden by a
//! body of greater priority, and through partly transparent surfaces. Surfaces are visited in order
//! along the shadow ray, because absorption depends on the media entered before.
//!
//! Used only in scenes with thin walls or priorities of media, and for lamps of varying emission.

use raywright_bvh::{Hit, Interval, Real, Vector};

use super::super::{MOST_PASSAGES, PathSegment};
use super::{MediumStack, PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{LightDensity, LightSample, ShadowRayTarget};
use crate::material::LayeredBsdf;
use crate::prepare::PreparedMaterial;
use crate::scene::AlphaMode;

impl<R: Real> PathTracer<'_, R> {
    /// Returns the transmittance of each channel along the shadow ray to a light sample, absorption
    /// included. For an emitter of varying emission, returns the transmittance times the emission
    /// at the hit of the shadow ray. `media` are the media around the ray's origin. Each thin wall
    /// counts as a segment, as it does for paths.
    #[inline(never)]
    pub(super) fn straight_transmittance(
        &mut self,
        path: &PathState<R>,
        mut media: MediumStack,
        (light, emitter): (&LightSample<R>, Option<u32>),
        surface_interaction: &Interaction<R>,
    ) -> R::Vec3 {
        let varied =
            emitter.filter(|&emitter| self.scene.lights.emitters.has_varying_emission(emitter));
        // Seen from nearly its own plane, a flat lamp may be hit far from its sampled point, again
        // and again.
        let flat = emitter.is_some_and(|emitter| self.scene.lights.emitters.is_flat(emitter));
        let sizeless = light.density == LightDensity::Delta;
        let (mut from, mut share, mut segments) = (
            *surface_interaction,
            R::Vec3::ONE,
            path.segments_traced - path.matched_segments + 1,
        );
        for _ in 0..=MOST_PASSAGES {
            // If the light lies at the ray's origin, nothing blocks it.
            let Some((ray, range)) = self.scene.shadow_ray(light, &from) else {
                return if varied.is_some() {
                    Vector::ZERO
                } else {
                    share
                };
            };
            let before = range.max;
            let endless =
                varied.is_some() || matches!(light.target, ShadowRayTarget::Infinity) && !sizeless;
            let range = if endless {
                Interval {
                    max: R::INFINITY,
                    ..range
                }
            } else {
                range
            };
            self.counters.shadow += 1;
            let segment = PathSegment::from_ray(ray.with_time(surface_interaction.time));
            let Some(hit) = self.scene.geometry.closest(&segment.ray, range, &mut ()) else {
                let transmitted = if varied.is_some() {
                    Vector::ZERO
                } else {
                    share
                };
                let distance = from.distance_to_target(&light.target);
                let shadow_segment = (from.surface.point, light.direction, distance);
                return transmitted * self.media_transmittance(path, &media, shadow_segment);
            };
            let mut interaction =
                Interaction::from_hit_without_normal_map(self.scene, &segment, &hit);
            // Nothing that a common surface emits or lets through depends on its normal map.
            let material = &self.scene.materials[interaction.material as usize];
            if !matches!(material, PreparedMaterial::Physical(m) if m.is_common) {
                interaction.apply_normal_map(self.scene, &segment, &hit);
            }
            let distance = (interaction.surface.point - from.surface.point).length();
            let shadow_segment = (from.surface.point, light.direction, distance);
            share *= self.media_transmittance(path, &media, shadow_segment);
            let is_own = emitter.is_some()
                && self
                    .scene
                    .lights
                    .emitters
                    .emitter_index_of(interaction.object, hit.primitive)
                    == emitter;
            let is_target = is_own && (flat || is_at_light_sample(&interaction, &light.target));
            let (transmittance, counts) = if varied.is_some() && (hit.t >= before || is_target) {
                // All surfaces before the light were passed: this hit is the light itself, or a
                // surface that hides it.
                let own = is_own && self.scene.is_emissive_side(&interaction);
                let context = self.scene.texture_tables.shading_context(&interaction);
                // Emission, times alpha.
                return if own {
                    share
                        * (self.emission_at_hit(&segment, &hit, &interaction)
                            * material.alpha_at(&context))
                } else {
                    Vector::ZERO
                };
            } else if is_target || self.scene.is_target_emitter(&light.target, &hit) {
                return share;
            } else if self.has_nested_dielectrics()
                && let Some(beyond) = self.media_behind_hidden_boundary(&media, &interaction)
            {
                media = beyond;
                (Vector::ONE, false)
            } else {
                if self.scene.materials[interaction.material as usize].is_open() {
                    media = self.media_beyond_surface(&media, &interaction);
                }
                self.surface_transmittance(path, &segment, &hit, &interaction, sizeless)
            };
            segments += u32::from(counts);
            share *= transmittance;
            if segments > self.max_depth || share == Vector::ZERO {
                return Vector::ZERO;
            }
            from = interaction;
        }
        self.counters.cut_short += 1;
        Vector::ZERO
    }

    /// Returns the transmittance of a surface for a ray that keeps its direction, and whether
    /// passing the surface counts as a segment.
    fn surface_transmittance(
        &self,
        path: &PathState<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
        sizeless: bool,
    ) -> (R::Vec3, bool) {
        if sizeless && !self.scene.objects[interaction.object as usize].casts_shadow {
            return (Vector::ONE, false);
        }
        let PreparedMaterial::Physical(m) = &self.scene.materials[interaction.material as usize]
        else {
            return (Vector::ZERO, false);
        };
        if m.alpha != AlphaMode::Opaque {
            // The present share of a partly transparent surface blocks all light: paths do not find
            // light straight through it either.
            return (
                Vector::splat(
                    R::ONE - m.alpha_at(&self.scene.texture_tables.shading_context(interaction)),
                ),
                false,
            );
        }
        let Some(index) = m.layers.filter(|_| m.is_thin()) else {
            return (Vector::ZERO, false);
        };
        let mut path_at_hit = PathState {
            segment: *segment,
            ..*path
        };
        let mut bsdf = LayeredBsdf::new(Vector::ZERO);
        self.build_layered_bsdf(
            &mut path_at_hit,
            hit,
            interaction,
            (m, &self.scene.layers[index as usize]),
            &mut bsdf,
        );
        (bsdf.straight(-interaction.direction), true)
    }
}

/// Whether a hit coincides with the sampled point of a lamp, within rounding.
fn is_at_light_sample<R: Real>(interaction: &Interaction<R>, target: &ShadowRayTarget<R>) -> bool {
    let ShadowRayTarget::Surface(target) = target else {
        return false;
    };
    let apart = (target.point - interaction.surface.point).length();
    apart <= R::from_f64(64.0) * (interaction.surface.error + target.error)
}
