//! Path tracing (Kajiya, "The Rendering Equation", 1986): at each vertex a path asks one light and goes on in one direction, both
//! drawn by chance, and what both ways find of the same light is combined by multiple importance sampling (Veach, Guibas, "Optimally
//! Combining Sampling Techniques for Monte Carlo Rendering", 1995). In the mean it is right whatever the chances are, but for the
//! paths that are longer than the scene allows.
//!
//! A path's state is numbers alone ([`PathState`]), and what one more segment makes of it does not know which others go beside it.

mod classic;
mod direct;
mod ground;
mod layered;
mod matched;
mod media;
mod mis;
mod mixture;
mod nested;
mod respond;
mod rough;
mod roulette;
mod scatter;
mod shade;
mod straight;
mod vertex;
mod vertices;
mod wavefront;

use raywright_bvh::{Hit, Ray, Real, Vector};

use media::Media;
use wavefront::Wavefront;

use super::spawn::LeastDistances;
use super::{CameraRays, FirstHit, LightTransport, MOST_PASSAGES, PathResults, PathSegment};
use crate::counters::Counters;
use crate::interaction::Interaction;
use crate::light::{LightId, LightUsage, SkySample};
use crate::observer::Observer;
use crate::prepare::{Material, Prepared};
use crate::sampler::{Address, Purpose, SampleHash, pair};
use crate::scene::AlphaMode;
use crate::settings::LightSampling;

/// As many paths as go side by side: what there is of them stays in a core's own cache.
const PATHS: usize = 256;

/// Follows rays as light goes, by chance.
pub(crate) struct PathTracer<'a, R: Real> {
    scene: &'a Prepared<R>,
    counters: Counters,
    usage: LightUsage,
    /// Whether the first hits of camera rays are kept, the one of the path at hand, and what that saw without light from elsewhere.
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

/// Density of a direction, over solid angle, from which on a lobe counts as a mirror: it is seven times narrower than the sun's disc, which has
/// a 14,700th of a unit, so that of directions drawn towards a light hardly any has a share in what the lobe finds.
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
    /// How many of them it came to unchanged by a border of equal media, and the surfaces that it passed unchanged in all.
    matched: u32,
    passages: u32,
    /// Whether it has met a surface.
    hit: bool,
    /// Least density with which it left one, the last one apart: how far it was scattered before.
    spread: f64,
    /// The bodies that it is in.
    media: Media,
    /// Where the ray left, and how.
    previous: PreviousVertex<R>,
    /// The one wavelength, in nanometres, by which a path goes on that was bent apart; none: it is white.
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

/// How a ray left its vertex: what it takes to know how else the light at its end could have been found.
#[derive(Clone, Copy, Debug)]
struct PreviousVertex<R: Real> {
    /// The vertex, and the normal there on the side that the path came from; zero where light comes from both.
    from: R::Vec3,
    normal: R::Vec3,
    /// Density over solid angle of the direction; infinite where no light could have been drawn instead: for rays of the camera, and
    /// of lobes without a density.
    density: f64,
}

/// Share of a technique in what two techniques find, by the densities of both, squared (Veach, Guibas 1995, "power heuristic"). No
/// density is squared by itself, so that none overflows.
#[inline(always)]
fn weight(own: f64, other: f64) -> f64 {
    if own == other {
        return 0.5;
    }
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

impl<R: Real> PathTracer<'_, R> {
    /// The path of a camera ray before its first segment.
    #[inline(always)]
    fn camera_path(&self, ray: Ray<R>, address: Address) -> PathState<R> {
        PathState {
            leg: PathSegment { ray, ..PathSegment::of_camera(self.scene) },
            throughput: Vector::ONE,
            radiance: Vector::ZERO,
            address,
            way: address.way(),
            draws: VertexSamples::default(),
            traced: 0,
            matched: 0,
            passages: 0,
            hit: false,
            spread: f64::INFINITY,
            media: self.media,
            previous: PreviousVertex { from: ray.origin, normal: ray.direction, density: f64::INFINITY },
            wavelength: None,
        }
    }

    /// What one more segment makes of a path that has met something. Whether it has another ray to be traced.
    #[inline(always)]
    fn met(&mut self, path: &mut PathState<R>, hit: &Hit<R>, at: &mut Interaction<R>) -> bool {
        at.perturb_where_bumpy(self.scene, &path.leg, hit);
        self.pass_media(path, at);
        self.keep_first(path, hit);
        if let Material::Physical(m) = &self.scene.materials[at.material as usize]
            && m.alpha != AlphaMode::Opaque
        {
            let alpha = m.alpha_at(&self.scene.sources.at(at));
            // A surface that covers a share of what is behind it is there as often.
            let absent = alpha < R::ONE && (alpha <= R::ZERO || R::from_f32(pair(path.address, Purpose::Coverage)[0]) >= alpha);
            if absent {
                return self.pass(path, at);
            }
        }
        if self.nests()
            && let Some(beyond) = self.hidden(&path.media, at)
        {
            path.media = beyond;
            return self.pass(path, at);
        }
        if let Some(tint) = self.matched(path, at) {
            return self.pass_matched(path, at, tint);
        }
        path.hit = true;
        path.traced += 1;
        self.vertex(path, hit, at)
    }

    /// Keeps what a camera ray hits first, where layers ask for it.
    #[inline(always)]
    fn keep_first(&mut self, path: &PathState<R>, hit: &Hit<R>) {
        if self.keeps_first && path.traced == 0 && path.passages == 0 {
            self.first = Some(FirstHit::new(self.scene, &path.leg, hit));
        }
    }

    /// Adds what a path saw of what its surface gives off by itself, where that is kept of camera rays.
    #[inline(always)]
    fn see(&mut self, camera: bool, radiance: R::Vec3) {
        if camera && self.keeps_first {
            self.direct += radiance;
        }
    }

    /// What a ray brings that hit nothing and sees this of the sky, in its share.
    #[inline(always)]
    fn escaped(&mut self, path: &PathState<R>, seen: &SkySample<R>) -> R::Vec3 {
        let direction = path.leg.ray.direction;
        let lights = &self.scene.lights;
        if self.is_unaided(path)
            && let Some(density) = lights.sky_sampler().and_then(|sampler| sampler.small())
        {
            self.counters.unaided += 1;
            self.counters.found += u64::from(lights.density_of_sky(direction, seen.place, 1.0) >= density);
        }
        seen.radiance * self.found(path, LightId::Sky, |probability| lights.density_of_sky(direction, seen.place, probability))
    }

    /// Whether a path was scattered and then went on as by a mirror: what it meets then, it meets by chance alone.
    #[inline(always)]
    fn is_unaided(&self, path: &PathState<R>) -> bool {
        path.spread < NARROW && path.previous.density >= NARROW
    }

    /// Share that a ray has in finding the light that it met, which is drawn with a density by the probability of being asked.
    #[inline(always)]
    fn found(&self, path: &PathState<R>, light: LightId, drawn: impl FnOnce(f64) -> f64) -> R {
        let PreviousVertex { from, normal, density } = path.previous;
        if density == f64::INFINITY {
            return R::ONE;
        }
        let lights = &self.scene.lights;
        let sampling = self.scene.sampling_of(light);
        if sampling == LightSampling::Scattering {
            return R::ONE;
        }
        let probability = lights.choice().probability::<R>(light, from, normal);
        let other = if probability > 0.0 { drawn(probability) } else { 0.0 };
        match sampling {
            LightSampling::Lights if other > 0.0 => R::ZERO,
            LightSampling::Lights => R::ONE,
            _ => R::from_f64(weight(density, other)),
        }
    }

    /// Takes a path on through a surface that is not there where it met it.
    fn pass(&mut self, path: &mut PathState<R>, at: &Interaction<R>) -> bool {
        path.address.bounce += 1;
        let rest = path.leg.rest;
        let ray = Ray { culls: path.leg.ray.culls, ..self.scene.spawn(at, at.direction, -R::ONE) };
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
