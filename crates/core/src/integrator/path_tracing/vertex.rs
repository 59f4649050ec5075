//! A vertex of any surface, by itself: what the surface gives off, what it sends back of a light, and where the path goes on.

use core::f64::consts::PI;

use raywright_bvh::{Hit, Real, Vector};

use super::super::spawn::stored;
use super::respond::respond;
use super::scatter::ScatteredRay;
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
            Material::Physical(m) if m.unlit => {
                let shown = path.throughput * m.base_at(&here);
                path.radiance += shown;
                self.see(path.traced == 1, shown);
                false
            }
            _ if self.is_at_limit(path) => false,
            Material::Classic(m) => {
                if let Some(mixture) = &m.mixture {
                    return self.mixed(path, at, mixture, m.colour.colour(&here));
                }
                let mut glass = m.transmission.as_ref().map(|transmission| transmission.glass);
                if let Some(glass) = glass.as_mut().filter(|_| self.nests()) {
                    glass.ior = self.relative_index(path, at, &here);
                }
                let normal = if glass.is_some() { at.facing_normal() } else { at.normal };
                let bsdf = classic::lobes((m, glass.as_ref()), &here, at, normal);
                // A light without size says how bright it makes a white classic surface that faces it, not what falls on it.
                self.shade(path, hit, at, &bsdf, (glass.as_ref(), R::from_f64(PI)))
            }
            Material::Physical(m) => {
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

    /// Asks a light, adds what is sent back of it, and sends the path on; whether it goes on. `glass`: what bends it, where something does;
    /// `gain`: factor on lights without size.
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
        if !drawn.some {
            return false;
        }
        let geometric = if at.outside { at.surface.normal } else { -at.surface.normal };
        let through = drawn.direction.dot(normal) < R::ZERO;
        // A shading normal must not take a reflection below the surface, nor what goes through it above.
        if (geometric.dot(drawn.direction) < R::ZERO) != through {
            return false;
        }
        // A coat may mirror about a normal of its own.
        let (direction, rest) = match glass.filter(|_| drawn.delta && (through || !L::COATED)) {
            // With the digits that storing takes from the direction.
            Some(glass) => {
                let interface = self.scene.interface(&path.leg, hit, at, glass);
                let exact = if through { interface.refracted } else { Some(interface.reflected) };
                exact.map_or((drawn.direction, Vector::ZERO), stored::<R>)
            }
            None => (drawn.direction, Vector::ZERO),
        };
        // Starts of rays count from the normal that the object has.
        let side = if through == (normal == at.normal) { -R::ONE } else { R::ONE };
        let material = &self.scene.materials[at.material as usize];
        // Of delta lobes only walls send light on without an index, straight where all of them is there.
        let straight = L::COATED && drawn.delta && through && material.is_wall() && material.covers();
        let lit = if bsdf.lets_through() { Vector::ZERO } else { normal };
        let ray = self.scene.spawn(at, direction, side);
        self.go_on(path, at, &drawn, ScatteredRay { ray, rest, lit, smooth: drawn.delta, through, straight })
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
