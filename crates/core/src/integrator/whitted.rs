//! Whitted ray tracing: local lighting, mirror reflection and refraction, for classic and physical
//! materials.
//!
//! A path carries its throughput. If a surface scatters two rays, one of them becomes a side
//! branch: a path of its own, traced to its end before the first path continues.

mod classic;
mod direct_light;
mod physical;
mod state;

use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use self::state::WhittedState;
use super::spawn::MinHitDistances;
use super::{
    CameraRays, FirstHit, LightTransport, PACKET, PacketHits, PathResult, PathResults, PathSegment,
};
use crate::counters::Counters;
use crate::interaction::Interaction;
use crate::observer::Observer;
use crate::prepare::{PreparedMaterial, PreparedScene};
use crate::sampler::SampleAddress;
use crate::scene::AlphaMode;
use crate::settings::Settings;

/// Whitted's ray tracer.
pub(crate) struct WhittedTracer<'a, R: Real> {
    scene: &'a PreparedScene<R>,
    counters: Counters,
    /// Stack of paths that wait until their side branches end; empty between camera rays.
    waiting_paths: Vec<WhittedState<R>>,
    /// Checked for cancellation while paths branch, because the branches of a single pixel may take
    /// unlimited time.
    observer: &'a dyn Observer,
    /// Number of side branches so far.
    divisions: u32,
    stopped: bool,
    /// Whether first hits of camera rays are kept, because layers need them.
    keeps_first: bool,
    /// First hit of the latest camera ray.
    first_hit: Option<FirstHit>,
    /// Directly visible radiance of the latest camera ray, without reflected light.
    direct: R::Vec3,
    max_depth: u32,
    min_distances: MinHitDistances<R>,
    first_hits: PacketHits<R>,
}

impl<'a, R: Real> LightTransport<'a, R> for WhittedTracer<'a, R> {
    const MAX_BATCH: usize = PACKET;

    fn new(
        scene: &'a PreparedScene<R>,
        max_depth: u32,
        keeps_first: bool,
        observer: &'a dyn Observer,
    ) -> Self {
        Self {
            scene,
            counters: Counters::default(),
            waiting_paths: Vec::new(),
            observer,
            divisions: 0,
            stopped: false,
            keeps_first,
            first_hit: None,
            direct: Vector::ZERO,
            // Rays divide: without a limit the tree of paths would never end.
            max_depth: max_depth.min(Settings::MOST_SEGMENTS),
            min_distances: scene.min_hit_distances(),
            first_hits: PacketHits::default(),
        }
    }

    fn trace(
        &mut self,
        CameraRays { rays, addresses }: CameraRays<'_, R>,
        out: &mut PathResults<R>,
    ) {
        out.clear();
        self.first_hits.intersect_packet(self.scene, rays);
        for (index, (ray, address)) in rays.iter().zip(addresses).enumerate() {
            let mut path = self.start_path(ray, address);
            let hit = self.first_hits.get_ray_hit(index).copied();
            self.trace_path(&mut path, hit);
            let veil = self.scene.veil;
            out.paths.push(PathResult {
                radiance: path.radiance + veil,
                coverage: path.coverage,
                shadow: R::ZERO,
            });
            if self.keeps_first {
                out.first_hits.push(self.first_hit);
                out.direct.push(self.direct + veil);
            }
        }
    }

    fn trace_first_hit(&mut self, ray: Ray<R>) -> Option<FirstHit> {
        self.counters.camera += 1;
        FirstHit::from_ray(self.scene, ray)
    }

    fn take_counters(&mut self) -> Counters {
        core::mem::take(&mut self.counters)
    }

    fn is_cancelled(&self) -> bool {
        self.stopped
    }
}

impl<R: Real> WhittedTracer<'_, R> {
    /// Returns the initial state of a camera ray's path.
    #[inline(always)]
    fn start_path(&mut self, ray: &Ray<R>, address: &SampleAddress) -> WhittedState<R> {
        self.first_hit = None;
        self.direct = Vector::ZERO;
        self.counters.camera += 1;
        // The ray is written in place: a copied segment would have to wait for its own numbers.
        let mut path = WhittedState {
            segment: PathSegment::from_camera(self.scene),
            throughput: Vector::ONE,
            radiance: Vector::ZERO,
            address: *address,
            remaining_segments: self.max_depth,
            passages: 0,
            is_camera_ray: true,
            share: R::ONE,
            coverage: R::ZERO,
            known_hit: None,
        };
        path.segment.ray = *ray;
        path
    }

    /// Returns the closest hit of a path's ray.
    #[inline(always)]
    fn intersect_path_ray(&self, path: &WhittedState<R>) -> Option<Hit<R>> {
        let min = if path.is_camera_ray {
            self.min_distances.camera - path.segment.skipped_distance
        } else {
            self.min_distances.secondary
        };
        self.scene.geometry.closest(
            &path.segment.ray,
            Interval {
                min,
                max: R::INFINITY,
            },
            &mut (),
        )
    }

    /// Advances a path by a segment that ends at the given hit. Returns a side branch, if any: the
    /// caller has to trace the branch to its end and add its radiance before the path continues.
    #[inline(always)]
    fn advance_path(
        &mut self,
        path: &mut WhittedState<R>,
        hit: Option<&Hit<R>>,
    ) -> Option<WhittedState<R>> {
        let Some(hit) = hit else {
            let backdrop = if path.is_camera_ray {
                self.scene.backdrop
            } else {
                None
            };
            let direction = path.segment.ray.direction;
            let seen = match backdrop {
                Some(backdrop) => backdrop.radiance(direction),
                None => self
                    .scene
                    .lights
                    .sky
                    .radiance(path.segment.start_point(), direction),
            };
            path.radiance += path.throughput * seen;
            self.add_directly_visible_radiance(path.is_camera_ray, path.throughput * seen);
            path.remaining_segments = 0;
            return None;
        };
        // `Interaction::from_hit`, in place.
        let mut interaction = Interaction::with_hit_geometry(self.scene, &path.segment, hit);
        interaction.fill_attributes(self.scene, &path.segment, hit);
        interaction.apply_normal_map(self.scene, &path.segment, hit);
        if path.is_camera_ray
            && self.keeps_first
            && self.first_hit.is_none()
            && !self.scene.is_invisible_at(&path.segment, hit)
        {
            self.first_hit = Some(FirstHit::new(self.scene, &path.segment, hit));
        }
        match &self.scene.materials[interaction.material as usize] {
            PreparedMaterial::Classic(m) => match self.wireframe_colour(path, hit, &interaction) {
                Some(edge) => self.end_on_wireframe_edge(path, edge),
                None => self.shade_classic(m, path, hit, &interaction),
            },
            PreparedMaterial::Physical(m) => {
                if m.alpha != AlphaMode::Opaque
                    && let Some(side_branch) = self.split_at_alpha(m, path, hit, &interaction)
                {
                    return side_branch;
                }
                match self.wireframe_colour(path, hit, &interaction) {
                    Some(edge) => self.end_on_wireframe_edge(path, edge),
                    None => self.shade_physical(m, path, hit, &interaction),
                }
            }
            PreparedMaterial::Unused => path.start_segment([None; 2]),
        }
    }

    /// Returns the wireframe's colour if a camera ray hits an edge.
    #[inline(always)]
    fn wireframe_colour(
        &self,
        path: &WhittedState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> Option<R::Vec3> {
        if path.is_camera_ray {
            self.scene.edge_colour_at(&path.segment, hit, interaction)
        } else {
            None
        }
    }

    /// Ends the path of a camera ray on a wireframe edge, with the colour of the edge.
    fn end_on_wireframe_edge(
        &mut self,
        path: &mut WhittedState<R>,
        edge: R::Vec3,
    ) -> Option<WhittedState<R>> {
        let shown = path.throughput * edge;
        path.radiance += shown;
        self.add_directly_visible_radiance(true, shown);
        self.first_hit
            .iter_mut()
            .for_each(|first| first.albedo = [0.0; 3]);
        path.start_segment([None; 2])
    }

    /// Adds radiance to the directly visible radiance of a camera ray, if layers need it. `camera`:
    /// whether the radiance arrives along the camera ray.
    #[inline(always)]
    fn add_directly_visible_radiance(&mut self, camera: bool, radiance: R::Vec3) {
        if camera && self.keeps_first {
            self.direct += radiance;
        }
    }

    /// Traces a path and its side branches to their ends. `known_hit` is the hit of the first ray,
    /// if already known.
    fn trace_path(&mut self, path: &mut WhittedState<R>, mut known_hit: Option<Option<Hit<R>>>) {
        while path.remaining_segments > 0 || self.resume_waiting_path(path) {
            let hit = match known_hit.take() {
                Some(hit) => hit,
                None => path.known_hit.or_else(|| self.intersect_path_ray(path)),
            };
            if let Some(side_branch) = self.advance_path(path, hit.as_ref()) {
                self.defer_path(path, side_branch);
            }
        }
    }
}

#[cfg(test)]
mod tests;
