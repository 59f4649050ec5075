//! A vertex of a path: what the surface gives off, what it sends back of a light, and where the path goes on.

use core::f64::consts::PI;

use raywright_bvh::{Hit, Real, Vector};

use super::{Onward, PathState, PathTracer, classic};
use crate::interaction::Interaction;
use crate::light::{LightId, Target};
use crate::material::{Bsdf, Frame, Glass, Interface, Sampled, Scatters};
use crate::prepare::{Alpha, Material};

/// How a path leaves a vertex.
pub(super) struct Leaves<'a, R: Real> {
    /// The normal of its lobes.
    pub normal: R::Vec3,
    /// Normal of the side that lights were asked for; zero for both.
    pub lit: R::Vec3,
    /// A number in [0, 1): below what the path counts, it goes on.
    pub luck: R,
    /// The boundary of glass that bends it; none: it goes as drawn.
    pub bent: Option<&'a Glass<R>>,
    /// Whether its lobes may have normals of their own.
    pub coated: bool,
}

impl<R: Real> PathTracer<'_, R> {
    /// Adds what a surface sends back along a path; whether the path goes on.
    #[inline(always)]
    pub(super) fn vertex(&mut self, path: &mut PathState<R>, hit: &Hit<R>, at: &Interaction<R>) -> bool {
        let scene = self.scene;
        let here = scene.sources.at(at);
        match &scene.materials[at.material as usize] {
            Material::Classic(m) => {
                if let Some(emission) = &m.emission {
                    self.emits(path, hit, at, emission.colour(&here));
                }
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
                let normal = if m.transmission.is_some() { at.towards() } else { at.normal };
                let bsdf = classic::lobes(m, &here, at, normal);
                let glass = m.transmission.as_ref().map(|transmission| transmission.glass);
                // A light without size says how bright it makes a white classic surface that faces it, not what falls on it.
                self.scatter(path, hit, at, &bsdf, (glass.as_ref(), R::from_f64(PI)))
            }
            Material::Physical(m) => {
                if let Some(emission) = &m.emission {
                    self.emits(path, hit, at, emission.tint(&here, Vector::ONE));
                }
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
                let normal = if model.glass.is_some() { at.towards() } else { at.normal };
                let bsdf = model.transport(normal, -at.direction, at.outside, scene.compensates);
                self.scatter(path, hit, at, &bsdf, (model.glass.as_ref(), R::ONE))
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

    /// Asks a light and draws the direction in which the path goes on.
    #[inline(always)]
    pub(super) fn scatter<L: Scatters<R>, const MOST: usize>(
        &mut self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        bsdf: &Bsdf<R, L, MOST>,
        (glass, gain): (Option<&Glass<R>>, R),
    ) -> bool {
        let sent = self.sample_direct(path, at, bsdf, gain);
        path.radiance += path.throughput * sent;
        let [lobe, u, v, luck] = path.draws.scatter.map(R::from_f32);
        let normal = bsdf.normal();
        let drawn = bsdf.sample(&Frame::about(normal), -at.direction, [lobe, u, v]);
        // A coat may mirror about a normal of its own.
        let through = drawn.direction.dot(normal) < R::ZERO;
        let bent = glass.filter(|_| drawn.delta && (through || !L::COATED));
        let lit = if bsdf.lets_through() { Vector::ZERO } else { normal };
        self.leaves(path, hit, at, &drawn, Leaves { normal, lit, luck, bent, coated: L::COATED })
    }

    /// Sends a path on in the direction that was drawn; whether it goes on.
    #[inline(always)]
    pub(super) fn leaves(
        &mut self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        drawn: &Sampled<R>,
        Leaves { normal, lit, luck, bent, coated }: Leaves<'_, R>,
    ) -> bool {
        if !drawn.some {
            return false;
        }
        let geometric = if at.outside { at.surface.normal } else { -at.surface.normal };
        let through = drawn.direction.dot(normal) < R::ZERO;
        // A shading normal must not take a reflection below the surface, nor what goes through it above.
        if (geometric.dot(drawn.direction) < R::ZERO) != through {
            return false;
        }
        let (direction, rest) = match bent {
            Some(glass) => self.known(path, hit, at, (glass, through), drawn),
            None => (drawn.direction, Vector::ZERO),
        };
        // Starts of rays count from the normal that the object has.
        let side = if through == (normal == at.normal) { -R::ONE } else { R::ONE };
        // Of delta lobes only walls send light on without an index.
        let straight = coated && drawn.delta && through && self.is_wall(at.material);
        let ray = self.scene.spawn(at, direction, side);
        let goes_on = self.go_on(path, at, drawn, Onward { ray, rest, luck, lit, through, straight });
        let rays = match (drawn.delta, through) {
            (_, true) => &mut self.counters.refraction,
            (true, false) => &mut self.counters.reflection,
            (false, false) => &mut self.counters.scatter,
        };
        *rays += u64::from(goes_on);
        goes_on
    }

    /// Whether a material is a wall that lets light straight through, all of it being there.
    fn is_wall(&self, material: u32) -> bool {
        matches!(&self.scene.materials[material as usize], Material::Physical(m) if m.is_wall() && m.alpha == Alpha::Opaque)
    }

    /// The direction that a boundary of glass sends a ray in, with the digits that storing takes from it.
    fn known(
        &self,
        path: &PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        (glass, through): (&Glass<R>, bool),
        drawn: &Sampled<R>,
    ) -> (R::Vec3, R::Vec3) {
        let side = if at.direction.dot(at.normal) > R::ZERO { -R::ONE } else { R::ONE };
        let [d, n] = self.scene.exact_directions(&path.leg, hit, at, side);
        let interface = Interface::new(d, n, glass.eta(at.outside));
        let exact = if through { interface.refracted } else { Some(interface.reflected) };
        exact.map_or((drawn.direction, Vector::ZERO), |exact| {
            let stored = R::Vec3::from_f64(exact);
            (stored, Vector::from_f64(exact - stored.to_f64()))
        })
    }
}

impl<R: Real> Interaction<R> {
    /// The shading normal on the side that the ray came from, also where the object's points outwards always.
    #[inline(always)]
    pub fn towards(&self) -> R::Vec3 {
        if self.direction.dot(self.normal) > R::ZERO { -self.normal } else { self.normal }
    }
}
