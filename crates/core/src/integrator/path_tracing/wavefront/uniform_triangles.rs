//! Vertices on uniform triangles: triangles outside instances whose material is the same everywhere.
//! They need no interaction. Points and normals of eight hits are computed side by side and written
//! straight to the columns of their vertices, with the bits of interactions.

use raywright_bvh::{Hit, Real, TriangleHitLanes};

use super::Wavefront;
use crate::integrator::path_tracing::vertices::{LitSides, VertexLanes};
use crate::integrator::path_tracing::{PathTracer, VertexSamples};
use crate::integrator::shading_normals::CornerNormalLanes;
use crate::integrator::{FirstHit, PathResults};
use crate::light::{LANES, set_lane_vector};
use crate::prepare::UniformSurface;

/// Geometry of the hits in a batch of vertices whose surfaces are not yet computed.
struct PendingSurfaces<R: Real> {
    triangles: TriangleHitLanes<R>,
    normals: CornerNormalLanes<R>,
}

impl<R: Real> PendingSurfaces<R> {
    fn new() -> Self {
        Self {
            triangles: TriangleHitLanes::default(),
            normals: CornerNormalLanes::new(),
        }
    }

    /// Computes the surfaces and the normals of a batch.
    #[inline(always)]
    fn flush(&mut self, vertices: &mut VertexLanes<R>) {
        let surfaces = self.triangles.take_surfaces();
        let normals =
            self.normals
                .facing_normals(&surfaces.normal, &vertices.direction, vertices.len);
        vertices.surface.set_triangles(&surfaces);
        (vertices.normal, vertices.geometric) = (normals.shading, normals.geometric);
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Moves the paths on uniform triangles to the front of the active paths, and prefetches the
    /// vertices of the triangles.
    pub(super) fn sort_uniform_triangles(
        &self,
        Wavefront {
            active,
            hits,
            uniform,
            ..
        }: &mut Wavefront<R>,
    ) {
        *uniform = 0;
        if !self.has_uniform_triangles {
            return;
        }
        for k in 0..active.len() {
            if self.is_on_uniform_triangle(&hits[k]) {
                self.scene.prefetch_vertex_indices(&hits[k]);
                active.swap(*uniform, k);
                hits.swap(*uniform, k);
                *uniform += 1;
            }
        }
        for hit in &hits[..*uniform] {
            self.scene.prefetch_vertex_attributes(hit);
        }
    }

    #[inline(always)]
    fn is_on_uniform_triangle(&self, hit: &Hit<R>) -> bool {
        hit.instance == Hit::<R>::NO_INSTANCE
            && self.scene.objects[hit.object as usize].uniform.is_some()
    }

    /// Puts the vertices on uniform triangles into the queues of their kinds, the first vertices
    /// of these queues.
    pub(super) fn queue_uniform_triangles(
        &mut self,
        wave: &mut Wavefront<R>,
        results: &mut PathResults<R>,
    ) {
        let Wavefront {
            paths,
            active,
            hits,
            uniform,
            draws,
            vertices,
            survives,
            ..
        } = wave;
        vertices.clear();
        survives.clear();
        let scene = self.scene;
        let mut pending = [(); 3].map(|()| PendingSurfaces::new());
        for (k, (&index, hit)) in active.iter().zip(&*hits).enumerate().take(*uniform) {
            let path = &mut paths[index as usize];
            if self.has_triangle_ends {
                path.start = hit.triangle_slot();
            }
            if self.keeps_first && path.segments_traced == 0 {
                results.first_hits[index as usize]
                    .get_or_insert_with(|| FirstHit::new(scene, &path.segment, hit));
            }
            path.has_hit = true;
            path.segments_traced += 1;
            let record = &scene.objects[hit.object as usize];
            let model = scene.materials[record.material as usize].uniform_model();
            let (Some(mesh), Some(model), false) =
                (&record.mesh, model, self.is_at_depth_limit(path))
            else {
                survives.push(false);
                continue;
            };
            survives.push(true);
            let is_matte = record.uniform == Some(UniformSurface::Matte);
            let samples = VertexSamples::from_draws(draws, k, active.len() + k);
            // By an index: a choice between references would be made for each column.
            let kind = self.common_kind(is_matte, &samples) as usize;
            let (list, pending) = (&mut vertices.common[kind], &mut pending[kind]);
            let batch = list.batch_with_free_lane();
            let lane = batch.push_path(
                k as u32,
                (path, &samples),
                (LitSides::One, R::ONE),
                scene.roulette,
            );
            if is_matte {
                set_lane_vector::<R>(&mut batch.base, lane, model.base);
            } else {
                batch.set_material_model(lane, model);
            }
            pending.triangles.push_hit(&scene.geometry, hit);
            pending.normals.set_hit(lane, scene, (record, mesh), hit);
            if batch.len == LANES {
                pending.flush(batch);
            }
        }
        for (list, pending) in vertices.common.iter_mut().zip(&mut pending) {
            if let Some(batch) = list.batches().last_mut().filter(|batch| !batch.is_full()) {
                pending.flush(batch);
            }
        }
    }
}
