//! Sums of one pixel's samples in one replicate. Samples are summed in blocks of 16, in ascending
//! order, and the sums of blocks are added in f64. Blocks start at fixed samples of the replicate,
//! and a partial block is kept separate. Adding samples later therefore gives the same bits as
//! taking all samples at once.

use core::marker::PhantomData;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

/// Number of samples in a block.
pub(crate) const BLOCK: usize = 16;

/// Whether this number of samples ends with a partial block after full ones.
pub(crate) fn has_partial_block(drawn: u32) -> bool {
    drawn > BLOCK as u32 && !drawn.is_multiple_of(BLOCK as u32)
}

/// Number of units in full coverage: the largest for which the sum over the greatest number of
/// samples fits in 32 bits.
pub(crate) const COVERAGE_UNITS: u32 = 1 << 16;

/// Converts a coverage from 0 to 1 to units of 1/[`COVERAGE_UNITS`].
#[inline(always)]
pub(crate) fn quantise_coverage<R: Real>(coverage: R) -> u32 {
    // Coverage is mostly zero or one, which rounding preserves.
    (coverage * R::from_f64(f64::from(COVERAGE_UNITS)) + R::from_f64(0.5)).to_f64() as u32
}

/// Sums of a pixel's samples in one replicate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PixelSums {
    /// Sum of the full blocks.
    pub sum: [f64; 3],
    /// Sum of the partial block.
    pub partial_block: [f64; 3],
    /// Square root of the summed squared deviations of the latest samples from their mean. A square
    /// root has the range of the samples themselves.
    pub spread: [f32; 3],
    /// Number of finite samples.
    pub samples: u16,
    /// Summed coverage in units of 1/[`COVERAGE_UNITS`], for the alpha. Whole numbers, so that the
    /// order of addition does not matter.
    pub covered: u32,
    /// Summed coverage by a ground's shadow, in the units of `covered`.
    pub shadowed: u32,
}

impl PixelSums {
    /// Returns the sum of all samples.
    #[inline(always)]
    pub fn total(&self) -> [f64; 3] {
        core::array::from_fn(|i| self.sum[i] + self.partial_block[i])
    }
}

/// Accumulates samples in ascending order, pixel by pixel.
#[derive(Default)]
pub(crate) struct SampleAccumulator<R: Real, B: BlockAccumulator<R>> {
    sums: PixelSums,
    block: B,
    /// Number of samples of the current block, dropped samples included.
    block_samples: usize,
    /// Number of finite samples with any coverage, over all pixels.
    pub hits: u64,
    scalar: PhantomData<R>,
}

/// Accumulator of a block's samples.
pub(crate) trait BlockAccumulator<R: Real>: Default {
    /// Continues a block whose samples so far have the sum `open`.
    fn resume_block(&mut self, open: [f64; 3]);
    /// Adds a finite sample.
    fn add_sample(&mut self, radiance: R::Vec3);
    /// Returns the sum of the block's samples, and starts the next block.
    fn close_block(&mut self) -> [f64; 3];
    /// Ends a pixel. Returns the square root of the pixel's sum of squared deviations; zero for an
    /// accumulator that keeps none.
    fn close_pixel(&mut self) -> [f32; 3];
}

impl<R: Real, B: BlockAccumulator<R>> SampleAccumulator<R, B> {
    /// Continues a pixel from its earlier sums after `drawn` samples, dropped samples included.
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

    /// Adds a sample with its coverage and its shadow, both in units of 1/[`COVERAGE_UNITS`]. Drops
    /// a sample that is not finite, and returns false.
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

    /// Ends a pixel, returns its sums, and starts the next pixel.
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

/// Accumulates sums alone, without squared deviations: for pictures without random sampling, for
/// which no error is estimated. The samples of a block are summed in their own precision.
#[derive(Default)]
pub(crate) struct SumAccumulator<R: Real>(R::Vec3);

impl<R: Real> BlockAccumulator<R> for SumAccumulator<R> {
    /// Restores the sum exactly: a sum of samples in this precision is representable in it.
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

/// Accumulates sums and second central moments, in f64: where samples of 10⁴ differ by 10⁻², an f32
/// sum of sixteen has lost the digits from which the error is estimated.
///
/// Deviations are taken from the pixel's first sample in one pass (Chan, Golub and LeVeque,
/// "Algorithms for Computing the Sample Variance: Analysis and Recommendations", 1983). A sample is
/// at most √n standard deviations from the mean of n samples. The number subtracted at the end is
/// therefore at most n times the result, and f64 keeps more digits than the f32 result holds.
#[derive(Default)]
pub(crate) struct MomentAccumulator {
    /// First sample of the pixel.
    first: DVec3,
    /// Number of finite samples.
    count: u32,
    /// Sum of the current block.
    block: DVec3,
    /// Sum of the deviations from the first sample.
    deviation: DVec3,
    /// Sum of the squared deviations from the first sample.
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
