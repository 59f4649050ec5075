//! Sums of one pixel's samples in one replicate: taken in blocks of 16 in ascending order, each
//! folded into f64. Blocks are counted from the replicate's first sample, and one that is not full
//! is kept apart, so that taking more samples later gives the bits of taking all at once.

use core::marker::PhantomData;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

/// Samples of a block.
pub(crate) const BLOCK: usize = 16;

/// Whether after so many samples there is a block that is not full beside full ones.
pub(crate) fn has_open(drawn: u32) -> bool {
    drawn > BLOCK as u32 && !drawn.is_multiple_of(BLOCK as u32)
}

/// Parts that a sample's coverage is counted in: as fine as a sum of as many samples as there can
/// be still fits.
pub(crate) const WHOLE: u32 = 1 << 16;

/// A coverage from 0 to 1 in parts of [`WHOLE`].
#[inline(always)]
pub(crate) fn parts<R: Real>(coverage: R) -> u32 {
    // Mostly all or nothing, of which rounding makes nothing else.
    (coverage * R::from_f64(f64::from(WHOLE)) + R::from_f64(0.5)).to_f64() as u32
}

/// What a pixel's samples in one replicate amount to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    /// Of the full blocks.
    pub sum: [f64; 3],
    /// Of the block that is not full.
    pub open: [f64; 3],
    /// Root of the sum of squared deviations of the samples that were added last, from their mean.
    /// The root, because it has the range of the samples themselves.
    pub spread: [f32; 3],
    /// Samples that entered.
    pub samples: u16,
    /// What of them something covers, in parts of [`WHOLE`], for the alpha: whole numbers, so that
    /// no order matters.
    pub covered: u32,
    /// What of them is a ground's shadow, in such parts.
    pub shadowed: u32,
}

impl Sums {
    /// Of all samples.
    #[inline(always)]
    pub fn total(&self) -> [f64; 3] {
        core::array::from_fn(|i| self.sum[i] + self.open[i])
    }
}

/// Takes samples in ascending order, pixel after pixel.
#[derive(Default)]
pub(crate) struct Gather<R: Real, B: Block<R>> {
    sums: Sums,
    block: B,
    /// Samples of the block, those that did not enter included.
    in_block: usize,
    /// Samples of all pixels that entered and are covered, wholly or in part.
    pub met: u64,
    scalar: PhantomData<R>,
}

/// What becomes of the samples of a block.
pub(crate) trait Block<R: Real>: Default {
    /// Goes on with a block that has the sum `open`.
    fn resume(&mut self, open: [f64; 3]);
    /// Takes a finite sample.
    fn put(&mut self, radiance: R::Vec3);
    /// The sum of a block that is not full; the next one starts.
    fn take(&mut self) -> [f64; 3];
    /// Ends a pixel, with the root of the sum of squared deviations where that is kept.
    fn spread(&mut self) -> [f32; 3];
}

impl<R: Real, B: Block<R>> Gather<R, B> {
    /// Goes on with a pixel that had `drawn` samples, those that did not enter included.
    #[inline(always)]
    pub fn resume(&mut self, sums: Sums, drawn: u32) {
        self.in_block = drawn as usize % BLOCK;
        self.sums = Sums {
            open: [0.0; 3],
            spread: [0.0; 3],
            ..sums
        };
        self.block.resume(sums.open);
    }

    /// Adds a sample with what of it is covered and what is shadow, in parts of [`WHOLE`]. One that
    /// is not finite is dropped: false.
    #[inline(always)]
    pub fn add(&mut self, radiance: R::Vec3, [covered, shadowed]: [u32; 2]) -> bool {
        let finite = radiance.is_finite();
        if finite {
            self.block.put(radiance);
            self.sums.covered += covered;
            self.sums.shadowed += shadowed;
            self.met += u64::from(covered > 0);
            self.sums.samples += 1;
        }
        self.in_block += 1;
        if self.in_block == BLOCK {
            let block = self.block.take();
            self.sums.sum = core::array::from_fn(|i| self.sums.sum[i] + block[i]);
            self.in_block = 0;
        }
        finite
    }

    /// Ends a pixel, and starts the next one from nothing.
    #[inline(always)]
    pub fn finish(&mut self) -> Sums {
        self.in_block = 0;
        let open = self.block.take();
        Sums {
            open,
            spread: self.block.spread(),
            ..core::mem::take(&mut self.sums)
        }
    }
}

/// Sums alone, each block in the precision of the samples: for pictures without chance, where no
/// error is estimated.
#[derive(Default)]
pub(crate) struct Plain<R: Real>(R::Vec3);

impl<R: Real> Block<R> for Plain<R> {
    /// A sum of such samples is one of their scalar, so it comes back as it was.
    #[inline(always)]
    fn resume(&mut self, sum: [f64; 3]) {
        self.0 = R::Vec3::from_f64(DVec3::from_array(sum));
    }

    #[inline(always)]
    fn put(&mut self, radiance: R::Vec3) {
        self.0 += radiance;
    }

    fn take(&mut self) -> [f64; 3] {
        core::mem::replace(&mut self.0, R::Vec3::ZERO)
            .to_f64()
            .to_array()
    }

    #[inline(always)]
    fn spread(&mut self) -> [f32; 3] {
        [0.0; 3]
    }
}

/// Sums with their second central moment, blocks in f64 too: where samples of 10⁴ differ by 10⁻², a
/// sum of sixteen in f32 has lost what the error is estimated from.
///
/// Deviations are taken from the pixel's first sample in one pass (Chan, Golub and LeVeque,
/// "Algorithms for Computing the Sample Variance: Analysis and Recommendations", 1983): a sample
/// lies no farther from the mean of n than √n standard deviations, so what is subtracted in the end
/// is at most n times what remains, and of f64's digits more are left than f32 holds.
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
    fn resume(&mut self, sum: [f64; 3]) {
        self.block = DVec3::from_array(sum);
    }

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

    fn take(&mut self) -> [f64; 3] {
        core::mem::take(&mut self.block).to_array()
    }

    #[inline(always)]
    fn spread(&mut self) -> [f32; 3] {
        let Self {
            entered,
            deviation,
            square,
            ..
        } = core::mem::take(self);
        let sum = square - deviation * deviation / f64::from(entered.max(1));
        sum.to_array().map(|s| s.max(0.0).sqrt() as f32)
    }
}
