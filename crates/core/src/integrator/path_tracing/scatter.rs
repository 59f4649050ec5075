//! How a path leaves a vertex: the ray in the direction that was drawn.

use raywright_bvh::{Ray, Real, Vector};

use super::respond::Answers;
use super::shade::NextRays;
use super::vertices::{Bounce, LitSides, VertexLanes};
use super::{PathState, PathTracer, PreviousVertex};
use crate::interaction::Interaction;
use crate::light::vector;
use crate::prepare::Spawn;

/// How a surface sends a path on, beside where.
#[derive(Clone, Copy, Debug)]
pub(super) struct Onward<R: Real> {
    /// What storing took from the direction.
    pub rest: R::Vec3,
    /// Whether a mirror or clear glass sends it, and whether it goes through the surface.
    pub smooth: bool,
    pub through: bool,
    /// Whether it does so as shadow rays do.
    pub straight: bool,
}

impl<R: Real> Onward<R> {
    /// As what is rough and opaque does.
    pub const REFLECTED: Self = Self {
        rest: <R::Vec3 as Vector<R>>::ZERO,
        smooth: false,
        through: false,
        straight: false,
    };
}

impl<R: Real> PathTracer<'_, R> {
    /// Sends a path on in the direction that was drawn.
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
            // Starts of rays count from the normal that the object has.
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

    /// Sends a path on along a ray, with what it then counts and the density of its direction.
    /// `lit`: normal of the side that lights were asked for; zero for both.
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
        // What goes straight on through a wall is still found by lights that were asked before it.
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
