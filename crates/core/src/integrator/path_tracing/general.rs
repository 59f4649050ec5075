//! Vertices on uncommon surfaces, each with its own lobes: their creation, and evaluation and
//! sampling of their BSDFs. All later stages are shared with common surfaces.

use core::f64::consts::PI;

use raywright_bvh::{Hit, Real, Vector};

use super::super::spawn::round_direction;
use super::bsdf_lanes::{BsdfLanes, LaneVertex, eval_bsdf_for_light};
use super::mixture_material::MixtureSurface;
use super::scatter::ScatteredRay;
use super::vertices::{LitSides, VertexLanes, VertexList, WavefrontSlice};
use super::{PathState, PathTracer, VertexSamples, classic};
use crate::interaction::Interaction;
use crate::light::{LaneColumn, LightSampleLanes, get_lane_vector};
use crate::material::{
    Bsdf, BsdfLobe, Glass, LayeredBsdf, MetallicRoughness, ScatteringLobe, ShadingFrame,
};
use crate::prepare::{ClassicInputs, LayeredInputs, PhysicalInputs, PreparedMaterial};

/// Lobes of a surface at a hit.
#[derive(Clone, Copy)]
enum SurfaceLobes {
    /// Index among the BSDFs. These are built in place, as they are too large to be moved.
    Bsdf(usize),
    /// Index among the layered BSDFs.
    Layered(usize),
    /// Index among the mixtures.
    Mixture(usize),
}

/// Surface at a hit: its lobes, the glass from which exact mirror and refracted directions are
/// computed, and the vertex's normal, lit sides and gain of delta lights. The lobes are stored in
/// [`GeneralSurfaces`].
type GeneralSurface<R> = (
    SurfaceLobes,
    Option<Glass<R>>,
    (<R as Real>::Vec3, LitSides, R),
);

/// Surfaces of the vertices in the general queue; kept to reuse the memory of the lists.
#[derive(Default)]
pub(super) struct GeneralSurfaces<R: Real> {
    /// The lobes of each surface, and the glass from which exact mirror and refracted directions
    /// are computed.
    surfaces: Vec<(SurfaceLobes, Option<Glass<R>>)>,
    bsdfs: BsdfPool<Bsdf<R>>,
    layered: BsdfPool<LayeredBsdf<R>>,
    mixtures: Vec<MixtureSurface<R>>,
}

/// BSDFs of which the first `used` are in use; kept to reuse the memory.
struct BsdfPool<B> {
    bsdfs: Vec<B>,
    used: usize,
}

impl<B> Default for BsdfPool<B> {
    fn default() -> Self {
        Self {
            bsdfs: Vec::new(),
            used: 0,
        }
    }
}

impl<R: Real, L: BsdfLobe<R>, const MOST: usize> BsdfPool<Bsdf<R, L, MOST>> {
    /// Returns an unused BSDF, without lobes, and its index.
    fn next_bsdf(&mut self, normal: R::Vec3) -> (&mut Bsdf<R, L, MOST>, usize) {
        let index = self.used;
        if index == self.bsdfs.len() {
            self.bsdfs.push(Bsdf::new(normal));
        }
        self.used += 1;
        let bsdf = &mut self.bsdfs[index];
        bsdf.reset(normal);
        (bsdf, index)
    }
}

impl<R: Real> GeneralSurfaces<R> {
    pub fn clear(&mut self) {
        self.surfaces.clear();
        self.mixtures.clear();
        (self.bsdfs.used, self.layered.used) = (0, 0);
    }
}

/// Returns the sides of a surface on which its BSDF receives sampled light.
fn lit_sides<R: Real, L: BsdfLobe<R>, const MOST: usize>(bsdf: &Bsdf<R, L, MOST>) -> LitSides {
    match (bsdf.is_delta(), bsdf.is_transmissive()) {
        (true, _) => LitSides::None,
        (false, true) => LitSides::Both,
        (false, false) => LitSides::One,
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Builds the lobes of the surface at a hit and adds its vertex; a path at a smooth surface of
    /// one lobe goes on at once. Returns whether the path goes on.
    pub(super) fn build_general_vertex(
        &mut self,
        position: u32,
        (path, hit, interaction): (&mut PathState<R>, &Hit<R>, &Interaction<R>),
        samples: &VertexSamples,
        (vertices, surfaces): (&mut VertexList<R>, &mut GeneralSurfaces<R>),
    ) -> bool {
        let scene = self.scene;
        let (lobes, glass, vertex_response) = match &scene.materials[interaction.material as usize]
        {
            PreparedMaterial::Classic(m) => {
                let surface = self.build_classic_surface(path, interaction, m, surfaces);
                if let (SurfaceLobes::Bsdf(index), glass, _) = &surface
                    && let [lobe] = surfaces.bsdfs.bsdfs[*index].lobes()
                    && lobe.is_delta()
                {
                    let lobe = (lobe, glass.as_ref());
                    return self.scatter_smoothly(path, (hit, interaction), lobe, samples);
                }
                surface
            }
            PreparedMaterial::Physical(m) => match m.layers {
                Some(layers) => {
                    let layers = &scene.layers[layers as usize];
                    self.build_layered_surface((path, hit, interaction), (m, layers), surfaces)
                }
                None => {
                    let model = self.unlayered_model(path, interaction, m);
                    if let Some(lobe) = model.smooth_lobe(interaction.outside) {
                        let lobe = (&lobe, model.glass.as_ref());
                        return self.scatter_smoothly(path, (hit, interaction), lobe, samples);
                    }
                    self.build_unlayered_surface(interaction, &model, surfaces)
                }
            },
            PreparedMaterial::Unused => return false,
        };
        vertices.batch_with_free_lane().push_vertex(
            position,
            (path, interaction, samples),
            vertex_response,
            scene.roulette,
        );
        surfaces.surfaces.push((lobes, glass));
        true
    }

    /// Builds the lobes of a classic material at a hit.
    #[inline(always)]
    fn build_classic_surface(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        m: &ClassicInputs<R>,
        surfaces: &mut GeneralSurfaces<R>,
    ) -> GeneralSurface<R> {
        let context = self.scene.texture_tables.shading_context(interaction);
        // A delta light's unit is the radiance of a white classic surface facing it, not
        // its irradiance.
        let gain = R::from_f64(PI);
        if let Some(mixture) = &m.mixture {
            let surface = MixtureSurface::new(mixture, interaction, m.colour.eval_colour(&context));
            let sides = surface.lit_sides(mixture);
            let index = surfaces.mixtures.len();
            surfaces.mixtures.push(surface);
            let vertex_response = (interaction.facing_normal(), sides, gain);
            (SurfaceLobes::Mixture(index), None, vertex_response)
        } else {
            let mut glass = m
                .transmission
                .as_ref()
                .map(|transmission| transmission.glass);
            if let Some(glass) = glass.as_mut().filter(|_| self.has_nested_dielectrics()) {
                glass.ior = self.relative_ior(path, interaction, &context);
            }
            let normal = if glass.is_some() {
                interaction.facing_normal()
            } else {
                interaction.normal
            };
            let (bsdf, index) = surfaces.bsdfs.next_bsdf(normal);
            classic::add_classic_lobes(bsdf, (m, glass.as_ref()), &context, interaction);
            let vertex_response = (normal, lit_sides(bsdf), gain);
            (SurfaceLobes::Bsdf(index), glass, vertex_response)
        }
    }

    /// Returns the model of a physical material without layers at a hit, relative to the surrounding
    /// medium.
    #[inline(always)]
    fn unlayered_model(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        m: &PhysicalInputs<R>,
    ) -> MetallicRoughness<R> {
        let context = self.scene.texture_tables.shading_context(interaction);
        let mut model = m.metallic_roughness_at(&context);
        if self.has_nested_dielectrics() {
            self.set_relative_ior(path, interaction, &context, &mut model);
        }
        model
    }

    /// Builds the lobes of a physical material without layers at a hit.
    #[inline(always)]
    fn build_unlayered_surface(
        &self,
        interaction: &Interaction<R>,
        model: &MetallicRoughness<R>,
        surfaces: &mut GeneralSurfaces<R>,
    ) -> GeneralSurface<R> {
        let normal = if model.glass.is_some() {
            interaction.facing_normal()
        } else {
            interaction.normal
        };
        let (bsdf, index) = surfaces.bsdfs.next_bsdf(normal);
        model.add_lobes_to(
            bsdf,
            -interaction.direction,
            interaction.outside,
            self.scene.compensates,
        );
        let vertex_response = (normal, lit_sides(bsdf), R::ONE);
        (SurfaceLobes::Bsdf(index), model.glass, vertex_response)
    }

    /// Builds the lobes of a physical material with layers at a hit.
    #[inline(always)]
    fn build_layered_surface(
        &self,
        hit: (&mut PathState<R>, &Hit<R>, &Interaction<R>),
        material: (&PhysicalInputs<R>, &LayeredInputs<R>),
        surfaces: &mut GeneralSurfaces<R>,
    ) -> GeneralSurface<R> {
        let (path, hit, interaction) = hit;
        let (bsdf, index) = surfaces.layered.next_bsdf(Vector::ZERO);
        let glass = self.build_layered_bsdf(path, hit, interaction, material, bsdf);
        let vertex_response = (bsdf.normal(), lit_sides(bsdf), R::ONE);
        (SurfaceLobes::Layered(index), glass, vertex_response)
    }

    /// Evaluates and samples the BSDFs of a batch of general vertices, and sets the properties of
    /// their scattered rays. `before` is the number of vertices in earlier batches of the queue.
    pub(super) fn shade_general_vertices(
        &self,
        slice: &WavefrontSlice<'_, R>,
        (surfaces, before): (&GeneralSurfaces<R>, usize),
        (vertices, lights): (&VertexLanes<R>, &LightSampleLanes<R>),
        scattered_rays: &mut LaneColumn<ScatteredRay<R>>,
    ) -> BsdfLanes<R> {
        let mut vertex_response = BsdfLanes::NONE;
        for (lane, (scattered_ray, (lobes, glass))) in scattered_rays
            .iter_mut()
            .zip(&surfaces.surfaces[before..][..vertices.len])
            .enumerate()
        {
            let vertex = LaneVertex {
                slice,
                vertices,
                lights,
                lane,
            };
            *scattered_ray = match lobes {
                SurfaceLobes::Bsdf(index) => self.shade_vertex(
                    &vertex,
                    (&surfaces.bsdfs.bsdfs[*index], glass.as_ref()),
                    &mut vertex_response,
                ),
                SurfaceLobes::Layered(index) => self.shade_vertex(
                    &vertex,
                    (&surfaces.layered.bsdfs[*index], glass.as_ref()),
                    &mut vertex_response,
                ),
                SurfaceLobes::Mixture(index) => {
                    self.shade_mixture(&vertex, &surfaces.mixtures[*index], &mut vertex_response)
                }
            };
        }
        vertex_response
    }

    /// Evaluates and samples a BSDF at a vertex, and returns the properties of the scattered ray.
    fn shade_vertex<L: BsdfLobe<R>, const MOST: usize>(
        &self,
        vertex: &LaneVertex<'_, R>,
        (bsdf, glass): (&Bsdf<R, L, MOST>, Option<&Glass<R>>),
        vertex_response: &mut BsdfLanes<R>,
    ) -> ScatteredRay<R> {
        let (normal, view) = (bsdf.normal(), vertex.view_direction());
        if let Some(light) = vertex.light_direction() {
            vertex_response.set_bsdf_values(vertex.lane, &eval_bsdf_for_light(bsdf, view, light));
        }
        let [lobe, u, v, _] = vertex.random_numbers();
        let mut bsdf_sample = bsdf.sample(&ShadingFrame::from_normal(normal), view, [lobe, u, v]);
        let through = bsdf_sample.direction.dot(normal) < R::ZERO;
        // A shading normal must not turn a reflection below the surface, nor a transmission above
        // it.
        let geometric = get_lane_vector::<R>(&vertex.vertices.geometric, vertex.lane);
        if !bsdf_sample.is_valid || (geometric.dot(bsdf_sample.direction) < R::ZERO) != through {
            return ScatteredRay::REFLECTED;
        }
        let (index, mut rest) = (vertex.vertices.hit_indices[vertex.lane], Vector::ZERO);
        let (path, interaction) = vertex.slice.path_and_interaction(index);
        // A coat may mirror about its own normal, so its directions stay as sampled.
        if let Some(glass) = glass.filter(|_| bsdf_sample.delta && (through || !L::COATED)) {
            let hit = &vertex.slice.hits[index as usize];
            // The exact direction, with the digits that storing it loses.
            let interface = self
                .scene
                .dielectric_interface(&path.segment, hit, interaction, glass);
            let exact = if through {
                interface.refracted
            } else {
                Some(interface.reflected)
            };
            (bsdf_sample.direction, rest) =
                exact.map_or((bsdf_sample.direction, rest), round_direction::<R>);
        }
        let material = &self.scene.materials[interaction.material as usize];
        // Among delta lobes, only thin walls of opaque alpha transmit straight.
        let straight = L::COATED
            && bsdf_sample.delta
            && through
            && material.is_thin_wall()
            && material.blocks_straight_rays();
        vertex_response.set_bsdf_sample(vertex.lane, &bsdf_sample);
        ScatteredRay {
            direction_error: rest,
            is_delta: bsdf_sample.delta,
            is_transmitted: through,
            is_straight: straight,
        }
    }
}
