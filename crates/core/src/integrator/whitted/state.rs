//! State of a Whitted path. The step that advances a path does not depend on the order of tracing,
//! so that paths may be traced one after the other or many at a time, with the same bits.

use raywright_bvh::{Hit, Ray, Real, Vector};

use super::super::PathSegment;
use crate::sampler::{PathBranch, SampleAddress};

/// State of a path: all data on which its next segment depends, as plain numbers.
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
    pub remaining_segments: u32,
    /// Surfaces that the sample's rays passed unchanged, side branches included.
    pub passages: u32,
    /// Whether the next ray still counts as a camera ray.
    pub is_camera_ray: bool,
    /// Share of the camera ray that this path carries, while its rays count as camera rays: less
    /// than 1 behind partly transparent surfaces.
    pub share: R,
    /// Share of the camera ray that surfaces cover, side branches included, 0 to 1.
    pub coverage: R,
    /// The hit on a partly transparent surface, while the path waits for the side branch behind the
    /// surface.
    pub known_hit: Option<Hit<R>>,
}

/// A scattered ray with its throughput.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SecondaryRay<R: Real> {
    pub ray: Ray<R>,
    pub throughput: R::Vec3,
    /// Rounding error of the stored direction. Only the next interface reads this error: at an exit
    /// from glass near the critical angle, the error grows thousands of times, and a slab would
    /// turn a ray that it should only shift.
    pub direction_error: R::Vec3,
}

/// The scattered rays of a surface: the ray of the path itself, and the ray of a side branch, which
/// is traced first and adds its radiance to the path.
pub(crate) type SecondaryRays<R> = [Option<SecondaryRay<R>>; 2];

impl<R: Real> WhittedState<R> {
    /// Returns the state of a side branch that starts at the path's current vertex.
    pub fn create_side_branch(&self, next: &SecondaryRay<R>, branch: PathBranch) -> Self {
        let mut segment = self.segment;
        segment.advance_to_ray(&next.ray, next.direction_error);
        Self {
            segment,
            throughput: next.throughput,
            radiance: Vector::ZERO,
            address: self.address.side_branch_address(branch),
            remaining_segments: self.remaining_segments - 1,
            passages: self.passages,
            is_camera_ray: false,
            share: R::ZERO,
            coverage: R::ZERO,
            known_hit: None,
        }
    }

    /// Finishes the vertex and continues the path with the scattered rays. Returns a side branch,
    /// if any, which must be traced to its end first.
    #[inline(always)]
    pub fn start_segment(&mut self, [onward, side_branch]: SecondaryRays<R>) -> Option<Self> {
        let side_branch =
            side_branch.map(|next| self.create_side_branch(&next, PathBranch::Reflected));
        self.coverage += self.share;
        self.share = R::ZERO;
        self.address.bounce += 1;
        self.remaining_segments -= 1;
        match onward {
            Some(next) if self.remaining_segments > 0 => {
                self.segment.advance_to_ray(&next.ray, next.direction_error);
                self.throughput = next.throughput;
                self.is_camera_ray = false;
            }
            _ => self.remaining_segments = 0,
        }
        side_branch
    }
}
