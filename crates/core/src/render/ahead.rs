//! Samples, made some ahead of being asked for: camera rays that leave one point find together what they hit, and paths go a segment
//! at a time side by side; in less time and with the same bits.

use raywright_bvh::{Precision, Ray};

use crate::integrator::{Brought, CameraRay, FirstHit, FirstHits, Kernel, Stream, Tracer};
use crate::sampler::Address;

/// As many camera rays as are asked at once what they hit.
const TOGETHER: usize = 16;

/// As many paths as go side by side: what there is of them stays in a core's own cache.
const PATHS: usize = 256;

/// A camera ray, and the sample that it is of.
pub(super) type Sample<R> = (Ray<R>, Address);

/// The camera rays made so far, and which one is next.
pub(super) struct Ahead<P: Precision> {
    samples: Vec<Sample<P::Real>>,
    hits: FirstHits<P>,
    stream: Stream<P>,
    next: usize,
}

impl<P: Precision> Default for Ahead<P> {
    fn default() -> Self {
        Self { samples: Vec::with_capacity(PATHS), hits: FirstHits::default(), stream: Stream::default(), next: 0 }
    }
}

impl<P: Precision> Ahead<P> {
    /// What the next sample brings: the first of those that `make` adds, at most so many, where none is left that was made ahead.
    #[inline(always)]
    pub fn next<K: Kernel>(
        &mut self,
        tracer: &mut Tracer<'_, P, K>,
        make: impl FnOnce(usize, &mut Vec<Sample<P::Real>>),
    ) -> Option<Brought<P::Real>> {
        if self.next == self.samples.len() {
            self.next = 0;
            self.samples.clear();
            make(if K::PATHS { PATHS } else { TOGETHER }, &mut self.samples);
            if K::PATHS {
                tracer.follow_all(&self.samples, TOGETHER, &mut self.stream);
            } else {
                tracer.meet(&self.samples, &mut self.hits);
            }
        }
        let (place, &(ray, address)) = (self.next, self.samples.get(self.next)?);
        self.next += 1;
        Some(if K::PATHS {
            self.stream.brought(place)
        } else {
            tracer.camera_ray(CameraRay { ray, met: self.hits.get(place) }, address)
        })
    }

    /// What the camera ray of the sample that came last hit first; none for the sky, and where layers ask for none.
    #[inline(always)]
    pub fn first<'a, K: Kernel>(&'a self, tracer: &'a Tracer<'_, P, K>) -> Option<&'a FirstHit> {
        if K::PATHS { self.stream.first(self.next - 1) } else { tracer.first() }
    }
}
