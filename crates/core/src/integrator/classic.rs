//! The classic material model: its terms, in the order in which the documented shaders add them.

use glam::DVec3;
use raywright_bvh::{Precision, Real, Vec3Of, Vector};

use super::dielectric::Interface;
use super::{Arrival, Kernel, Next, Shading, Tracer};
use crate::prepare::{Classic, Specular, Transmission};
use crate::sampler::Branch;
use crate::scene::SpecularModel;

impl<P: Precision, K: Kernel> Tracer<'_, P, K> {
    /// Adds the local term of a classic surface to `radiance` and returns the ray to follow.
    #[inline(always)]
    pub(super) fn classic(
        &mut self,
        m: &Classic<P::Real>,
        arrival: Arrival<'_, P>,
        shading: &Shading<P>,
        throughput: Vec3Of<P>,
        segments: u32,
        radiance: &mut Vec3Of<P>,
    ) -> Option<Next<P::Real>> {
        let mut shading = *shading;
        let reflects = m.reflection.is_some() || m.transmission.is_some();
        let alone = reflects && segments == 1 && self.scene.rules.local_only_at_limit;
        let colour = m.colour.at(&shading.point);
        if alone || !m.local.is_zero() {
            let local = self.local(m, &mut shading, colour);
            let weight = if alone { P::Real::ONE } else { m.local.at(&shading.point) };
            *radiance += throughput * local * weight;
        }
        if let Some(emission) = &m.emission {
            *radiance += throughput * emission.at(&shading.point);
        }
        if alone {
            return None;
        }
        if let Some(transmission) = &m.transmission {
            return self.refract(transmission, arrival, &shading, throughput, segments, radiance);
        }
        let reflection = m.reflection.as_ref()?;
        let mut throughput = throughput * reflection.weight.at(&shading.point);
        if reflection.tinted {
            throughput *= colour;
        }
        let mut direction = shading.inputs().r;
        if let Some((amount, rows)) = &reflection.fuzz {
            let p = shading.inputs().p;
            let wave = Vec3Of::<P>::new(rows[0].dot(p).sin(), rows[1].dot(p).sin(), rows[2].dot(p).sin());
            direction = (direction + wave * *amount).normalize();
        }
        if let Some(specular) = m.specular.as_ref().filter(|s| s.on_reflection) {
            let highlight = self.highlights(specular, &shading);
            *radiance += throughput * highlight;
        }
        if segments > 1 {
            self.counters.reflection += 1;
        }
        Some(Next::new(self.leave(&shading, direction, P::Real::ONE), throughput))
    }

    /// colour·(ambient + Σ diffuse·light) + Σ specular + rim. Leaves the first light's direction and shadow in the shading
    /// point, where the expressions of reflection weights find them.
    #[inline(always)]
    fn local(&mut self, m: &Classic<P::Real>, shading: &mut Shading<P>, colour: Vec3Of<P>) -> Vec3Of<P> {
        let scene = self.scene;
        let zero = P::Real::ZERO;
        let n = shading.inputs().n;
        let mut lit = m.ambient;
        let mut gloss = Vec3Of::<P>::ZERO;
        let specular = m.specular.as_ref().filter(|s| !s.on_reflection);
        let before = shading.point.inputs;
        let mut first = None;
        for light in &scene.lights.delta {
            let Some(seen) = light.sample(shading.inputs().p) else { continue };
            shading.point.inputs.l = seen.direction;
            let facing = n.dot(seen.direction).max(zero);
            let highlight = match specular {
                Some(s) if light.specular => lobe::<P>(s, shading, seen.direction),
                _ => zero,
            };
            let mut share = P::Real::ONE;
            if light.dimmed && (facing > zero || highlight > zero || m.shadow.is_some()) {
                if light.shadows && m.asks_what_is_between {
                    let between = self.before(&seen, shading, m.shadow.is_some());
                    shading.point.inputs.occluder_distance = between.distance;
                    shading.point.inputs.shadow = between.share;
                }
                share = m.shadow.as_ref().map_or(shading.inputs().shadow, |s| s.at(&shading.point));
                shading.point.inputs.shadow = share;
            }
            lit += seen.arriving * (m.diffuse.at(&shading.point) * facing * share);
            if let Some(s) = specular
                && highlight > zero
            {
                let tint = if s.lit { seen.arriving } else { Vec3Of::<P>::ONE };
                let share = if s.shadowed { share } else { P::Real::ONE };
                gloss += tint * (highlight * share * s.strength.at(&shading.point));
            }
            first.get_or_insert(shading.point.inputs);
            shading.point.inputs = before;
        }
        if !m.diffuse.is_zero()
            && let Some((drawn, share)) = self.emitter(shading)
        {
            shading.point.inputs.l = drawn.direction;
            shading.point.inputs.shadow = share;
            // Emissive surfaces have a radiance, so here the classic surface answers as Lambert's: its colour over π.
            let facing = n.dot(drawn.direction) * share * P::Real::from_f64(core::f64::consts::FRAC_1_PI);
            lit += drawn.arriving * (m.diffuse.at(&shading.point) * facing);
        }
        shading.point.inputs = first.unwrap_or(before);
        let mut local = colour * lit + gloss;
        if let Some((strength, exponent)) = &m.rim {
            let k = n.dot(shading.inputs().d);
            local += Vec3Of::<P>::splat(strength.at(&shading.point) * Real::powi(P::Real::ONE - k * k, *exponent));
        }
        local
    }

    /// Highlights that belong to the reflection: no shadow ray, as the documented preset's mirror has it.
    fn highlights(&mut self, specular: &Specular<P::Real>, shading: &Shading<P>) -> Vec3Of<P> {
        let mut sum = Vec3Of::<P>::ZERO;
        for light in self.scene.lights.delta.iter().filter(|l| l.specular) {
            let Some(seen) = light.sample(shading.inputs().p) else { continue };
            let mut highlight = lobe::<P>(specular, shading, seen.direction);
            if highlight > P::Real::ZERO && specular.shadowed && light.shadows {
                highlight *= self.before(&seen, shading, false).share;
            }
            let tint = if specular.lit { seen.arriving } else { Vec3Of::<P>::ONE };
            sum += tint * (highlight * specular.strength.at(&shading.point));
        }
        sum
    }

    /// The ray's direction and the shading normal, turned by `side`, with all digits that are known: a normal that is the
    /// geometric one from before it was stored.
    fn directions(&self, (leg, hit): Arrival<'_, P>, shading: &Shading<P>, side: P::Real) -> [DVec3; 2] {
        let (n, out) = (shading.inputs().n, shading.surface.normal);
        let known = || self.scene.geometry.located(&leg.ray, hit).normal.to_f64();
        let n = if n == out {
            known()
        } else if n == -out {
            -known()
        } else {
            n.to_f64()
        };
        [leg.ray.direction.to_f64() + leg.rest.to_f64(), n * side.to_f64()]
    }

    /// Refraction with the reflection of glass: one ray, or both with their Fresnel weights.
    #[inline(always)]
    pub(super) fn refract(
        &mut self,
        t: &Transmission<P::Real>,
        arrival: Arrival<'_, P>,
        shading: &Shading<P>,
        throughput: Vec3Of<P>,
        segments: u32,
        radiance: &mut Vec3Of<P>,
    ) -> Option<Next<P::Real>> {
        if segments <= 1 {
            return None;
        }
        let inputs = shading.inputs();
        // A normal that is not turned to the viewer points away from a ray inside.
        let side = if inputs.d.dot(inputs.n) > P::Real::ZERO { -P::Real::ONE } else { P::Real::ONE };
        let [d, n] = self.directions(arrival, shading, side);
        let eta = if shading.outside { 1.0 / t.ior } else { t.ior };
        let interface = Interface::new(d, n, eta);
        let leaves = |this: &Self, direction: DVec3, side, throughput| {
            let stored = Vec3Of::<P>::from_f64(direction);
            let rest = Vec3Of::<P>::from_f64(direction - stored.to_f64());
            Next { ray: this.leave(shading, stored, side), throughput, rest }
        };
        let reflected = |this: &mut Self, throughput| {
            this.counters.reflection += 1;
            leaves(this, interface.reflected, side, throughput)
        };
        let Some(refracted) = interface.refracted else {
            return Some(reflected(self, throughput * t.reflected_tint));
        };
        let onward = |this: &mut Self, throughput| {
            this.counters.refraction += 1;
            leaves(this, refracted, -side, throughput)
        };
        if let Some(threshold) = t.switch {
            return Some(if P::Real::from_f64(interface.schlick()) > threshold {
                reflected(self, throughput * t.reflected_tint)
            } else {
                onward(self, throughput * t.refracted_tint)
            });
        }
        let fresnel = P::Real::from_f64(interface.fresnel());
        let mirrored = throughput * t.reflected_tint * fresnel;
        if mirrored != Vec3Of::<P>::ZERO {
            let next = reflected(self, mirrored);
            *radiance += self.aside(next, segments - 1, Branch::Reflected);
        }
        let through = throughput * t.refracted_tint * (P::Real::ONE - fresnel);
        (through != Vec3Of::<P>::ZERO).then(|| onward(self, through))
    }
}

/// The shape of a highlight towards a light in unit direction `l`.
#[inline(always)]
fn lobe<P: Precision>(s: &Specular<P::Real>, shading: &Shading<P>, l: Vec3Of<P>) -> P::Real {
    let inputs = shading.inputs();
    let cosine = match s.model {
        SpecularModel::Blinn => inputs.n.dot((l - inputs.d).normalize()),
        SpecularModel::BlinnReflected => inputs.n.dot((l - inputs.r).normalize()),
        SpecularModel::Phong => inputs.r.dot(l),
        SpecularModel::Grazing => inputs.d.dot(inputs.r),
    };
    // Halfway between opposite directions there is none: NaN, and no highlight.
    Real::powi(cosine.max(P::Real::ZERO), s.exponent)
}
