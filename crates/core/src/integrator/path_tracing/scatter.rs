//! Scattered rays: the continuation of a path from a vertex in the sampled direction.

use raywright_bvh::{Ray, Real, Vector};

use super::bsdf_lanes::BsdfLanes;
use super::shade::NextRays;
use super::vertices::{LitSides, VertexLanes, WavefrontSlice};
use super::{PathState, PathTracer, PreviousVertex};
use crate::interaction::Interaction;
use crate::light::lane_vector;
use crate::prepare::PreparedSpawn;

/// Properties of a scattered ray besides its direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScatteredRay<R: Real> {
    /// Rounding error of the stored direction.
    pub rest: R::Vec3,
    /// Whether a delta lobe scattered the ray, and whether the ray is transmitted through the
    /// surface.
    pub smooth: bool,
    pub through: bool,
    /// Whether the ray is transmitted without a change of direction, as shadow rays are.
    pub straight: bool,
}

impl<R: Real> ScatteredRay<R> {
    /// Properties of a ray from a rough opaque surface.
    pub const REFLECTED: Self = Self {
        rest: <R::Vec3 as Vector<R>>::ZERO,
        smooth: false,
        through: false,
        straight: false,
    };
}

impl<R: Real> PathTracer<'_, R> {
    /// Continues the path of a vertex in the sampled direction.
    #[inline(always)]
    pub(super) fn continue_path(
        &mut self,
        slice: &mut WavefrontSlice<'_, R>,
        (vertices, lane): (&VertexLanes<R>, usize),
        (bsdf_lanes, next): (&BsdfLanes<R>, &NextRays<R>),
        scattered_ray: &ScatteredRay<R>,
    ) {
        let index = vertices.place[lane] as usize;
        let (path, interaction) = (
            &mut slice.paths[slice.active[index] as usize],
            &slice.interactions[index],
        );
        let mut ray = Ray::new(
            lane_vector::<R>(&next.origin, lane),
            lane_vector::<R>(&bsdf_lanes.direction, lane),
        );
        let normal = lane_vector::<R>(&vertices.normal, lane);
        if !matches!(self.scene.rules.spawn, PreparedSpawn::ErrorBound) {
            // Ray origins are offset along the object's normal.
            let side = if scattered_ray.through == (normal == interaction.normal) {
                -R::ONE
            } else {
                R::ONE
            };
            ray = self.scene.spawn(interaction, ray.direction, side);
        }
        let lit = if vertices.sides[lane] == LitSides::Both {
            Vector::ZERO
        } else {
            normal
        };
        let leaves = (
            lane_vector::<R>(&next.throughput, lane),
            bsdf_lanes.density[lane].to_f64(),
        );
        self.leave(path, interaction, leaves, (&ray, lit), scattered_ray);
    }

    /// Continues a path along a ray, with the new throughput and the density of the ray's
    /// direction. `lit`: normal of the side on which lights were sampled; zero for both sides.
    #[inline(always)]
    pub(super) fn leave(
        &mut self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        (throughput, density): (R::Vec3, f64),
        (ray, lit): (&Ray<R>, R::Vec3),
        scattered_ray: &ScatteredRay<R>,
    ) {
        *match (scattered_ray.smooth, scattered_ray.through) {
            (_, true) => &mut self.counters.refraction,
            (true, false) => &mut self.counters.reflection,
            (false, false) => &mut self.counters.scatter,
        } += 1;
        path.segment.advance(ray, scattered_ray.rest);
        path.throughput = throughput;
        path.address.bounce += 1;
        // Light samples taken before a thin wall still cover paths that pass straight through the
        // wall.
        if !scattered_ray.straight {
            path.min_pdf = path.min_pdf.min(path.previous.density);
            path.previous = PreviousVertex {
                from: interaction.surface.point,
                normal: lit,
                density,
            };
            self.counters.unaided +=
                u64::from(self.is_unaided(path) && !self.scene.lights.emitters.is_empty());
        }
        if self.scene.tracks_media && scattered_ray.through {
            path.media = self.beyond(&path.media, interaction);
        }
    }
}
