//! Wavefront path tracing: many paths at a time, stage by stage, one segment of all paths before
//! the next segment. Memory requests of one path overlap with computations of other paths, and
//! rays, sky and surfaces each have the caches to themselves. The bits of a path do not depend on
//! other paths.

mod path_ends;
mod uniform_triangles;
mod vertex_inputs;

use raywright_bvh::{Hit, Interval, RayEndTriangles, Real, Vector, run_widest};

use super::super::{CameraRays, PACKET, PacketHits, PathResults};
use super::bsdf_lanes::{BsdfLanes, BsdfTask};
use super::light::SampledLights;
use super::scatter::ScatteredRay;
use super::shade::ShadedLanes;
use super::vertex_queues::VertexQueues;
use super::vertices::{VertexLanes, WavefrontSlice};
use super::{PathState, PathTracer, VertexSamples};
use crate::interaction::Interaction;
use crate::light::{LANES, LaneColumn, LightSampleLanes, SkySample};

/// State of a batch of paths; kept to reuse the memory of the lists.
#[derive(Default)]
pub(super) struct Wavefront<R: Real> {
    paths: Vec<PathState<R>>,
    /// Indices of the active paths: those whose ray hit a surface.
    active: Vec<u32>,
    /// Hits of the active paths, in their order.
    hits: Vec<Hit<R>>,
    /// Number of active paths on uniform triangles, the first of `active`.
    uniform: usize,
    /// Indices of the paths whose latest ray hit nothing.
    escaped: Vec<u32>,
    /// Sky samples of the escaped paths.
    sky_samples: Vec<SkySample<R>>,
    /// Interactions of the active paths; unused for those on uniform triangles and at the end.
    interactions: Vec<Interaction<R>>,
    draws: Vec<[f32; 4]>,
    vertices: VertexQueues<R>,
    /// Sampled lights of the vertices in one queue.
    requested: SampledLights<R>,
    /// Whether each active path survives.
    survives: Vec<bool>,
    first_hits: PacketHits<R>,
}

impl<R: Real> PathTracer<'_, R> {
    /// Traces the paths of camera rays to their ends.
    pub(super) fn trace_paths(
        &mut self,
        rays: CameraRays<'_, R>,
        wave: &mut Wavefront<R>,
        results: &mut PathResults<R>,
    ) {
        self.start_paths(rays, wave);
        if self.keeps_first {
            results.first_hits.resize(rays.rays.len(), None);
            results.direct.resize(rays.rays.len(), Vector::ZERO);
            if self.scene.scatters {
                let hits = (&*wave.active, &*wave.hits);
                self.find_veiled_hits(&wave.paths, hits, &mut results.first_hits);
            }
        }
        loop {
            if self.scene.scatters {
                self.scatter_in_media(
                    &mut wave.paths,
                    (&mut wave.active, &mut wave.hits),
                    &mut wave.escaped,
                );
            }
            self.end_escaped_paths(wave, &mut results.direct);
            if wave.active.is_empty() {
                break;
            }
            self.sort_uniform_triangles(wave);
            self.compute_interactions(wave);
            self.draw_vertex_samples(wave);
            self.queue_uniform_triangles(wave, results);
            self.evaluate_materials(wave, results);
            self.shade_vertices(wave);
            self.intersect_rays(wave);
        }
        self.collect_results(wave, results);
    }

    /// Starts the paths of camera rays and finds their first hits; rays of a common origin are
    /// intersected as packets.
    fn start_paths(
        &mut self,
        CameraRays { rays, addresses }: CameraRays<'_, R>,
        wave: &mut Wavefront<R>,
    ) {
        let Wavefront {
            paths,
            active,
            hits,
            escaped,
            first_hits,
            ..
        } = wave;
        self.counters.camera += rays.len() as u64;
        paths.clear();
        paths.extend(
            rays.iter()
                .zip(addresses)
                .map(|(&ray, &address)| self.start_path(ray, address)),
        );
        active.clear();
        hits.clear();
        escaped.clear();
        for (packet, (rays, paths)) in rays.chunks(PACKET).zip(paths.chunks(PACKET)).enumerate() {
            first_hits.intersect_packet(self.scene, rays);
            for (i, path) in paths.iter().enumerate() {
                let hit = first_hits
                    .get_ray_hit(i)
                    .copied()
                    .unwrap_or_else(|| self.intersect_path_ray(path));
                let index = (PACKET * packet + i) as u32;
                match hit {
                    Some(hit) => {
                        active.push(index);
                        hits.push(hit);
                    }
                    None => escaped.push(index),
                }
            }
        }
    }

    /// Traces the rays of the active paths that survive. Those that hit a surface stay active.
    fn intersect_rays(
        &self,
        Wavefront {
            paths,
            active,
            hits,
            escaped,
            survives,
            ..
        }: &mut Wavefront<R>,
    ) {
        hits.clear();
        let mut survives = survives.iter();
        active.retain(|&index| {
            if survives.next() != Some(&true) {
                return false;
            }
            match self.intersect_path_ray(&paths[index as usize]) {
                Some(hit) => {
                    hits.push(hit);
                    true
                }
                None => {
                    escaped.push(index);
                    false
                }
            }
        });
    }

    /// Returns the closest hit of a path's ray.
    #[inline(always)]
    pub(super) fn intersect_path_ray(&self, path: &PathState<R>) -> Option<Hit<R>> {
        let min = if path.segments_traced == 0 {
            self.min_distances.camera - path.segment.skipped_distance
        } else {
            self.min_distances.secondary
        };
        self.scene.geometry.closest_with_ray_ends(
            &path.segment.ray,
            Interval {
                min,
                max: R::INFINITY,
            },
            &RayEndTriangles::from_start(path.start),
            &mut (),
        )
    }

    /// Evaluates materials, adds emission, and puts each vertex into the queue of its kind.
    fn evaluate_materials(&mut self, wave: &mut Wavefront<R>, results: &mut PathResults<R>) {
        let Wavefront {
            paths,
            active,
            hits,
            uniform,
            interactions,
            draws,
            vertices,
            survives,
            ..
        } = wave;
        let mut next_light = active.len() + *uniform;
        for (k, ((&index, hit), interaction)) in active
            .iter()
            .zip(&*hits)
            .zip(&mut *interactions)
            .enumerate()
            .skip(*uniform)
        {
            let path = &mut paths[index as usize];
            if self.has_triangle_ends {
                path.start = hit.triangle_slot();
            }
            if self.keeps_first {
                self.first_hit = results.first_hits[index as usize];
            }
            let samples = VertexSamples::from_draws(draws, k, next_light);
            next_light += usize::from(!self.is_on_smooth_surface(hit));
            survives.push(self.queue_vertex(
                k as u32,
                (path, hit, interaction),
                &samples,
                vertices,
            ));
            if self.keeps_first {
                results.first_hits[index as usize] = self.first_hit;
                results.direct[index as usize] +=
                    core::mem::replace(&mut self.direct, Vector::ZERO);
            }
        }
    }

    /// Shades the vertices, queue by queue.
    fn shade_vertices(
        &mut self,
        Wavefront {
            paths,
            active,
            hits,
            uniform,
            interactions,
            vertices,
            requested,
            survives,
            ..
        }: &mut Wavefront<R>,
    ) {
        vertices.perturb_normals(interactions);
        let (mut slice, compensated) = (
            WavefrontSlice {
                paths,
                active,
                uniform: *uniform,
                interactions,
                hits,
            },
            self.scene.compensates,
        );
        let VertexQueues {
            common: [glossy, matte, under_lamps],
            general,
            surfaces,
            ..
        } = vertices;
        if let Some(lamps) = self.lamps.take() {
            self.shade_diffuse_vertices(&mut slice, under_lamps.batches(), &lamps, survives);
            self.lamps = Some(lamps);
        }
        self.shade_batches(
            &mut slice,
            (matte.batches(), requested),
            survives,
            |_, _, _, (vertices, lights), _| {
                run_widest(BsdfTask::<R, true> {
                    vertices,
                    lights,
                    energy_compensation: compensated,
                })
            },
        );
        self.shade_batches(
            &mut slice,
            (glossy.batches(), requested),
            survives,
            |_, _, _, (vertices, lights), _| {
                run_widest(BsdfTask::<R, false> {
                    vertices,
                    lights,
                    energy_compensation: compensated,
                })
            },
        );
        self.shade_batches(
            &mut slice,
            (general.batches(), requested),
            survives,
            |tracer, slice, before, lanes, scattered_rays| {
                tracer.shade_general_vertices(slice, (surfaces, before), lanes, scattered_rays)
            },
        );
    }

    /// Shades the vertices of one queue and continues their paths. `shade_lanes` evaluates and
    /// samples the BSDFs of a batch, given the number of vertices before the batch; it also sets
    /// the properties of scattered rays that differ from those of rough opaque surfaces.
    fn shade_batches(
        &mut self,
        slice: &mut WavefrontSlice<'_, R>,
        (vertices, requested): (&mut [VertexLanes<R>], &mut SampledLights<R>),
        survives: &mut [bool],
        shade_lanes: impl Fn(
            &Self,
            &WavefrontSlice<'_, R>,
            usize,
            (&VertexLanes<R>, &LightSampleLanes<R>),
            &mut LaneColumn<ScatteredRay<R>>,
        ) -> BsdfLanes<R>,
    ) {
        self.sample_lights(vertices, requested);
        let mut scattered_rays = [ScatteredRay::REFLECTED; LANES];
        for (group, (vertices, (choices, lights))) in
            vertices.iter().zip(requested.batches()).enumerate()
        {
            let bsdf_lanes = shade_lanes(
                self,
                slice,
                group * LANES,
                (vertices, lights),
                &mut scattered_rays,
            );
            let shaded = ShadedLanes::from_vertices(
                vertices,
                lights,
                &bsdf_lanes,
                self.scene.rules.shadow_max_distance,
            );
            for (lane, scattered_ray) in scattered_rays.iter().enumerate().take(vertices.len) {
                let index = vertices.hit_indices[lane] as usize;
                if let Some(light) = choices.lights[lane].filter(|_| shaded.lit.is_lit[lane]) {
                    self.add_direct_light(slice, (vertices, lane), (light, lights), &shaded);
                }
                if shaded.next.continues[lane] {
                    slice.paths[slice.active[index] as usize].record_light_sample(lights, lane);
                    self.continue_path(
                        slice,
                        (vertices, lane),
                        (&bsdf_lanes, &shaded.next),
                        scattered_ray,
                    );
                } else {
                    if shaded.next.overflows[lane] {
                        slice.paths[slice.active[index] as usize].radiance =
                            Vector::splat(R::INFINITY);
                    }
                    survives[index] = false;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
