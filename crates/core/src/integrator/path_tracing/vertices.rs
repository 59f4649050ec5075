//! Batches of vertices as structures of arrays, one vertex in each SIMD lane.

use raywright_bvh::{Hit, Real};

use super::{PathState, VertexSamples};
use crate::interaction::Interaction;
use crate::light::{
    LANES, LaneColumn, ReceivingPointLanes, SurfaceLanes, Vec3Column, set_lane_vector,
};
use crate::material::MetallicRoughness;
use crate::settings::RouletteStart;

/// The paths of a wavefront at their current segment, with hits and interactions.
pub(super) struct WavefrontSlice<'a, R: Real> {
    pub paths: &'a mut [PathState<R>],
    /// Indices of the paths whose segment hit a surface; these paths are called active.
    pub active: &'a [u32],
    /// Number of active paths on uniform triangles, the first of `active`. They have no
    /// interactions.
    pub uniform: usize,
    /// Interactions of the active paths, in the order of `active`. `hits` has the same order.
    pub interactions: &'a mut [Interaction<R>],
    pub hits: &'a [Hit<R>],
}

impl<R: Real> WavefrontSlice<'_, R> {
    /// Returns the path and the interaction of a vertex, given its index in `active`. The vertex
    /// must not lie on a uniform triangle.
    #[inline(always)]
    pub fn path_and_interaction(&self, index: u32) -> (&PathState<R>, &Interaction<R>) {
        (
            &self.paths[self.active[index as usize] as usize],
            &self.interactions[index as usize],
        )
    }
}

/// Sides on which a surface receives sampled light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LitSides {
    /// Neither side: all lobes are delta lobes.
    None,
    /// The side of its normal.
    One,
    /// Both sides, since the surface transmits.
    Both,
}

/// Weighting of a light sample, also for multiple importance sampling.
#[derive(Clone, Copy, Debug)]
pub(super) enum MisStrategy {
    /// BSDF value without a weight: BSDF sampling does not find this light.
    Unweighted,
    /// BSDF value without a weight, for a delta light. `shines`: whether the light makes
    /// highlights.
    Delta { shines: bool },
    /// The BSDF value, weighted by the densities of light sampling and of BSDF sampling.
    PowerHeuristic,
}

impl MisStrategy {
    /// Whether the light makes no highlights: only the diffuse part of the BSDF counts.
    pub fn is_diffuse_only(&self) -> bool {
        matches!(self, Self::Delta { shines: false })
    }
}

/// A batch of at most [`LANES`] vertices, with the data of their paths.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexLanes<R: Real> {
    /// Number of vertices.
    pub len: usize,
    /// Indices of the vertices in [`WavefrontSlice::active`].
    pub hit_indices: LaneColumn<u32>,
    pub surface: SurfaceLanes<R>,
    /// Geometric normal on the path's side.
    pub geometric: Vec3Column<R>,
    pub normal: Vec3Column<R>,
    /// Unit direction of the incoming ray.
    pub direction: Vec3Column<R>,
    pub sides: LaneColumn<LitSides>,
    /// Base colour of common surfaces.
    pub base: Vec3Column<R>,
    /// Further terms of common surfaces: metallic, roughness, and the dielectric's reflectances at
    /// normal and at grazing incidence. Unused for matte surfaces.
    pub model_terms: [LaneColumn<R>; 4],
    /// Factor on the light of delta lights, whose unit differs between classic and physical
    /// materials.
    pub gain: LaneColumn<R>,
    pub throughput: Vec3Column<R>,
    /// Uniform numbers in [0, 1) for the lobe, the direction (two numbers), and Russian roulette.
    pub numbers: [LaneColumn<R>; 4],
    /// Uniform numbers for the light, see [`ReceivingPointLanes`].
    pub light_numbers: [LaneColumn<f32>; 4],
    /// Factor from the throughput to the survival probability; infinite without Russian roulette.
    pub survival_scale: LaneColumn<R>,
    /// Weighting of the light sample.
    pub strategy: LaneColumn<MisStrategy>,
}

impl<R: Real> VertexLanes<R> {
    pub fn new() -> Self {
        let none = [[R::ZERO; LANES]; 3];
        Self {
            len: 0,
            hit_indices: [0; LANES],
            surface: SurfaceLanes::new(),
            geometric: none,
            normal: none,
            direction: none,
            sides: [LitSides::One; LANES],
            base: none,
            model_terms: [none[0]; 4],
            gain: none[0],
            throughput: none,
            numbers: [none[0]; 4],
            light_numbers: [[0.0; LANES]; 4],
            survival_scale: none[0],
            strategy: [MisStrategy::Unweighted; LANES],
        }
    }

    /// Adds a vertex, and returns its lane. `normal` is the normal of the vertex's BSDF, `gain` the
    /// factor on delta lights, `index` the vertex's index in [`WavefrontSlice::active`].
    #[inline(always)]
    pub fn push_vertex(
        &mut self,
        index: u32,
        (path, interaction, samples): (&PathState<R>, &Interaction<R>, &VertexSamples),
        (normal, sides, gain): (R::Vec3, LitSides, R),
        roulette: RouletteStart,
    ) -> usize {
        let lane = self.push_path(index, (path, samples), (sides, gain), roulette);
        self.surface.set_lane(lane, &interaction.surface);
        set_lane_vector::<R>(
            &mut self.geometric,
            lane,
            if interaction.outside {
                interaction.surface.normal
            } else {
                -interaction.surface.normal
            },
        );
        set_lane_vector::<R>(&mut self.normal, lane, normal);
        lane
    }

    /// Adds a vertex without its surface, as [`Self::push_vertex`].
    #[inline(always)]
    pub fn push_path(
        &mut self,
        index: u32,
        (path, samples): (&PathState<R>, &VertexSamples),
        (sides, gain): (LitSides, R),
        roulette: RouletteStart,
    ) -> usize {
        let lane = self.len;
        self.len += 1;
        self.hit_indices[lane] = index;
        set_lane_vector::<R>(&mut self.direction, lane, path.segment.ray.direction);
        self.sides[lane] = sides;
        self.gain[lane] = gain;
        set_lane_vector::<R>(&mut self.throughput, lane, path.throughput);
        for (column, number) in self.numbers.iter_mut().zip(samples.scatter) {
            column[lane] = R::from_f32(number);
        }
        for (column, number) in self.light_numbers.iter_mut().zip(samples.light) {
            column[lane] = number;
        }
        self.survival_scale[lane] = path.survival_scale(roulette);
        lane
    }

    /// Sets the material model of the common surface in a lane.
    #[inline(always)]
    pub fn set_material_model(&mut self, lane: usize, model: &MetallicRoughness<R>) {
        set_lane_vector::<R>(&mut self.base, lane, model.base);
        let terms = [
            model.metallic,
            model.roughness,
            model.dielectric,
            model.grazing,
        ];
        for (column, term) in self.model_terms.iter_mut().zip(terms) {
            column[lane] = term;
        }
    }

    /// Returns the vertices as points for which lights are sampled.
    #[inline(always)]
    pub fn receiving_points(&self) -> ReceivingPointLanes<'_, R> {
        ReceivingPointLanes {
            point: &self.surface.point,
            normal: &self.normal,
            is_two_sided: self.sides.map(|sides| sides == LitSides::Both),
            numbers: &self.light_numbers,
        }
    }

    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.len == LANES
    }
}

/// A list of vertices in batches of [`LANES`]. Cleared batches are kept to reuse their memory.
#[derive(Clone, Debug, Default)]
pub(super) struct VertexList<R: Real> {
    lanes: Vec<VertexLanes<R>>,
    used: usize,
}

impl<R: Real> VertexList<R> {
    pub fn clear(&mut self) {
        self.used = 0;
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.used
            .checked_sub(1)
            .map_or(0, |last| last * LANES + self.lanes[last].len)
    }

    /// Returns the last batch if it has room for a vertex, else a new batch.
    #[inline(always)]
    pub fn batch_with_free_lane(&mut self) -> &mut VertexLanes<R> {
        if self.used == 0 || self.lanes[self.used - 1].is_full() {
            if self.used == self.lanes.len() {
                self.lanes.push(VertexLanes::new());
            }
            self.lanes[self.used].len = 0;
            self.used += 1;
        }
        &mut self.lanes[self.used - 1]
    }

    pub fn batches(&mut self) -> &mut [VertexLanes<R>] {
        &mut self.lanes[..self.used]
    }
}
