//! Sums of one pixel's samples in one replicate.
//!
//! Samples are summed in blocks of 16, in ascending order, and the sums of blocks are added in
//! `f64`. Blocks start at fixed samples of the replicate, and the sum of an incomplete block is
//! kept separate. Samples added later therefore give the same bits as samples taken all at once.

use core::marker::PhantomData;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

/// Number of samples in a block.
pub(crate) const BLOCK: usize = 16;

/// Whether `drawn` samples end with an incomplete block after at least one full block.
pub(crate) fn has_partial_block(drawn: u32) -> bool {
    drawn > BLOCK as u32 && !drawn.is_multiple_of(BLOCK as u32)
}

/// Integer that stands for full coverage of one sample. It is the greatest power of two for which
/// the sum over the greatest number of samples fits in 32 bits.
pub(crate) const COVERAGE_UNITS: u32 = 1 << 16;

/// Converts a coverage in 0..1 to an integer in units of 1/[`COVERAGE_UNITS`].
#[inline(always)]
pub(crate) fn quantise_coverage<R: Real>(coverage: R) -> u32 {
    // Coverage is mostly zero or one, which rounding preserves.
    (coverage * R::from_f64(f64::from(COVERAGE_UNITS)) + R::from_f64(0.5)).to_f64() as u32
}

/// Sums of a pixel's samples in one replicate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PixelSums {
    /// Radiance summed over the full blocks.
    pub sum: [f64; 3],
    /// Radiance summed over the incomplete block.
    pub partial_block: [f64; 3],
    /// Square root of the summed squared deviations of the newly added samples from their mean. The
    /// square root has the same range as the samples.
    pub spread: [f32; 3],
    /// Number of samples with a finite radiance.
    pub samples: u16,
    /// Coverage (alpha) summed over samples, in units of 1/[`COVERAGE_UNITS`]. The sum of integers
    /// does not depend on the order of addition.
    pub covered: u32,
    /// Coverage by the shadow on the studio's ground, summed in the same units.
    pub shadowed: u32,
}

impl PixelSums {
    /// Returns the sum of all samples.
    #[inline(always)]
    pub fn total(&self) -> [f64; 3] {
        core::array::from_fn(|i| self.sum[i] + self.partial_block[i])
    }
}

/// Accumulates samples pixel by pixel, in ascending order of samples.
#[derive(Default)]
pub(crate) struct SampleAccumulator<R: Real, B: BlockAccumulator<R>> {
    sums: PixelSums,
    block: B,
    /// Number of samples in the current block. Dropped samples (not finite) count too.
    block_samples: usize,
    /// Number of finite samples with a coverage above zero, over all pixels.
    pub hits: u64,
    scalar: PhantomData<R>,
}

/// Accumulator of the samples of one block.
pub(crate) trait BlockAccumulator<R: Real>: Default {
    /// Continues a block whose samples so far sum to `open`.
    fn resume_block(&mut self, open: [f64; 3]);
    /// Adds a finite sample.
    fn add_sample(&mut self, radiance: R::Vec3);
    /// Returns the sum of the block's samples, and starts the next block.
    fn close_block(&mut self) -> [f64; 3];
    /// Ends a pixel. Returns the square root of the sum of the pixel's squared deviations, or zero
    /// if the accumulator does not keep deviations.
    fn close_pixel(&mut self) -> [f32; 3];
}

impl<R: Real, B: BlockAccumulator<R>> SampleAccumulator<R, B> {
    /// Continues a pixel from its earlier sums. `drawn` is its number of samples so far; dropped
    /// samples (not finite) count too.
    #[inline(always)]
    pub fn resume_pixel(&mut self, sums: PixelSums, drawn: u32) {
        self.block_samples = drawn as usize % BLOCK;
        self.sums = PixelSums {
            partial_block: [0.0; 3],
            spread: [0.0; 3],
            ..sums
        };
        self.block.resume_block(sums.partial_block);
    }

    /// Adds a sample with its coverage and its shadow, both in units of 1/[`COVERAGE_UNITS`].
    /// Returns whether the sample is finite; a sample that is not finite is dropped.
    #[inline(always)]
    pub fn add_sample(&mut self, radiance: R::Vec3, [covered, shadowed]: [u32; 2]) -> bool {
        let finite = radiance.is_finite();
        if finite {
            self.block.add_sample(radiance);
            self.sums.covered += covered;
            self.sums.shadowed += shadowed;
            self.hits += u64::from(covered > 0);
            self.sums.samples += 1;
        }
        self.block_samples += 1;
        if self.block_samples == BLOCK {
            let block = self.block.close_block();
            self.sums.sum = core::array::from_fn(|i| self.sums.sum[i] + block[i]);
            self.block_samples = 0;
        }
        finite
    }

    /// Ends a pixel and returns its sums. The next sample starts the next pixel.
    #[inline(always)]
    pub fn finish_pixel(&mut self) -> PixelSums {
        self.block_samples = 0;
        let open = self.block.close_block();
        PixelSums {
            partial_block: open,
            spread: self.block.close_pixel(),
            ..core::mem::take(&mut self.sums)
        }
    }
}

/// Accumulates sums without squared deviations, for pictures without random sampling, whose error
/// is not estimated. The samples of a block are summed in the renderer's precision.
#[derive(Default)]
pub(crate) struct SumAccumulator<R: Real>(R::Vec3);

impl<R: Real> BlockAccumulator<R> for SumAccumulator<R> {
    /// Restores the sum of an incomplete block. No digit is lost: samples of this precision were
    /// summed in this precision.
    #[inline(always)]
    fn resume_block(&mut self, sum: [f64; 3]) {
        self.0 = R::Vec3::from_f64(DVec3::from_array(sum));
    }

    #[inline(always)]
    fn add_sample(&mut self, radiance: R::Vec3) {
        self.0 += radiance;
    }

    fn close_block(&mut self) -> [f64; 3] {
        core::mem::replace(&mut self.0, R::Vec3::ZERO)
            .to_f64()
            .to_array()
    }

    #[inline(always)]
    fn close_pixel(&mut self) -> [f32; 3] {
        [0.0; 3]
    }
}

/// Accumulates sums and second central moments in `f64`. In `f32`, the sum of sixteen samples of
/// 10⁴ that differ by 10⁻² would have lost the digits needed to estimate the error.
///
/// Deviations are taken from the pixel's first sample, in one pass (Chan, Golub and LeVeque,
/// "Algorithms for Computing the Sample Variance: Analysis and Recommendations", 1983). A sample is
/// at most √n standard deviations from the mean of n samples. The number subtracted at the end is
/// therefore at most n times the result. `f64` has enough digits for this subtraction.
#[derive(Default)]
pub(crate) struct MomentAccumulator {
    /// First sample of the pixel.
    first: DVec3,
    /// Number of finite samples.
    count: u32,
    /// Sum of the current block.
    block: DVec3,
    /// Sum over samples of the deviation from the first sample.
    deviation: DVec3,
    /// Sum over samples of the squared deviation from the first sample.
    square: DVec3,
}

impl<R: Real> BlockAccumulator<R> for MomentAccumulator {
    #[inline(always)]
    fn resume_block(&mut self, sum: [f64; 3]) {
        self.block = DVec3::from_array(sum);
    }

    #[inline(always)]
    fn add_sample(&mut self, radiance: R::Vec3) {
        let value = radiance.to_f64();
        if self.count == 0 {
            self.first = value;
        }
        let deviation = value - self.first;
        self.count += 1;
        self.block += value;
        self.deviation += deviation;
        self.square += deviation * deviation;
    }

    fn close_block(&mut self) -> [f64; 3] {
        core::mem::take(&mut self.block).to_array()
    }

    #[inline(always)]
    fn close_pixel(&mut self) -> [f32; 3] {
        let Self {
            count: entered,
            deviation,
            square,
            ..
        } = core::mem::take(self);
        let sum = square - deviation * deviation / f64::from(entered.max(1));
        sum.to_array().map(|s| s.max(0.0).sqrt() as f32)
    }
}
