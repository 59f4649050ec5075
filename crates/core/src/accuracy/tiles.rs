//! Random sample of a picture's tiles, and estimates for the whole picture from the sample.
//!
//! The probability that a tile is drawn grows with its noise in the pilot pass, a short render of
//! the tiles. It is at least a quarter of the probability under uniform sampling.
//!
//! Tiles are ordered once, by a key divided by the probability (sequential Poisson sampling:
//! Ohlsson, "Sequential Poisson Sampling", 1998). The first n tiles are a valid sample for every n,
//! so more time only adds tiles. The keys are multiples of the golden ratio along rows in
//! alternating direction. They spread a sample evenly over the picture.

use super::estimate::ConfidenceInterval;
use crate::hash::splitmix64;
use crate::metrics::student_factor_95;
use crate::settings::Crop;

/// Golden ratio minus one. The fractional parts of its multiples are evenly spread over 0..1.
const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;

/// Fraction of a tile's probability that depends only on its area. The remaining fraction is
/// proportional to its noise.
const EVEN: f64 = 0.25;

/// Division of a picture into square tiles, numbered row by row as in the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TileGrid {
    pub size: [u32; 2],
    /// Edge of a tile in pixels.
    pub edge: u32,
    /// Seed of the order in which tiles are drawn.
    pub seed: u64,
}

impl TileGrid {
    fn column_count(&self) -> u32 {
        self.size[0].div_ceil(self.edge)
    }

    pub fn tile_count(&self) -> usize {
        (self.column_count() * self.size[1].div_ceil(self.edge)) as usize
    }

    pub fn tile_crop(&self, index: u32) -> Crop {
        let (x, y) = (
            index % self.column_count() * self.edge,
            index / self.column_count() * self.edge,
        );
        Crop {
            x,
            y,
            width: self.edge.min(self.size[0] - x),
            height: self.edge.min(self.size[1] - y),
        }
    }

    pub fn pixel_count_of_tile(&self, index: u32) -> f64 {
        let Crop { width, height, .. } = self.tile_crop(index);
        f64::from(width) * f64::from(height)
    }

    /// Returns the rectangle of a tile with a margin in pixels on each side, clipped to the
    /// picture.
    pub fn tile_crop_with_margin(&self, index: u32, margin: u32) -> Crop {
        let Crop {
            x,
            y,
            width,
            height,
        } = self.tile_crop(index);
        let (left, top) = (x.saturating_sub(margin), y.saturating_sub(margin));
        let end = |position: u32, edge: u32, all: u32| (position + edge + margin).min(all);
        Crop {
            x: left,
            y: top,
            width: end(x, width, self.size[0]) - left,
            height: end(y, height, self.size[1]) - top,
        }
    }

    /// Returns the sorting key of every tile, 0 to 1. Neighbouring tiles have evenly spread keys.
    /// Tiles are drawn by ascending key.
    fn tile_sorting_keys(&self) -> Vec<f64> {
        let start = splitmix64(self.seed) as f64 / 2_f64.powi(64);
        let place = |index: u32| {
            let (x, y) = (index % self.column_count(), index / self.column_count());
            y * self.column_count()
                + if y % 2 == 0 {
                    x
                } else {
                    self.column_count() - 1 - x
                }
        };
        (0..self.tile_count() as u32)
            .map(|index| (start + f64::from(place(index)) * GOLDEN_RATIO).fract())
            .collect()
    }

    /// Returns the indices of all tiles. For every n, the first n tiles are spread evenly over the
    /// picture.
    pub fn evenly_spread_tile_order(&self) -> Vec<u32> {
        let keys = self.tile_sorting_keys();
        let mut all: Vec<u32> = (0..self.tile_count() as u32).collect();
        all.sort_by(|&a, &b| keys[a as usize].total_cmp(&keys[b as usize]));
        all
    }
}

/// Time and noise of a tile in the pilot pass, which renders tiles with few samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PilotTile {
    pub tile: u32,
    /// Render time in seconds summed over all threads.
    pub seconds: f64,
    /// Relative variance of the mean radiance, summed over pixels.
    pub noise: f64,
}

/// Tiles in the order in which they are drawn, with the probability of each.
#[derive(Clone, Debug)]
pub(super) struct TileSample {
    pub grid: TileGrid,
    /// Results of the pilot pass (a short render of the tiles), in the order in which the tiles are
    /// drawn.
    pub passes: Vec<PilotTile>,
    /// Probability of each tile in a draw of one tile, in the order of drawing. The sum is one.
    draw_probabilities: Vec<f64>,
}

impl TileSample {
    /// Orders the tiles of the pilot pass for drawing. They are the first tiles of
    /// [`TileGrid::evenly_spread_tile_order`].
    pub fn new(grid: TileGrid, looks: &[PilotTile]) -> Self {
        let keys = grid.tile_sorting_keys();
        let area = |pilot_pass: &PilotTile| grid.pixel_count_of_tile(pilot_pass.tile);
        let [areas, noise] = [
            looks.iter().map(area).sum::<f64>(),
            looks.iter().map(|pilot_pass| pilot_pass.noise).sum(),
        ];
        let even = if noise > 0.0 { EVEN } else { 1.0 };
        let share = |pilot_pass: &PilotTile| {
            even * area(pilot_pass) / areas + (1.0 - even) * pilot_pass.noise / noise.max(1e-300)
        };
        let mut all: Vec<(PilotTile, f64)> = looks
            .iter()
            .map(|pilot_pass| (*pilot_pass, share(pilot_pass)))
            .collect();
        all.sort_by(|(a, p), (b, q)| {
            (keys[a.tile as usize] / p).total_cmp(&(keys[b.tile as usize] / q))
        });
        let (order, share) = all.into_iter().unzip();
        Self {
            grid,
            passes: order,
            draw_probabilities: share,
        }
    }

    /// Returns the number of tiles that can be drawn. These are the tiles of the pilot pass, a
    /// short render that measured their time and noise.
    pub fn drawable_tile_count(&self) -> usize {
        self.passes.len()
    }

    /// Returns the number of pixels that a tile represents: the number of pixels of all tiles times
    /// the tile's probability in a draw of one tile. Error and probability both grow with noise. So
    /// the error per represented pixel differs less between tiles than the error per pixel.
    pub fn represented_pixel_count(&self, position: usize) -> f64 {
        self.draw_probabilities[position]
            * self
                .passes
                .iter()
                .map(|pilot_pass| self.grid.pixel_count_of_tile(pilot_pass.tile))
                .sum::<f64>()
    }

    /// Whether the first `count` tiles are the whole picture.
    pub fn covers_picture(&self, count: usize) -> bool {
        count >= self.grid.tile_count()
    }

    /// Returns the probability of each of the first `count` tiles to be in a sample of this size.
    pub fn inclusion_probabilities(&self, count: usize) -> Vec<f64> {
        let looked = self.drawable_tile_count() as f64 / self.grid.tile_count() as f64;
        let count = count.min(self.drawable_tile_count());
        if count == self.drawable_tile_count() {
            return vec![looked; count];
        }
        // A tile is certain if its multiplied probability exceeds one; the other tiles then get
        // larger probabilities.
        let (mut certain, mut factor) = (vec![false; self.drawable_tile_count()], count as f64);
        loop {
            let (mut left, mut rest) = (count as f64, 0.0);
            for (share, certain) in self.draw_probabilities.iter().zip(&mut certain) {
                *certain |= share * factor >= 1.0;
                if *certain { left -= 1.0 } else { rest += share }
            }
            let next = if rest > 0.0 {
                left.max(0.0) / rest
            } else {
                0.0
            };
            if next <= factor * (1.0 + 1e-12) {
                break;
            }
            factor = next;
        }
        let chance = |(share, certain): (&f64, bool)| {
            if certain {
                1.0
            } else {
                (share * factor).min(1.0)
            }
        };
        self.draw_probabilities
            .iter()
            .zip(certain)
            .take(count)
            .map(|of| looked * chance(of))
            .collect()
    }
}

/// Terms of one tile in a ratio of two sums over the picture. Numerator and denominator are lists
/// of independent terms, such as one per block of pixels.
#[derive(Clone, Debug)]
pub(super) struct RatioTerm<'a> {
    pub inclusion_probability: f64,
    pub numerator: &'a [f64],
    pub denominator: &'a [f64],
    /// Variance of the numerator's sum due to the reference's noise alone.
    pub reference_variance: f64,
}

impl RatioTerm<'_> {
    /// Returns the residual of the tile, which is numerator minus `ratio` times denominator, and
    /// its variance. The variance is estimated from differences of neighbouring terms.
    fn ratio_residual(&self, ratio: f64) -> (f64, f64) {
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        let total = sum(self.numerator) - ratio * sum(self.denominator);
        if self.numerator.len() != self.denominator.len() || self.numerator.len() < 2 {
            return (total, 0.0);
        }
        let pieces: Vec<f64> = self
            .numerator
            .iter()
            .zip(self.denominator)
            .map(|(a, b)| a - ratio * b)
            .collect();
        (total, variance_of_sum(&pieces))
    }
}

/// Returns the variance of the sum of at least two independent terms. It is estimated from the
/// differences of neighbouring terms.
pub(super) fn variance_of_sum(pieces: &[f64]) -> f64 {
    let steps: f64 = pieces
        .windows(2)
        .map(|pair| (pair[0] - pair[1]) * (pair[0] - pair[1]))
        .sum();
    let n = pieces.len() as f64;
    n / (2.0 * (n - 1.0)) * steps
}

/// Estimates the ratio of two sums over the whole picture from a sample of tiles (Hájek, "Comment
/// on a Paper by D. Basu", 1971). Returns the ratio, its standard error and Student's factor. The
/// standard error includes the choice of tiles and the noise within tiles. `None` if the
/// denominator is zero.
pub(super) fn hajek_ratio_estimate(shares: &[RatioTerm<'_>]) -> Option<(f64, f64, f64)> {
    let total = |of: fn(&RatioTerm<'_>) -> f64| {
        shares
            .iter()
            .map(|share| of(share) / share.inclusion_probability)
            .sum::<f64>()
    };
    let (above, below) = (
        total(|share| share.numerator.iter().sum()),
        total(|share| share.denominator.iter().sum()),
    );
    if !(below > 0.0 && above.is_finite()) {
        return None;
    }
    let ratio = above / below;
    let (mut drawn, mut within, mut squares, mut count) = (0.0, 0.0, 0.0, 0);
    for share in shares {
        let (residual, variance) = share.ratio_residual(ratio);
        let part = (1.0 - share.inclusion_probability).max(0.0)
            * (residual / share.inclusion_probability).powi(2);
        drawn += part;
        squares += part * part;
        within += variance / share.inclusion_probability;
        count += usize::from(share.inclusion_probability < 1.0);
    }
    if count == 1 {
        return Some((ratio, f64::INFINITY, f64::INFINITY));
    }
    let is_error = shares.iter().any(|share| share.reference_variance > 0.0);
    if count == 0
        && is_error
        && shares.len() > 1
        && shares.iter().all(|share| share.numerator.len() == 1)
    {
        // All tiles are drawn, and each is a single piece: the differences between tiles bound the
        // noise from above.
        within = variance_of_sum(
            &shares
                .iter()
                .map(|share| share.ratio_residual(ratio).0)
                .collect::<Vec<_>>(),
        );
    }
    // The degrees of freedom are few if few tiles hold most of the variance.
    let (freedom, correction) = match count {
        0 => (f64::INFINITY, 0.0),
        n => (
            (3.0 * drawn * drawn / squares.max(1e-300))
                .min(n as f64 - 1.0)
                .max(1.0),
            n as f64 / (n as f64 - 1.0),
        ),
    };
    let (drawn, error) = (
        drawn * correction,
        (drawn * correction + within).sqrt() / below,
    );
    // Degrees of freedom by Welch and Satterthwaite; the noise within tiles counts as exactly
    // known.
    let freedom = freedom * ((drawn + within) / drawn.max(1e-300)).powi(2);
    Some((
        ratio,
        error,
        student_factor_95((freedom.min(1e6) as u32).max(1)),
    ))
}

/// Returns the estimated ratio of two sums over the whole picture, with its confidence interval.
/// The interval starts at zero if noise of the reference alone could explain the ratio.
pub(super) fn ratio_interval(shares: &[RatioTerm<'_>]) -> ConfidenceInterval {
    let Some((value, error, factor)) = hajek_ratio_estimate(shares) else {
        return ConfidenceInterval {
            value: 0.0,
            low: 0.0,
            high: f64::INFINITY,
        };
    };
    let below: f64 = shares
        .iter()
        .map(|share| share.denominator.iter().sum::<f64>() / share.inclusion_probability)
        .sum();
    let doubt = shares
        .iter()
        .map(|share| {
            share.reference_variance / (share.inclusion_probability * share.inclusion_probability)
        })
        .sum::<f64>()
        .sqrt()
        / below;
    match value <= student_factor_95(u32::MAX) * doubt || value <= 0.0 {
        true => ConfidenceInterval::from_value_within_noise(value, factor * error.max(doubt)),
        false => ConfidenceInterval::from_relative_error(value, factor * error),
    }
}

#[cfg(test)]
mod tests;
