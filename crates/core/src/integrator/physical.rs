//! Whitted shading of a physical material: base colour lit by the lights and by the sky's cosine-weighted average, smooth
//! reflection and refraction traced, rough lobes as local highlights.

use core::f64::consts::PI;

use raywright_bvh::{Precision, Ray, Real, Vec3Of, Vector};

use super::{Arrival, Kernel, Leg, Next, Shading, Tracer};
use crate::effects::MIRROR_ROUGHNESS;
use crate::prepare::{Alpha, Physical};
use crate::sampler::Branch;

/// Least perceptual roughness of a local highlight: below it the lobe of a light without size is a spike.
const LEAST_ROUGHNESS: f64 = 0.03;

impl<R: Real> Physical<R> {
    /// Base colour and alpha at a point.
    fn base_at<P: Precision<Real = R>>(&self, shading: &Shading<P>) -> (R::Vec3, R) {
        let mut colour = self.base.at(&shading.point);
        let mut alpha = self.opacity;
        if let Some(texture) = &self.base_texture {
            let [r, g, b, a] = texture.texel(&shading.point);
            colour *= R::Vec3::new(r, g, b);
            alpha *= a;
        }
        if self.vertex_colours {
            let [r, g, b, a] = shading.vertex_colour;
            colour *= R::Vec3::new(r, g, b);
            alpha *= a;
        }
        (colour, alpha)
    }

    /// Base colour at a point.
    pub fn albedo_at<P: Precision<Real = R>>(&self, shading: &Shading<P>) -> R::Vec3 {
        self.base_at(shading).0
    }

    /// Coverage at a point: 0 or 1 for a mask.
    pub fn alpha_at<P: Precision<Real = R>>(&self, shading: &Shading<P>) -> R {
        let alpha = || self.base_at(shading).1;
        match self.alpha {
            Alpha::Opaque => R::ONE,
            Alpha::Mask(cutoff) if alpha() < cutoff => R::ZERO,
            Alpha::Mask(_) => R::ONE,
            Alpha::Blend => Real::clamp(alpha(), R::ZERO, R::ONE),
        }
    }
}

/// What the local terms share.
struct Lobes<R: Real> {
    n: R::Vec3,
    view: R::Vec3,
    albedo: R::Vec3,
    f0: R::Vec3,
    roughness: R,
}

impl<P: Precision, K: Kernel> Tracer<'_, P, K> {
    /// Where the surface does not cover what is behind it: the ray that goes on. A half-transparent one adds what is behind
    /// and lowers `throughput` to its own share.
    pub(super) fn cutout(
        &mut self,
        m: &Physical<P::Real>,
        leg: &Leg<P::Real>,
        shading: &Shading<P>,
        throughput: &mut Vec3Of<P>,
        radiance: &mut Vec3Of<P>,
        segments: u32,
    ) -> Option<Ray<P::Real>> {
        if m.alpha == Alpha::Opaque {
            return None;
        }
        let alpha = m.alpha_at(shading);
        if alpha >= P::Real::ONE {
            return None;
        }
        let behind = self.leave(shading, shading.inputs().d, -P::Real::ONE);
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
    pub(super) fn physical(
        &mut self,
        m: &Physical<P::Real>,
        arrival: Arrival<'_, P>,
        shading: &Shading<P>,
        throughput: Vec3Of<P>,
        segments: u32,
        radiance: &mut Vec3Of<P>,
    ) -> Option<Next<P::Real>> {
        let (one, base) = (P::Real::ONE, m.base_at(shading).0);
        if let Some((factor, texture)) = &m.emission {
            let texel = texture.as_ref().map_or(Vec3Of::<P>::ONE, |t| t.colour(&shading.point));
            *radiance += throughput * *factor * texel;
        }
        if m.unlit {
            *radiance += throughput * base;
            return None;
        }
        let (mut metallic, mut roughness) = (m.metallic, m.roughness);
        if let Some(texture) = &m.metallic_roughness {
            let [_, g, b, _] = texture.texel(&shading.point);
            (metallic, roughness) = (metallic * b, roughness * g);
        }
        let through = if m.transmission.is_some() { one - metallic } else { P::Real::ZERO };
        let tint = m.transmission.map_or(P::Real::ZERO, |t| t.refracted_tint.max_element().min(one));
        let lobes = Lobes {
            n: shading.inputs().n,
            view: -shading.inputs().d,
            albedo: base * ((one - metallic) * (one - through * tint)),
            f0: Vec3Of::<P>::splat(m.f0) * (one - metallic) + base * metallic,
            roughness,
        };
        let mirror = m.mirrors && roughness <= P::Real::from_f64(MIRROR_ROUGHNESS);
        *radiance += throughput * self.lit(&lobes, shading, mirror);
        if let Some(transmission) = m.transmission.as_ref().filter(|_| through > P::Real::ZERO) {
            return self.refract(transmission, arrival, shading, throughput * through, segments, radiance);
        }
        let facing = lobes.n.dot(lobes.view).max(P::Real::ZERO);
        let weight = throughput * schlick::<P>(lobes.f0, facing);
        (mirror && segments > 1).then(|| {
            self.counters.reflection += 1;
            Next::new(self.leave(shading, shading.inputs().r, one), weight)
        })
    }

    /// Light of the lights and of the sky's average, diffused and as rough highlights.
    fn lit(&mut self, lobes: &Lobes<P::Real>, shading: &Shading<P>, mirror: bool) -> Vec3Of<P> {
        let scene = self.scene;
        let zero = P::Real::ZERO;
        let mut sum = Vec3Of::<P>::ZERO;
        for light in &scene.lights.delta {
            let Some(seen) = light.sample(shading.inputs().p) else { continue };
            let facing = lobes.n.dot(seen.direction);
            if facing <= zero {
                continue;
            }
            let share = if light.shadows { self.before(&seen, shading, false).share } else { P::Real::ONE };
            if share > zero {
                sum += seen.arriving * lobes.respond::<P>(seen.direction, facing, light.specular) * (facing * share);
            }
        }
        if let Some((drawn, share)) = self.emitter(shading) {
            let facing = lobes.n.dot(drawn.direction);
            sum += drawn.arriving * lobes.respond::<P>(drawn.direction, facing, true) * (facing * share);
        }
        if let Some(irradiance) = &scene.irradiance {
            let facing = lobes.n.dot(lobes.view).max(zero);
            let reflected = environment_reflectance::<P>(lobes.f0, lobes.roughness, facing);
            sum += lobes.albedo * (Vec3Of::<P>::ONE - reflected) * irradiance.at(lobes.n);
            if !mirror {
                sum += reflected * irradiance.at(shading.inputs().r);
            }
        }
        sum
    }
}

impl<R: Real> Lobes<R> {
    /// Bidirectional reflectance towards a light: Lambert below, GGX with height-correlated shadowing above ("Microfacet
    /// Models for Refraction through Rough Surfaces", Walter et al. 2007; "Understanding the Masking-Shadowing Function",
    /// Heitz 2014). D in the form (hx² + hy²)/α² + hz², which keeps its digits at low roughness.
    fn respond<P: Precision<Real = R>>(&self, l: R::Vec3, facing: R, specular: bool) -> R::Vec3 {
        let pi = R::from_f64(PI);
        let h = (l + self.view).normalize();
        let fresnel = schlick::<P>(self.f0, h.dot(l).max(R::ZERO));
        let diffuse = self.albedo * (R::Vec3::ONE - fresnel) / pi;
        let seen = self.n.dot(self.view);
        if !specular || seen <= R::ZERO {
            return diffuse;
        }
        let roughness = self.roughness.max(R::from_f64(LEAST_ROUGHNESS));
        let a2 = Real::powi(roughness, 4);
        let across = self.n.cross(h);
        let hz = self.n.dot(h);
        let slope = across.dot(across) / a2 + hz * hz;
        let d = R::ONE / (pi * a2 * slope * slope);
        let smith = |c: R| (a2 + (R::ONE - a2) * c * c).sqrt();
        let visibility = R::from_f64(0.5) / (facing * smith(seen) + seen * smith(facing));
        diffuse + fresnel * (d * visibility)
    }
}

/// "An Inexpensive BRDF Model for Physically-based Rendering" (Schlick 1994).
fn schlick<P: Precision>(f0: Vec3Of<P>, cosine: P::Real) -> Vec3Of<P> {
    f0 + (Vec3Of::<P>::ONE - f0) * Real::powi(P::Real::ONE - cosine.min(P::Real::ONE), 5)
}

/// Reflectance of a rough surface under uniform light: the analytic fit of "Physically Based Shading on Mobile" (Karis 2014),
/// which lies within 0.02 of the integral.
fn environment_reflectance<P: Precision>(f0: Vec3Of<P>, roughness: P::Real, facing: P::Real) -> Vec3Of<P> {
    let c = P::Real::from_f64;
    let rx = roughness * c(-1.0) + c(1.0);
    let ry = roughness * c(-0.0275) + c(0.0425);
    let rz = roughness * c(-0.572) + c(1.04);
    let rw = roughness * c(0.022) + c(-0.04);
    // 2^(−9.28·cosine)
    let decay = (facing * c(-9.28 * core::f64::consts::LN_2)).exp();
    let a = (rx * rx).min(decay) * rx + ry;
    let (scale, offset) = (a * c(-1.04) + rz, a * c(1.04) + rw);
    (f0 * scale + Vec3Of::<P>::splat(offset)).max(Vec3Of::<P>::ZERO).min(Vec3Of::<P>::ONE)
}
