//! Layers of what camera rays meet first, beside a picture: means over the samples of each pixel.

use crate::film::{Plan, Plane};
use crate::integrator::FirstHit;
use crate::settings::Aov;

/// Sums of the layers that come from first hits, for one pixel.
pub(super) struct FirstHits<'a> {
    plan: &'a Plan,
    sums: Vec<[f64; 3]>,
    hits: u16,
}

impl<'a> FirstHits<'a> {
    pub fn new(plan: &'a Plan) -> Self {
        Self { plan, sums: vec![[0.0; 3]; plan.layers.mean.len()], hits: 0 }
    }

    /// Goes on with a pixel of a plane that has some samples.
    pub fn resume(&mut self, plane: &Plane, pixel: usize) {
        for (sum, layer) in self.sums.iter_mut().zip(&plane.layers) {
            *sum = layer.get(pixel).copied().unwrap_or([0.0; 3]);
        }
        self.hits = plane.first_hits.get(pixel).copied().unwrap_or(0);
    }

    #[inline(always)]
    pub fn add(&mut self, first: Option<&FirstHit>) {
        if !self.sums.is_empty() {
            self.sum(first);
        }
    }

    fn sum(&mut self, first: Option<&FirstHit>) {
        let Some(first) = first else { return };
        self.hits += 1;
        for (sum, (aov, _)) in self.sums.iter_mut().zip(&self.plan.layers.mean) {
            let value = match aov {
                Aov::Albedo => first.albedo,
                Aov::Normal => first.normal,
                _ => first.position,
            };
            *sum = core::array::from_fn(|i| sum[i] + value[i]);
        }
    }

    /// Hands the sums of the pixel over and starts the next one.
    #[inline(always)]
    pub fn push(&mut self, plane: &mut Plane) {
        if self.sums.is_empty() {
            return;
        }
        for (layer, sum) in plane.layers.iter_mut().zip(&mut self.sums) {
            layer.push(core::mem::take(sum));
        }
        if self.plan.counts_first_hits() {
            plane.first_hits.push(self.hits);
        }
        self.hits = 0;
    }
}
