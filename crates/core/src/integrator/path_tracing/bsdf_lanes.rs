//! Evaluation and sampling of BSDFs at vertices. The same source serves a single vertex of any
//! surface and several vertices of common surfaces side by side; this file also moves numbers
//! between columns and SIMD lanes.

use core::array::from_fn;

use raywright_bvh::{Real, SimdTask, Vector, run_widest};

use super::vertices::{VertexLanes, WavefrontSlice};
use crate::interaction::Interaction;
use crate::light::{Column, LANES, LightLanes, LightTargetKind, Vec3Column, lane_vector, set_lane};
use crate::material::{
    Bsdf, BsdfSample, Lambert, LobeFamily, MetallicRoughness, NormalMap, ShadingFrame,
};
use crate::number::{Lanes, Mask, Number, Vector3};

/// BSDF values of surfaces for the direction of a sampled light.
#[derive(Clone, Copy)]
pub(super) struct LightResponse<N: Number> {
    /// BSDF value, and its diffuse part, for lights that make no highlights.
    pub value: N::Vec3,
    pub diffuse: N::Vec3,
    /// Density by solid angle with which the BSDF samples the light's direction.
    pub density: N,
}

/// Evaluates the BSDFs of surfaces for a light's direction and a view direction. `dull`: whether
/// the light, or any of several lights, makes no highlights.
#[inline(always)]
pub(super) fn eval_light<N: Number, L: LobeFamily<N>, const MOST: usize>(
    bsdf: &Bsdf<N, L, MOST>,
    view: N::Vec3,
    (direction, dull): (N::Vec3, bool),
) -> LightResponse<N> {
    let (value, density) = bsdf.eval_and_pdf(view, direction);
    let diffuse = if dull {
        bsdf.eval_diffuse(view, direction)
    } else {
        N::Vec3::ZERO
    };
    LightResponse {
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
    /// Densities with which the BSDFs sample the lights' directions.
    pub light_density: Column<R>,
    /// Validity of the sampled direction, the direction, its weight, and its density; the density
    /// is infinite for mirrors and clear glass.
    pub some: Column<bool>,
    pub direction: Vec3Column<R>,
    pub weight: Vec3Column<R>,
    pub density: Column<R>,
}

/// SIMD task: evaluates and samples the BSDFs of common surfaces. `MATTE`: surfaces without
/// specular reflection, which have a single lobe with the same numbers as the full model.
pub(super) struct BsdfTask<'a, R: Real, const MATTE: bool> {
    pub vertices: &'a VertexLanes<R>,
    pub lights: &'a LightLanes<R>,
    /// Whether multiple scattering among microfacets is included.
    pub compensated: bool,
}

impl<R: Real, const MATTE: bool> SimdTask for BsdfTask<'_, R, MATTE> {
    type Output = BsdfLanes<R>;
    #[inline(always)]
    fn run(self) -> BsdfLanes<R> {
        let (mut bsdf_lanes, v, lights) = (BsdfLanes::NONE, self.vertices, &self.lights.direction);
        if R::IS_SINGLE {
            bsdf_lanes.add::<Lanes<LANES>, MATTE>(0, v, lights, self.compensated);
        } else {
            (0..v.len)
                .for_each(|lane| bsdf_lanes.add::<R, MATTE>(lane, v, lights, self.compensated));
        }
        for lane in 0..LANES {
            // A shading normal must not turn a reflection below the surface.
            let (geometric, direction) = (
                lane_vector::<R>(&v.geometric, lane),
                lane_vector::<R>(&bsdf_lanes.direction, lane),
            );
            let below = Vector::dot(geometric, direction) < R::ZERO;
            bsdf_lanes.some[lane] &= !below;
        }
        bsdf_lanes
    }
}

impl<R: Real> BsdfLanes<R> {
    pub const NONE: Self = Self {
        value: [[R::ZERO; LANES]; 3],
        diffuse: [[R::ZERO; LANES]; 3],
        light_density: [R::ZERO; LANES],
        some: [false; LANES],
        direction: [[R::ZERO; LANES]; 3],
        weight: [[R::ZERO; LANES]; 3],
        density: [R::ZERO; LANES],
    };

    /// Sets the BSDF values of the vertex in a lane.
    pub fn put_response(&mut self, lane: usize, response: &LightResponse<R>) {
        set_lane::<R>(&mut self.value, lane, response.value);
        set_lane::<R>(&mut self.diffuse, lane, response.diffuse);
        self.light_density[lane] = response.density;
    }

    /// Sets the BSDF sample of the vertex in a lane.
    pub fn put_sample(&mut self, lane: usize, bsdf_sample: &BsdfSample<R>) {
        self.some[lane] = bsdf_sample.some;
        set_lane::<R>(&mut self.direction, lane, bsdf_sample.direction);
        set_lane::<R>(&mut self.weight, lane, bsdf_sample.weight);
        self.density[lane] = if bsdf_sample.delta {
            R::INFINITY
        } else {
            bsdf_sample.density
        };
    }

    /// Evaluates and samples as many vertices as the number type `N` has lanes, starting at the
    /// lane `from`.
    #[inline(always)]
    fn add<N: Number, const MATTE: bool>(
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
            .fold(false, |some, strategy| some | strategy.is_dull());
        let (normal, view, base) = (
            load3::<N, R>(&v.normal, from),
            -load3::<N, R>(&v.direction, from),
            load3::<N, R>(&v.base, from),
        );
        let light = (load3::<N, R>(lights, from), dull);
        let numbers = [
            load::<N, R>(&v.numbers[0], from),
            load::<N, R>(&v.numbers[1], from),
            load::<N, R>(&v.numbers[2], from),
        ];
        let (response, sampled) = if MATTE {
            let bsdf = Bsdf::<N, Lambert<N>, 1>::new(normal).with_lobe(Lambert { albedo: base });
            both(&bsdf, view, light, numbers)
        } else {
            let [metallic, roughness, dielectric, grazing] = &v.terms;
            let model = MetallicRoughness {
                base,
                metallic: load::<N, R>(metallic, from),
                roughness: load::<N, R>(roughness, from),
                dielectric: load::<N, R>(dielectric, from),
                grazing: load::<N, R>(grazing, from),
                glass: None,
            };
            both(
                &model.rough(normal, view, compensated),
                view,
                light,
                numbers,
            )
        };
        store3::<N, R>(&mut out.value, from, response.value);
        store3::<N, R>(&mut out.diffuse, from, response.diffuse);
        store::<N, R>(&mut out.light_density, from, response.density);
        store3::<N, R>(&mut out.direction, from, sampled.direction);
        store3::<N, R>(&mut out.weight, from, sampled.weight);
        store::<N, R>(&mut out.density, from, sampled.density);
        for lane in 0..N::LANES {
            out.some[from + lane] = sampled.some.lane(lane);
        }
    }
}

/// A vertex in a lane of a batch, with the data of its path and its light.
pub(super) struct LaneVertex<'a, R: Real> {
    pub slice: &'a WavefrontSlice<'a, R>,
    pub vertices: &'a VertexLanes<R>,
    pub lights: &'a LightLanes<R>,
    pub lane: usize,
}

impl<R: Real> LaneVertex<'_, R> {
    /// Returns the unit direction back along the incoming ray.
    pub fn view(&self) -> R::Vec3 {
        -lane_vector::<R>(&self.vertices.direction, self.lane)
    }

    /// Returns the unit direction to the sampled light, and whether the light makes no highlights;
    /// `None` without a light.
    pub fn light(&self) -> Option<(R::Vec3, bool)> {
        let is_seen = self.lights.target_kinds[self.lane] != LightTargetKind::Nothing;
        is_seen.then(|| {
            (
                lane_vector::<R>(&self.lights.direction, self.lane),
                self.vertices.strategy[self.lane].is_dull(),
            )
        })
    }

    /// Returns the uniform numbers in [0, 1) for the lobe, the direction (two numbers), and Russian
    /// roulette.
    pub fn numbers(&self) -> [R; 4] {
        self.vertices.numbers.map(|column| column[self.lane])
    }

    /// Returns the interaction at the vertex.
    pub fn interaction(&self) -> &Interaction<R> {
        self.slice.of(self.vertices.place[self.lane]).1
    }
}

/// Loads the SIMD lanes of a number from a column, starting at the lane `from`.
#[inline(always)]
fn load<N: Number, R: Real>(column: &Column<R>, from: usize) -> N {
    N::of_lanes(|lane| Real::to_f64(column[from + lane]))
}

#[inline(always)]
fn load3<N: Number, R: Real>([x, y, z]: &Vec3Column<R>, from: usize) -> N::Vec3 {
    N::Vec3::new(
        load::<N, R>(x, from),
        load::<N, R>(y, from),
        load::<N, R>(z, from),
    )
}

#[inline(always)]
fn store<N: Number, R: Real>(column: &mut Column<R>, from: usize, number: N) {
    for lane in 0..N::LANES {
        column[from + lane] = Real::from_f64(number.lane(lane));
    }
}

#[inline(always)]
fn store3<N: Number, R: Real>([x, y, z]: &mut Vec3Column<R>, from: usize, v: N::Vec3) {
    store::<N, R>(x, from, v.x());
    store::<N, R>(y, from, v.y());
    store::<N, R>(z, from, v.z());
}

#[inline(always)]
fn both<N: Number, L: LobeFamily<N>, const MOST: usize>(
    bsdf: &Bsdf<N, L, MOST>,
    view: N::Vec3,
    light: (N::Vec3, bool),
    numbers: [N; 3],
) -> (LightResponse<N>, BsdfSample<N>) {
    (
        eval_light(bsdf, view, light),
        bsdf.sample(&ShadingFrame::from_normal(bsdf.normal()), view, numbers),
    )
}

struct PerturbNormals<'a, N: Number>(&'a NormalMap<N>);

impl<N: Number> SimdTask for PerturbNormals<'_, N> {
    type Output = N::Vec3;
    #[inline(always)]
    fn run(self) -> N::Vec3 {
        self.0.perturbed_normal()
    }
}

/// Returns a SIMD mask from a predicate of the lane.
#[inline(always)]
fn mask<N: Number>(yes: impl Fn(usize) -> bool) -> N::Mask {
    let mut mask = N::Mask::default();
    (0..N::LANES)
        .filter(|&lane| yes(lane))
        .for_each(|lane| mask.set(lane));
    mask
}

/// Computes the perturbed normals of at most [`LANES`] vertices; `these` returns the normal map's
/// value in a lane.
#[inline(always)]
pub(super) fn perturbed_normals<'a, R: Real>(
    these: impl Fn(usize) -> &'a NormalMap<R>,
) -> [R::Vec3; LANES] {
    type N = Lanes<LANES>;
    if !R::IS_SINGLE {
        return from_fn(|lane| these(lane).perturbed_normal());
    }
    let vectors = |part: fn(&NormalMap<R>) -> R::Vec3| {
        <N as Number>::Vec3::of_lanes(|lane| part(these(lane)).to_f64())
    };
    let normals = run_widest(PerturbNormals(&NormalMap::<N> {
        normal: vectors(|curved| curved.normal),
        along: vectors(|curved| curved.along),
        mirrored: mask::<N>(|lane| these(lane).mirrored),
        code: vectors(|curved| curved.code),
        geometric: vectors(|curved| curved.geometric),
        outside: mask::<N>(|lane| these(lane).outside),
        direction: vectors(|curved| curved.direction),
    }));
    from_fn(|lane| R::Vec3::from_f64(normals.lane(lane)))
}
