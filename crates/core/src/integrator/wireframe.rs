//! Wireframe: lines along the edges of triangles at first hits of camera rays. Lines are one pixel
//! wide, unlit, and antialiased by the pixel's samples.
//!
//! On triangles of a few pixels the width is limited to a fraction of the triangle: a dense mesh
//! becomes grey instead of black.

use glam::DVec3;
use raywright_bvh::{Hit, Real, Vector};

use super::PathSegment;
use crate::interaction::Interaction;
use crate::picture::{LINE_RADIANCES, needs_bright_lines};
use crate::prepare::PreparedScene;

/// Greatest width of a line on one triangle, relative to the distance from the edge to the opposite
/// corner.
const WIDEST: f64 = 1.0 / 12.0;

impl<R: Real> PreparedScene<R> {
    /// Returns the colour of an edge at a hit. `None` beside edges, on shapes without triangles, on
    /// the caps of a section, and if the scene draws no edges.
    #[inline(always)]
    pub(super) fn edge_colour_at(
        &self,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> Option<R::Vec3> {
        if self.draws_edges
            && !self.is_section_cap(interaction.object)
            && self.is_on_edge(segment, hit)
        {
            Some(self.edge_colour(interaction))
        } else {
            None
        }
    }

    fn is_section_cap(&self, object: u32) -> bool {
        self.objects[object as usize]
            .mesh
            .as_ref()
            .is_some_and(|mesh| self.meshes[mesh.mesh as usize].is_cap)
    }

    /// Whether a ray passes an edge of the hit triangle at less than half a pixel. A pixel is the
    /// width of the camera's ray cone at the hit.
    #[inline(never)]
    fn is_on_edge(&self, segment: &PathSegment<R>, hit: &Hit<R>) -> bool {
        let Some(corners) = self.geometry.triangle_corners(&segment.ray, hit) else {
            return false;
        };
        let cone = self.camera.ray_cone();
        let distance = segment.length_before + segment.skipped_distance + hit.t;
        let pixel = (cone.width + cone.spread * distance).to_f64();
        let (origin, direction) = (segment.ray.origin.to_f64(), segment.ray.direction.to_f64());
        let weights = [R::ONE - hit.u - hit.v, hit.u, hit.v].map(Real::to_f64);
        (0..3).any(|i| {
            let [from, to]: [DVec3; 2] = [1, 2].map(|k| corners[(i + k) % 3]);
            let across = direction.cross(to - from);
            weights[i] < WIDEST && 2.0 * (from - origin).dot(across).abs() < pixel * across.length()
        })
    }

    fn edge_colour(&self, interaction: &Interaction<R>) -> R::Vec3 {
        let context = self.texture_tables.shading_context(interaction);
        let colour = self.materials[interaction.material as usize].base_colour_at(&context);
        let is_dark = needs_bright_lines(colour.to_f64().to_array());
        Vector::splat(R::from_f64(LINE_RADIANCES[usize::from(is_dark)]))
    }
}

#[cfg(test)]
mod tests;
