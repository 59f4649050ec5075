//! State of a Whitted path. A step advances one path independently of all others. Paths may be
//! traced one by one or many at a time, with the same bits.

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
    /// Address of the next vertex in the sample sequence.
    pub address: SampleAddress,
    /// Remaining segments, including the next one; zero for an ended path.
    pub remaining_segments: u32,
    /// Number of surfaces that the sample's rays passed straight, on the path and its side
    /// branches.
    pub passages: u32,
    /// Whether the next ray still counts as a camera ray.
    pub is_camera_ray: bool,
    /// Weight of this path in the camera ray's coverage, 0 to 1. Less than 1 behind partly
    /// transparent surfaces; zero after the first scattering.
    pub share: R,
    /// Coverage (alpha) of the camera ray so far, side branches included, 0 to 1.
    pub coverage: R,
    /// Hit on a partly transparent surface. Set while the path waits for the side branch that
    /// passes the surface.
    pub known_hit: Option<Hit<R>>,
}

/// A scattered ray with its throughput.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SecondaryRay<R: Real> {
    pub ray: Ray<R>,
    pub throughput: R::Vec3,
    /// Rounding error of the stored direction, for the next smooth interface alone. At an exit from
    /// glass near the critical angle, this error grows by a factor of thousands. Uncorrected, a
    /// glass slab would rotate a ray that it should only shift.
    pub direction_error: R::Vec3,
}

/// The scattered rays of a surface: first the ray that continues the path, then the ray of a side
/// branch. The side branch is traced first, and its radiance is added to the path.
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

    /// Continues the path with the scattered rays of its vertex. Returns the side branch, if any;
    /// the caller must trace this branch to its end first.
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
