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
mod layered;
mod light;
mod matched;
mod media;
mod mixture;
mod nested;
mod roulette;
mod scatter;
mod shade;
mod straight;
mod transmittance;
mod vertices;
mod wavefront;

use raywright_bvh::{Hit, Ray, Real, Vector};

use media::Media;
use wavefront::Wavefront;

use super::spawn::LeastDistances;
use super::{CameraRays, FirstHit, LightTransport, MOST_PASSAGES, PathResults, PathSegment};
use crate::counters::Counters;
use crate::interaction::Interaction;
use crate::light::LightUsage;
use crate::observer::Observer;
use crate::prepare::Prepared;
use crate::sampler::{SampleAddress, SampleHash};

/// Number of paths traced side by side: their state fits in a core's own cache.
const PATHS: usize = 256;

/// The path tracer.
pub(crate) struct PathTracer<'a, R: Real> {
    scene: &'a Prepared<R>,
    counters: Counters,
    usage: LightUsage,
    /// Whether first hits of camera rays are kept; the first hit of the current path, and the
    /// path's directly visible radiance, without reflected light.
    keeps_first: bool,
    first: Option<FirstHit>,
    direct: R::Vec3,
    max_depth: u32,
    least: LeastDistances<R>,
    /// Media around the camera.
    media: Media,
    wavefront: Wavefront<R>,
}

impl<'a, R: Real> LightTransport<'a, R> for PathTracer<'a, R> {
    const BATCH: usize = PATHS;

    fn new(scene: &'a Prepared<R>, max_depth: u32, keeps_first: bool, _: &'a dyn Observer) -> Self {
        let mut tracer = Self {
            scene,
            counters: Counters::default(),
            usage: LightUsage::new(&scene.lights),
            keeps_first,
            first: None,
            direct: Vector::ZERO,
            max_depth,
            least: scene.least_distances(),
            media: Media::default(),
            wavefront: Wavefront::default(),
        };
        if scene.tracks_media {
            tracer.media = tracer.media_of_camera();
        }
        tracer
    }

    fn trace(&mut self, rays: CameraRays<'_, R>, out: &mut PathResults<R>) {
        out.clear();
        let mut wavefront = core::mem::take(&mut self.wavefront);
        self.follow(rays, &mut wavefront, out);
        self.wavefront = wavefront;
    }

    fn first_hit(&mut self, ray: Ray<R>) -> Option<FirstHit> {
        self.counters.camera += 1;
        FirstHit::of_ray(self.scene, ray)
    }

    fn take_counters(&mut self) -> Counters {
        core::mem::take(&mut self.counters)
    }

    fn into_light_usage(self) -> LightUsage {
        self.usage
    }
}

/// Density by solid angle above which a lobe counts as a mirror: the lobe is then seven times
/// narrower than the sun's disc of 1/14,700 sr, and hardly any direction sampled towards a light
/// falls into it.
const NARROW: f64 = 1e5;

/// State of a path: all data on which its next segment depends.
#[derive(Clone, Copy, Debug)]
struct PathState<R: Real> {
    /// The next ray.
    segment: PathSegment<R>,
    /// Throughput of the path (beta).
    throughput: R::Vec3,
    /// Radiance collected so far.
    radiance: R::Vec3,
    /// Address of the next vertex, for random numbers.
    address: SampleAddress,
    sample_hash: SampleHash,
    draws: VertexSamples,
    /// Segments traced so far.
    traced: u32,
    /// Number of segments that end at index-matched boundaries, and number of surfaces passed
    /// unchanged.
    matched: u32,
    passages: u32,
    /// Whether the path has hit a surface.
    hit: bool,
    /// Share of the studio's light that is blocked where the camera ray reaches the ground, 0 to 1.
    shadow: R,
    /// Least density of a scattered direction before the last vertex, by solid angle: small after a
    /// diffuse reflection.
    min_pdf: f64,
    /// Media around the path.
    media: Media,
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
    /// Position of the vertex, and its unit normal on the receiving side; zero if both sides
    /// receive light.
    from: R::Vec3,
    normal: R::Vec3,
    /// Density by solid angle of the scattered direction. Infinite for camera rays and delta lobes,
    /// whose directions light sampling cannot choose.
    density: f64,
}

impl<R: Real> PathTracer<'_, R> {
    /// Returns the initial state of a camera ray's path.
    #[inline(always)]
    fn camera_path(&self, ray: Ray<R>, address: SampleAddress) -> PathState<R> {
        PathState {
            segment: PathSegment {
                ray,
                ..PathSegment::from_camera(self.scene)
            },
            throughput: Vector::ONE,
            radiance: Vector::ZERO,
            address,
            sample_hash: address.sample_hash(),
            draws: VertexSamples::default(),
            traced: 0,
            matched: 0,
            passages: 0,
            hit: false,
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

    /// Records the first hit of a path's camera ray, if layers need it.
    #[inline(always)]
    fn keep_first(&mut self, path: &PathState<R>, hit: &Hit<R>) {
        if self.keeps_first && path.traced == 0 && path.passages == 0 {
            self.first = Some(FirstHit::new(self.scene, &path.segment, hit));
        }
    }

    /// Continues a path through a surface that is absent at the hit, because of alpha or nesting.
    /// Returns whether the path goes on.
    fn pass(&mut self, path: &mut PathState<R>, interaction: &Interaction<R>) -> bool {
        path.address.bounce += 1;
        let rest = path.segment.rest;
        let ray = Ray {
            culls: path.segment.ray.culls,
            ..self
                .scene
                .spawn(interaction, interaction.direction, -R::ONE)
        };
        path.segment.advance(&ray, rest);
        self.counts_passage(path)
    }

    /// Counts a surface that a path passed unchanged. Returns whether the path may pass further
    /// surfaces.
    fn counts_passage(&mut self, path: &mut PathState<R>) -> bool {
        path.passages += 1;
        let ends = path.passages > MOST_PASSAGES;
        self.counters.cut_short += u64::from(ends);
        !ends
    }

    /// Whether a path has reached its depth limit. Segments between index-matched boundaries count
    /// as a single segment.
    #[inline(always)]
    fn is_at_limit(&self, path: &PathState<R>) -> bool {
        path.traced - path.matched >= self.max_depth
    }
}
