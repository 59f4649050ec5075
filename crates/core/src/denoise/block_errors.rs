//! Mean error over a picture, with an interval from blocks of pixels.
//!
//! The filter correlates neighbouring pixels, so the standard error of the mean is computed from
//! blocks: the variance of a block is half the mean squared difference of adjacent blocks. An error
//! carried by few pixels is underestimated more often than overestimated. So the interval is
//! log-normal above the estimate, and extends farther up than down.

use crate::film::ErrorEstimate;
use crate::metrics::student_factor_95;

/// Edge in pixels of the blocks over which squared errors are summed.
const BLOCK: usize = 8;

/// Largest meaningful standard error, as a share of the noisy picture's squared error. A share of
/// the denoised picture's own estimate would reject estimates that are low by chance. Then more
/// than one in twenty of the accepted estimates would be too high.
const UNKNOWN: f64 = 0.5;

/// Largest standard error, relative to the estimate, at which the upper end of the interval is
/// log-normal. Beyond it the end is extrapolated.
const SKEWED: f64 = 0.5;

/// Sums of estimated squared errors over a picture and over its blocks of 8 × 8 pixels.
pub(super) struct BlockErrorSums {
    /// Sums over blocks, row by row.
    blocks: Vec<f64>,
    columns: usize,
    sum: f64,
    square: f64,
    /// Number of pixels of the picture.
    pub(super) pixels: f64,
    /// Numbers of complete blocks along width and height; only complete blocks enter the standard
    /// error.
    whole: [usize; 2],
}

impl BlockErrorSums {
    pub(super) fn new([width, height]: [usize; 2]) -> Self {
        let columns = width.div_ceil(BLOCK);
        let whole = [width / BLOCK, height / BLOCK];
        let blocks = vec![0.0; columns * height.div_ceil(BLOCK)];
        Self {
            blocks,
            columns,
            sum: 0.0,
            square: 0.0,
            pixels: (width * height) as f64,
            whole,
        }
    }

    /// Adds the squared error of the pixel in column `x` and row `y`.
    pub(super) fn add_error(&mut self, x: usize, y: usize, error: f64) {
        self.blocks[y / BLOCK * self.columns + x / BLOCK] += error;
        self.sum += error;
        self.square += error * error;
    }

    /// Returns the mean squared error over pixels.
    pub(super) fn mean_error(&self) -> f64 {
        self.sum / self.pixels
    }

    /// Returns the standard error of the mean squared error and its degrees of freedom; `None`
    /// without two adjacent blocks.
    ///
    /// n normally distributed blocks have 2n differences d between neighbours. Each difference
    /// shares a block with six others, so Σd² has the mean 4nσ² and the variance 40nσ⁴. That
    /// corresponds to (4n)²·2/(40n) = 4n/5 degrees of freedom. (Σd²)²/Σd⁴ is then 2n/3; the
    /// function returns 6/5 of it. The result is less if few blocks dominate the differences.
    fn standard_error(&self) -> Option<(f64, f64)> {
        let [columns, rows] = self.whole;
        let at = |x: usize, y: usize| self.blocks[y * self.columns + x] / (BLOCK * BLOCK) as f64;
        let along = (0..rows).flat_map(|y| (1..columns).map(move |x| at(x, y) - at(x - 1, y)));
        let down = (1..rows).flat_map(|y| (0..columns).map(move |x| at(x, y) - at(x, y - 1)));
        let (mut squares, mut fourths, mut count) = (0.0, 0.0, 0_u64);
        for square in along.chain(down).map(|apart| apart * apart) {
            (squares, fourths, count) = (squares + square, fourths + square * square, count + 1);
        }
        let freedom = if fourths > 0.0 {
            1.2 * squares * squares / fourths
        } else {
            f64::INFINITY
        };
        (count > 0).then(|| {
            (
                (squares / count as f64 / 2.0 / (columns * rows) as f64).sqrt(),
                freedom,
            )
        })
    }

    /// Returns the standard error of the mean, combined with a further standard error `off`, and
    /// Student's factor. The standard error is zero if all errors are zero. The further error is
    /// not estimated from blocks, so a greater share of it raises the degrees of freedom
    /// (Satterthwaite, 1946).
    fn combined_standard_error(&self, off: f64) -> (f64, f64) {
        let (own, freedom) = self
            .standard_error()
            .unwrap_or((f64::INFINITY, f64::INFINITY));
        let unsure = if self.square > 0.0 {
            (own * own + off * off).sqrt()
        } else {
            0.0
        };
        let of_both = if own > 0.0 && own < unsure {
            freedom * (unsure / own).powi(4)
        } else {
            freedom
        };
        (unsure, student_factor_95((of_both as u32).max(1)))
    }

    /// Returns the square root of the mean squared error with its interval. `off` is a further
    /// standard error of the mean. The lower end uses Student's factor; the upper end is
    /// log-normal, extrapolated linearly for large standard errors.
    pub(super) fn rms_interval(&self, off: f64) -> ErrorEstimate {
        let (mean, (unsure, factor)) = (self.mean_error(), self.combined_standard_error(off));
        let share = if unsure < SKEWED * mean {
            unsure / mean
        } else {
            SKEWED
        };
        let above = if share > 0.0 {
            libm::expm1(factor * share) / share
        } else {
            factor
        };
        let root = |square: f64| square.max(0.0).sqrt();
        let carriers = if self.square > 0.0 {
            self.sum * self.sum / self.square
        } else {
            f64::INFINITY
        };
        ErrorEstimate {
            value: root(mean),
            low: root(mean - factor * unsure),
            high: root(mean + above * unsure),
            carriers,
        }
    }

    /// Whether the interval is too wide to be meaningful. `noise` is the mean squared error of the
    /// noisy picture.
    pub(super) fn is_interval_meaningless(&self, off: f64, noise: f64) -> bool {
        self.square > 0.0 && self.combined_standard_error(off).0 > UNKNOWN * noise
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the standard error follows from differences of neighbouring blocks. Columns of
    /// blocks of 0 and 1 in turn differ by 1 along rows and by 0 down, so that eight blocks of four
    /// by two have (6/10)/2/8 for its square. Six equal squares are 6/5 of six degrees of freedom.
    /// A rim of partial blocks counts in the mean alone. A further error as great as that of the
    /// blocks gives four times the degrees of freedom.
    #[test]
    fn blocks_say_how_sure_a_mean_is() {
        let mut sums = BlockErrorSums::new([33, 16]);
        for (x, y) in (0..33).flat_map(|x| (0..16).map(move |y| (x, y))) {
            sums.add_error(
                x,
                y,
                f64::from(u8::from(x / 8 % 2 == 1)) + f64::from(u8::from(x == 32)) * 33.0,
            );
        }
        assert!((sums.mean_error() - (256.0 + 16.0 * 33.0) / 528.0).abs() < 1e-12);
        let (error, freedom) = sums.standard_error().expect("blocks");
        assert!((error - (0.6_f64 / 16.0).sqrt()).abs() < 1e-12 && (freedom - 7.2).abs() < 1e-12);
        assert_eq!(
            [
                sums.combined_standard_error(0.0).1,
                sums.combined_standard_error(error).1
            ],
            [7, 28].map(student_factor_95)
        );
        assert_eq!(BlockErrorSums::new([15, 9]).standard_error(), None);
    }

    /// Protects: an interval reaches up as for a log-normal error, down as for a normal one, by
    /// Student's factor for the seven degrees of freedom of eight blocks, and changes without a
    /// step where it becomes undefined. The squared standard error is (6/10)/2/8, for a mean of a
    /// half or a fifth of it.
    #[test]
    fn intervals_reach_farther_up() {
        let sums = |base: f64, height: f64| {
            let mut sums = BlockErrorSums::new([32, 16]);
            for (x, y) in (0..32).flat_map(|x| (0..16).map(move |y| (x, y))) {
                sums.add_error(x, y, base + height * f64::from(u8::from(x / 8 % 2 == 1)));
            }
            sums
        };
        let (unsure, factor) = ((0.6_f64 / 16.0).sqrt(), 2.364_624);
        let estimate = sums(0.5, 1.0).rms_interval(0.0);
        assert!(
            (estimate.low.powi(2) - (1.0 - factor * unsure)).abs() < 1e-6,
            "{estimate:?}"
        );
        assert!(
            (estimate.high.powi(2) - (factor * unsure).exp()).abs() < 1e-6,
            "{estimate:?}"
        );
        let [near, far] = [1e-6, -1e-6].map(|by| sums(2.0 * unsure - 0.5 + by, 1.0));
        assert!((near.rms_interval(0.0).high - far.rms_interval(0.0).high).abs() < 1e-4);
        assert!(sums(-0.5, 1.0).rms_interval(0.0).high > (factor * unsure).sqrt());
    }
}
