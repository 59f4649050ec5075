//! Integrators: they compute the radiance along camera rays. [`whitted`] is Whitted ray tracing
//! (Whitted, "An Improved Illumination Model for Shaded Display", 1980), [`path_tracing`] path
//! tracing. Both implement the trait [`LightTransport`]. The other files hold code that both share.

mod first_hit;
mod frame;
mod normal_mapping;
mod path_tracing;
mod physical;
mod ray_cone_footprint;
mod shading_normals;
mod shadow;
mod spawn;
mod surface;
mod whitted;
mod wireframe;

pub(crate) use first_hit::FirstHit;
use first_hit::PacketHits;
pub(crate) use path_tracing::PathTracer;
pub(crate) use surface::PathSegment;
pub(crate) use whitted::WhittedTracer;

use raywright_bvh::{Ray, Real, Vector};

use crate::counters::{Counters, MOST_PASSAGES};
use crate::light::LightUsage;
use crate::observer::Observer;
use crate::prepare::PreparedScene;
use crate::sampler::SampleAddress;

/// Greatest number of camera rays in a packet.
pub(crate) const PACKET: usize = 16;

/// Result of tracing a camera ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathResult<R: Real> {
    pub radiance: R::Vec3,
    /// Coverage (alpha) of the ray.
    pub coverage: R,
    /// Share of the studio's light that the scene blocks where the ray reaches the ground, 0 to 1.
    /// Meaningful only for rays that no surface covers.
    pub shadow: R,
}

/// Camera rays, and the addresses of their samples in the sample sequence.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraRays<'a, R: Real> {
    pub rays: &'a [Ray<R>],
    pub addresses: &'a [SampleAddress],
}

/// Results of a batch of camera rays, in the order of the rays.
#[derive(Debug, Default)]
pub(crate) struct PathResults<R: Real> {
    pub paths: Vec<PathResult<R>>,
    /// First hit of each ray, `None` for the sky; empty if no layer needs first hits.
    pub first_hits: Vec<Option<FirstHit>>,
    /// Emission and sky that each ray sees directly, without reflected light; empty if no layer
    /// needs this radiance.
    pub direct: Vec<R::Vec3>,
}

impl<R: Real> PathResults<R> {
    fn clear(&mut self) {
        self.paths.clear();
        self.first_hits.clear();
        self.direct.clear();
    }

    /// Returns the first hit of the ray at `index`, and the emission that the ray sees directly.
    pub fn first_hit_and_emission(&self, index: usize) -> (Option<&FirstHit>, R::Vec3) {
        let direct = self.direct.get(index).copied().unwrap_or(Vector::ZERO);
        (self.first_hits.get(index).and_then(Option::as_ref), direct)
    }
}

/// An integrator: computes the radiance along camera rays. Each worker thread has its own.
pub(crate) trait LightTransport<'a, R: Real> {
    /// Greatest number of camera rays in a batch.
    const MAX_BATCH: usize;

    /// Creates an integrator for paths of at most `max_depth` segments. `keeps_first`: whether
    /// picture layers need the first hits of camera rays.
    fn new(
        scene: &'a PreparedScene<R>,
        max_depth: u32,
        keeps_first: bool,
        observer: &'a dyn Observer,
    ) -> Self;

    /// Traces the paths of camera rays, and overwrites `out` with their results.
    fn trace(&mut self, rays: CameraRays<'_, R>, out: &mut PathResults<R>);

    /// Traces a camera ray to its first hit only; `None` for the sky.
    fn trace_first_hit(&mut self, ray: Ray<R>) -> Option<FirstHit>;

    /// Returns the numbers of rays traced since the last call, and resets them.
    fn take_counters(&mut self) -> Counters;

    /// Whether the observer cancelled a path midway. The results are then invalid.
    fn is_cancelled(&self) -> bool {
        false
    }

    /// Returns how much each light was used, once all rays are traced. Empty for an integrator that
    /// does not count usage.
    fn into_light_usage(self) -> LightUsage
    where
        Self: Sized,
    {
        LightUsage::default()
    }
}
