//! Test whether two noisy pictures differ by more than their noise. Blocks of several sizes are
//! tested, at a common level of significance.
//!
//! The difference of two estimates of the same picture has mean zero, and its variance is the sum
//! of their variances. Pixels are independent, so the same holds for sums over a block. The summed
//! difference, divided by the square root of the summed variances, follows Student's distribution.
//! Its degrees of freedom are those of a sum of estimated variances (Satterthwaite, "An Approximate
//! Distribution of Estimates of Variance Components", 1946). They are few if few pixels have most
//! of the noise. Each channel of a block is tested separately.
//!
//! Large blocks reveal a weak difference over a large area, small blocks a strong difference in a
//! small area. So blocks of several edge lengths are tested, each twice the previous length, and
//! neighbouring blocks overlap by half. The level is divided evenly among the edge lengths, and by
//! Bonferroni's inequality among the tests of a length. So if pictures differ by noise alone, the
//! probability that any test fails is at most the level, even though the tests depend on each
//! other.

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;

use super::MetricsError;

/// Edge of the smallest blocks in pixels. Sums over smaller blocks are too far from normally
/// distributed.
const SMALLEST: u32 = 16;

/// Relative difference of block sums that rounding may cause. A smaller difference is ignored.
const ROUNDING: f64 = 1.0 / (1 << 20) as f64;

/// Colours of a picture with their standard errors: the input of [`test_against_noise`].
#[derive(Clone, Debug)]
pub struct PictureWithErrors<'a> {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Radiance of each pixel, row by row.
    pub rgb: &'a [[f32; 3]],
    /// Standard error of each pixel's value, per channel; `None` for a picture without noise.
    pub standard_errors: Option<Vec<[f32; 3]>>,
    /// Degrees of freedom of each standard error: one less than the number of replicates.
    pub freedom: f64,
}

/// Result of [`test_against_noise`]: the number of blocks in which two pictures differ by more than
/// noise, and the clearest of these differences.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NoiseTestResult {
    /// Level of significance: probability that two pictures fail the test although they differ by
    /// noise alone.
    pub level: f64,
    /// Number of tested blocks, each in three channels.
    pub blocks: usize,
    /// Number of blocks that differ by more than noise.
    pub beyond: usize,
    /// Block and channel in which noise alone is the least probable cause of the difference; `None`
    /// if no pixel could be tested.
    pub clearest: Option<TestedBlock>,
    /// Number of pixels left out: in one of the pictures they are not finite or have no standard
    /// error.
    pub untested: usize,
}

/// Square block of pixels in one channel: its mean difference from the reference, and the
/// probability that noise alone causes this difference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TestedBlock {
    /// First column of the block.
    pub x: u32,
    /// First row of the block from the top of the picture.
    pub y: u32,
    /// Edge of the block in pixels, before clipping to the picture.
    pub edge: u32,
    /// Channel, 0 to 2 for red, green and blue.
    pub channel: usize,
    /// Mean over the block of picture minus reference.
    pub difference: f64,
    /// Mean difference divided by the reference's mean; `None` for a black reference.
    pub share: Option<f64>,
    /// Mean difference in units of its standard error.
    pub deviation: f64,
    /// Probability, at most 1, that noise alone causes so large a deviation in at least one tested
    /// block.
    pub probability: f64,
}

/// Sums over the pixels of a block in one channel, from which the test is computed.
#[derive(Clone, Copy, Default)]
struct BlockSums {
    difference: f64,
    reference: f64,
    size: f64,
    variance: f64,
    /// Sum of the squared variance estimates, each divided by its degrees of freedom.
    uncertainty: f64,
    pixels: f64,
}

impl BlockSums {
    fn add(self, other: &Self) -> Self {
        Self {
            difference: self.difference + other.difference,
            reference: self.reference + other.reference,
            size: self.size + other.size,
            variance: self.variance + other.variance,
            uncertainty: self.uncertainty + other.uncertainty,
            pixels: self.pixels + other.pixels,
        }
    }

    /// Returns the summed difference in units of its standard error, and the probability that noise
    /// alone causes a difference at least as large.
    fn student_t_test(&self) -> (f64, f64) {
        let beyond_rounding = (self.difference.abs() - ROUNDING * self.size).max(0.0);
        if beyond_rounding == 0.0 {
            return (0.0, 1.0);
        }
        if self.variance == 0.0 {
            return (f64::INFINITY, 0.0);
        }
        let t = beyond_rounding / self.variance.sqrt();
        let freedom = self.variance * self.variance / self.uncertainty;
        (
            t.copysign(self.difference),
            student_two_sided_tail(t, freedom),
        )
    }
}

/// Returns the two-sided tail probability of Student's t with `freedom` degrees of freedom, by the
/// incomplete beta function (Abramowitz and Stegun, "Handbook of Mathematical Functions", 1964,
/// 26.7.1 and 26.5.27).
fn student_two_sided_tail(t: f64, freedom: f64) -> f64 {
    // Beyond 1e12, more degrees of freedom change no digit; infinity would give NaN.
    let freedom = freedom.min(1e12);
    let (a, b) = (0.5 * freedom, 0.5);
    let [x, rest] = [freedom, t * t].map(|part| part / (freedom + t * t));
    if !(x > 0.0 && rest > 0.0) {
        return if x > 0.0 { 1.0 } else { 0.0 };
    }
    // For large arguments the difference of the logarithms of gamma functions loses digits; the
    // first terms of its series do not.
    let quotient = if a > 1e4 {
        0.5 * libm::log(a) - 0.125 / a
    } else {
        libm::lgamma(a + b) - libm::lgamma(a)
    };
    let logarithm = if rest < 0.5 {
        libm::log1p(-rest)
    } else {
        libm::log(x)
    };
    let term = libm::exp(a * logarithm + b * libm::log(rest) + quotient - libm::lgamma(b));
    if x < (a + 1.0) / (a + b + 2.0) {
        term / (a * incomplete_beta_fraction(a, b, x))
    } else {
        1.0 - term / (b * incomplete_beta_fraction(b, a, rest))
    }
}

/// Continued fraction of the incomplete beta function (Olver et al., "NIST Handbook of Mathematical
/// Functions", 2010, 8.17.22) by Lentz's method ("Generating Bessel Functions in Mie Scattering
/// Calculations Using Continued Fractions", 1976). It converges fast for `x < (a + 1) / (a + b +
/// 2)`.
fn incomplete_beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    const MOST: u32 = 10_000;
    let (mut value, mut numerator, mut denominator) = (1.0, 1.0, 0.0);
    for i in 1..MOST {
        let m = f64::from(i / 2);
        let coefficient = if i % 2 == 0 {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        let off_zero = |number: f64| {
            if number.abs() < f64::MIN_POSITIVE {
                f64::MIN_POSITIVE
            } else {
                number
            }
        };
        numerator = off_zero(1.0 + coefficient / numerator);
        denominator = 1.0 / off_zero(1.0 + coefficient * denominator);
        value *= numerator * denominator;
        if (numerator * denominator - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    value
}

/// Tests whether a picture differs from a reference by more than the noise of both. `level` is the
/// accepted probability that pictures fail that differ by noise alone.
///
/// # Errors
/// [`MetricsError::Size`] for different sizes, [`MetricsError::Pixels`] if a buffer does not match
/// its picture.
pub fn test_against_noise(
    picture: &PictureWithErrors<'_>,
    reference: &PictureWithErrors<'_>,
    level: f64,
) -> Result<NoiseTestResult, MetricsError> {
    let (width, height) = (picture.width, picture.height);
    if (width, height) != (reference.width, reference.height) {
        return Err(MetricsError::Size(
            width,
            height,
            reference.width,
            reference.height,
        ));
    }
    let pixels = width as usize * height as usize;
    let fits = |side: &PictureWithErrors<'_>| {
        side.rgb.len() == pixels
            && side
                .standard_errors
                .as_ref()
                .is_none_or(|errors| errors.len() == pixels)
    };
    if pixels == 0 || !fits(picture) || !fits(reference) {
        return Err(MetricsError::Pixels);
    }
    let largest = width.min(height).max(SMALLEST);
    let edges: Vec<u32> = std::iter::successors(Some(SMALLEST), |edge| Some(edge * 2))
        .take_while(|edge| *edge <= largest)
        .collect();
    // Sums over squares (cells) of half the smallest edge, from which all blocks are composed.
    let step = SMALLEST / 2;
    let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
    let cells: Vec<([BlockSums; 3], usize)> = (0..columns * rows)
        .into_par_iter()
        .map(|cell| {
            sum_over_smallest_blocks(
                picture,
                reference,
                [cell % columns * step, cell / columns * step],
                step,
            )
        })
        .collect();
    let untested = cells.iter().map(|(_, untested)| untested).sum();
    let mut found = NoiseTests {
        level,
        blocks: 0,
        beyond: 0,
        clearest: None,
    };
    for &edge in &edges {
        found.test_block_differences(&cells, [columns, rows], edge, edges.len());
    }
    Ok(NoiseTestResult {
        level,
        blocks: found.blocks,
        beyond: found.beyond,
        clearest: found.clearest,
        untested,
    })
}

/// Returns the sums over a square of pixels for each channel, and the number of pixels left out.
/// `[x, y]` is the column and row of the upper left pixel; `edge` is in pixels.
fn sum_over_smallest_blocks(
    picture: &PictureWithErrors<'_>,
    reference: &PictureWithErrors<'_>,
    [x, y]: [u32; 2],
    edge: u32,
) -> ([BlockSums; 3], usize) {
    let (mut sums, mut untested) = ([BlockSums::default(); 3], 0);
    for row in y..(y + edge).min(picture.height) {
        for column in x..(x + edge).min(picture.width) {
            let pixel = row as usize * picture.width as usize + column as usize;
            let sides = [picture, reference].map(|side| {
                let error = side
                    .standard_errors
                    .as_ref()
                    .map_or([0.0; 3], |errors| errors[pixel]);
                (
                    side.rgb[pixel].map(f64::from),
                    error.map(f64::from),
                    side.freedom,
                )
            });
            let is_known = |(rgb, error, _): &([f64; 3], [f64; 3], f64)| {
                rgb.iter().all(|channel| channel.is_finite())
                    && error.iter().all(|error| *error >= 0.0 && error.is_finite())
            };
            if !sides.iter().all(is_known) {
                untested += 1;
                continue;
            }
            let [(a, error_a, freedom_a), (b, error_b, freedom_b)] = sides;
            for (channel, sum) in sums.iter_mut().enumerate() {
                let [of_a, of_b] = [error_a[channel].powi(2), error_b[channel].powi(2)];
                sum.difference += a[channel] - b[channel];
                sum.reference += b[channel];
                sum.size += a[channel].abs() + b[channel].abs();
                sum.variance += of_a + of_b;
                sum.uncertainty += of_a * of_a / freedom_a + of_b * of_b / freedom_b;
                sum.pixels += 1.0;
            }
        }
    }
    (sums, untested)
}

/// Results of the tests, accumulated over blocks.
struct NoiseTests {
    level: f64,
    blocks: usize,
    beyond: usize,
    clearest: Option<TestedBlock>,
}

impl NoiseTests {
    /// Tests all blocks with this edge length in pixels and adds the results. `edges` is the number
    /// of different edge lengths, among which the level is divided.
    fn test_block_differences(
        &mut self,
        cells: &[([BlockSums; 3], usize)],
        [columns, rows]: [u32; 2],
        edge: u32,
        edges: usize,
    ) {
        let step = SMALLEST / 2;
        let (across, stride) = (edge / step, edge / SMALLEST);
        // The last block is the first one that reaches the end of the picture.
        let starts = |total: u32| {
            (0..total)
                .step_by(stride as usize)
                .take_while(move |start| *start == 0 || start + across < total + stride)
                .collect::<Vec<u32>>()
        };
        let (left, top) = (starts(columns), starts(rows));
        let tests = 3 * left.len() * top.len() * edges;
        self.blocks += left.len() * top.len();
        for (&row, &column) in top
            .iter()
            .flat_map(|row| left.iter().map(move |column| (row, column)))
        {
            let mut block = [BlockSums::default(); 3];
            for cell in (row..(row + across).min(rows))
                .flat_map(|y| (column..(column + across).min(columns)).map(move |x| (x, y)))
            {
                let (sums, _) = &cells[(cell.1 * columns + cell.0) as usize];
                block
                    .iter_mut()
                    .zip(sums)
                    .for_each(|(all, more)| *all = all.add(more));
            }
            let mut is_beyond = false;
            for (channel, sums) in block
                .iter()
                .enumerate()
                .filter(|(_, sums)| sums.pixels > 0.0)
            {
                let (deviation, probability) = sums.student_t_test();
                let probability = (probability * tests as f64).min(1.0);
                is_beyond |= probability <= self.level;
                if self.clearest.is_none_or(|clearest| {
                    (probability, -deviation.abs())
                        < (clearest.probability, -clearest.deviation.abs())
                }) {
                    let share = (sums.reference != 0.0).then(|| sums.difference / sums.reference);
                    let (x, y, difference) =
                        (column * step, row * step, sums.difference / sums.pixels);
                    self.clearest = Some(TestedBlock {
                        x,
                        y,
                        edge,
                        channel,
                        difference,
                        share,
                        deviation,
                        probability,
                    });
                }
            }
            self.beyond += usize::from(is_beyond);
        }
    }
}

#[cfg(test)]
mod tests;
