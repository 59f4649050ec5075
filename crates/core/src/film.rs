//! The film: sums of a pixel's samples, in f64, and the picture that tiles are put into.
//!
//! Samples are summed in fixed blocks of 16 in ascending order, each block folded into f64: the same bits for any tiles and
//! threads, and a way open to resume a picture or to merge shards of it.

use raywright_bvh::{Real, Vector};

use crate::picture::{Layer, Picture};

/// Samples of a block.
pub(crate) const BLOCK: u32 = 16;

/// A pixel's sums.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pixel {
    pub sum: [f64; 3],
    /// Sums of squares; only kept where the standard error is asked for.
    pub squares: [f64; 3],
    /// Samples that hit something, for the alpha.
    pub hits: u32,
    pub samples: u32,
}

/// Sums one pixel's samples in ascending order.
pub(crate) struct Accumulator<R: Real> {
    pixel: Pixel,
    block: R::Vec3,
    in_block: u32,
}

impl<R: Real> Accumulator<R> {
    pub fn new() -> Self {
        Self { pixel: Pixel::default(), block: R::Vec3::ZERO, in_block: 0 }
    }

    /// Adds a sample. One that is not finite is dropped: false.
    #[inline(always)]
    pub fn add(&mut self, radiance: R::Vec3, hit: bool, squares: bool) -> bool {
        let finite = radiance.is_finite();
        if finite {
            self.block += radiance;
            self.pixel.hits += u32::from(hit);
            self.pixel.samples += 1;
            if squares {
                let x = radiance.to_f64().to_array();
                self.pixel.squares = core::array::from_fn(|i| self.pixel.squares[i] + x[i] * x[i]);
            }
        }
        self.in_block += 1;
        if self.in_block == BLOCK {
            self.fold();
        }
        finite
    }

    fn fold(&mut self) {
        let block = self.block.to_f64().to_array();
        self.pixel.sum = core::array::from_fn(|i| self.pixel.sum[i] + block[i]);
        (self.block, self.in_block) = (R::Vec3::ZERO, 0);
    }

    pub fn finish(mut self) -> Pixel {
        self.fold();
        self.pixel
    }
}

impl Pixel {
    /// Mean radiance; black without samples.
    pub fn mean(&self) -> [f32; 3] {
        let n = f64::from(self.samples.max(1));
        self.sum.map(|s| (s / n) as f32)
    }

    /// Share of the samples that hit something.
    pub fn coverage(&self) -> f32 {
        self.hits as f32 / self.samples.max(1) as f32
    }

    /// Standard error of the mean, per channel; zero below two samples.
    pub fn standard_error(&self) -> [f32; 3] {
        let n = f64::from(self.samples);
        core::array::from_fn(|i| {
            if self.samples < 2 {
                return 0.0;
            }
            let variance = (self.squares[i] - self.sum[i] * self.sum[i] / n).max(0.0) / (n - 1.0);
            (variance / n).sqrt() as f32
        })
    }
}

/// A picture in the making. Tiles bring their pixels finished, so that putting one in its place only copies.
#[derive(Clone, Debug)]
pub(crate) struct Film {
    picture: Picture,
}

/// A rectangle of the film in film coordinates, with what was rendered there, row by row.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
    pub rgb: Vec<[f32; 3]>,
    /// Coverage; empty where the film has none.
    pub alpha: Vec<f32>,
    /// One buffer a layer, in the film's order.
    pub layers: Vec<Vec<f32>>,
}

impl Film {
    /// Black, with layers of these names.
    pub fn new(width: u32, height: u32, layers: &[String], alpha: bool) -> Self {
        let mut picture = Picture::new(width, height);
        let empty = || vec![0.0; picture.pixels()];
        let layers = layers.iter().map(|name| Layer { name: name.clone(), samples: empty() }).collect();
        let alpha = alpha.then(empty);
        (picture.layers, picture.alpha) = (layers, alpha);
        Self { picture }
    }

    /// Puts a finished tile in its place.
    pub fn put(&mut self, tile: &Tile) {
        let width = self.picture.width as usize;
        for row in 0..tile.height as usize {
            let from = row * tile.width as usize..(row + 1) * tile.width as usize;
            let start = (tile.y as usize + row) * width + tile.x as usize;
            let to = start..start + tile.width as usize;
            self.picture.rgb[to.clone()].copy_from_slice(&tile.rgb[from.clone()]);
            if let Some(alpha) = &mut self.picture.alpha {
                alpha[to.clone()].copy_from_slice(&tile.alpha[from.clone()]);
            }
            for (layer, samples) in self.picture.layers.iter_mut().zip(&tile.layers) {
                layer.samples[to.clone()].copy_from_slice(&samples[from.clone()]);
            }
        }
    }

    /// The picture so far; pixels of unfinished tiles are black.
    pub fn picture(self) -> Picture {
        self.picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Protects (M12): a long sum agrees with the f64 sum of the same samples to six digits, where a plain f32 sum has two.
    #[test]
    fn long_sums_keep_their_digits() {
        let mut pixel = Accumulator::<f32>::new();
        let (mut sum, count) = (0.0, 10_000_000_u32);
        for i in 0..count {
            let sample = 0.7 + 0.2 * ((i.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0 - 0.5);
            sum += f64::from(sample);
            pixel.add(Vec3::splat(sample), true, false);
        }
        let (found, expected) = (f64::from(pixel.finish().mean()[0]), sum / f64::from(count));
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} instead of {expected}");
    }

    /// Protects (F04): a sample that is not finite is dropped and reported, and its neighbours in the block stay.
    #[test]
    fn not_finite_samples_are_dropped() {
        let mut pixel = Accumulator::<f32>::new();
        assert!(pixel.add(Vec3::ONE, true, true));
        assert!(!pixel.add(Vec3::new(f32::NAN, 0.0, 0.0), true, true));
        assert!(!pixel.add(Vec3::new(0.0, f32::INFINITY, 0.0), true, true));
        assert!(pixel.add(Vec3::splat(3.0), true, true));
        let pixel = pixel.finish();
        assert_eq!((pixel.samples, pixel.mean(), pixel.standard_error()), (2, [2.0; 3], [1.0; 3]));
    }
}
