//! Evaluation and sampling of BSDFs at vertices.
//!
//! The number type decides whether the code treats a single vertex or several vertices of common
//! surfaces in SIMD lanes. This file also copies numbers between columns and SIMD registers.

use core::array::from_fn;

use raywright_bvh::{Real, SimdTask, Vector, run_widest};

use super::vertices::{VertexLanes, WavefrontSlice};
use crate::interaction::Interaction;
use crate::light::{
    LANES, LaneColumn, LightSampleLanes, ShadowRayTargetKind, Vec3Column, get_lane_vector,
    set_lane_vector,
};
use crate::material::{
    Bsdf, BsdfLobe, BsdfSample, Lambert, MetallicRoughness, NormalMap, ShadingFrame,
};
use crate::number::{Lanes, Mask, Number, Vector3};

/// BSDF values for the direction to a sampled light; numbers may be SIMD registers of several
/// surfaces.
#[derive(Clone, Copy)]
pub(super) struct BsdfResponse<N: Number> {
    /// BSDF value.
    pub value: N::Vec3,
    /// Diffuse part of the value, for lights that make no highlights. Zero if not requested, see
    /// [`eval_bsdf_for_light`].
    pub diffuse: N::Vec3,
    /// Density by solid angle with which the BSDF samples the light's direction.
    pub density: N,
}

/// Evaluates BSDFs for the direction to a light. `view` points back along the incoming ray. `dull`:
/// whether the diffuse part is needed, because the light of at least one lane makes no highlights.
#[inline(always)]
pub(super) fn eval_bsdf_for_light<N: Number, L: BsdfLobe<N>, const MOST: usize>(
    bsdf: &Bsdf<N, L, MOST>,
    view: N::Vec3,
    (direction, dull): (N::Vec3, bool),
) -> BsdfResponse<N> {
    let (value, density) = bsdf.eval_and_pdf(view, direction);
    let diffuse = if dull {
        bsdf.eval_diffuse(view, direction)
    } else {
        N::Vec3::ZERO
    };
    BsdfResponse {
        value,
        diffuse,
        density,
    }
}

/// BSDF values and BSDF samples of vertices, in columns.
#[derive(Clone, Copy)]
pub(super) struct BsdfLanes<R: Real> {
    pub value: Vec3Column<R>,
    pub diffuse: Vec3Column<R>,
    /// Density by solid angle with which the BSDF samples the direction to the light.
    pub light_density: LaneColumn<R>,
    /// Whether the BSDF sample is valid.
    pub is_valid: LaneColumn<bool>,
    /// Sampled unit direction.
    pub direction: Vec3Column<R>,
    /// Weight of the BSDF sample, by which the path's throughput is multiplied.
    pub weight: Vec3Column<R>,
    /// Density of the sampled direction by solid angle; infinite for mirrors and clear glass.
    pub density: LaneColumn<R>,
}

/// SIMD task: evaluates and samples the BSDFs of common surfaces (rough, opaque, without layers).
///
/// `MATTE` selects surfaces without specular reflection. Their BSDF is a single diffuse lobe, with
/// the same numbers as the full model.
pub(super) struct BsdfTask<'a, R: Real, const MATTE: bool> {
    pub vertices: &'a VertexLanes<R>,
    pub lights: &'a LightSampleLanes<R>,
    /// Whether the BSDF includes multiple scattering among microfacets.
    pub energy_compensation: bool,
}

impl<R: Real, const MATTE: bool> SimdTask for BsdfTask<'_, R, MATTE> {
    type Output = BsdfLanes<R>;
    #[inline(always)]
    fn run(self) -> BsdfLanes<R> {
        let (mut bsdf_lanes, v, lights) = (BsdfLanes::NONE, self.vertices, &self.lights.direction);
        if R::IS_SINGLE {
            bsdf_lanes.eval_bsdf_lanes::<Lanes<LANES>, MATTE>(
                0,
                v,
                lights,
                self.energy_compensation,
            );
        } else {
            for lane in 0..v.len {
                bsdf_lanes.eval_bsdf_lanes::<R, MATTE>(lane, v, lights, self.energy_compensation);
            }
        }
        for lane in 0..LANES {
            // A shading normal must not turn a reflection below the surface.
            let (geometric, direction) = (
                get_lane_vector::<R>(&v.geometric, lane),
                get_lane_vector::<R>(&bsdf_lanes.direction, lane),
            );
            let below = Vector::dot(geometric, direction) < R::ZERO;
            bsdf_lanes.is_valid[lane] &= !below;
        }
        bsdf_lanes
    }
}

impl<R: Real> BsdfLanes<R> {
    pub const NONE: Self = Self {
        value: [[R::ZERO; LANES]; 3],
        diffuse: [[R::ZERO; LANES]; 3],
        light_density: [R::ZERO; LANES],
        is_valid: [false; LANES],
        direction: [[R::ZERO; LANES]; 3],
        weight: [[R::ZERO; LANES]; 3],
        density: [R::ZERO; LANES],
    };

    /// Sets the BSDF values of the vertex in a lane.
    pub fn set_bsdf_values(&mut self, lane: usize, response: &BsdfResponse<R>) {
        set_lane_vector::<R>(&mut self.value, lane, response.value);
        set_lane_vector::<R>(&mut self.diffuse, lane, response.diffuse);
        self.light_density[lane] = response.density;
    }

    /// Sets the BSDF sample of the vertex in a lane.
    pub fn set_bsdf_sample(&mut self, lane: usize, bsdf_sample: &BsdfSample<R>) {
        self.is_valid[lane] = bsdf_sample.is_valid;
        set_lane_vector::<R>(&mut self.direction, lane, bsdf_sample.direction);
        set_lane_vector::<R>(&mut self.weight, lane, bsdf_sample.weight);
        self.density[lane] = if bsdf_sample.delta {
            R::INFINITY
        } else {
            bsdf_sample.density
        };
    }

    /// Evaluates and samples the vertices of `N::LANES` lanes, starting at the lane `from`.
    #[inline(always)]
    fn eval_bsdf_lanes<N: Number, const MATTE: bool>(
        &mut self,
        from: usize,
        v: &VertexLanes<R>,
        lights: &Vec3Column<R>,
        compensated: bool,
    ) {
        let out = self;
        let dull = v
            .strategy
            .iter()
            .fold(false, |some, strategy| some | strategy.is_diffuse_only());
        let (normal, view, base) = (
            load_vector_lanes::<N, R>(&v.normal, from),
            -load_vector_lanes::<N, R>(&v.direction, from),
            load_vector_lanes::<N, R>(&v.base, from),
        );
        let light = (load_vector_lanes::<N, R>(lights, from), dull);
        let numbers = [
            load_lanes::<N, R>(&v.numbers[0], from),
            load_lanes::<N, R>(&v.numbers[1], from),
            load_lanes::<N, R>(&v.numbers[2], from),
        ];
        let (response, sampled) = if MATTE {
            let bsdf = Bsdf::<N, Lambert<N>, 1>::new(normal).with_lobe(Lambert { albedo: base });
            eval_and_sample(&bsdf, view, light, numbers)
        } else {
            let [metallic, roughness, dielectric, grazing] = &v.model_terms;
            let model = MetallicRoughness {
                base,
                metallic: load_lanes::<N, R>(metallic, from),
                roughness: load_lanes::<N, R>(roughness, from),
                dielectric: load_lanes::<N, R>(dielectric, from),
                grazing: load_lanes::<N, R>(grazing, from),
                glass: None,
            };
            eval_and_sample(
                &model.rough_bsdf(normal, view, compensated),
                view,
                light,
                numbers,
            )
        };
        store_vector_lanes::<N, R>(&mut out.value, from, response.value);
        store_vector_lanes::<N, R>(&mut out.diffuse, from, response.diffuse);
        store_lanes::<N, R>(&mut out.light_density, from, response.density);
        store_vector_lanes::<N, R>(&mut out.direction, from, sampled.direction);
        store_vector_lanes::<N, R>(&mut out.weight, from, sampled.weight);
        store_lanes::<N, R>(&mut out.density, from, sampled.density);
        for lane in 0..N::LANES {
            out.is_valid[from + lane] = sampled.is_valid.lane(lane);
        }
    }
}

/// A vertex in a lane of a batch, with the data of its path and its light.
pub(super) struct LaneVertex<'a, R: Real> {
    pub slice: &'a WavefrontSlice<'a, R>,
    pub vertices: &'a VertexLanes<R>,
    pub lights: &'a LightSampleLanes<R>,
    pub lane: usize,
}

impl<R: Real> LaneVertex<'_, R> {
    /// Returns the unit direction back along the incoming ray.
    pub fn view_direction(&self) -> R::Vec3 {
        -get_lane_vector::<R>(&self.vertices.direction, self.lane)
    }

    /// Returns the unit direction to the sampled light, and whether the light makes no highlights;
    /// `None` without a light.
    pub fn light_direction(&self) -> Option<(R::Vec3, bool)> {
        let is_seen = self.lights.target_kinds[self.lane] != ShadowRayTargetKind::Nothing;
        is_seen.then(|| {
            (
                get_lane_vector::<R>(&self.lights.direction, self.lane),
                self.vertices.strategy[self.lane].is_diffuse_only(),
            )
        })
    }

    /// Returns the uniform numbers in [0, 1) for the lobe, the direction (two numbers), and Russian
    /// roulette.
    pub fn random_numbers(&self) -> [R; 4] {
        self.vertices.numbers.map(|column| column[self.lane])
    }

    /// Returns the interaction at the vertex.
    pub fn interaction(&self) -> &Interaction<R> {
        self.slice
            .path_and_interaction(self.vertices.hit_indices[self.lane])
            .1
    }
}

/// Loads a SIMD register from a column, starting at the lane `from`.
#[inline(always)]
fn load_lanes<N: Number, R: Real>(column: &LaneColumn<R>, from: usize) -> N {
    N::from_lanes(|lane| Real::to_f64(column[from + lane]))
}

#[inline(always)]
fn load_vector_lanes<N: Number, R: Real>([x, y, z]: &Vec3Column<R>, from: usize) -> N::Vec3 {
    N::Vec3::new(
        load_lanes::<N, R>(x, from),
        load_lanes::<N, R>(y, from),
        load_lanes::<N, R>(z, from),
    )
}

#[inline(always)]
fn store_lanes<N: Number, R: Real>(column: &mut LaneColumn<R>, from: usize, number: N) {
    for lane in 0..N::LANES {
        column[from + lane] = Real::from_f64(number.lane(lane));
    }
}

#[inline(always)]
fn store_vector_lanes<N: Number, R: Real>([x, y, z]: &mut Vec3Column<R>, from: usize, v: N::Vec3) {
    store_lanes::<N, R>(x, from, v.x());
    store_lanes::<N, R>(y, from, v.y());
    store_lanes::<N, R>(z, from, v.z());
}

#[inline(always)]
fn eval_and_sample<N: Number, L: BsdfLobe<N>, const MOST: usize>(
    bsdf: &Bsdf<N, L, MOST>,
    view: N::Vec3,
    light: (N::Vec3, bool),
    numbers: [N; 3],
) -> (BsdfResponse<N>, BsdfSample<N>) {
    (
        eval_bsdf_for_light(bsdf, view, light),
        bsdf.sample(&ShadingFrame::from_normal(bsdf.normal()), view, numbers),
    )
}

struct PerturbNormalsTask<'a, N: Number>(&'a NormalMap<N>);

impl<N: Number> SimdTask for PerturbNormalsTask<'_, N> {
    type Output = N::Vec3;
    #[inline(always)]
    fn run(self) -> N::Vec3 {
        self.0.perturbed_normal()
    }
}

/// Returns the SIMD mask of the lanes for which a predicate holds.
#[inline(always)]
fn mask_from_lanes<N: Number>(yes: impl Fn(usize) -> bool) -> N::Mask {
    let mut mask = N::Mask::default();
    (0..N::LANES)
        .filter(|&lane| yes(lane))
        .for_each(|lane| mask.set_lane(lane));
    mask
}

/// Returns the perturbed normals of the vertices in all [`LANES`] lanes. `these` returns the value
/// of the normal map for a lane.
#[inline(always)]
pub(super) fn perturb_lane_normals<'a, R: Real>(
    these: impl Fn(usize) -> &'a NormalMap<R>,
) -> [R::Vec3; LANES] {
    type N = Lanes<LANES>;
    if !R::IS_SINGLE {
        return from_fn(|lane| these(lane).perturbed_normal());
    }
    let vectors = |part: fn(&NormalMap<R>) -> R::Vec3| {
        <N as Number>::Vec3::from_lanes(|lane| part(these(lane)).to_f64())
    };
    let normals = run_widest(PerturbNormalsTask(&NormalMap::<N> {
        normal: vectors(|curved| curved.normal),
        along: vectors(|curved| curved.along),
        mirrored: mask_from_lanes::<N>(|lane| these(lane).mirrored),
        code: vectors(|curved| curved.code),
        geometric: vectors(|curved| curved.geometric),
        outside: mask_from_lanes::<N>(|lane| these(lane).outside),
        direction: vectors(|curved| curved.direction),
    }));
    from_fn(|lane| R::Vec3::from_f64(normals.lane(lane)))
}
