//! Whitted shading of a physical material: base colour lit by the lights and by the sky's cosine-weighted average, smooth
//! reflection and refraction traced, rough lobes as local highlights.

use core::f64::consts::PI;

use raywright_bvh::{Precision, Ray, Real, Vec3Of, Vector};

use super::{Arrival, Kernel, Leg, Next, Tracer};
use crate::effects::MIRROR_ROUGHNESS;
use crate::interaction::Interaction;
use crate::prepare::{Alpha, Here, Physical};

/// Least perceptual roughness of a local highlight: below it the lobe of a light without size is a spike.
const LEAST_ROUGHNESS: f64 = 0.03;

impl<R: Real> Physical<R> {
    /// Base colour at a point.
    pub fn base_at(&self, here: &Here<'_, R>) -> R::Vec3 {
        let colour = self.base.tint(here, R::Vec3::ONE);
        let [r, g, b, _] = here.at.colour;
        if self.vertex_colours { colour * R::Vec3::new(r, g, b) } else { colour }
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
            *radiance += self.follow(next, segments - 1, false).radiance;
        }
        *throughput *= alpha;
        None
    }

    /// Adds what a physical surface sends back by itself to `radiance` and returns the ray to follow.
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
        let (one, base) = (P::Real::ONE, m.base_at(&here));
        if let Some(emission) = &m.emission {
            *radiance += emission.tint(&here, throughput);
        }
        if m.unlit {
            *radiance += throughput * base;
            return None;
        }
        let (metallic, roughness) = (m.metallic.number(&here), m.roughness.number(&here));
        let through = if m.transmission.is_some() { one - metallic } else { P::Real::ZERO };
        let tint = m.transmission.map_or(P::Real::ZERO, |t| t.refracted_tint.max_element().min(one));
        let lobes = Lobes {
            n: at.normal,
            view: -at.direction,
            albedo: base * ((one - metallic) * (one - through * tint)),
            f0: Vec3Of::<P>::splat(m.f0) * (one - metallic) + base * metallic,
            roughness,
        };
        let mirror = m.mirrors && roughness <= P::Real::from_f64(MIRROR_ROUGHNESS);
        *radiance += throughput * self.lit(&lobes, at, mirror);
        if let Some(transmission) = m.transmission.as_ref().filter(|_| through > P::Real::ZERO) {
            return self.refract(transmission, arrival, at, throughput * through, segments, radiance);
        }
        let facing = lobes.n.dot(lobes.view).max(P::Real::ZERO);
        let weight = throughput * schlick::<P>(lobes.f0, facing);
        (mirror && segments > 1).then(|| {
            self.counters.reflection += 1;
            Next::new(self.leave(at, at.mirrored(), one), weight)
        })
    }

    /// Light of the lights and of the sky's average, diffused and as rough highlights.
    fn lit(&mut self, lobes: &Lobes<P::Real>, at: &Interaction<P::Real>, mirror: bool) -> Vec3Of<P> {
        let scene = self.scene;
        let zero = P::Real::ZERO;
        let mut sum = Vec3Of::<P>::ZERO;
        for light in &scene.lights {
            let Some(seen) = light.seen_from(at.surface.point) else { continue };
            let facing = lobes.n.dot(seen.direction);
            if facing <= zero {
                continue;
            }
            let share = if light.shadows { self.before(&seen, at, false).share } else { P::Real::ONE };
            if share > zero {
                sum += seen.colour * lobes.respond::<P>(seen.direction, facing, light.specular) * (facing * share);
            }
        }
        if let Some((drawn, share)) = self.emitter(at) {
            let facing = lobes.n.dot(drawn.direction);
            sum += drawn.irradiance * lobes.respond::<P>(drawn.direction, facing, true) * (facing * share);
        }
        if let Some(irradiance) = &scene.irradiance {
            let facing = lobes.n.dot(lobes.view).max(zero);
            let reflected = environment_reflectance::<P>(lobes.f0, lobes.roughness, facing);
            sum += lobes.albedo * (Vec3Of::<P>::ONE - reflected) * irradiance.at(lobes.n);
            if !mirror {
                sum += reflected * irradiance.at(at.mirrored());
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
