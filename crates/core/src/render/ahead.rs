//! Samples, made some ahead of being asked for: camera rays that leave one point find together what they hit, and paths go a segment
//! at a time side by side; in less time and with the same bits.

use raywright_bvh::{Ray, Real, Vector};

use crate::integrator::{Brought, CameraRay, FirstHit, FirstHits, Kernel, Stream, Tracer};
use crate::sampler::{Address, Sequence};

/// As many camera rays as are asked at once what they hit.
const TOGETHER: usize = 16;

/// As many paths as go side by side: what there is of them stays in a core's own cache.
const PATHS: usize = 256;

/// Samples that are to be taken: their addresses, their camera rays, and what it takes to make them.
pub(super) struct Samples<R: Real> {
    pub addresses: Vec<Address>,
    pub rays: Vec<Ray<R>>,
    pub sequences: Vec<(Sequence, u32)>,
    pub places: Vec<[f32; 4]>,
}

/// The samples made so far, and which one is next.
pub(super) struct Ahead<R: Real> {
    samples: Samples<R>,
    hits: FirstHits<R>,
    stream: Stream<R>,
    next: usize,
}

impl<R: Real> Default for Ahead<R> {
    fn default() -> Self {
        let samples = Samples { addresses: Vec::new(), rays: Vec::new(), sequences: Vec::new(), places: Vec::new() };
        Self { samples, hits: FirstHits::default(), stream: Stream::default(), next: 0 }
    }
}

impl<R: Real> Ahead<R> {
    /// What the next sample brings: the first of those that `make` adds, at most so many, where none is left that was made ahead.
    #[inline(always)]
    pub fn next<K: Kernel>(
        &mut self,
        tracer: &mut Tracer<'_, R, K>,
        make: impl FnOnce(usize, &mut Samples<R>),
    ) -> Option<Brought<R>> {
        if self.next == self.samples.rays.len() {
            self.next = 0;
            self.samples.addresses.clear();
            self.samples.rays.clear();
            self.samples.sequences.clear();
            self.samples.places.clear();
            make(if K::PATHS { PATHS } else { TOGETHER }, &mut self.samples);
            let Samples { addresses, rays, .. } = &self.samples;
            if K::PATHS {
                tracer.follow_all((rays, addresses), TOGETHER, &mut self.stream);
            } else {
                tracer.meet(rays, &mut self.hits);
            }
        }
        let (place, ray, address) = (self.next, self.samples.rays.get(self.next)?, self.samples.addresses.get(self.next)?);
        self.next += 1;
        Some(if K::PATHS {
            self.stream.brought(place)
        } else {
            tracer.camera_ray(CameraRay { ray, met: self.hits.get(place) }, address)
        })
    }

    /// What the camera ray of the sample that came last hit first, none for the sky, and what it saw without light from elsewhere; nothing
    /// where layers ask for none.
    #[inline(always)]
    pub fn first<'a, K: Kernel>(&'a self, tracer: &'a Tracer<'_, R, K>) -> (Option<&'a FirstHit>, [f64; 3]) {
        let (first, direct) = if K::PATHS { self.stream.first(self.next - 1) } else { tracer.first() };
        (first, direct.to_f64().to_array())
    }
}
