//! Light that arrives straight through surfaces: thin walls, boundaries hidden by a body of greater
//! priority, and partly transparent surfaces. Surfaces are visited in order along the ray, because
//! absorption depends on the media entered before.
//!
//! Used only in scenes with thin walls or priorities.

use raywright_bvh::{Hit, Interval, Real, Vector};

use super::super::{MOST_PASSAGES, PathSegment};
use super::{Media, PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{Density, LightSample, Target};
use crate::material::LayeredBsdf;
use crate::prepare::Material;
use crate::scene::AlphaMode;

impl<R: Real> PathTracer<'_, R> {
    /// Transmittance of a light, in each channel, along a shadow ray that begins in `media`;
    /// absorption is included. Each thin wall takes a segment, as for paths. For an emitter of
    /// varying emission the result is its emission at the ray's hit, evaluated as for paths.
    #[inline(never)]
    pub(super) fn arrives_straight(
        &mut self,
        path: &PathState<R>,
        mut media: Media,
        (light, emitter): (&LightSample<R>, Option<u32>),
        at: &Interaction<R>,
    ) -> R::Vec3 {
        let varied = emitter.filter(|&emitter| self.scene.lights.emitters.varies(emitter));
        // Seen from its own plane, a flat lamp may be hit far from its sampled point, and then
        // again and again.
        let flat = emitter.is_some_and(|emitter| self.scene.lights.emitters.is_flat(emitter));
        let sizeless = light.density == Density::Delta;
        let (mut from, mut share, mut segments) =
            (*at, R::Vec3::ONE, path.traced - path.matched + 1);
        for _ in 0..=MOST_PASSAGES {
            // If the light lies at the ray's origin, nothing blocks it.
            let Some((ray, range)) = self.scene.towards(light, &from) else {
                return if varied.is_some() {
                    Vector::ZERO
                } else {
                    share
                };
            };
            let before = range.max;
            let endless = varied.is_some() || matches!(light.target, Target::Infinity) && !sizeless;
            let range = if endless {
                Interval {
                    max: R::INFINITY,
                    ..range
                }
            } else {
                range
            };
            self.counters.shadow += 1;
            let leg = PathSegment::of(ray.at_time(at.time));
            let Some(hit) = self.scene.geometry.closest(&leg.ray, range, &mut ()) else {
                let left = if varied.is_some() {
                    Vector::ZERO
                } else {
                    share
                };
                return left * self.passes_media(&media, from.distance_to(&light.target));
            };
            let met = Interaction::of(self.scene, &leg, &hit);
            share *= self.passes_media(&media, (met.surface.point - from.surface.point).length());
            let is_own = emitter.is_some()
                && self.scene.lights.emitters.of(met.object, hit.primitive) == emitter;
            let is_there = is_own && (flat || is_at(&met, &light.target));
            let (passes, counts) = if varied.is_some() && (hit.t >= before || is_there) {
                // All surfaces before the light were passed: this hit is the light, or the light is
                // hidden.
                let own = is_own && self.scene.shines(&met);
                let (material, here) = (
                    &self.scene.materials[met.material as usize],
                    self.scene.sources.at(&met),
                );
                // Emission, times alpha.
                return if own {
                    share * (material.emission_at(&here) * material.alpha_at(&here))
                } else {
                    Vector::ZERO
                };
            } else if is_there || self.scene.is_own(&light.target, &hit) {
                return share;
            } else if self.nests()
                && let Some(beyond) = self.hidden(&media, &met)
            {
                media = beyond;
                (Vector::ONE, false)
            } else {
                self.through_wall(path, &leg, &hit, &met, sizeless)
            };
            segments += u32::from(counts);
            share *= passes;
            if segments > self.max_depth || share == Vector::ZERO {
                return Vector::ZERO;
            }
            from = met;
        }
        self.counters.cut_short += 1;
        Vector::ZERO
    }

    /// Straight transmittance of a surface, and whether passing it takes a segment.
    fn through_wall(
        &self,
        path: &PathState<R>,
        leg: &PathSegment<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        sizeless: bool,
    ) -> (R::Vec3, bool) {
        if sizeless && !self.scene.objects[at.object as usize].casts_shadow {
            return (Vector::ONE, false);
        }
        let Material::Physical(m) = &self.scene.materials[at.material as usize] else {
            return (Vector::ZERO, false);
        };
        if m.alpha != AlphaMode::Opaque {
            // The present share of a partly transparent surface blocks all light: paths do not find
            // light straight through it either.
            return (
                Vector::splat(R::ONE - m.alpha_at(&self.scene.sources.at(at))),
                false,
            );
        }
        let Some(place) = m.layered.filter(|_| m.is_wall()) else {
            return (Vector::ZERO, false);
        };
        let mut here = PathState { leg: *leg, ..*path };
        let mut bsdf = LayeredBsdf::new(Vector::ZERO);
        self.layers_at(
            &mut here,
            hit,
            at,
            (m, &self.scene.layers[place as usize]),
            &mut bsdf,
        );
        (bsdf.straight(-at.direction), true)
    }
}

/// Whether a hit coincides with a lamp's sampled point, within rounding.
fn is_at<R: Real>(met: &Interaction<R>, target: &Target<R>) -> bool {
    let Target::Surface(target) = target else {
        return false;
    };
    let apart = (target.point - met.surface.point).length();
    apart <= R::from_f64(64.0) * (met.surface.error + target.error)
}
