//! Whitted shading of a physical material: base colour lit by the lights and by the sky's cosine-weighted average, smooth
//! reflection and refraction traced, rough lobes as local highlights.

use raywright_bvh::{Precision, Ray, Real, Vec3Of, Vector};

use super::{Arrival, Kernel, Leg, Next, Tracer};
use crate::effects::MIRROR_ROUGHNESS;
use crate::interaction::Interaction;
use crate::material::MetallicRoughness;
use crate::prepare::{Alpha, Here, Physical};
use crate::sampler::Branch;

impl<R: Real> Physical<R> {
    /// Base colour at a point.
    #[inline]
    pub fn base_at(&self, here: &Here<'_, R>) -> R::Vec3 {
        let colour = self.base.tint(here, R::Vec3::ONE);
        let [r, g, b, _] = here.at.colour;
        if self.vertex_colours { colour * R::Vec3::new(r, g, b) } else { colour }
    }

    /// What the model's inputs are at a point.
    #[inline(always)]
    fn model_at(&self, here: &Here<'_, R>) -> MetallicRoughness<R> {
        MetallicRoughness {
            base: self.base_at(here),
            metallic: self.metallic.number(here),
            roughness: self.roughness.number(here),
            dielectric: self.f0,
            glass: self.glass,
        }
    }

    /// Coverage at a point: 0 or 1 for a mask.
    pub fn alpha_at(&self, here: &Here<'_, R>) -> R {
        let alpha = || {
            let alpha = self.opacity.number(here);
            if self.vertex_colours { alpha * here.at.colour[3] } else { alpha }
        };
        match self.alpha {
            Alpha::Opaque => R::ONE,
            Alpha::Mask(cutoff) if alpha() < cutoff => R::ZERO,
            Alpha::Mask(_) => R::ONE,
            Alpha::Blend => Real::clamp(alpha(), R::ZERO, R::ONE),
        }
    }
}

impl<P: Precision, K: Kernel> Tracer<'_, P, K> {
    /// Where the surface does not cover what is behind it: the ray that goes on. A half-transparent one adds what is behind
    /// and lowers `throughput` to its own share.
    pub(super) fn cutout(
        &mut self,
        m: &Physical<P::Real>,
        leg: &Leg<P::Real>,
        at: &Interaction<P::Real>,
        throughput: &mut Vec3Of<P>,
        radiance: &mut Vec3Of<P>,
        segments: u32,
    ) -> Option<Ray<P::Real>> {
        if m.alpha == Alpha::Opaque {
            return None;
        }
        let alpha = m.alpha_at(&self.scene.sources.at(at));
        if alpha >= P::Real::ONE {
            return None;
        }
        let behind = self.leave(at, at.direction, -P::Real::ONE);
        if alpha <= P::Real::ZERO {
            return Some(behind);
        }
        if segments > 1 {
            let next = Next { ray: behind, throughput: *throughput * (P::Real::ONE - alpha), rest: leg.rest };
            *radiance += self.aside(next, segments - 1, Branch::Behind);
        }
        *throughput *= alpha;
        None
    }

    /// Adds what a physical surface sends back by itself to `radiance` and returns the ray to follow.
    #[inline(always)]
    pub(super) fn physical(
        &mut self,
        m: &Physical<P::Real>,
        arrival: Arrival<'_, P>,
        at: &Interaction<P::Real>,
        throughput: Vec3Of<P>,
        segments: u32,
        radiance: &mut Vec3Of<P>,
    ) -> Option<Next<P::Real>> {
        let here = self.scene.sources.at(at);
        if let Some(emission) = &m.emission {
            *radiance += emission.tint(&here, throughput);
        }
        if m.unlit {
            *radiance += throughput * m.base_at(&here);
            return None;
        }
        let model = m.model_at(&here);
        let mirror = m.mirrors && model.roughness <= P::Real::from_f64(MIRROR_ROUGHNESS);
        *radiance += throughput * self.lit(&model, at, mirror);
        let through = model.through();
        if let Some(glass) = model.glass.as_ref().filter(|_| through > P::Real::ZERO) {
            return self.refract((glass, None), arrival, at, throughput * through, segments, radiance);
        }
        let weight = throughput * model.mirror().reflectance(-at.direction.dot(at.normal));
        (mirror && segments > 1).then(|| {
            self.counters.reflection += 1;
            Next::new(self.leave(at, at.mirrored(), P::Real::ONE), weight)
        })
    }

    /// Light of the lights and of the sky's average, diffused and as rough highlights.
    fn lit(&mut self, model: &MetallicRoughness<P::Real>, at: &Interaction<P::Real>, mirror: bool) -> Vec3Of<P> {
        let (scene, normal, view) = (self.scene, at.normal, -at.direction);
        let bsdf = model.answer(normal);
        let zero = P::Real::ZERO;
        let mut sum = Vec3Of::<P>::ZERO;
        for light in &scene.lights.delta {
            let Some(seen) = light.sample(at.surface.point) else { continue };
            let facing = normal.dot(seen.direction);
            if facing <= zero {
                continue;
            }
            let share = if light.shadows { self.before(&seen, at, false).share } else { P::Real::ONE };
            if share > zero {
                let wi = seen.direction;
                let answer = if light.specular { bsdf.eval(view, wi) } else { bsdf.diffuse(view, wi) };
                sum += seen.arriving * answer * (facing * share);
            }
        }
        if let Some((drawn, share)) = self.emitter(at) {
            let facing = normal.dot(drawn.direction);
            sum += drawn.arriving * bsdf.eval(view, drawn.direction) * (facing * share);
        }
        if let Some(irradiance) = &scene.irradiance {
            let facing = normal.dot(view).max(zero);
            let reflected = environment_reflectance::<P::Real>(model.f0(), model.roughness, facing);
            sum += model.albedo() * (Vec3Of::<P>::ONE - reflected) * irradiance.at(normal);
            if !mirror {
                sum += reflected * irradiance.at(at.mirrored());
            }
        }
        sum
    }
}

/// Reflectance of a rough surface under uniform light: the analytic fit of "Physically Based Shading on Mobile" (Karis 2014),
/// which lies within 0.02 of the integral.
fn environment_reflectance<R: Real>(f0: R::Vec3, roughness: R, facing: R) -> R::Vec3 {
    let c = R::from_f64;
    let rx = roughness * c(-1.0) + c(1.0);
    let ry = roughness * c(-0.0275) + c(0.0425);
    let rz = roughness * c(-0.572) + c(1.04);
    let rw = roughness * c(0.022) + c(-0.04);
    // 2^(−9.28·cosine)
    let decay = (facing * c(-9.28 * core::f64::consts::LN_2)).exp();
    let a = (rx * rx).min(decay) * rx + ry;
    let (scale, offset) = (a * c(-1.04) + rz, a * c(1.04) + rw);
    (f0 * scale + R::Vec3::splat(offset)).max(R::Vec3::ZERO).min(R::Vec3::ONE)
}
