//! From camera rays to what they bring: Whitted ray tracing (Whitted, "An Improved Illumination
//! Model for Shaded Display", 1980) in [`whitted`], and path tracing in [`path_tracing`]. Two types
//! behind one small trait; what both ask of a scene is beside them.

mod bump;
mod cone;
mod first_hit;
mod frame;
mod path_tracing;
mod physical;
mod shadow;
mod spawn;
mod surface;
mod whitted;
mod wireframe;

pub(crate) use first_hit::FirstHit;
use first_hit::FirstHits;
pub(crate) use path_tracing::PathTracer;
pub(crate) use surface::PathSegment;
pub(crate) use whitted::WhittedTracer;

use raywright_bvh::{Ray, Real, Vector};

use crate::counters::{Counters, MOST_PASSAGES};
use crate::light::LightUsage;
use crate::observer::Observer;
use crate::prepare::Prepared;
use crate::sampler::Address;

/// As many camera rays as are intersected together.
pub(crate) const PACKET: usize = 16;

/// What a camera ray brought.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathResult<R: Real> {
    pub radiance: R::Vec3,
    /// Share of the ray that something covers, seen through what is there in part.
    pub coverage: R,
    /// Share of what it sees of the studio's ground that lies in shadow, where nothing covers it.
    pub shadow: R,
}

/// Camera rays with the addresses of their samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraRays<'a, R: Real> {
    pub rays: &'a [Ray<R>],
    pub addresses: &'a [Address],
}

/// What camera rays brought, in their order.
#[derive(Debug, Default)]
pub(crate) struct PathResults<R: Real> {
    pub paths: Vec<PathResult<R>>,
    /// What each ray hit first, none for the sky, and what it saw without light from elsewhere;
    /// empty where layers ask for neither.
    pub first_hits: Vec<Option<FirstHit>>,
    pub direct: Vec<R::Vec3>,
}

impl<R: Real> PathResults<R> {
    fn clear(&mut self) {
        self.paths.clear();
        self.first_hits.clear();
        self.direct.clear();
    }

    /// The first hit of a ray, and what it saw without light from elsewhere.
    pub fn first(&self, place: usize) -> (Option<&FirstHit>, R::Vec3) {
        let direct = self.direct.get(place).copied().unwrap_or(Vector::ZERO);
        (self.first_hits.get(place).and_then(Option::as_ref), direct)
    }
}

/// An algorithm that finds the radiance along camera rays; one a worker.
pub(crate) trait LightTransport<'a, R: Real> {
    /// Most camera rays that it takes at a time.
    const BATCH: usize;

    /// For paths of so many segments. `keeps_first`: whether layers ask what camera rays hit first.
    fn new(
        scene: &'a Prepared<R>,
        max_depth: u32,
        keeps_first: bool,
        observer: &'a dyn Observer,
    ) -> Self;

    /// Finds what camera rays bring, in place of what `out` held.
    fn trace(&mut self, rays: CameraRays<'_, R>, out: &mut PathResults<R>);

    /// The first hit of a ray that is followed no further; none for the sky.
    fn first_hit(&mut self, ray: Ray<R>) -> Option<FirstHit>;

    /// Hands over what was counted since this was last called.
    fn take_counters(&mut self) -> Counters;

    /// Whether the observer stopped a path halfway, so that what was traced is worth nothing.
    fn is_stopped(&self) -> bool {
        false
    }

    /// Which lights lit anything, once all is traced; nothing is known of them where it does not
    /// count.
    fn into_light_usage(self) -> LightUsage
    where
        Self: Sized,
    {
        LightUsage::default()
    }
}
