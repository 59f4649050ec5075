//! A path on its way. What one more segment makes of it is apart from who asks for it, so that
//! paths may be followed one by one or many at a time, in any order: their bits depend on nothing
//! else.

use raywright_bvh::{Hit, Ray, Real, Vector};

use super::super::PathSegment;
use crate::sampler::{Address, Branch};

/// Where a path is: all that its next segment depends on, in numbers alone, so that paths can lie
/// side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WhittedState<R: Real> {
    /// The ray to be traced.
    pub leg: PathSegment<R>,
    /// Share of what arrives along it that reaches the camera.
    pub throughput: R::Vec3,
    /// What the path has brought so far.
    pub radiance: R::Vec3,
    /// The vertex in the making, for random numbers.
    pub address: Address,
    /// Segments that it may still have, the one to be traced included; none: it has ended.
    pub segments: u32,
    /// Surfaces that the rays of its sample passed unchanged, with those of the paths that it
    /// waited for.
    pub passages: u32,
    /// Whether it still is what the camera sees first.
    pub camera: bool,
    /// Share of the camera ray that goes this way, while it is what the camera sees: less than one
    /// behind what is there in part.
    pub share: R,
    /// What of the camera ray it has found covered, with the paths that it waited for.
    pub covered: R,
    /// What the ray met, where that waits for what is behind it.
    pub met: Option<Hit<R>>,
}

/// A ray to follow, with what it counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NextRay<R: Real> {
    pub ray: Ray<R>,
    pub throughput: R::Vec3,
    /// What storing took from the direction. Only the next interface asks for it: leaving glass
    /// near the critical angle magnifies it thousands of times, and a slab then turns a ray that it
    /// should only move.
    pub rest: R::Vec3,
}

/// The rays that leave a surface: the path's own, and another one, whose path comes first and
/// brings its radiance to this one.
pub(crate) type ScatteredRays<R> = [Option<NextRay<R>>; 2];

impl<R: Real> WhittedState<R> {
    /// The path of a side branch that leaves at the vertex in the making.
    pub fn branch(&self, next: &NextRay<R>, branch: Branch) -> Self {
        let mut leg = self.leg;
        leg.go_on(&next.ray, next.rest);
        Self {
            leg,
            throughput: next.throughput,
            radiance: Vector::ZERO,
            address: self.address.aside(branch),
            segments: self.segments - 1,
            passages: self.passages,
            camera: false,
            share: R::ZERO,
            covered: R::ZERO,
            met: None,
        }
    }

    /// Ends the vertex and takes up what leaves it. Returns the path that is to be followed to its
    /// end first, if there is one.
    #[inline(always)]
    pub fn leave(&mut self, [onward, aside]: ScatteredRays<R>) -> Option<Self> {
        let aside = aside.map(|next| self.branch(&next, Branch::Reflected));
        self.covered += self.share;
        self.share = R::ZERO;
        self.address.bounce += 1;
        self.segments -= 1;
        match onward {
            Some(next) if self.segments > 0 => {
                self.leg.go_on(&next.ray, next.rest);
                self.throughput = next.throughput;
                self.camera = false;
            }
            _ => self.segments = 0,
        }
        aside
    }
}
