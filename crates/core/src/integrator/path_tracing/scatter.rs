//! Scattered rays: the continuation of a path from a vertex in the sampled direction.

use raywright_bvh::{Ray, Real, Vector};

use super::bsdf_lanes::BsdfLanes;
use super::shade::ScatteredRayLanes;
use super::vertices::{LitSides, VertexLanes, WavefrontSlice};
use super::{LightKinds, NARROW, PathState, PathTracer, PreviousVertex};
use crate::counters::add_power;
use crate::interaction::Interaction;
use crate::light::get_lane_vector;
use crate::prepare::PreparedSpawnRule;

/// Properties of a scattered ray besides its direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScatteredRay<R: Real> {
    /// Rounding error of the stored direction.
    pub direction_error: R::Vec3,
    /// Whether a delta lobe scattered the ray.
    pub is_delta: bool,
    /// Whether the ray is transmitted through the surface.
    pub is_transmitted: bool,
    /// Whether the ray passes a thin wall straight. Shadow rays pass such a wall too: for multiple
    /// importance sampling, the vertex before the wall stays the previous vertex.
    pub is_straight: bool,
}

impl<R: Real> ScatteredRay<R> {
    /// A ray from a rough opaque surface.
    pub const REFLECTED: Self = Self {
        direction_error: <R::Vec3 as Vector<R>>::ZERO,
        is_delta: false,
        is_transmitted: false,
        is_straight: false,
    };

    /// Returns 1 if the ray leaves on the side of an interaction's normal, else −1. `normal` is the
    /// normal of the vertex, on the viewer's side.
    #[inline(always)]
    pub fn side(&self, interaction: &Interaction<R>, normal: R::Vec3) -> R {
        if self.is_transmitted == (normal == interaction.normal) {
            -R::ONE
        } else {
            R::ONE
        }
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Continues the path of the vertex in `lane` in the direction that the BSDF sampled.
    #[inline(always)]
    pub(super) fn continue_path(
        &mut self,
        slice: &mut WavefrontSlice<'_, R>,
        (vertices, lane): (&VertexLanes<R>, usize),
        (bsdf_lanes, next): (&BsdfLanes<R>, &ScatteredRayLanes<R>),
        scattered_ray: &ScatteredRay<R>,
    ) {
        let index = vertices.hit_indices[lane] as usize;
        let path = &mut slice.paths[slice.active[index] as usize];
        let mut ray = Ray::new(
            get_lane_vector::<R>(&next.origin, lane),
            get_lane_vector::<R>(&bsdf_lanes.direction, lane),
        );
        let normal = get_lane_vector::<R>(&vertices.normal, lane);
        if !matches!(self.scene.rules.spawn, PreparedSpawnRule::ErrorBound) {
            // Ray origins are offset along the object's normal.
            let interaction = &slice.interactions[index];
            let side = scattered_ray.side(interaction, normal);
            ray = self.scene.spawn_ray(interaction, ray.direction, side);
        }
        let lit = if vertices.sides[lane] == LitSides::Both {
            Vector::ZERO
        } else {
            normal
        };
        let leaves = (
            get_lane_vector::<R>(&next.throughput, lane),
            bsdf_lanes.density[lane].to_f64(),
        );
        let from = get_lane_vector::<R>(&vertices.surface.point, lane);
        if self.scene.tracks_media && scattered_ray.is_transmitted {
            path.media = self.media_beyond_surface(&path.media, &slice.interactions[index]);
        }
        self.start_segment(path, from, leaves, (&ray, lit), scattered_ray);
    }

    /// Continues a path along a scattered ray from the point `from` of a surface.
    ///
    /// - `density`: density by solid angle of the ray's direction, infinite for a delta lobe.
    /// - `lit`: normal of the side on which lights were sampled; zero for both sides.
    #[inline(always)]
    pub(super) fn start_segment(
        &mut self,
        path: &mut PathState<R>,
        from: R::Vec3,
        (throughput, density): (R::Vec3, f64),
        (ray, lit): (&Ray<R>, R::Vec3),
        scattered_ray: &ScatteredRay<R>,
    ) {
        *match (scattered_ray.is_delta, scattered_ray.is_transmitted) {
            (_, true) => &mut self.counters.refraction,
            (true, false) => &mut self.counters.reflection,
            (false, false) => &mut self.counters.scatter,
        } += 1;
        path.segment
            .advance_to_ray(ray, scattered_ray.direction_error);
        path.throughput = throughput;
        path.address.bounce += 1;
        // Light samples taken before a thin wall still cover paths that pass straight through the
        // wall.
        if !scattered_ray.is_straight {
            path.min_pdf = path.min_pdf.min(path.previous.density);
            path.previous = PreviousVertex {
                from,
                normal: lit,
                density,
                lights: LightKinds::All,
            };
            self.counters.unaided += u64::from(
                self.hits_lights_by_chance(path) && !self.scene.lights.emitters.is_empty(),
            );
            let [sampled, radiance] = path.light_sample;
            path.is_narrow = path.min_pdf < density && density > NARROW * sampled;
            if path.is_narrow {
                let hit = throughput.to_f64().max_element() * radiance;
                self.counters.narrow += 1;
                add_power(&mut self.counters.narrow_power, hit);
            }
        }
    }
}
