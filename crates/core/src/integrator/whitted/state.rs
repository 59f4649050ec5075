//! State of a Whitted path. A step advances one path independently of all others. Paths may be
//! traced one by one or many at a time, with the same bits.

use raywright_bvh::{Hit, Ray, Real, Vector};

use super::super::{MOST_PASSAGES, PathSegment};
use super::WhittedTracer;
use crate::interaction::Interaction;
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

// Stack of paths that wait until their side branches end.

/// Number of side branches between checks for cancellation.
const DIVISIONS: u32 = 4096;

impl<R: Real> WhittedTracer<'_, R> {
    /// Pushes a path onto the stack of waiting paths, and continues with its side branch. Not
    /// inlined: most paths never branch.
    #[inline(never)]
    pub(super) fn defer_path(&mut self, path: &mut WhittedState<R>, side_branch: WhittedState<R>) {
        self.divisions = self.divisions.wrapping_add(1);
        if self.divisions.is_multiple_of(DIVISIONS) && self.observer.is_cancelled() {
            self.stopped = true;
        }
        if self.stopped {
            self.waiting_paths.clear();
            path.remaining_segments = 0;
        } else {
            self.waiting_paths
                .push(core::mem::replace(path, side_branch));
        }
    }

    /// Replaces an ended path by the path that waits for it, if any. Returns whether a path
    /// continues.
    #[inline(always)]
    pub(super) fn resume_waiting_path(&mut self, path: &mut WhittedState<R>) -> bool {
        !self.waiting_paths.is_empty() && self.pop_waiting_path(path)
    }

    /// Adds an ended path to the path that waits for it, and continues the first waiting path that
    /// has segments left. Returns whether a path continues.
    #[inline(never)]
    fn pop_waiting_path(&mut self, path: &mut WhittedState<R>) -> bool {
        while let Some(before) = self.waiting_paths.pop() {
            let state = core::mem::replace(path, before);
            path.radiance += state.radiance;
            path.coverage += state.coverage;
            path.passages = state.passages;
            // The waiting path may itself have no segments left.
            if path.remaining_segments > 0 {
                return true;
            }
        }
        false
    }
}

// Surfaces that a path passes without a change of direction.

impl<R: Real> WhittedTracer<'_, R> {
    /// Continues a path in the same direction beyond a surface, with its new throughput. Takes no
    /// segment.
    pub(super) fn pass_through_surface(
        &mut self,
        path: &mut WhittedState<R>,
        interaction: &Interaction<R>,
        throughput: R::Vec3,
    ) {
        let rest = path.segment.direction_error;
        path.segment
            .advance_to_ray(&self.ray_behind_surface(path, interaction), rest);
        path.throughput = throughput;
        path.address.bounce += 1;
        self.count_passed_surface(path);
    }

    /// Continues a path beyond an index-matched boundary, which only tints its throughput.
    pub(super) fn pass_index_matched_boundary(
        &mut self,
        path: &mut WhittedState<R>,
        interaction: &Interaction<R>,
        throughput: R::Vec3,
    ) {
        self.counters.refraction += 1;
        path.coverage += core::mem::replace(&mut path.share, R::ZERO);
        path.is_camera_ray = false;
        self.pass_through_surface(path, interaction, throughput);
    }

    /// Returns the ray that continues a path's ray beyond a surface.
    pub(super) fn ray_behind_surface(
        &self,
        path: &WhittedState<R>,
        interaction: &Interaction<R>,
    ) -> Ray<R> {
        Ray {
            is_camera_ray: path.segment.ray.is_camera_ray,
            ..self.scene.spawn_straight_ray(interaction)
        }
    }

    /// Counts a surface that a path passed unchanged, and ends the path if it passed too many.
    pub(super) fn count_passed_surface(&mut self, path: &mut WhittedState<R>) {
        path.passages += 1;
        if path.passages > MOST_PASSAGES {
            path.remaining_segments = 0;
            self.counters.cut_short += 1;
        }
    }
}
