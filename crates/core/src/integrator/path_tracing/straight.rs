//! What arrives of a light over surfaces that let it straight through: thin walls, boundaries that
//! a body of greater priority hides, and what is absent in part. They are met in the order of the
//! way, because what a metre of it absorbs depends on what was passed before.
//!
//! Asked only in scenes that have such walls or priorities.

use raywright_bvh::{Hit, Interval, Real, Vector};

use super::super::{MOST_PASSAGES, PathSegment};
use super::{Media, PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{Density, LightSample, Target};
use crate::material::LayeredBsdf;
use crate::prepare::Material;
use crate::scene::AlphaMode;

impl<R: Real> PathTracer<'_, R> {
    /// Share of a light that arrives where it is asked from, on a way that begins in these bodies,
    /// in each channel: what the way absorbs is taken too. Each thin wall takes a segment, as it
    /// does from paths. Of an emitter that varies, what is given off where the way meets it: there
    /// it is read, as paths read it.
    #[inline(never)]
    pub(super) fn arrives_straight(
        &mut self,
        path: &PathState<R>,
        mut media: Media,
        (light, emitter): (&LightSample<R>, Option<u32>),
        at: &Interaction<R>,
    ) -> R::Vec3 {
        let varied = emitter.filter(|&emitter| self.scene.lights.emitters.varies(emitter));
        // From a place of its own plane a flat lamp may be met far from where it was drawn, and
        // from there again and again.
        let flat = emitter.is_some_and(|emitter| self.scene.lights.emitters.is_flat(emitter));
        let sizeless = light.density == Density::Delta;
        let (mut from, mut share, mut segments) =
            (*at, R::Vec3::ONE, path.traced - path.matched + 1);
        for _ in 0..=MOST_PASSAGES {
            // Where the light is where the ray would start, nothing is in between.
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
                // What lies before it was passed: it is met, or nothing of it.
                let own = is_own && self.scene.shines(&met);
                let (material, here) = (
                    &self.scene.materials[met.material as usize],
                    self.scene.sources.at(&met),
                );
                // What a surface gives off, in its share that is there.
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

    /// Share that a surface lets straight through, and whether a path that passes there has one
    /// more segment.
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
            // What covers a part lets nothing through: paths do not find light straight through it
            // either.
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

/// Whether a surface is where a lamp's point was drawn, as far as rounding tells.
fn is_at<R: Real>(met: &Interaction<R>, target: &Target<R>) -> bool {
    let Target::Surface(target) = target else {
        return false;
    };
    let apart = (target.point - met.surface.point).length();
    apart <= R::from_f64(64.0) * (met.surface.error + target.error)
}
