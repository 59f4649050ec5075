//! Shading of a batch of vertices in steps: direct light, shadow rays, scattered rays. Each step
//! treats all vertices. The result of a vertex has the same bits in any batch.

use raywright_bvh::{Real, SimdTask, Vector, run_widest};

use super::bsdf_lanes::BsdfLanes;
use super::light::power_heuristic;
use super::roulette::{apply_roulette, has_finite_components, is_nonzero};
use super::vertices::{LitSides, MisStrategy, VertexLanes};
use crate::light::{
    LANES, LaneColumn, LightSampleLanes, ShadowRayTargetKind, Vec3Column, get_lane_vector,
    set_lane_vector,
};

/// Results of shading a batch of vertices. Each field is computed by a separate function: the
/// compiler then knows that outputs do not alias inputs.
#[derive(Clone, Copy)]
pub(super) struct ShadedLanes<R: Real> {
    pub lit: DirectLightLanes<R>,
    pub shadow: ShadowRayLanes<R>,
    pub next: ScatteredRayLanes<R>,
}

impl<R: Real> ShadedLanes<R> {
    /// Shades vertices, given their BSDF values and BSDF samples. `reach` is the greatest length of
    /// a shadow ray to an infinitely distant delta light.
    #[inline]
    pub fn from_vertices(
        vertices: &VertexLanes<R>,
        lights: &LightSampleLanes<R>,
        bsdf_lanes: &BsdfLanes<R>,
        reach: R,
    ) -> Self {
        Self {
            lit: run_widest(DirectLightTask {
                vertices,
                lights,
                bsdf_lanes,
            }),
            shadow: run_widest(ShadowRayTask {
                vertices,
                lights,
                reach,
            }),
            next: run_widest(ScatterTask {
                vertices,
                bsdf_lanes,
            }),
        }
    }
}

/// Direct light at vertices, before the visibility of the lights is known.
#[derive(Clone, Copy)]
pub(super) struct DirectLightLanes<R: Real> {
    /// Whether the surface scatters the sampled light towards the viewer, if the light is
    /// unoccluded.
    pub is_lit: LaneColumn<bool>,
    /// Whether the surface transmits the sampled light, instead of reflecting it.
    pub is_through: LaneColumn<bool>,
    /// Scattered radiance per unit of throughput, if the light is unoccluded.
    pub reflected: Vec3Column<R>,
}

struct DirectLightTask<'a, R: Real> {
    vertices: &'a VertexLanes<R>,
    lights: &'a LightSampleLanes<R>,
    bsdf_lanes: &'a BsdfLanes<R>,
}

impl<R: Real> SimdTask for DirectLightTask<'_, R> {
    type Output = DirectLightLanes<R>;
    #[inline(always)]
    fn run(self) -> DirectLightLanes<R> {
        let Self {
            vertices: v,
            lights,
            bsdf_lanes,
        } = self;
        let mut out = DirectLightLanes {
            is_lit: [false; LANES],
            is_through: [false; LANES],
            reflected: [[R::ZERO; LANES]; 3],
        };
        let mut weighed = [false; LANES];
        let mut dull = [false; LANES];
        let mut sizeless = [false; LANES];
        let mut seen = [false; LANES];
        for lane in 0..LANES {
            weighed[lane] = matches!(v.strategy[lane], MisStrategy::PowerHeuristic);
            dull[lane] = v.strategy[lane].is_diffuse_only();
            sizeless[lane] = matches!(v.strategy[lane], MisStrategy::Delta { .. });
            seen[lane] = lights.target_kinds[lane] != ShadowRayTargetKind::Nothing;
        }
        for lane in 0..LANES {
            let (direction, zero) = (get_lane_vector::<R>(&lights.direction, lane), R::ZERO);
            let facing = get_lane_vector::<R>(&v.normal, lane).dot(direction);
            // The light must lie above both the shading and the geometric horizon, or below both
            // for transmissive surfaces. Lights without highlights are reflected alone.
            let below = get_lane_vector::<R>(&v.geometric, lane).dot(direction) < zero;
            let above = (facing > zero) & !below;
            let through = (v.sides[lane] == LitSides::Both) & (facing < zero) & below & !dull[lane];
            let (value, diffuse) = (
                get_lane_vector::<R>(&bsdf_lanes.value, lane),
                get_lane_vector::<R>(&bsdf_lanes.diffuse, lane),
            );
            let value = if dull[lane] { diffuse } else { value };
            let both = R::from_f64(power_heuristic(
                lights.density[lane],
                bsdf_lanes.light_density[lane].to_f64(),
            ));
            let share = if sizeless[lane] { v.gain[lane] } else { R::ONE };
            let share = if weighed[lane] { both } else { share };
            let scattered =
                get_lane_vector::<R>(&lights.arriving, lane) * value * (Real::abs(facing) * share);
            out.is_lit[lane] = seen[lane] & (above | through) & is_nonzero::<R>(scattered);
            out.is_through[lane] = through;
            set_lane_vector::<R>(&mut out.reflected, lane, scattered);
        }
        out
    }
}

/// Shadow rays from vertices to sampled points of lights. A light may be a surface or infinitely
/// distant.
#[derive(Clone, Copy)]
pub(super) struct ShadowRayLanes<R: Real> {
    pub start: Vec3Column<R>,
    pub directions: Vec3Column<R>,
    /// Length of the ray. Zero, negative or infinite: nothing can lie between the vertex and a
    /// light's surface.
    pub length: LaneColumn<R>,
    /// Whether the ray's origin lies on the side of the vertex's surface to which the ray points.
    /// The triangle of the vertex may then be named in [`RayEndTriangles`](raywright_bvh::RayEndTriangles).
    pub leaves: LaneColumn<bool>,
    /// Whether the ray's end lies on the side of the light's surface from which the ray arrives.
    /// The light's triangles may then be named in [`RayEndTriangles`](raywright_bvh::RayEndTriangles).
    pub reaches: LaneColumn<bool>,
}

struct ShadowRayTask<'a, R: Real> {
    vertices: &'a VertexLanes<R>,
    lights: &'a LightSampleLanes<R>,
    reach: R,
}

impl<R: Real> SimdTask for ShadowRayTask<'_, R> {
    type Output = ShadowRayLanes<R>;
    #[inline(always)]
    fn run(self) -> ShadowRayLanes<R> {
        let (v, lights, none) = (self.vertices, self.lights, [[R::ZERO; LANES]; 3]);
        let mut out = ShadowRayLanes {
            start: none,
            directions: none,
            length: none[0],
            leaves: [true; LANES],
            reaches: [true; LANES],
        };
        if (0..LANES).fold(false, |some, lane| {
            some | (lights.target_kinds[lane] == ShadowRayTargetKind::Surface)
        }) {
            for lane in 0..LANES {
                let (ray, length, [leaves, reaches]) = v
                    .surface
                    .get_lane(lane)
                    .spawn_unchecked_ray_to_surface(&lights.surface.get_lane(lane));
                set_lane_vector::<R>(&mut out.start, lane, ray.origin);
                set_lane_vector::<R>(&mut out.directions, lane, ray.direction);
                out.length[lane] = length;
                (out.leaves[lane], out.reaches[lane]) = (leaves, reaches);
            }
        }
        if (0..LANES).fold(false, |some, lane| {
            some | (lights.target_kinds[lane] == ShadowRayTargetKind::Infinity)
        }) {
            for lane in 0..LANES {
                let far = lights.target_kinds[lane] == ShadowRayTargetKind::Infinity;
                let direction = get_lane_vector::<R>(&lights.direction, lane);
                let start = v.surface.get_lane(lane).spawn_ray_origin(direction);
                let length = if lights.density[lane] == 0.0 {
                    self.reach
                } else {
                    R::INFINITY
                };
                let [before, target_direction] =
                    [&out.start, &out.directions].map(|column| get_lane_vector::<R>(column, lane));
                set_lane_vector::<R>(&mut out.start, lane, if far { start } else { before });
                set_lane_vector::<R>(
                    &mut out.directions,
                    lane,
                    if far { direction } else { target_direction },
                );
                out.length[lane] = if far { length } else { out.length[lane] };
                out.leaves[lane] |= far;
            }
        }
        out
    }
}

/// Scattered rays of vertices after Russian roulette.
#[derive(Clone, Copy)]
pub(super) struct ScatteredRayLanes<R: Real> {
    pub continues: LaneColumn<bool>,
    /// Whether the path ends because its throughput is not finite.
    pub overflows: LaneColumn<bool>,
    pub origin: Vec3Column<R>,
    pub throughput: Vec3Column<R>,
}

struct ScatterTask<'a, R: Real> {
    vertices: &'a VertexLanes<R>,
    bsdf_lanes: &'a BsdfLanes<R>,
}

impl<R: Real> SimdTask for ScatterTask<'_, R> {
    type Output = ScatteredRayLanes<R>;
    #[inline(always)]
    fn run(self) -> ScatteredRayLanes<R> {
        let (v, bsdf_lanes, none) = (self.vertices, self.bsdf_lanes, [[R::ZERO; LANES]; 3]);
        let mut out = ScatteredRayLanes {
            continues: [false; LANES],
            overflows: [false; LANES],
            origin: none,
            throughput: none,
        };
        for lane in 0..LANES {
            let direction = get_lane_vector::<R>(&bsdf_lanes.direction, lane);
            let throughput = get_lane_vector::<R>(&v.throughput, lane)
                * get_lane_vector::<R>(&bsdf_lanes.weight, lane);
            out.overflows[lane] =
                bsdf_lanes.is_valid[lane] & !has_finite_components::<R>(throughput);
            let (throughput, continues) =
                apply_roulette(throughput, v.survival_scale[lane], v.numbers[3][lane]);
            out.continues[lane] = bsdf_lanes.is_valid[lane] & continues;
            set_lane_vector::<R>(&mut out.throughput, lane, throughput);
            set_lane_vector::<R>(
                &mut out.origin,
                lane,
                v.surface.get_lane(lane).spawn_ray_origin(direction),
            );
        }
        out
    }
}

#[cfg(test)]
mod tests;
