//! What a vertex of a path receives from the light that it asks.

use raywright_bvh::{Hit, Interval, Precision, Ray, Real, Vec3Of, Vector};

use super::super::shadow::Product;
use super::super::{Kernel, Leg, Tracer};
use super::{Walk, weight};
use crate::interaction::Interaction;
use crate::light::{Density, LightId, LightSample, Target};
use crate::material::{Bsdf, Scatters};
use crate::prepare::{Alpha, Material};
use crate::settings::LightSampling;

impl<P: Precision, K: Kernel> Tracer<'_, P, K> {
    /// Light of one light, drawn by chance, that a surface sends back along a path. `gain`: factor on lights without size, whose
    /// unit is not the same to both families of materials.
    #[inline(always)]
    pub(super) fn asked<L: Scatters<P::Real>, const MOST: usize>(
        &mut self,
        walk: &Walk<P::Real>,
        at: &Interaction<P::Real>,
        bsdf: &Bsdf<P::Real, L, MOST>,
        gain: P::Real,
    ) -> Vec3Of<P> {
        let scene = self.scene;
        let (lights, zero) = (&scene.lights, P::Real::ZERO);
        if lights.choice().is_empty() || bsdf.is_delta() {
            return Vector::ZERO;
        }
        let [coarse, fine, u, v] = walk.draws.light;
        let (point, normal, view) = (at.surface.point, bsdf.normal(), -at.direction);
        let lit = if bsdf.lets_through() { Vector::ZERO } else { normal };
        let Some((light, probability)) = lights.choice().draw::<P::Real>(point, lit, [coarse, fine]) else {
            return Vector::ZERO;
        };
        let Some(seen) = lights.sample(light, point, [u, v], probability) else { return Vector::ZERO };
        let facing = normal.dot(seen.direction);
        // Above the shading normal's horizon and the surface's own, or below both of what lets light through.
        let geometric = if at.outside { at.surface.normal } else { -at.surface.normal };
        let through = facing < zero;
        if facing == zero || (geometric.dot(seen.direction) < zero) != through || through && !bsdf.lets_through() {
            return Vector::ZERO;
        }
        let value = || if through { bsdf.eval_either(view, seen.direction) } else { bsdf.eval(view, seen.direction) };
        let (answer, share) = match seen.density {
            Density::Delta => {
                let shines = matches!(light, LightId::Delta(i) if lights.delta[i as usize].specular);
                let answer = if shines {
                    value()
                } else if through {
                    Vector::ZERO
                } else {
                    bsdf.diffuse(view, seen.direction)
                };
                (answer, gain)
            }
            Density::SolidAngle(density) => {
                let combined = |other: P::Real| P::Real::from_f64(weight(density, other.to_f64()));
                match scene.sampling_of(light) {
                    LightSampling::Scattering => return Vector::ZERO,
                    LightSampling::Lights => (value(), P::Real::ONE),
                    LightSampling::Both if through => (value(), combined(bsdf.pdf(view, seen.direction))),
                    LightSampling::Both => {
                        let (answer, other) = bsdf.answer(view, seen.direction);
                        (answer, combined(other))
                    }
                }
            }
        };
        let Some(seen) = self.aimed(light, seen, point) else { return Vector::ZERO };
        let mut sent = seen.arriving * answer * (Real::abs(facing) * share);
        if sent == Vector::ZERO || !sent.is_finite() {
            return Vector::ZERO;
        }
        let varies = matches!(light, LightId::Emitter(i) if lights.emitters.varies(i));
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let media = || if through { self.beyond(&walk.media, at) } else { walk.media };
        if varies || shadows && scene.lets_straight {
            let emitter = match light {
                LightId::Emitter(i) if varies => Some(i),
                _ => None,
            };
            let media = media();
            sent *= self.arrives_straight(walk, media, &seen, (at, emitter));
        } else {
            if scene.absorbs {
                sent *= self.passes_media(&media(), at.distance_to(&seen.target));
            }
            if shadows {
                sent *= self.arrives(&seen, at);
            }
        }
        scene.reached.note(light, sent != Vector::ZERO);
        sent
    }

    /// Share of a light that arrives where it is asked from.
    #[inline]
    fn arrives(&mut self, light: &LightSample<P::Real>, at: &Interaction<P::Real>) -> P::Real {
        // Where the light is where the ray would start, nothing is in between.
        let Some((ray, mut range)) = self.towards(light, at) else { return P::Real::ONE };
        let sizeless = light.density == Density::Delta;
        if matches!(light.target, Target::Infinity) && !sizeless {
            // The scene's limit on shadows is that of its lights, not of its sky.
            range = Interval { max: P::Real::INFINITY, ..range };
        }
        self.counters.shadow += 1;
        let ray = ray.at_time(at.time);
        let mut product = Product::default();
        let blocked = self.scene.geometry.any(
            &ray,
            range,
            &mut |hit| {
                if !self.is_own(&light.target, hit) {
                    product.factor(self.lets_through(&ray, hit, sizeless).to_f64());
                }
                product.opaque
            },
            &mut (),
        );
        if blocked { P::Real::ZERO } else { P::Real::from_f64(product.value()) }
    }

    /// Share of light that passes an occluder straight: where it is absent, and the light of a light without size where it casts no
    /// shadow. Light with a size is found by paths too, which meet everything.
    fn lets_through(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>, sizeless: bool) -> P::Real {
        let record = &self.scene.objects[hit.outermost() as usize];
        if sizeless && !record.casts_shadow {
            return P::Real::ONE;
        }
        match &self.scene.materials[record.material as usize] {
            Material::Physical(m) if m.alpha != Alpha::Opaque => {
                let at = Interaction::of::<P, K>(self.scene, &Leg::of(*ray), hit);
                P::Real::ONE - m.alpha_at(&self.scene.sources.at(&at))
            }
            _ => P::Real::ZERO,
        }
    }
}
