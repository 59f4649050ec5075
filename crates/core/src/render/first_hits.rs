//! Layers that describe the first hits of camera rays, such as albedo. A pixel's value is the mean
//! over its samples.

use crate::film::{FilmPlan, ReplicateBuffer};
use crate::integrator::FirstHit;
use crate::settings::Aov;

/// Sums of a pixel's first-hit layers, to which samples are added one by one.
pub(super) struct FirstHitSums<'a> {
    plan: &'a FilmPlan,
    sums: Vec<[f64; 3]>,
    hits: u16,
}

impl<'a> FirstHitSums<'a> {
    pub fn new(plan: &'a FilmPlan) -> Self {
        Self {
            plan,
            sums: vec![[0.0; 3]; plan.layers.mean.len()],
            hits: 0,
        }
    }

    /// Loads the sums of the samples that a pixel already has.
    pub fn resume_pixel(&mut self, buffer: &ReplicateBuffer, pixel: usize) {
        for (sum, layer) in self.sums.iter_mut().zip(&buffer.layers) {
            *sum = layer.get(pixel).copied().unwrap_or([0.0; 3]);
        }
        self.hits = buffer.first_hits.get(pixel).copied().unwrap_or(0);
    }

    /// Adds the first hit of a sample's camera ray. `first` returns the hit and the directly
    /// visible radiance; it is only called if a layer needs them. `entered` is whether the sample
    /// was finite.
    #[inline(always)]
    pub fn add_sample<'f>(
        &mut self,
        first: impl FnOnce() -> (Option<&'f FirstHit>, [f64; 3]),
        entered: bool,
    ) {
        if !self.sums.is_empty() {
            let (first, direct) = first();
            self.add_values(first, direct, entered);
        }
    }

    fn add_values(&mut self, first: Option<&FirstHit>, direct: [f64; 3], entered: bool) {
        self.hits += u16::from(first.is_some());
        for (sum, (aov, _)) in self.sums.iter_mut().zip(&self.plan.layers.mean) {
            let value = match (aov, first) {
                // Emission is a part of the colour, so it is dropped together with the colour.
                (Aov::Emission, _) if entered => direct,
                (Aov::Emission, _) | (_, None) => continue,
                (Aov::Albedo, Some(first)) => first.albedo,
                (Aov::Normal, Some(first)) => first.normal,
                (_, Some(first)) => first.position,
            };
            *sum = core::array::from_fn(|i| sum[i] + value[i]);
        }
    }

    /// Appends the sums of the pixel to the buffer. The next pixel can then begin.
    #[inline(always)]
    pub fn push_pixel(&mut self, buffer: &mut ReplicateBuffer) {
        if self.sums.is_empty() {
            return;
        }
        for (layer, sum) in buffer.layers.iter_mut().zip(&mut self.sums) {
            layer.push(core::mem::take(sum));
        }
        if self.plan.counts_first_hits() {
            buffer.first_hits.push(self.hits);
        }
        self.hits = 0;
    }
}
