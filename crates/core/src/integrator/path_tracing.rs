//! Path tracing (Kajiya, "The Rendering Equation", 1986): at each vertex a path asks one light and
//! goes on in one direction, both drawn by chance, and what both ways find of the same light is
//! combined by multiple importance sampling (Veach, Guibas, "Optimally Combining Sampling
//! Techniques for Monte Carlo Rendering", 1995). In the mean it is right whatever the chances are,
//! but for the paths that are longer than the scene allows.
//!
//! A path's state is numbers alone ([`PathState`]), and what one more segment makes of it does not
//! know which others go beside it.

mod arrival;
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
mod respond;
mod roulette;
mod scatter;
mod shade;
mod straight;
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
use crate::sampler::{Address, SampleHash};

/// As many paths as go side by side: what there is of them stays in a core's own cache.
const PATHS: usize = 256;

/// Follows rays as light goes, by chance.
pub(crate) struct PathTracer<'a, R: Real> {
    scene: &'a Prepared<R>,
    counters: Counters,
    usage: LightUsage,
    /// Whether the first hits of camera rays are kept, the one of the path at hand, and what that
    /// saw without light from elsewhere.
    keeps_first: bool,
    first: Option<FirstHit>,
    direct: R::Vec3,
    max_depth: u32,
    least: LeastDistances<R>,
    /// Bodies that the camera is in.
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

/// Density of a direction, over solid angle, from which on a lobe counts as a mirror: it is seven
/// times narrower than the sun's disc, which has a 14,700th of a unit, so that of directions drawn
/// towards a light hardly any has a share in what the lobe finds.
const NARROW: f64 = 1e5;

/// Where a path is: all that its next segment depends on.
#[derive(Clone, Copy, Debug)]
struct PathState<R: Real> {
    /// The ray to be traced.
    leg: PathSegment<R>,
    /// What arrives along it counts so much.
    throughput: R::Vec3,
    /// What the path has brought so far.
    radiance: R::Vec3,
    /// The vertex in the making, for random numbers.
    address: Address,
    way: SampleHash,
    draws: VertexSamples,
    /// Segments traced so far.
    traced: u32,
    /// How many of them it came to unchanged by a border of equal media, and the surfaces that it
    /// passed unchanged in all.
    matched: u32,
    passages: u32,
    /// Whether it has met a surface.
    hit: bool,
    /// Share of the studio's light that is kept from the ground where its camera ray came to it.
    shadow: R,
    /// Least density with which it left one, the last one apart: how far it was scattered before.
    spread: f64,
    /// The bodies that it is in.
    media: Media,
    /// Where the ray left, and how.
    previous: PreviousVertex<R>,
    /// The one wavelength, in nanometres, by which a path goes on that was bent apart; none: it is
    /// white.
    wavelength: Option<f64>,
}

/// Numbers in [0, 1) that nearly every vertex asks for.
#[derive(Clone, Copy, Debug, Default)]
struct VertexSamples {
    /// Which light it asks, and where on it.
    light: [f32; 4],
    /// Which way the path goes on, by the lobe and a direction of it, and whether.
    scatter: [f32; 4],
}

/// How a ray left its vertex: what it takes to know how else the light at its end could have been
/// found.
#[derive(Clone, Copy, Debug)]
struct PreviousVertex<R: Real> {
    /// The vertex, and the normal there on the side that the path came from; zero where light comes
    /// from both.
    from: R::Vec3,
    normal: R::Vec3,
    /// Density over solid angle of the direction; infinite where no light could have been drawn
    /// instead: for rays of the camera, and of lobes without a density.
    density: f64,
}

impl<R: Real> PathTracer<'_, R> {
    /// The path of a camera ray before its first segment.
    #[inline(always)]
    fn camera_path(&self, ray: Ray<R>, address: Address) -> PathState<R> {
        PathState {
            leg: PathSegment {
                ray,
                ..PathSegment::of_camera(self.scene)
            },
            throughput: Vector::ONE,
            radiance: Vector::ZERO,
            address,
            way: address.way(),
            draws: VertexSamples::default(),
            traced: 0,
            matched: 0,
            passages: 0,
            hit: false,
            shadow: R::ZERO,
            spread: f64::INFINITY,
            media: self.media,
            previous: PreviousVertex {
                from: ray.origin,
                normal: ray.direction,
                density: f64::INFINITY,
            },
            wavelength: None,
        }
    }

    /// Keeps what a camera ray hits first, where layers ask for it.
    #[inline(always)]
    fn keep_first(&mut self, path: &PathState<R>, hit: &Hit<R>) {
        if self.keeps_first && path.traced == 0 && path.passages == 0 {
            self.first = Some(FirstHit::new(self.scene, &path.leg, hit));
        }
    }

    /// Takes a path on through a surface that is not there where it met it.
    fn pass(&mut self, path: &mut PathState<R>, at: &Interaction<R>) -> bool {
        path.address.bounce += 1;
        let rest = path.leg.rest;
        let ray = Ray {
            culls: path.leg.ray.culls,
            ..self.scene.spawn(at, at.direction, -R::ONE)
        };
        path.leg.go_on(&ray, rest);
        self.counts_passage(path)
    }

    /// Counts a surface that a path passed unchanged. Whether it may pass more.
    fn counts_passage(&mut self, path: &mut PathState<R>) -> bool {
        path.passages += 1;
        let ends = path.passages > MOST_PASSAGES;
        self.counters.cut_short += u64::from(ends);
        !ends
    }

    /// Whether a path has all its segments. Those between borders of equal media are one.
    #[inline(always)]
    fn is_at_limit(&self, path: &PathState<R>) -> bool {
        path.traced - path.matched >= self.max_depth
    }
}
