//! What the shading of a vertex reads: the interaction at its hit, and its random numbers.

use raywright_bvh::{Hit, Real};

use super::Wavefront;
use crate::integrator::path_tracing::{PathState, PathTracer, VertexSamples};
use crate::integrator::shading_normals::ShadingNormalLanes;
use crate::interaction::Interaction;
use crate::sampler::{SamplePurpose, SampleSequence, sample_4d_batch};

impl<R: Real> PathTracer<'_, R> {
    /// Computes points, frames and texture coordinates of hits, in stages: each prefetches for all
    /// hits what the next one reads, vertex indices, vertices, and texels.
    pub(super) fn compute_interactions(
        &self,
        Wavefront {
            paths,
            active,
            hits,
            uniform,
            interactions,
            ..
        }: &mut Wavefront<R>,
    ) {
        if interactions.len() < active.len() {
            interactions.resize(active.len(), Interaction::PLACEHOLDER);
        }
        let (active, hits) = (&active[*uniform..], &hits[*uniform..]);
        let interactions = &mut interactions[*uniform..];
        let rays = active
            .iter()
            .map(|&index| &paths[index as usize].segment.ray);
        let has_meshes = !self.scene.meshes.is_empty();
        let with_indices = hits.iter().inspect(|hit| {
            if has_meshes {
                self.scene.prefetch_vertex_indices(hit);
            }
        });
        self.scene
            .geometry
            .surfaces(rays.zip(with_indices), |k, surface| {
                interactions[k].surface = surface
            });
        if has_meshes {
            hits.iter()
                .for_each(|hit| self.scene.prefetch_vertex_attributes(hit));
        }
        let mut normals = ShadingNormalLanes::new();
        for (k, (&index, hit)) in active.iter().zip(hits).enumerate() {
            let (segment, interaction) = (&paths[index as usize].segment, &mut interactions[k]);
            interaction.fill_geometry_from_surface(self.scene, &segment.ray, hit);
            interaction.fill_texture_coordinates(self.scene, segment, hit);
            self.scene.texture_tables.prefetch_texels(interaction);
            normals.push_hit(self.scene, (interactions, k), (&segment.ray, hit));
        }
        normals.flush(interactions);
    }

    /// Computes the random numbers that nearly every vertex needs; those for a light only where a
    /// light sample can reach the surface.
    pub(super) fn draw_vertex_samples(
        &self,
        Wavefront {
            paths,
            active,
            hits,
            draws,
            ..
        }: &mut Wavefront<R>,
    ) {
        draws.clear();
        let states = &*paths;
        let sequence = |index: u32, purpose| {
            let PathState {
                address,
                sample_hash,
                ..
            } = &states[index as usize];
            (
                SampleSequence::from_sample_hash(*sample_hash, *address, purpose),
                address.index,
            )
        };
        let all = active.iter();
        sample_4d_batch(
            all.map(|&index| sequence(index, SamplePurpose::Scatter)),
            draws,
        );
        if !self.scene.lights.light_sampler().is_empty() {
            let lit = active
                .iter()
                .zip(&*hits)
                .filter(|(_, hit)| !self.is_on_smooth_surface(hit));
            sample_4d_batch(
                lit.map(|(&index, _)| sequence(index, SamplePurpose::Light)),
                draws,
            );
        }
    }

    /// Whether a hit lies on a surface that is everywhere a smooth mirror or smooth glass.
    #[inline(always)]
    pub(super) fn is_on_smooth_surface(&self, hit: &Hit<R>) -> bool {
        self.scene.objects[hit.outermost_id() as usize].is_smooth
    }
}

impl VertexSamples {
    /// Returns the numbers of a vertex, given the indices of both points among the numbers of
    /// [`PathTracer::draw_vertex_samples`]; `light` may lie beyond their end.
    #[inline(always)]
    pub(super) fn from_draws(draws: &[[f32; 4]], scatter: usize, light: usize) -> Self {
        // Directions matter most: they get the first two dimensions of a point, which are the best
        // stratified.
        let [u, v, u_roulette, lobe] = draws[scatter];
        Self {
            scatter: [lobe, u, v, u_roulette],
            light: draws.get(light).copied().unwrap_or_default(),
        }
    }
}
