//! What is claimed of a denoised picture, by the squared errors of its pixels, each of them right on average and most of them noisy.
//!
//! Neighbours share their noise, since a filter made them, so that the standard error of the mean is taken from blocks: half the mean
//! square of what adjacent ones differ by is the variance of one. What errors are relative to is estimated, too. The filtered colour
//! itself goes with the error and makes relative ones too small, the same without the pixel's own noise too large; the value is relative to
//! the product of both, and a quarter of what the claims by each of them differ by counts as a standard error of it. That does not become
//! less in larger pictures.

use core::array::from_fn;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::mixture::{FLOOR, replicate_statistics};
use super::plane::PixelPlane;
use super::{CandidatePixel, Denoised};
use crate::film::{BRIGHTEST, Doubt, Estimate, FOUR, Film, ReplicateQuad, Uncertainty};
use crate::picture::Picture;

/// Pixels to each side of a block.
const BLOCK: usize = 8;

/// Standard normal deviate of 95 %.
const NORMAL: f64 = 1.959_963_984_540_054;

/// A claim says nothing if its standard error is a larger share of it.
const UNKNOWN: f64 = 0.5;

/// Pixels to each side by which a pixel's error is told.
const REACH: usize = 10;

/// The sums of a claim over a picture.
struct ErrorSums {
    /// ErrorSums over blocks, row by row, and their sum.
    blocks: Vec<f64>,
    columns: usize,
    sum: f64,
    square: f64,
    pixels: f64,
    /// Whole blocks to each side; the others are no neighbours of theirs.
    whole: [usize; 2],
}

impl ErrorSums {
    fn new([width, height]: [usize; 2]) -> Self {
        let columns = width.div_ceil(BLOCK);
        let whole = [width / BLOCK, height / BLOCK];
        let blocks = vec![0.0; columns * height.div_ceil(BLOCK)];
        Self { blocks, columns, sum: 0.0, square: 0.0, pixels: (width * height) as f64, whole }
    }

    fn add(&mut self, x: usize, y: usize, error: f64) {
        self.blocks[y / BLOCK * self.columns + x / BLOCK] += error;
        self.sum += error;
        self.square += error * error;
    }

    fn mean(&self) -> f64 {
        self.sum / self.pixels
    }

    /// Of the mean; none where there are no two blocks.
    fn standard_error(&self) -> Option<f64> {
        let [columns, rows] = self.whole;
        let at = |x: usize, y: usize| self.blocks[y * self.columns + x] / (BLOCK * BLOCK) as f64;
        let along = (0..rows).flat_map(|y| (1..columns).map(move |x| at(x, y) - at(x - 1, y)));
        let down = (1..rows).flat_map(|y| (0..columns).map(move |x| at(x, y) - at(x, y - 1)));
        let (sum, count) = along.chain(down).fold((0.0, 0_u64), |(sum, count), apart| (sum + apart * apart, count + 1));
        (count > 0).then(|| (sum / count as f64 / 2.0 / (columns * rows) as f64).sqrt())
    }

    /// The root of the mean, with what its standard error and something else that it may be off by say of it.
    fn estimate(&self, off: f64) -> Estimate {
        let mean = self.mean();
        let error = self.standard_error().map_or(f64::INFINITY, |own| (own * own + off * off).sqrt());
        // Where nothing differs, nothing is off.
        let width = if self.square > 0.0 { NORMAL * error } else { 0.0 };
        let root = |square: f64| square.max(0.0).sqrt();
        let carriers = if self.square > 0.0 { self.sum * self.sum / self.square } else { f64::INFINITY };
        Estimate { value: root(mean), low: root(mean - width), high: root(mean + width), carriers }
    }

    /// Whether the interval would say nothing.
    fn is_unknown(&self, off: f64) -> bool {
        let error = self.standard_error().map_or(f64::INFINITY, |own| (own * own + off * off).sqrt());
        self.square > 0.0 && error > UNKNOWN * self.mean()
    }
}

/// The picture of mixed pixels, with its claim.
pub(super) fn estimate(film: &Film, four: &ReplicateQuad<'_>, mut picture: Picture, pixels: &[CandidatePixel]) -> Denoised {
    let [width, height] = film.size().map(|edge| edge as usize);
    let [mut absolute, mut relative, mut by_whole, mut by_base] = [(); 4].map(|()| ErrorSums::new([width, height]));
    let (mut before, mut change) = (0.0, 0.0);
    for (place, pixel) in pixels.iter().enumerate() {
        let (x, y) = (place % width, place / width);
        let [mean, ..] = replicate_statistics(four.radiance(place));
        let (mut sums, mut colour) = ([0.0; 4], [0.0; 3]);
        for i in 0..3 {
            let (added, error) = (f64::from(pixel.added[0][i]), f64::from(pixel.apart[0][i]));
            let [whole, base] = [pixel.added[1][i], pixel.base[i]].map(|colour| f64::from(colour).max(0.0));
            colour[i] = mean[i] + added;
            let own = colour[i].max(0.0);
            let over = [1.0, whole * base + FLOOR, own * own + FLOOR, base * base + FLOOR];
            sums = from_fn(|k| sums[k] + error / over[k] / 3.0);
            before += mean[i];
            change += added;
        }
        [&mut absolute, &mut relative, &mut by_whole, &mut by_base].into_iter().zip(sums).for_each(|(of, sum)| of.add(x, y, sum));
        // What is beyond any picture stays as it is.
        if mean.iter().all(|mean| mean.abs() < BRIGHTEST) {
            picture.rgb[place] = colour.map(|c| c as f32);
        }
    }
    let off = (by_whole.mean() - by_base.mean()).abs() / 4.0;
    let doubts = [(film.is_lit_by_chance(), Doubt::LightByChance), (relative.is_unknown(off), Doubt::WideInterval)];
    let doubt = doubts.into_iter().find_map(|(is, doubt)| is.then_some(doubt));
    let (rmse, root_relmse) = (absolute.estimate(0.0), relative.estimate(off));
    let error = Uncertainty { rmse, root_relmse, replicates: FOUR as u32, doubt };
    let brightened = if before > 0.0 { change / before } else { 0.0 };
    Denoised { standard_error: errors([width, height], pixels), picture, error, brightened }
}

/// Roots of the squared errors of pixels, by what their neighbours' are, in radiance or relative to theirs, whichever says less: beside a lamp
/// the one is the lamp's, and of a lamp the other is what is dark beside it, times its own brightness.
fn errors([width, height]: [usize; 2], pixels: &[CandidatePixel]) -> Vec<[f32; 3]> {
    let near = |of: &(dyn Fn(&CandidatePixel) -> f32 + Sync)| {
        PixelPlane { width, height, at: pixels.iter().map(of).collect() }.box_mean(REACH)
    };
    let channels: Vec<[PixelPlane; 2]> = (0..3)
        .into_par_iter()
        .map(|i| [near(&|pixel| pixel.apart[0][i]), near(&|pixel| pixel.apart[0][i] / relative_to(pixel, i))])
        .collect();
    let of = |(place, pixel): (usize, &CandidatePixel)| {
        from_fn(|i| {
            let [absolute, relative] = channels[i].each_ref().map(|plane| plane.at[place]);
            absolute.min(relative * relative_to(pixel, i)).max(0.0).sqrt()
        })
    };
    pixels.iter().enumerate().map(of).collect()
}

/// What a pixel's squared error is relative to.
fn relative_to(pixel: &CandidatePixel, channel: usize) -> f32 {
    pixel.added[1][channel].max(0.0) * pixel.base[channel].max(0.0) + FLOOR as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the standard error is that of blocks as neighbours say it: columns of blocks that are 0 and 1 in turn differ by 1 along rows
    /// and by 0 down, so that eight blocks of four by two have (6/10)/2/8 for the square. A rim that is no whole block is in the mean alone.
    #[test]
    fn blocks_say_how_sure_a_mean_is() {
        let mut sums = ErrorSums::new([33, 16]);
        for (x, y) in (0..33).flat_map(|x| (0..16).map(move |y| (x, y))) {
            sums.add(x, y, f64::from(u8::from(x / 8 % 2 == 1)) + f64::from(u8::from(x == 32)) * 33.0);
        }
        assert!((sums.mean() - (256.0 + 16.0 * 33.0) / 528.0).abs() < 1e-12);
        assert!((sums.standard_error().expect("blocks") - (0.6_f64 / 16.0).sqrt()).abs() < 1e-12);
        assert_eq!(ErrorSums::new([15, 9]).standard_error(), None);
    }
}
