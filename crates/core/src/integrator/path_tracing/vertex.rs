//! A vertex of any surface, by itself: what the surface gives off, what it sends back of a light, and where the path goes on.

use core::f64::consts::PI;

use raywright_bvh::{Hit, Real, Vector};

use super::respond::respond;
use super::scatter::Scattering;
use super::{PathState, PathTracer, classic};
use crate::interaction::Interaction;
use crate::light::{LightId, Target};
use crate::material::{Bsdf, Frame, Glass, LobeFamily};
use crate::prepare::Material;

impl<R: Real> PathTracer<'_, R> {
    /// Adds what a surface sends back along a path; whether the path goes on.
    #[inline(always)]
    pub(super) fn vertex(&mut self, path: &mut PathState<R>, hit: &Hit<R>, at: &Interaction<R>) -> bool {
        let scene = self.scene;
        let here = scene.sources.at(at);
        let material = &scene.materials[at.material as usize];
        if material.glows() {
            self.emits(path, hit, at, material.emission_at(&here));
        }
        match material {
            Material::Classic(m) => {
                if path.traced >= self.max_depth {
                    return false;
                }
                if let Some(mixture) = &m.mixture {
                    return self.mixed(path, at, mixture, m.colour.colour(&here));
                }
                let own;
                let m = if self.nests() && m.transmission.is_some() {
                    own = self.immersed_classic(path, at, &here, m);
                    &own
                } else {
                    m
                };
                let normal = if m.transmission.is_some() { at.facing_normal() } else { at.normal };
                let bsdf = classic::lobes(m, &here, at, normal);
                let glass = m.transmission.as_ref().map(|transmission| transmission.glass);
                // A light without size says how bright it makes a white classic surface that faces it, not what falls on it.
                self.shade(path, hit, at, &bsdf, (glass.as_ref(), R::from_f64(PI)))
            }
            Material::Physical(m) => {
                if m.unlit {
                    let shown = path.throughput * m.base_at(&here);
                    path.radiance += shown;
                    self.see(path.traced == 1, shown);
                    return false;
                }
                if path.traced >= self.max_depth {
                    return false;
                }
                if let Some(place) = m.layered {
                    return self.layered(path, hit, at, (m, &scene.layers[place as usize]));
                }
                let mut model = m.model_at(&here);
                if self.nests() {
                    self.immersed(path, at, &here, &mut model);
                }
                let normal = if model.glass.is_some() { at.facing_normal() } else { at.normal };
                let bsdf = model.transport(normal, -at.direction, at.outside, scene.compensates);
                self.shade(path, hit, at, &bsdf, (model.glass.as_ref(), R::ONE))
            }
            Material::Unused => false,
        }
    }

    /// Adds what a surface gives off, in the share that a ray has in finding it.
    #[inline]
    pub(super) fn emits(&mut self, path: &mut PathState<R>, hit: &Hit<R>, at: &Interaction<R>, emission: R::Vec3) {
        // What glows in parts is dark mostly; no share of nothing is worth asking for.
        if emission == Vector::ZERO || !self.scene.shines(at) {
            return;
        }
        let share = match self.scene.lights.emitters.of(at.object, hit.primitive) {
            Some(emitter) => {
                let light = LightId::Emitter(emitter);
                self.usage.count(light, true);
                let (lights, from, direction) = (&self.scene.lights, path.previous.from, path.leg.ray.direction);
                self.found(path, light, |probability| {
                    lights.density(light, from, direction, &Target::Surface(at.surface), probability)
                })
            }
            None => R::ONE,
        };
        self.counters.found += u64::from(self.is_unaided(path));
        let emitted = path.throughput * emission * share;
        path.radiance += emitted;
        self.see(path.traced == 1, emitted);
    }

    /// Asks a light, adds what is sent back of it, and sends the path on; whether it goes on. `gain`: factor on lights without size.
    #[inline(always)]
    pub(super) fn shade<L: LobeFamily<R>, const MOST: usize>(
        &mut self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        bsdf: &Bsdf<R, L, MOST>,
        (glass, gain): (Option<&Glass<R>>, R),
    ) -> bool {
        self.light(path, at, bsdf, gain);
        let [lobe, u, v, _] = path.draws.scatter.map(R::from_f32);
        let normal = bsdf.normal();
        let drawn = bsdf.sample(&Frame::about(normal), -at.direction, [lobe, u, v]);
        // A coat may mirror about a normal of its own.
        let through = drawn.direction.dot(normal) < R::ZERO;
        let bent = glass.filter(|_| drawn.delta && (through || !L::COATED));
        let lit = if bsdf.lets_through() { Vector::ZERO } else { normal };
        self.scatter(path, hit, at, &drawn, Scattering { normal, lit, bent, coated: L::COATED })
    }

    /// Adds what a surface sends back of a light, drawn by chance.
    #[inline(always)]
    pub(super) fn light<L: LobeFamily<R>, const MOST: usize>(
        &mut self,
        path: &mut PathState<R>,
        at: &Interaction<R>,
        bsdf: &Bsdf<R, L, MOST>,
        gain: R,
    ) {
        if !bsdf.is_delta()
            && let Some(query) = self.query(path, at, bsdf.normal(), bsdf.lets_through())
        {
            let response = respond(bsdf, -at.direction, (query.seen.direction, query.strategy.is_dull()));
            self.add_direct(path, at, &query, (&response, gain));
        }
    }
}
