//! How a path leaves a vertex: the ray in the direction that was drawn, unless chance ends the path.

use raywright_bvh::{Ray, Real};

use super::roulette::{is_number, survive};
use super::{PathState, PathTracer, PreviousVertex};
use crate::interaction::Interaction;
use crate::material::BsdfSample;

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
        let carried = path.throughput * drawn.weight;
        let (throughput, goes_on) = survive(carried, most, R::from_f32(path.draws.scatter[3]));
        if !goes_on {
            if !is_number::<R>(carried) {
                path.radiance += carried;
            }
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
}
