//! Sums of one pixel's samples in one replicate: taken in blocks of 16 in ascending order, each folded into f64.

use core::marker::PhantomData;

use glam::DVec3;
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
#[derive(Default)]
pub(crate) struct Gather<R: Real, B: Block<R>> {
    sums: Sums,
    block: B,
    /// Samples of the block, those that did not enter included.
    in_block: usize,
    scalar: PhantomData<R>,
}

/// What becomes of the samples of a block.
pub(crate) trait Block<R: Real>: Default {
    /// Takes a finite sample.
    fn put(&mut self, radiance: R::Vec3);
    /// Hands its samples to the sums, which count them already, and starts the next block.
    fn fold(&mut self, sums: &mut Sums);
    /// Ends a pixel, with the root of the sum of squared deviations where that is kept.
    fn spread(&mut self) -> [f32; 3];
}

impl<R: Real, B: Block<R>> Gather<R, B> {
    /// Adds a sample. One that is not finite is dropped: false.
    #[inline(always)]
    pub fn add(&mut self, radiance: R::Vec3, hit: bool) -> bool {
        let finite = radiance.is_finite();
        if finite {
            self.block.put(radiance);
            self.sums.hits += u16::from(hit);
            self.sums.samples += 1;
        }
        self.in_block += 1;
        if self.in_block == BLOCK {
            self.fold();
        }
        finite
    }

    /// Ends a pixel, and starts the next one from nothing.
    #[inline(always)]
    pub fn finish(&mut self) -> Sums {
        self.fold();
        Sums { spread: self.block.spread(), ..core::mem::take(&mut self.sums) }
    }

    fn fold(&mut self) {
        self.block.fold(&mut self.sums);
        self.in_block = 0;
    }
}

/// Sums alone, each block in the precision of the samples: for pictures without chance, where no error is estimated.
#[derive(Default)]
pub(crate) struct Plain<R: Real>(R::Vec3);

impl<R: Real> Block<R> for Plain<R> {
    #[inline(always)]
    fn put(&mut self, radiance: R::Vec3) {
        self.0 += radiance;
    }

    fn fold(&mut self, sums: &mut Sums) {
        let block = self.0.to_f64().to_array();
        sums.sum = core::array::from_fn(|i| sums.sum[i] + block[i]);
        self.0 = R::Vec3::ZERO;
    }

    #[inline(always)]
    fn spread(&mut self) -> [f32; 3] {
        [0.0; 3]
    }
}

/// Sums with their second central moment, blocks in f64 too: where samples of 10⁴ differ by 10⁻², a sum of sixteen in f32 has
/// lost what the error is estimated from.
///
/// Deviations are taken from the pixel's first sample in one pass (Chan, Golub and LeVeque, "Algorithms for Computing the Sample
/// Variance: Analysis and Recommendations", 1983): a sample lies no farther from the mean of n than √n standard deviations, so
/// what is subtracted in the end is at most n times what remains, and of f64's digits more are left than f32 holds.
#[derive(Default)]
pub(crate) struct Moments {
    /// The pixel's first sample, and how many have entered.
    first: DVec3,
    entered: u32,
    /// Sum of the block.
    block: DVec3,
    /// Sums of deviations from the first sample, and of their squares.
    deviation: DVec3,
    square: DVec3,
}

impl<R: Real> Block<R> for Moments {
    #[inline(always)]
    fn put(&mut self, radiance: R::Vec3) {
        let value = radiance.to_f64();
        if self.entered == 0 {
            self.first = value;
        }
        let deviation = value - self.first;
        self.entered += 1;
        self.block += value;
        self.deviation += deviation;
        self.square += deviation * deviation;
    }

    fn fold(&mut self, sums: &mut Sums) {
        let block = core::mem::take(&mut self.block).to_array();
        sums.sum = core::array::from_fn(|i| sums.sum[i] + block[i]);
    }

    #[inline(always)]
    fn spread(&mut self) -> [f32; 3] {
        let Self { entered, deviation, square, .. } = core::mem::take(self);
        let sum = square - deviation * deviation / f64::from(entered.max(1));
        sum.to_array().map(|s| s.max(0.0).sqrt() as f32)
    }
}
