//! Evaluation of materials at hits, and sorting of vertices into queues by kind of surface. All
//! work that depends on a vertex alone is done before its batch is shaded. Common surfaces (rough,
//! opaque, without layers) are by far the majority in real models.

use core::f64::consts::PI;

use raywright_bvh::{Hit, Real};

use super::bsdf_lanes::perturb_lane_normals;
use super::classic::build_matte_model;
use super::general::GeneralSurfaces;
use super::vertices::{LitSides, VertexList};
use super::{PathState, PathTracer, VertexSamples};
use crate::interaction::Interaction;
use crate::light::{LANES, set_lane_vector};
use crate::material::{MetallicRoughness, NormalMap};
use crate::prepare::PreparedMaterial;
use crate::sampler::{SamplePurpose, sample_2d};
use crate::scene::AlphaMode;
use crate::texture::NormalMapInput;

/// Kinds of vertices on common surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CommonKind {
    /// With specular reflection.
    Glossy,
    /// Without specular reflection.
    Matte,
    /// Without specular reflection, and the light is one of [`PathTracer::lamps`].
    UnderLamp,
}

/// Queues of vertices by kind: common surfaces, and all remaining surfaces. Kept between wavefronts to
/// reuse the memory of the lists.
#[derive(Default)]
pub(super) struct VertexQueues<R: Real> {
    /// By [`CommonKind`].
    pub common: [VertexList<R>; 3],
    pub general: VertexList<R>,
    pub surfaces: GeneralSurfaces<R>,
    /// Values of normal maps, each with the index of its vertex in the glossy queue.
    normal_maps: Vec<(usize, NormalMap<R>)>,
}

impl<R: Real> VertexQueues<R> {
    pub fn clear(&mut self) {
        self.common.iter_mut().for_each(VertexList::clear);
        self.general.clear();
        self.surfaces.clear();
        self.normal_maps.clear();
    }

    /// Perturbs the normals of the common surfaces with normal maps.
    pub fn perturb_normals(&mut self, interactions: &mut [Interaction<R>]) {
        let vertices = self.common[CommonKind::Glossy as usize].batches();
        for these in self.normal_maps.chunks(LANES) {
            let normals = perturb_lane_normals(|lane| &these[lane.min(these.len() - 1)].1);
            for (&(vertex, _), normal) in these.iter().zip(normals) {
                let (vertices, lane) = (&mut vertices[vertex / LANES], vertex % LANES);
                set_lane_vector::<R>(&mut vertices.normal, lane, normal);
                interactions[vertices.hit_indices[lane] as usize].normal = normal;
            }
        }
    }
}

/// A common surface at a hit: its material model, its factor on the light of delta lights, and its
/// normal map.
type CommonSurface<'a, R> = (MetallicRoughness<R>, R, Option<&'a NormalMapInput<R>>);

impl<R: Real> PathTracer<'_, R> {
    /// Adds the vertex at a hit to the queue of its kind. Returns whether the path goes on: at once
    /// behind the surface, or after shading.
    #[inline(always)]
    pub(super) fn queue_vertex(
        &mut self,
        index: u32,
        (path, hit, interaction): (&mut PathState<R>, &Hit<R>, &mut Interaction<R>),
        samples: &VertexSamples,
        vertices: &mut VertexQueues<R>,
    ) -> bool {
        let scene = self.scene;
        let material = &scene.materials[interaction.material as usize];
        let common = if path.segments_traced - path.matched_segments + 1 < self.max_depth {
            self.eval_common_surface(material, interaction)
        } else {
            None
        };
        if common.is_none() {
            interaction.apply_normal_map(scene, &path.segment, hit);
        }
        self.attenuate_by_media(path, interaction);
        self.record_first_hit(path, hit, interaction);
        if common.is_none()
            && let Some(continues) = self.continue_behind_absent_surface(path, interaction)
        {
            return continues;
        }
        path.has_hit = true;
        path.segments_traced += 1;
        if path.segments_traced == 1
            && let Some(edge) = scene.edge_colour_at(&path.segment, hit, interaction)
        {
            self.end_on_wireframe_edge(path, edge);
            return false;
        }
        if material.emits() {
            let emission = self.emission_at_hit(&path.segment, hit, interaction);
            self.add_emission(path, hit, interaction, emission);
        }
        let Some((mut model, gain, bump)) = common else {
            return self.queue_general_vertex(index, (path, hit, interaction), samples, vertices);
        };
        // A matte surface does not depend on an index of refraction.
        if self.has_nested_dielectrics() && matches!(material, PreparedMaterial::Physical(_)) {
            self.set_relative_ior(
                path,
                interaction,
                &scene.texture_tables.shading_context(interaction),
                &mut model,
            );
        }
        // Normal maps are applied to the glossy queue alone.
        let kind = self.common_kind(model.is_matte() && bump.is_none(), samples);
        let list = &mut vertices.common[kind as usize];
        if let Some(bump) = bump {
            vertices.normal_maps.push((
                list.len(),
                interaction.eval_normal_map(bump, scene, &path.segment, hit),
            ));
        }
        let lanes = list.batch_with_free_lane();
        let lane = lanes.push_vertex(
            index,
            (path, interaction, samples),
            (interaction.normal, LitSides::One, gain),
            scene.roulette,
        );
        lanes.set_material_model(lane, &model);
        true
    }

    /// Returns the kind of a vertex on a common surface.
    #[inline(always)]
    pub(super) fn common_kind(&self, is_matte: bool, samples: &VertexSamples) -> CommonKind {
        match &self.lamps {
            _ if !is_matte => CommonKind::Glossy,
            Some(lamps) if lamps.are_chosen(samples.light) => CommonKind::UnderLamp,
            _ => CommonKind::Matte,
        }
    }

    /// Evaluates the common surface of a material at a hit; `None` for a material of another kind.
    #[inline(always)]
    fn eval_common_surface<'a>(
        &self,
        material: &'a PreparedMaterial<R>,
        interaction: &Interaction<R>,
    ) -> Option<CommonSurface<'a, R>> {
        let context = self.scene.texture_tables.shading_context(interaction);
        let surface = match material {
            PreparedMaterial::Physical(m) if m.is_common => (
                m.metallic_roughness_at(&context),
                R::ONE,
                m.normal_map.as_ref(),
            ),
            // A delta light's unit is the radiance of a white classic surface facing it, not its
            // irradiance.
            PreparedMaterial::Classic(m) if m.matte => {
                (build_matte_model(m, &context), R::from_f64(PI), None)
            }
            _ => return None,
        };
        surface.0.is_rough().then_some(surface)
    }

    /// Continues a path through a surface that is absent at the hit or leaves the path unchanged.
    /// Returns whether the path goes on; `None` if the surface is present.
    #[inline]
    fn continue_behind_absent_surface(
        &mut self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
    ) -> Option<bool> {
        if self.is_absent(path, interaction) {
            if self.scene.materials[interaction.material as usize].is_open() {
                path.media = self.media_beyond_surface(&path.media, interaction);
            }
            return Some(self.pass_through_surface(path, interaction));
        }
        if self.has_nested_dielectrics()
            && let Some(beyond) = self.media_behind_hidden_boundary(&path.media, interaction)
        {
            path.media = beyond;
            return Some(self.pass_through_surface(path, interaction));
        }
        let tint = self.index_matched_tint(path, interaction)?;
        Some(self.pass_index_matched_boundary(path, interaction, tint))
    }

    /// Whether a surface is absent at the hit. Stochastic alpha: a partly transparent surface is
    /// present with a probability of its alpha.
    #[inline]
    pub(super) fn is_absent(&self, path: &PathState<R>, interaction: &Interaction<R>) -> bool {
        let PreparedMaterial::Physical(m) = &self.scene.materials[interaction.material as usize]
        else {
            return false;
        };
        if m.alpha == AlphaMode::Opaque {
            return false;
        }
        let alpha = m.alpha_at(&self.scene.texture_tables.shading_context(interaction));
        alpha < R::ONE
            && (alpha <= R::ZERO
                || R::from_f32(sample_2d(path.address, SamplePurpose::Coverage)[0]) >= alpha)
    }

    /// Adds a vertex on an uncommon surface to the general queue. Returns false if the path ends at
    /// the surface, because the surface is unlit or the depth limit is reached.
    fn queue_general_vertex(
        &mut self,
        index: u32,
        (path, hit, interaction): (&mut PathState<R>, &Hit<R>, &Interaction<R>),
        samples: &VertexSamples,
        vertices: &mut VertexQueues<R>,
    ) -> bool {
        if let PreparedMaterial::Physical(m) = &self.scene.materials[interaction.material as usize]
            && m.unlit
        {
            let shown = path.throughput
                * m.base_colour_at(&self.scene.texture_tables.shading_context(interaction));
            path.radiance += shown;
            self.add_directly_visible_radiance(path.segments_traced == 1, shown);
            return false;
        }
        !self.is_at_depth_limit(path)
            && self.build_general_vertex(
                index,
                (path, hit, interaction),
                samples,
                (&mut vertices.general, &mut vertices.surfaces),
            )
    }
}
