//! Sums of one pixel's samples in one replicate: taken in blocks of 16 in ascending order, each folded into f64.

use raywright_bvh::{Real, Vector};

/// Samples of a block.
pub(crate) const BLOCK: usize = 16;

/// What a pixel's samples in one replicate amount to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    pub sum: [f64; 3],
    /// Root of the sum of squared deviations from their mean. The root, because it has the range of the samples themselves.
    pub spread: [f32; 3],
    /// Samples that entered.
    pub samples: u16,
    /// Those of them that hit something, for the alpha.
    pub hits: u16,
}

/// Takes samples in ascending order, pixel after pixel.
pub(crate) trait Gather<R: Real>: Default {
    /// Adds a sample. One that is not finite is dropped: false.
    fn add(&mut self, radiance: R::Vec3, hit: bool) -> bool;
    /// Ends a pixel, and starts the next one from nothing.
    fn finish(&mut self) -> Sums;
}

/// Sums alone, each block in the precision of the samples: for pictures without chance, where no error is estimated.
#[derive(Default)]
pub(crate) struct Plain<R: Real> {
    sums: Sums,
    block: R::Vec3,
    in_block: usize,
}

impl<R: Real> Plain<R> {
    fn fold(&mut self) {
        let block = self.block.to_f64().to_array();
        self.sums.sum = core::array::from_fn(|i| self.sums.sum[i] + block[i]);
        (self.block, self.in_block) = (R::Vec3::ZERO, 0);
    }
}

impl<R: Real> Gather<R> for Plain<R> {
    #[inline(always)]
    fn add(&mut self, radiance: R::Vec3, hit: bool) -> bool {
        let finite = radiance.is_finite();
        if finite {
            self.block += radiance;
            self.sums.hits += u16::from(hit);
            self.sums.samples += 1;
        }
        self.in_block += 1;
        if self.in_block == BLOCK {
            self.fold();
        }
        finite
    }

    #[inline(always)]
    fn finish(&mut self) -> Sums {
        self.fold();
        core::mem::take(&mut self.sums)
    }
}

/// Sums with their second central moment, blocks in f64 too: where samples of 10⁴ differ by 10⁻², a sum of sixteen in f32 has
/// lost what the error is estimated from.
///
/// A block's deviations are taken from its own mean (two passes) and joined to those before it by the formula of Chan, Golub
/// and LeVeque ("Updating Formulae and a Pairwise Algorithm for Computing Sample Variances", 1979), so that no square of a sum
/// is ever subtracted and no moment is negative.
#[derive(Default)]
pub(crate) struct Moments {
    sums: Sums,
    moment: [f64; 3],
    block: [[f64; 3]; BLOCK],
    /// Samples of the block, and those of them that entered.
    in_block: usize,
    entered: usize,
}

impl Moments {
    fn fold(&mut self) {
        let values = &self.block[..self.entered];
        if !values.is_empty() {
            let (n, before) = (values.len() as f64, f64::from(self.sums.samples));
            for i in 0..3 {
                let sum = values.iter().fold(0.0, |sum, v| sum + v[i]);
                let mean = sum / n;
                let deviation = values.iter().fold(0.0, |moment, v| moment + (v[i] - mean) * (v[i] - mean));
                let apart = if before > 0.0 { mean - self.sums.sum[i] / before } else { 0.0 };
                self.moment[i] += deviation + apart * apart * (before * n / (before + n));
                self.sums.sum[i] += sum;
            }
            self.sums.samples += values.len() as u16;
        }
        (self.in_block, self.entered) = (0, 0);
    }
}

impl<R: Real> Gather<R> for Moments {
    #[inline(always)]
    fn add(&mut self, radiance: R::Vec3, hit: bool) -> bool {
        let finite = radiance.is_finite();
        if finite {
            self.block[self.entered] = radiance.to_f64().to_array();
            self.entered += 1;
            self.sums.hits += u16::from(hit);
        }
        self.in_block += 1;
        if self.in_block == BLOCK {
            self.fold();
        }
        finite
    }

    #[inline(always)]
    fn finish(&mut self) -> Sums {
        self.fold();
        let spread = core::mem::take(&mut self.moment).map(|m| m.sqrt() as f32);
        Sums { spread, ..core::mem::take(&mut self.sums) }
    }
}
