//! Whether two pictures differ by more than their noise: tests of blocks of all sizes at one level
//! for all of them together.
//!
//! The difference of two estimates of one picture has the mean zero and, pixel by pixel, the sum of
//! their variances. So has its sum over a block, since pixels are independent, divided by the root
//! of the summed variances it follows Student's distribution: its degrees of freedom are those of a
//! sum of estimated variances (Satterthwaite, "An Approximate Distribution of Estimates of Variance
//! Components", 1946), few where a few pixels have most of the noise. A block is tested in each
//! channel by itself.
//!
//! A difference that is small and wide is seen in large blocks alone, one that is small and strong
//! in small ones. So blocks of several edges are tested, each doubling the one before and
//! overlapping its neighbours by half. The level is divided evenly among the edges, and by
//! Bonferroni's inequality among the tests of each: then one alarm or more in pictures that differ
//! by noise alone has at most that probability, however the tests depend on each other.

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;

use super::MetricsError;

/// Edge of the smallest blocks, in pixels: sums of fewer pixels are too far from normal.
const SMALLEST: u32 = 16;

/// What two ways to add the same numbers may differ by, as a share of them: no noise, and no
/// difference either.
const ROUNDING: f64 = 1.0 / (1 << 20) as f64;

/// A picture with what is known of its noise.
#[derive(Clone, Debug)]
pub struct NoisyPicture<'a> {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance of each pixel.
    pub rgb: &'a [[f32; 3]],
    /// Standard error of each; none for a picture without noise.
    pub standard_errors: Option<Vec<[f32; 3]>>,
    /// Degrees of freedom of each standard error: one fewer than there are replicates.
    pub freedom: f64,
}

/// What the tests found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NoiseVerdict {
    /// Probability of an alarm, or several, where there is nothing but noise.
    pub level: f64,
    /// Blocks that were tested, each in three channels.
    pub blocks: usize,
    /// Blocks whose difference is beyond noise.
    pub beyond: usize,
    /// The block that is the least likely by noise alone; none where no pixel could be tested.
    pub clearest: Option<NoiseBlock>,
    /// Pixels that are no finite numbers in one picture, or of which one has no standard error;
    /// they are left out.
    pub untested: usize,
}

/// A block of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NoiseBlock {
    /// Its first column.
    pub x: u32,
    /// Its first row from the top.
    pub y: u32,
    /// Its edge in pixels, before it is cut where the picture ends.
    pub edge: u32,
    /// The channel, 0 to 2 for red, green and blue.
    pub channel: usize,
    /// Mean of the difference.
    pub difference: f64,
    /// The same as a share of the reference's mean there; none where that is black.
    pub share: Option<f64>,
    /// The difference in standard errors of itself.
    pub deviation: f64,
    /// Probability, with respect to all tests, that noise alone makes a difference as clear as that
    /// somewhere: at most 1.
    pub probability: f64,
}

/// What a block has in a channel, or the sum over some.
#[derive(Clone, Copy, Default)]
struct BlockSums {
    difference: f64,
    reference: f64,
    size: f64,
    variance: f64,
    /// Squares of the estimated variances, over their degrees of freedom.
    uncertainty: f64,
    pixels: f64,
}

impl BlockSums {
    fn plus(self, other: &Self) -> Self {
        Self {
            difference: self.difference + other.difference,
            reference: self.reference + other.reference,
            size: self.size + other.size,
            variance: self.variance + other.variance,
            uncertainty: self.uncertainty + other.uncertainty,
            pixels: self.pixels + other.pixels,
        }
    }

    /// The difference in standard errors, and the probability of one that is as large or larger.
    fn test(&self) -> (f64, f64) {
        let beyond_rounding = (self.difference.abs() - ROUNDING * self.size).max(0.0);
        if beyond_rounding == 0.0 {
            return (0.0, 1.0);
        }
        if self.variance == 0.0 {
            return (f64::INFINITY, 0.0);
        }
        let t = beyond_rounding / self.variance.sqrt();
        let freedom = self.variance * self.variance / self.uncertainty;
        (t.copysign(self.difference), two_sided(t, freedom))
    }
}

/// Probability that Student's t with so many degrees of freedom is further from zero than that, by
/// the incomplete beta function (Abramowitz and Stegun, "Handbook of Mathematical Functions", 1964,
/// 26.7.1 and 26.5.27).
fn two_sided(t: f64, freedom: f64) -> f64 {
    // More degrees of freedom change no digit, and infinitely many would leave no number.
    let freedom = freedom.min(1e12);
    let (a, b) = (0.5 * freedom, 0.5);
    let [x, rest] = [freedom, t * t].map(|part| part / (freedom + t * t));
    if !(x > 0.0 && rest > 0.0) {
        return if x > 0.0 { 1.0 } else { 0.0 };
    }
    // Where both gamma functions are so large that their quotient would lose digits, the first
    // terms of its series have all of them.
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
        term / (a * beta_fraction(a, b, x))
    } else {
        1.0 - term / (b * beta_fraction(b, a, rest))
    }
}

/// The continued fraction below the incomplete beta function (Olver et al., "NIST Handbook of
/// Mathematical Functions", 2010, 8.17.22) by Lentz's method ("Generating Bessel Functions in Mie
/// Scattering Calculations Using Continued Fractions", 1976). It converges fast for
/// `x < (a + 1) / (a + b + 2)`.
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
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

/// Tests whether a picture differs from a reference by more than the noise of both, at a level for
/// all tests together.
///
/// # Errors
/// [`MetricsError::Size`] for different sizes, [`MetricsError::Pixels`] where a buffer does not
/// fit.
pub fn judge_noise(
    picture: &NoisyPicture<'_>,
    reference: &NoisyPicture<'_>,
    level: f64,
) -> Result<NoiseVerdict, MetricsError> {
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
    let fits = |side: &NoisyPicture<'_>| {
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
    // Sums of the halves of the smallest blocks, of which all others are made.
    let step = SMALLEST / 2;
    let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
    let cells: Vec<([BlockSums; 3], usize)> = (0..columns * rows)
        .into_par_iter()
        .map(|cell| {
            sums(
                picture,
                reference,
                [cell % columns * step, cell / columns * step],
                step,
            )
        })
        .collect();
    let untested = cells.iter().map(|(_, untested)| untested).sum();
    let mut found = Found {
        level,
        blocks: 0,
        beyond: 0,
        clearest: None,
    };
    for &edge in &edges {
        found.test_edge(&cells, [columns, rows], edge, edges.len());
    }
    Ok(NoiseVerdict {
        level,
        blocks: found.blocks,
        beyond: found.beyond,
        clearest: found.clearest,
        untested,
    })
}

/// Sums over a square of pixels, and how many of them are left out.
fn sums(
    picture: &NoisyPicture<'_>,
    reference: &NoisyPicture<'_>,
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

/// What was found so far.
struct Found {
    level: f64,
    blocks: usize,
    beyond: usize,
    clearest: Option<NoiseBlock>,
}

impl Found {
    /// Tests all blocks of an edge, of which there are so many.
    fn test_edge(
        &mut self,
        cells: &[([BlockSums; 3], usize)],
        [columns, rows]: [u32; 2],
        edge: u32,
        edges: usize,
    ) {
        let step = SMALLEST / 2;
        let (across, stride) = (edge / step, edge / SMALLEST);
        // The last one is the first that reaches the end.
        let starts = |of: u32| {
            (0..of)
                .step_by(stride as usize)
                .take_while(move |start| *start == 0 || start + across < of + stride)
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
                    .for_each(|(all, more)| *all = all.plus(more));
            }
            let mut is_beyond = false;
            for (channel, sums) in block
                .iter()
                .enumerate()
                .filter(|(_, sums)| sums.pixels > 0.0)
            {
                let (deviation, probability) = sums.test();
                let probability = (probability * tests as f64).min(1.0);
                is_beyond |= probability <= self.level;
                if self.clearest.is_none_or(|clearest| {
                    (probability, -deviation.abs())
                        < (clearest.probability, -clearest.deviation.abs())
                }) {
                    let share = (sums.reference != 0.0).then(|| sums.difference / sums.reference);
                    let (x, y, difference) =
                        (column * step, row * step, sums.difference / sums.pixels);
                    self.clearest = Some(NoiseBlock {
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
mod tests {
    use super::*;
    use crate::hash::mix;

    fn unit(seed: [u32; 3]) -> f64 {
        let bits = seed.iter().fold(1, |state, &part| {
            mix(state ^ u64::from(part).wrapping_mul(0x9E37_79B9_7F4A_7C15))
        });
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A colour of each pixel.
    type Colours = Vec<[f32; 3]>;

    /// Two pictures of even noise, four replicates each, of which the first is brighter by a factor
    /// within a square.
    fn pair(seed: u32, edge: u32, factor: f64) -> [(Colours, Colours); 2] {
        [0, 1].map(|side| {
            let pixel = |i: u32| {
                let inside = side == 0 && i % SIZE < edge && i / SIZE < edge;
                let replicate = |r: u32| {
                    let u: f64 = (0..6)
                        .map(|k| unit([seed, i * 8 + side * 4 + r, k]))
                        .sum::<f64>()
                        - 3.0;
                    (1.0 + 0.1 * u) * if inside { factor } else { 1.0 }
                };
                let values = [0, 1, 2, 3].map(replicate);
                let mean = values.iter().sum::<f64>() / 4.0;
                let variance = values
                    .iter()
                    .map(|value| (value - mean).powi(2))
                    .sum::<f64>()
                    / 12.0;
                ([mean as f32; 3], [variance.sqrt() as f32; 3])
            };
            (0..SIZE * SIZE).map(pixel).unzip()
        })
    }

    const SIZE: u32 = 96;

    fn judged(seed: u32, edge: u32, factor: f64) -> NoiseVerdict {
        let sides = pair(seed, edge, factor);
        let [a, b] = sides.each_ref().map(|(rgb, errors)| NoisyPicture {
            width: SIZE,
            height: SIZE,
            rgb,
            standard_errors: Some(errors.clone()),
            freedom: 3.0,
        });
        judge_noise(&a, &b, 0.05).expect("one size")
    }

    /// Protects: Student's distribution by numbers of 60 digits (the incomplete beta function of
    /// mpmath 1.3; from 1e9 degrees of freedom on the normal distribution with its first
    /// correction), from the middle far into the tails, and its limits.
    #[test]
    fn students_tails_are_exact() {
        let known = [
            (0.5, 1.0, 0.70483276469913),
            (3.182, 3.0, 0.050017136543314),
            (12.924, 3.0, 0.00099999511109003),
            (2.086, 20.0, 0.04999635445744),
            (63.657, 1.0, 0.0099999593454681),
            (1.0, 2.5, 0.40406102727827),
            (4.417, 1e9, 1.0008024070545e-5),
            (30.0, 7.25, 7.1642625360361e-9),
            (1e-6, 12.0, 0.99999921854739),
            (6.0, 3e4, 1.9957666621554e-9),
            (8.0, 1e12, 1.2441921161679e-15),
            (8.0, f64::INFINITY, 1.2441921161679e-15),
            (1e8, 1.5, 7.5417048640325e-13),
        ];
        for (t, freedom, expected) in known {
            // The more degrees, the nearer is the argument to one, where the fraction loses digits.
            let (found, bound) = (two_sided(t, freedom), 1e-12 + 1e-17 * freedom.min(1e12));
            assert!(
                (found / expected - 1.0_f64).abs() < bound,
                "{t}, {freedom}: {found}"
            );
        }
        assert_eq!(
            [two_sided(0.0, 3.0), two_sided(f64::INFINITY, 3.0)],
            [1.0, 0.0]
        );
    }

    /// Protects: noise alone gives no more alarms than stated, of a hundred pairs at 5 in 100; a
    /// bias of a tenth of the picture is found where it is.
    #[test]
    fn alarms_are_as_rare_as_stated() {
        let alarms = (0..100)
            .filter(|&seed| judged(seed, 0, 1.0).beyond > 0)
            .count();
        assert!(alarms <= 11, "{alarms}");
        let found = judged(7, 32, 1.02);
        assert!(found.beyond > 0, "{found:?}");
        let clearest = found.clearest.expect("blocks");
        assert!(
            clearest.x < 32 && clearest.y < 32 && clearest.share.is_some_and(|share| share > 0.0),
            "{clearest:?}"
        );
    }

    /// Protects: pictures without noise differ where their numbers do, but for rounding; what is no
    /// number is left out and counted.
    #[test]
    fn exact_pictures_differ_by_their_numbers() {
        let exact = |rgb: &[[f32; 3]], other: &[[f32; 3]]| {
            let side = |rgb| NoisyPicture {
                width: 20,
                height: 20,
                rgb,
                standard_errors: None,
                freedom: 1.0,
            };
            judge_noise(&side(rgb), &side(other), 0.01).expect("one size")
        };
        let grey = vec![[0.3_f32; 3]; 400];
        let mut other = grey.clone();
        other[399] = [f32::from_bits(0.3_f32.to_bits() + 1); 3];
        assert_eq!(exact(&grey, &other).beyond, 0);
        other[399] = [0.31; 3];
        let verdict = exact(&grey, &other);
        assert!(
            verdict.beyond > 0
                && verdict
                    .clearest
                    .is_some_and(|block| block.deviation.is_infinite()),
            "{verdict:?}"
        );
        other[399] = [f32::NAN; 3];
        assert_eq!(
            (exact(&grey, &other).beyond, exact(&grey, &other).untested),
            (0, 1)
        );
    }
}
