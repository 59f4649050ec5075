//! Path tracing (Kajiya, "The Rendering Equation", 1986). Each vertex samples one light and one
//! scattered direction, and multiple importance sampling combines both (Veach, Guibas, "Optimally
//! Combining Sampling Techniques for Monte Carlo Rendering", 1995). The estimate is unbiased,
//! except for paths beyond the depth limit.
//!
//! The state of a path is plain numbers ([`PathState`]). The next segment of a path does not depend
//! on the other paths in the same wavefront.

mod bsdf_lanes;
mod classic;
mod emission;
mod gather;
mod general;
mod ground;
mod index_matched;
mod layered;
mod light;
mod media;
mod mixture;
mod nested;
mod roulette;
mod scatter;
mod shade;
mod straight_light;
mod transmittance;
mod vertices;
mod wavefront;

use raywright_bvh::{Hit, Ray, Real, TriangleSlot, Vector};

use media::MediumStack;
use wavefront::Wavefront;

use super::spawn::MinHitDistances;
use super::{CameraRays, FirstHit, LightTransport, MOST_PASSAGES, PathResults, PathSegment};
use crate::counters::Counters;
use crate::interaction::Interaction;
use crate::light::LightUsage;
use crate::observer::Observer;
use crate::prepare::{PreparedScene, PreparedSpawnRule};
use crate::sampler::{SampleAddress, SampleHash};

/// Number of paths traced side by side: their state fits in a core's own cache.
const BATCH_PATHS: usize = 256;

/// The path tracer.
pub(crate) struct PathTracer<'a, R: Real> {
    scene: &'a PreparedScene<R>,
    counters: Counters,
    usage: LightUsage,
    /// Whether first hits of camera rays are kept, because picture layers (AOVs) need them.
    keeps_first: bool,
    /// First hit of the current path.
    first_hit: Option<FirstHit>,
    /// Directly visible radiance of the current path, without reflected light.
    direct: R::Vec3,
    max_depth: u32,
    min_distances: MinHitDistances<R>,
    /// Whether ray queries receive the triangle on which a ray starts and the triangles before
    /// which a shadow ray ends, so that these need no exact test, see
    /// [`RayEnds`](raywright_bvh::RayEnds).
    has_triangle_ends: bool,
    /// Media around the camera.
    media: MediumStack,
    wavefront: Wavefront<R>,
}

impl<'a, R: Real> LightTransport<'a, R> for PathTracer<'a, R> {
    const MAX_BATCH: usize = BATCH_PATHS;

    fn new(
        scene: &'a PreparedScene<R>,
        max_depth: u32,
        keeps_first: bool,
        _: &'a dyn Observer,
    ) -> Self {
        let mut tracer = Self {
            scene,
            counters: Counters::default(),
            usage: LightUsage::new(&scene.lights),
            keeps_first,
            first_hit: None,
            direct: Vector::ZERO,
            max_depth,
            min_distances: scene.min_hit_distances(),
            has_triangle_ends: scene.geometry.has_triangle_ends()
                && matches!(scene.rules.spawn, PreparedSpawnRule::ErrorBound),
            media: MediumStack::default(),
            wavefront: Wavefront::default(),
        };
        if scene.tracks_media {
            tracer.media = tracer.find_camera_media();
        }
        tracer
    }

    fn trace(&mut self, rays: CameraRays<'_, R>, out: &mut PathResults<R>) {
        out.clear();
        let mut wavefront = core::mem::take(&mut self.wavefront);
        self.trace_paths(rays, &mut wavefront, out);
        self.wavefront = wavefront;
    }

    fn trace_first_hit(&mut self, ray: Ray<R>) -> Option<FirstHit> {
        self.counters.camera += 1;
        FirstHit::from_ray(self.scene, ray)
    }

    fn take_counters(&mut self) -> Counters {
        core::mem::take(&mut self.counters)
    }

    fn into_light_usage(self) -> LightUsage {
        self.usage
    }
}

/// Density by solid angle, per steradian, from which on a lobe counts as a mirror: the lobe is then
/// seven times narrower than the sun's disc of 1/14,700 sr, and hardly any direction sampled
/// towards a light falls into it.
const MIRROR_DENSITY: f64 = 1e5;

/// State of a path: all data on which its next segment depends.
#[derive(Clone, Copy, Debug)]
struct PathState<R: Real> {
    /// The next ray.
    segment: PathSegment<R>,
    /// Triangle that the next ray leaves, for [`RayEnds`](raywright_bvh::RayEnds).
    start: TriangleSlot,
    /// Throughput of the path (beta).
    throughput: R::Vec3,
    /// Radiance collected so far.
    radiance: R::Vec3,
    /// Address of the next vertex, for random numbers.
    address: SampleAddress,
    sample_hash: SampleHash,
    samples: VertexSamples,
    /// Segments traced so far.
    segments_traced: u32,
    /// Number of segments that end at index-matched boundaries.
    matched_segments: u32,
    /// Number of surfaces that the path passed without scattering.
    passages: u32,
    /// Whether the path has hit a surface.
    has_hit: bool,
    /// Share of the studio's light that the scene blocks at the camera ray's point on the ground, 0
    /// to 1.
    shadow: R,
    /// Least density by solid angle among the path's scattered directions, the latest direction
    /// excepted; small if the path was reflected diffusely.
    min_pdf: f64,
    /// Media around the path.
    media: MediumStack,
    /// Origin of the ray: the previous vertex.
    previous: PreviousVertex<R>,
    /// Wavelength in nanometres after dispersion; `None` for a white path.
    wavelength: Option<f64>,
}

/// Uniform numbers in [0, 1) that nearly every vertex of a path needs.
#[derive(Clone, Copy, Debug, Default)]
struct VertexSamples {
    /// Numbers for the choice of a light and of a point on the light.
    light: [f32; 4],
    /// Numbers for the choice of a lobe, the direction, and Russian roulette.
    scatter: [f32; 4],
}

/// The previous vertex of a path: the data that give the density with which light sampling would
/// have chosen the ray's direction.
#[derive(Clone, Copy, Debug)]
struct PreviousVertex<R: Real> {
    /// Position of the vertex.
    from: R::Vec3,
    /// Unit normal on the receiving side; zero if both sides receive light.
    normal: R::Vec3,
    /// Density by solid angle of the scattered direction. Infinite for camera rays and delta lobes,
    /// whose directions light sampling cannot choose.
    density: f64,
}

impl<R: Real> PathTracer<'_, R> {
    /// Returns the initial state of a camera ray's path.
    #[inline(always)]
    fn start_path(&self, ray: Ray<R>, address: SampleAddress) -> PathState<R> {
        PathState {
            segment: PathSegment {
                ray,
                ..PathSegment::from_camera(self.scene)
            },
            start: TriangleSlot::NONE,
            throughput: Vector::ONE,
            radiance: Vector::ZERO,
            address,
            sample_hash: address.sample_hash(),
            samples: VertexSamples::default(),
            segments_traced: 0,
            matched_segments: 0,
            passages: 0,
            has_hit: false,
            shadow: R::ZERO,
            min_pdf: f64::INFINITY,
            media: self.media,
            previous: PreviousVertex {
                from: ray.origin,
                normal: ray.direction,
                density: f64::INFINITY,
            },
            wavelength: None,
        }
    }

    /// Records the first hit of a path's camera ray, if picture layers (AOVs) need it.
    #[inline(always)]
    fn record_first_hit(&mut self, path: &PathState<R>, hit: &Hit<R>) {
        if self.keeps_first && path.segments_traced == 0 && path.passages == 0 {
            self.first_hit = Some(FirstHit::new(self.scene, &path.segment, hit));
        }
    }

    /// Continues a path through a surface that is absent at the hit, because of alpha or nesting.
    /// Returns whether the path goes on.
    fn pass_through_surface(
        &mut self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
    ) -> bool {
        path.address.bounce += 1;
        let rest = path.segment.direction_error;
        let ray = Ray {
            is_camera_ray: path.segment.ray.is_camera_ray,
            ..self
                .scene
                .spawn_ray(interaction, interaction.direction, -R::ONE)
        };
        path.segment.advance_to_ray(&ray, rest);
        self.count_passed_surface(path)
    }

    /// Counts a surface that a path passed unchanged. Returns whether the path may pass further
    /// surfaces.
    fn count_passed_surface(&mut self, path: &mut PathState<R>) -> bool {
        path.passages += 1;
        let ends = path.passages > MOST_PASSAGES;
        self.counters.cut_short += u64::from(ends);
        !ends
    }

    /// Whether a path has reached its depth limit. Segments between index-matched boundaries count
    /// as a single segment.
    #[inline(always)]
    fn is_at_depth_limit(&self, path: &PathState<R>) -> bool {
        path.segments_traced - path.matched_segments >= self.max_depth
    }
}
