//! Camera rays, made some ahead of being followed: those that leave one point find together what they hit, in less time and with
//! the same bits.

use raywright_bvh::{Precision, Ray};

use crate::integrator::{CameraRay, FirstHits, Kernel, Tracer};

/// As many as are asked at once.
const AHEAD: usize = 16;

/// The rays made so far, and which one is next.
pub(super) struct Ahead<P: Precision> {
    rays: Vec<Ray<P::Real>>,
    hits: FirstHits<P>,
    next: usize,
}

impl<P: Precision> Default for Ahead<P> {
    fn default() -> Self {
        Self { rays: Vec::with_capacity(AHEAD), hits: FirstHits::default(), next: 0 }
    }
}

impl<P: Precision> Ahead<P> {
    /// The next ray: the first of `rays` where none is left that was made ahead, in which case those are taken that come next.
    #[inline(always)]
    pub fn next<K: Kernel>(
        &mut self,
        tracer: &Tracer<'_, P, K>,
        rays: impl Iterator<Item = Ray<P::Real>>,
    ) -> Option<CameraRay<'_, P::Real>> {
        if self.next == self.rays.len() {
            self.rays.clear();
            self.rays.extend(rays.take(AHEAD));
            tracer.meet(&self.rays, &mut self.hits);
            self.next = 0;
        }
        let place = self.next;
        self.next += 1;
        self.rays.get(place).map(|&ray| CameraRay { ray, met: self.hits.get(place) })
    }
}
