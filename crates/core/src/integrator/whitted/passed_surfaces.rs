//! Surfaces that a path passes without a change of direction.

use raywright_bvh::{Ray, Real};

use super::WhittedTracer;
use super::state::WhittedState;
use crate::integrator::MOST_PASSAGES;
use crate::interaction::Interaction;

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
