//! Surfaces that send each ray one of three ways by chance, as a family of shaders has them ([`crate::scene::Mixture`]).

use core::f64::consts::PI;

use raywright_bvh::{Real, Vector};

use super::scatter::ScatteredRay;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::material::{Bsdf, BsdfSample, Frame, Interface, Lobe, cosine_sample};
use crate::scene::Mixture;

/// Least chance by which the published shader divides.
const LEAST_CHANCE: f64 = 0.001;

/// A surface of a mixture as a ray meets it.
struct MixtureChances {
    /// Chances of being mirrored and of going through; the rest is diffused.
    mirrored: f64,
    through: f64,
    interface: Interface,
}

impl MixtureChances {
    fn new<R: Real>(m: &Mixture, at: &Interaction<R>) -> Self {
        let normal = at.facing_normal();
        let eta = m.ior.map_or(1.0, |ior| if at.outside { 1.0 / ior } else { ior });
        let interface = Interface::new(at.direction.to_f64(), normal.to_f64(), eta);
        let s = m.specular_chance;
        let (mut mirrored, mut through) = (s, m.refraction_chance);
        if s > 0.0 && m.ior.is_some() {
            // Schlick at the angle on the thin side.
            let fresnel = match interface.refracted {
                None => 1.0,
                Some(refracted) => {
                    let cosine = if eta > 1.0 { -refracted.dot(normal.to_f64()) } else { interface.cos_incident };
                    interface.schlick(cosine.max(0.0))
                }
            };
            mirrored = s + (1.0 - s) * fresnel;
            through = if s < 1.0 { through * (1.0 - mirrored) / (1.0 - s) } else { 0.0 };
        }
        if interface.refracted.is_none() {
            through = 0.0;
        }
        Self { mirrored, through, interface }
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Sends a path on from such a surface; whether it goes on.
    #[inline(never)]
    pub(super) fn mixed(&mut self, path: &mut PathState<R>, at: &Interaction<R>, m: &Mixture, albedo: R::Vec3) -> bool {
        let (met, normal) = (MixtureChances::new(m, at), at.facing_normal());
        let diffused = 1.0 - met.mirrored - met.through;
        if !m.published_roulette && diffused > 0.0 {
            let matte = Bsdf::<R>::new(normal).with(Lobe::Lambert { albedo: albedo * R::from_f64(diffused) });
            self.light(path, at, &matte, R::from_f64(PI));
        }
        let [way, u, v, luck] = path.draws.scatter.map(R::from_f32);
        let way = way.to_f64();
        // The normal and an even point of the unit sphere together are drawn by the cosine.
        let h = Frame::<R>::about(normal).to_world(cosine_sample::<R>([u, v]));
        let blend = |smooth: glam::DVec3, about: R::Vec3, roughness: f64| {
            let share = roughness * roughness;
            R::Vec3::from_f64((smooth * (1.0 - share) + about.to_f64() * share).normalize())
        };
        let one = R::ONE;
        let (direction, weight, chance, side) = if way < met.mirrored {
            let colour = R::Vec3::from_f64(m.specular_colour.0.into());
            (blend(met.interface.reflected, h, m.specular_roughness), colour, met.mirrored, one)
        } else if let Some(refracted) = met.interface.refracted.filter(|_| way < met.mirrored + met.through) {
            (blend(refracted, h - normal * (one + one) * h.dot(normal), m.refraction_roughness), Vector::ONE, met.through, -one)
        } else {
            (h, albedo, diffused, one)
        };
        let priced = side == one && way >= met.mirrored && !m.published_roulette;
        let density = if priced { R::from_f64(diffused / PI) * normal.dot(h) } else { R::ZERO };
        let mut drawn = BsdfSample { some: true, direction, weight, density, delta: !priced };
        if m.published_roulette {
            let divided = weight * R::from_f64(1.0 / chance.max(LEAST_CHANCE));
            let largest = (path.throughput * divided).max_element();
            if !largest.is_finite() {
                path.radiance += path.throughput * divided;
                return false;
            }
            if luck >= largest {
                return false;
            }
            drawn.weight = divided * (one / largest);
        }
        let ray = self.scene.spawn(at, direction, if normal == at.normal { side } else { -side });
        let (smooth, through) = (way < met.mirrored, side != one);
        self.go_on(path, at, &drawn, ScatteredRay { ray, rest: Vector::ZERO, lit: normal, smooth, through, straight: false })
    }
}
