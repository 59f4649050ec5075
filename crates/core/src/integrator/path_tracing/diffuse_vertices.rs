//! Matte vertices under rectangular lamps: one task computes the whole vertex, from the surface at the
//! hit to the place on the lamp and the next ray. Numbers stay in registers, and a vertex is read from
//! memory and written to it once. Each lane has the bits of a vertex by itself.

use core::any::Any;
use core::f32::consts::FRAC_1_PI;

use raywright_bvh::{
    Interval, LaneAngles, LaneFloats, LaneTask, LaneVector, Ray, Real, Simd, SimdFloats, Vector,
    run_in_lanes_of,
};

use super::PathTracer;
use super::scatter::ScatteredRay;
use super::vertices::{VertexLanes, WavefrontSlice};
use crate::light::{
    LANES, LaneColumn, LightId, RectangleLamps, Vec3Column, add_numbers, get_lane_vector,
};
use crate::settings::LightSampling;

/// Least cosine between a direction and the geometric normal: four units of rounding. Below, `f32`
/// may not tell on which side of the surface the direction points.
const LEAST_COSINE: f32 = 1.0 / (1 << 22) as f32;
/// Relative distance that is at least the distance to the next `f32`.
const NEXT_NUMBER: f32 = 1.0 / (1 << 23) as f32;

/// What vertices bring, in columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadedDiffuseLanes {
    /// Origin of the next ray and of shadow rays.
    pub start: Vec3Column<f32>,
    /// Mask of the lanes whose sampled light arrives at the point and is reflected if nothing blocks
    /// it.
    pub lit: u32,
    /// Index of the chosen lamp.
    pub lamp: LaneColumn<f32>,
    /// Density by solid angle of the direction to the lamp; zero if no light arrives.
    pub light_density: LaneColumn<f32>,
    /// Greatest component of the lamp's radiance.
    pub light_radiance: LaneColumn<f32>,
    /// Mask of the lanes whose shadow rays have the following directions and lengths. Others end at the
    /// exact place on their lamp.
    pub ends_before_lamp: u32,
    pub shadow_direction: Vec3Column<f32>,
    pub shadow_length: LaneColumn<f32>,
    /// Place of the sampled point on the lamp, see [`RectangleLamps::surface`].
    pub lamp_place: [LaneColumn<f32>; 2],
    /// Reflected radiance times the path's throughput, if nothing blocks the light.
    pub reflected: Vec3Column<f32>,
    /// Mask of the lanes whose path goes on.
    pub continues: u32,
    /// Mask of the lanes whose path ends because its throughput is not finite.
    pub overflows: u32,
    pub direction: Vec3Column<f32>,
    /// Density by solid angle of the direction.
    pub density: LaneColumn<f32>,
    pub throughput: Vec3Column<f32>,
}

/// Task of [`run_in_lanes_of`]: shades vertices.
struct DiffuseVertexTask<'a> {
    vertices: &'a VertexLanes<f32>,
    lamps: &'a RectangleLamps,
}

impl LaneTask for DiffuseVertexTask<'_> {
    type Output = ShadedDiffuseLanes;
    #[inline(always)]
    fn run<S: Simd>(self, zero: SimdFloats<S>) -> ShadedDiffuseLanes {
        shade(self.vertices, self.lamps, zero)
    }
}

/// Shades vertices, as many as `zero` has lanes.
#[inline(always)]
fn shade<F: LaneFloats>(
    vertices: &VertexLanes<f32>,
    lamps: &RectangleLamps,
    zero: F,
) -> ShadedDiffuseLanes {
    let (one, none) = (zero.like(1.0), zero);
    let surface = &vertices.surface;
    let point = LaneVector::load_like(zero, &surface.point);
    let geometric = LaneVector::load_like(zero, &vertices.geometric);
    let normal = LaneVector::load_like(zero, &vertices.normal);
    let albedo = LaneVector::load_like(zero, &vertices.base);
    let throughput = LaneVector::load_like(zero, &vertices.throughput);
    let (above, below) = (
        LaneVector::load_like(zero, &surface.above),
        LaneVector::load_like(zero, &surface.below),
    );
    let side = geometric.dot(LaneVector::load_like(zero, &surface.normal));
    let base = LaneVector::new(
        zero.select_less(side, above.x, below.x),
        zero.select_less(side, above.y, below.y),
        zero.select_less(side, above.z, below.z),
    );
    let start = ray_start(base, geometric, zero.load_like(&surface.error));
    let cosine = -normal.dot(LaneVector::load_like(zero, &vertices.direction));

    let [coarse, fine, x, y] = &vertices.light_numbers;
    let light = lamps.sample(
        (point, normal),
        add_numbers(zero.load_like(coarse), zero.load_like(fine)),
        [zero.load_like(x), zero.load_like(y)],
    );
    let across = light.end - start;
    let length = across.dot(across).sqrt();
    let shadow_direction = across * (one / length);
    // The ray must approach the lamp and leave the surface: then it meets neither.
    let leaves = zero.like(LEAST_COSINE).select_less(
        geometric.dot(shadow_direction),
        light.end_margin,
        none,
    );
    let ends_before_lamp = light
        .normal
        .dot(shadow_direction)
        .select_less(none, leaves, none);
    let facing = normal.dot(light.direction);
    // The power heuristic of both techniques.
    let ratio = facing * zero.like(FRAC_1_PI) / light.density;
    let share = one / (one + ratio * ratio);
    let reflected = albedo * light.radiance * (ratio * share) * throughput;
    // One where the sampled light is reflected, else zero; false for NaN.
    let lit = none.select_less(cosine, one, none);
    let lit = none.select_less(facing, lit, none);
    let lit = none.select_less(light.density, lit, none);
    let lit = zero
        .like(LEAST_COSINE)
        .select_less(geometric.dot(light.direction), lit, none);
    let lit = none.select_less(reflected.max_element(), lit, none);

    let [_, u, v, u_roulette] = &vertices.numbers;
    let u = zero.load_like(u);
    let height = (one - u).max_or_second(zero).sqrt();
    let [cos, sin] = zero.load_like(v).cos_sin_turns();
    let radius = u.sqrt();
    let direction = to_world(normal, [radius * cos, radius * sin, height]);
    let valid = none.select_less(cosine, one, none);
    let valid = none.select_less(height, valid, none);
    let valid = zero
        .like(LEAST_COSINE)
        .select_less(geometric.dot(direction), valid, none);
    let after = throughput * albedo;
    let brightest = after.max_element();
    let infinite = zero.like(f32::INFINITY);
    // The sum of all components is not finite if any is not. No component is negative.
    let is_finite = after.absolute_sum().select_less(infinite, one, none);
    let survival = (brightest * zero.load_like(&vertices.survival_scale)).min_or_second(one);
    let continues = zero
        .load_like(u_roulette)
        .select_less(survival, valid, none);
    let continues = none.select_less(brightest, continues, none);
    ShadedDiffuseLanes {
        start: start.to_columns(),
        lit: lit.positive_lanes(),
        lamp: light.lamp.to_array(),
        light_density: light.density.to_array(),
        light_radiance: light.radiance.max_element().to_array(),
        ends_before_lamp: ends_before_lamp.positive_lanes(),
        shadow_direction: shadow_direction.to_columns(),
        shadow_length: length.to_array(),
        lamp_place: light.place.map(F::to_array),
        reflected: reflected.to_columns(),
        continues: (continues * is_finite).positive_lanes(),
        overflows: (valid - is_finite).positive_lanes(),
        direction: direction.to_columns(),
        density: (height * zero.like(FRAC_1_PI)).to_array(),
        throughput: (after * (one / survival)).to_columns(),
    }
}

/// Returns the origin of rays from a base point to the side of the geometric normal: off the surface by the
/// error bound, and each coordinate rounded away from it.
#[inline(always)]
fn ray_start<F: LaneFloats>(
    point: LaneVector<F>,
    geometric: LaneVector<F>,
    error: F,
) -> LaneVector<F> {
    let moved = point + geometric * (geometric.absolute_sum() * error);
    LaneVector::new(
        away(moved.x, geometric.x),
        away(moved.y, geometric.y),
        away(moved.z, geometric.z),
    )
}

#[inline(always)]
fn away<F: LaneFloats>(number: F, sign: F) -> F {
    number + (number.abs() * number.like(NEXT_NUMBER)).flip_sign(sign)
}

/// Returns a vector of a frame about a unit normal in the world, as
/// [`ShadingFrame::from_normal`](crate::material::ShadingFrame::from_normal).
#[inline(always)]
fn to_world<F: LaneFloats>(n: LaneVector<F>, [x, y, z]: [F; 3]) -> LaneVector<F> {
    let one = z.like(1.0);
    let sign = one.flip_sign(n.z);
    let a = -one / (sign + n.z);
    let b = n.x * n.y * a;
    let tangent = LaneVector::new(one + sign * n.x * n.x * a, sign * b, -(sign * n.x));
    let bitangent = LaneVector::new(b, sign + n.y * n.y * a, -n.y);
    tangent * x + bitangent * y + n * z
}

impl<R: Real> PathTracer<'_, R> {
    /// Returns the tables of the lamps if all lights permit this kind of vertex.
    pub(super) fn diffuse_vertex_lamps(&self) -> Option<RectangleLamps> {
        let lamps = self
            .scene
            .lights
            .rectangle_lamps(&self.scene.geometry)
            .filter(|_| R::IS_SINGLE)?;
        let is_plain = |emitter: u32| {
            let light = LightId::Emitter(emitter);
            self.needs_one_shadow_ray(light)
                && self.scene.light_sampling_strategy(light) == LightSampling::Both
        };
        lamps.emitters.into_iter().all(is_plain).then_some(lamps)
    }

    /// Shades matte vertices, and continues their paths. Clears the flags of paths that end.
    pub(super) fn shade_diffuse_vertices(
        &mut self,
        slice: &mut WavefrontSlice<'_, R>,
        batches: &[VertexLanes<R>],
        lamps: &RectangleLamps,
        survives: &mut [bool],
    ) {
        for batch in batches {
            // Always succeeds: other precisions have no such lamps.
            let Some(vertices) = (batch as &dyn Any).downcast_ref() else {
                return;
            };
            let shaded = run_in_lanes_of(self.registers, DiffuseVertexTask { vertices, lamps });
            for lane in 0..batch.len {
                let index = batch.hit_indices[lane] as usize;
                if shaded.lit >> lane & 1 != 0 {
                    self.add_lamp_light(slice, lamps, (batch, &shaded, lane));
                }
                survives[index] = self.continue_diffuse_path(slice, (batch, lane), &shaded);
            }
        }
    }

    /// Adds the light of the lamp that a vertex sampled, if nothing blocks it.
    #[inline(always)]
    fn add_lamp_light(
        &mut self,
        slice: &mut WavefrontSlice<'_, R>,
        lamps: &RectangleLamps,
        (batch, shaded, lane): (&VertexLanes<R>, &ShadedDiffuseLanes, usize),
    ) {
        let index = batch.hit_indices[lane] as usize;
        let path = &mut slice.paths[slice.active[index] as usize];
        let light = LightId::Emitter(lamps.emitters[shaded.lamp[lane] as usize % LANES]);
        let (ray, length, sides) = if shaded.ends_before_lamp >> lane & 1 != 0 {
            let (start, direction) = (&shaded.start, &shaded.shadow_direction);
            let ray = Ray::new(vector::<R>(start, lane), vector::<R>(direction, lane));
            (ray, R::from_f32(shaded.shadow_length[lane]), [true; 2])
        } else {
            let place = shaded.lamp_place.map(|column| column[lane]);
            let target = lamps.surface(shaded.lamp[lane] as usize, place);
            let surface = batch.surface.get_lane(lane);
            surface.spawn_unchecked_ray_to_surface(&target)
        };
        let ends = self.shadow_ray_ends(&slice.hits[index], light, sides);
        // If the lamp lies at the point, nothing blocks it.
        let visible = if length > R::ZERO && length.is_finite() {
            let (min, ray) = (R::ZERO, ray.with_time(path.segment.ray.time));
            let range = Interval { min, max: length };
            self.shadow_transmittance((&ray, &ends), range, None, false)
        } else {
            R::ONE
        };
        if visible > R::ZERO {
            path.radiance += vector::<R>(&shaded.reflected, lane) * visible;
        }
        self.usage.count_ray(light, visible > R::ZERO);
    }

    /// Continues the path of a vertex, or ends it. Returns whether it goes on.
    #[inline(always)]
    fn continue_diffuse_path(
        &mut self,
        slice: &mut WavefrontSlice<'_, R>,
        (vertices, lane): (&VertexLanes<R>, usize),
        shaded: &ShadedDiffuseLanes,
    ) -> bool {
        let index = vertices.hit_indices[lane] as usize;
        let path = &mut slice.paths[slice.active[index] as usize];
        if shaded.continues >> lane & 1 == 0 {
            if shaded.overflows >> lane & 1 != 0 {
                path.radiance = Vector::splat(R::INFINITY);
            }
            return false;
        }
        let sampled = f64::from(shaded.light_density[lane]);
        if sampled > 0.0 {
            path.light_sample = [sampled, shaded.light_radiance[lane].into()];
        }
        let (start, direction) = (
            vector::<R>(&shaded.start, lane),
            vector::<R>(&shaded.direction, lane),
        );
        let leaves = (
            vector::<R>(&shaded.throughput, lane),
            shaded.density[lane].into(),
        );
        let normal = get_lane_vector::<R>(&vertices.normal, lane);
        self.start_segment(
            path,
            get_lane_vector::<R>(&vertices.surface.point, lane),
            leaves,
            (&Ray::new(start, direction), normal),
            &ScatteredRay::REFLECTED,
        );
        true
    }
}

/// Returns the vector in a lane.
#[inline(always)]
fn vector<R: Real>([x, y, z]: &Vec3Column<f32>, lane: usize) -> R::Vec3 {
    Vector::new(
        R::from_f32(x[lane]),
        R::from_f32(y[lane]),
        R::from_f32(z[lane]),
    )
}

#[cfg(test)]
mod tests;
