//! Stream of sample results. Samples are traced in batches and returned one by one. Camera rays
//! with a common origin are traversed together, and the paths of a batch advance segment by segment
//! side by side. This is faster and gives the same bits.

use raywright_bvh::{Ray, Real, Vector};

use crate::integrator::{CameraRays, FirstHit, LightTransport, PathResult, PathResults};
use crate::sampler::{SampleAddress, SampleSequence};

/// A batch of samples: their addresses and camera rays, and buffers for their generation.
pub(super) struct SampleBatch<R: Real> {
    pub addresses: Vec<SampleAddress>,
    pub rays: Vec<Ray<R>>,
    /// Buffer of random sequences: for each sample, its sequence and the index of its point.
    pub sequences: Vec<(SampleSequence, u32)>,
    /// Buffer of four random numbers for each sample, which determine the position in its pixel.
    pub places: Vec<[f32; 4]>,
}

/// Stream of sample results. It holds the results of a batch and the index of the next result. A
/// new batch is traced when none is left.
pub(super) struct SampleStream<R: Real> {
    samples: SampleBatch<R>,
    results: PathResults<R>,
    next: usize,
}

impl<R: Real> Default for SampleStream<R> {
    fn default() -> Self {
        let samples = SampleBatch {
            addresses: Vec::new(),
            rays: Vec::new(),
            sequences: Vec::new(),
            places: Vec::new(),
        };
        Self {
            samples,
            results: PathResults::default(),
            next: 0,
        }
    }
}

impl<R: Real> SampleStream<R> {
    /// Returns the result of the next sample; `None` if all samples are finished. If the batch is
    /// used up, `make` generates a new batch of at most the given number of samples, and it is
    /// traced.
    #[inline(always)]
    pub fn next_result<'a, T: LightTransport<'a, R>>(
        &mut self,
        tracer: &mut T,
        make: impl FnOnce(usize, &mut SampleBatch<R>),
    ) -> Option<PathResult<R>> {
        if self.next == self.samples.rays.len() {
            self.next = 0;
            self.samples.addresses.clear();
            self.samples.rays.clear();
            self.samples.sequences.clear();
            self.samples.places.clear();
            make(T::MAX_BATCH, &mut self.samples);
            let SampleBatch {
                addresses, rays, ..
            } = &self.samples;
            tracer.trace(CameraRays { rays, addresses }, &mut self.results);
        }
        let result = *self.results.paths.get(self.next)?;
        self.next += 1;
        Some(result)
    }

    /// Returns the first hit of the last returned sample's camera ray, and its directly visible
    /// radiance. The hit is `None` for the sky. The radiance is zero if no layer needs it.
    #[inline(always)]
    pub fn first_hit_and_emission(&self) -> (Option<&FirstHit>, [f64; 3]) {
        let (first, direct) = self.results.first_hit_and_emission(self.next - 1);
        (first, direct.to_f64().to_array())
    }
}
