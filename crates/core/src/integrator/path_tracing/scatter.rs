//! Scattered rays: how a path leaves a vertex in the sampled direction.

use raywright_bvh::{Ray, Real, Vector};

use super::respond::Answers;
use super::shade::NextRays;
use super::vertices::{Bounce, LitSides, VertexLanes};
use super::{PathState, PathTracer, PreviousVertex};
use crate::interaction::Interaction;
use crate::light::vector;
use crate::prepare::Spawn;

/// Properties of a scattered ray besides its direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Onward<R: Real> {
    /// Rounding error of the stored direction.
    pub rest: R::Vec3,
    /// Whether a delta lobe scattered the ray, and whether the ray goes through the surface.
    pub smooth: bool,
    pub through: bool,
    /// Whether the ray goes straight through, as shadow rays do.
    pub straight: bool,
}

impl<R: Real> Onward<R> {
    /// A ray from a rough opaque surface.
    pub const REFLECTED: Self = Self {
        rest: <R::Vec3 as Vector<R>>::ZERO,
        smooth: false,
        through: false,
        straight: false,
    };
}

impl<R: Real> PathTracer<'_, R> {
    /// Continues a path in the sampled direction.
    #[inline(always)]
    pub(super) fn send_on(
        &mut self,
        bounce: &mut Bounce<'_, R>,
        (vertices, lane): (&VertexLanes<R>, usize),
        (answers, next): (&Answers<R>, &NextRays<R>),
        onward: &Onward<R>,
    ) {
        let place = vertices.place[lane] as usize;
        let (path, at) = (
            &mut bounce.paths[bounce.going[place] as usize],
            &bounce.met[place],
        );
        let mut ray = Ray::new(
            vector::<R>(&next.origin, lane),
            vector::<R>(&answers.direction, lane),
        );
        let normal = vector::<R>(&vertices.normal, lane);
        if !matches!(self.scene.rules.spawn, Spawn::ErrorBound) {
            // Ray origins are offset along the object's normal.
            let side = if onward.through == (normal == at.normal) {
                -R::ONE
            } else {
                R::ONE
            };
            ray = self.scene.spawn(at, ray.direction, side);
        }
        let lit = if vertices.sides[lane] == LitSides::Both {
            Vector::ZERO
        } else {
            normal
        };
        let leaves = (
            vector::<R>(&next.throughput, lane),
            answers.density[lane].to_f64(),
        );
        self.leave(path, at, leaves, (&ray, lit), onward);
    }

    /// Continues a path along a ray, with its throughput and the density of its direction. `lit`:
    /// normal of the side on which lights were sampled; zero for both.
    #[inline(always)]
    pub(super) fn leave(
        &mut self,
        path: &mut PathState<R>,
        at: &Interaction<R>,
        (throughput, density): (R::Vec3, f64),
        (ray, lit): (&Ray<R>, R::Vec3),
        onward: &Onward<R>,
    ) {
        *match (onward.smooth, onward.through) {
            (_, true) => &mut self.counters.refraction,
            (true, false) => &mut self.counters.reflection,
            (false, false) => &mut self.counters.scatter,
        } += 1;
        path.leg.go_on(ray, onward.rest);
        path.throughput = throughput;
        path.address.bounce += 1;
        // Light samples from before a thin wall still cover paths that pass straight through it.
        if !onward.straight {
            path.spread = path.spread.min(path.previous.density);
            path.previous = PreviousVertex {
                from: at.surface.point,
                normal: lit,
                density,
            };
            self.counters.unaided +=
                u64::from(self.is_unaided(path) && !self.scene.lights.emitters.is_empty());
        }
        if self.scene.tracks_media && onward.through {
            path.media = self.beyond(&path.media, at);
        }
    }
}
