//! How a path leaves a vertex: the ray in the direction that was drawn, unless chance ends the path.

use raywright_bvh::{Hit, Ray, Real, Vector};

use super::super::spawn::stored;
use super::roulette::survive;
use super::{PathState, PathTracer, PreviousVertex};
use crate::interaction::Interaction;
use crate::material::{BsdfSample, Glass};
use crate::prepare::{Alpha, Material};

/// What scattering takes besides the direction.
pub(super) struct Scattering<'a, R: Real> {
    /// The normal of the lobes.
    pub normal: R::Vec3,
    /// Normal of the side that lights were asked for; zero for both.
    pub lit: R::Vec3,
    /// The boundary of glass that bends the path; none: it goes as drawn.
    pub bent: Option<&'a Glass<R>>,
    /// Whether lobes may have normals of their own.
    pub coated: bool,
}

/// How a path would go on.
pub(super) struct ScatteredRay<R: Real> {
    pub ray: Ray<R>,
    /// What storing took from its direction.
    pub rest: R::Vec3,
    /// Normal of the side that lights were asked for; zero for both.
    pub lit: R::Vec3,
    /// Whether a mirror or clear glass sends it, and whether it goes through the surface.
    pub smooth: bool,
    pub through: bool,
    /// Whether it does so as shadow rays do.
    pub straight: bool,
}

impl<R: Real> PathTracer<'_, R> {
    /// Sends a path on in the direction that was drawn; whether it goes on.
    #[inline(always)]
    pub(super) fn scatter(
        &mut self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        drawn: &BsdfSample<R>,
        Scattering { normal, lit, bent, coated }: Scattering<'_, R>,
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
        // Of delta lobes only walls send light on without an index.
        let straight = coated && drawn.delta && through && self.is_wall(at.material);
        let ray = self.scene.spawn(at, direction, side);
        self.go_on(path, at, drawn, ScatteredRay { ray, rest, lit, smooth: drawn.delta, through, straight })
    }

    /// Takes a path on in the direction that was drawn at a vertex, unless chance ends it.
    #[inline(always)]
    pub(super) fn go_on(
        &mut self,
        path: &mut PathState<R>,
        at: &Interaction<R>,
        drawn: &BsdfSample<R>,
        onward: ScatteredRay<R>,
    ) -> bool {
        let most = path.most_survival(self.scene.roulette);
        let (throughput, goes_on) = survive(path.throughput * drawn.weight, most, R::from_f32(path.draws.scatter[3]));
        if !goes_on {
            return false;
        }
        let density = if drawn.delta { f64::INFINITY } else { drawn.density.to_f64() };
        self.leave(path, at, (throughput, density), onward);
        true
    }

    /// Sends a path on that is known to go on, with what it then counts and the density of its direction.
    #[inline(always)]
    pub(super) fn leave(
        &mut self,
        path: &mut PathState<R>,
        at: &Interaction<R>,
        (throughput, density): (R::Vec3, f64),
        onward: ScatteredRay<R>,
    ) {
        *match (onward.smooth, onward.through) {
            (_, true) => &mut self.counters.refraction,
            (true, false) => &mut self.counters.reflection,
            (false, false) => &mut self.counters.scatter,
        } += 1;
        path.leg.go_on(&onward.ray, onward.rest);
        path.throughput = throughput;
        path.address.bounce += 1;
        // What goes straight on through a wall is still found by lights that were asked before it.
        if !onward.straight {
            path.spread = path.spread.min(path.previous.density);
            path.previous = PreviousVertex { from: at.surface.point, normal: onward.lit, density };
            self.counters.unaided += u64::from(self.is_unaided(path) && !self.scene.lights.emitters.is_empty());
        }
        if self.scene.tracks_media && onward.through {
            path.media = self.beyond(&path.media, at);
        }
    }

    /// Whether a material is a wall that lets light straight through, all of it being there.
    fn is_wall(&self, material: u32) -> bool {
        matches!(&self.scene.materials[material as usize], Material::Physical(m) if m.is_wall() && m.alpha == Alpha::Opaque)
    }
}
