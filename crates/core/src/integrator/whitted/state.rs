//! State of a Whitted path. Advancing a path is separate from the order of tracing, so that paths
//! may be traced one by one or many at a time, in any order, with the same bits.

use raywright_bvh::{Hit, Ray, Real, Vector};

use super::super::PathSegment;
use crate::sampler::{Branch, SampleAddress};

/// State of a path: everything that its next segment depends on, as plain numbers, so that paths
/// can lie side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WhittedState<R: Real> {
    /// The next ray.
    pub segment: PathSegment<R>,
    /// Throughput of the path (beta).
    pub throughput: R::Vec3,
    /// Radiance collected so far.
    pub radiance: R::Vec3,
    /// Address of the next vertex, for random numbers.
    pub address: SampleAddress,
    /// Remaining segments, including the next one; zero for an ended path.
    pub segments: u32,
    /// Surfaces that the sample's rays passed unchanged, side branches included.
    pub passages: u32,
    /// Whether the next ray still counts as a camera ray.
    pub camera: bool,
    /// Share of the camera ray, while it counts as one: less than one behind partly transparent
    /// surfaces.
    pub share: R,
    /// Covered share of the camera ray, side branches included.
    pub covered: R,
    /// The hit, if its path waits for the path behind it.
    pub hit: Option<Hit<R>>,
}

/// A scattered ray with its throughput.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NextRay<R: Real> {
    pub ray: Ray<R>,
    pub throughput: R::Vec3,
    /// Rounding error of the stored direction. Only the next interface uses it: leaving glass near
    /// the critical angle magnifies the error thousands of times, and a slab then turns a ray that
    /// it should only shift.
    pub rest: R::Vec3,
}

/// The scattered rays of a surface: the path's own, and one for a side branch, which is traced
/// first and adds its radiance to this path.
pub(crate) type ScatteredRays<R> = [Option<NextRay<R>>; 2];

impl<R: Real> WhittedState<R> {
    /// The path of a side branch at the current vertex.
    pub fn branch(&self, next: &NextRay<R>, branch: Branch) -> Self {
        let mut segment = self.segment;
        segment.advance(&next.ray, next.rest);
        Self {
            segment,
            throughput: next.throughput,
            radiance: Vector::ZERO,
            address: self.address.aside(branch),
            segments: self.segments - 1,
            passages: self.passages,
            camera: false,
            share: R::ZERO,
            covered: R::ZERO,
            hit: None,
        }
    }

    /// Finishes the vertex and continues with the scattered rays. Returns a side branch that must
    /// be traced to its end first, if any.
    #[inline(always)]
    pub fn leave(&mut self, [onward, aside]: ScatteredRays<R>) -> Option<Self> {
        let aside = aside.map(|next| self.branch(&next, Branch::Reflected));
        self.covered += self.share;
        self.share = R::ZERO;
        self.address.bounce += 1;
        self.segments -= 1;
        match onward {
            Some(next) if self.segments > 0 => {
                self.segment.advance(&next.ray, next.rest);
                self.throughput = next.throughput;
                self.camera = false;
            }
            _ => self.segments = 0,
        }
        aside
    }
}
