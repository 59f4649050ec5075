//! Buffer of one replicate, either for a tile or for a whole film, and copies from buffer to
//! buffer.

use core::ops::Range;

use super::sums::{BLOCK, has_partial_block};
use super::{FilmPlan, PixelSums};
use crate::settings::Crop;

/// Sums of one replicate over a rectangle of pixels, row by row. A list that the picture does not
/// need is empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReplicateBuffer {
    /// Summed radiance of each pixel. Samples after the last full block are excluded, unless the
    /// pixel has no full block; see [`sums`](super::sums).
    pub sums: Vec<[f64; 3]>,
    /// Summed radiance of each pixel's samples after its last full block. Empty if no pixel has
    /// such samples after a full block.
    pub partial_blocks: Vec<[f64; 3]>,
    /// Number of each pixel's samples with a finite radiance.
    pub samples: Vec<u16>,
    /// Coverage (alpha) of each pixel, summed over samples in units of
    /// 1/[`COVERAGE_UNITS`](super::sums::COVERAGE_UNITS).
    pub covered: Vec<u32>,
    /// Coverage of each pixel by the shadow on the studio's ground, summed in the same units.
    pub shadowed: Vec<u32>,
    /// Number of each pixel's camera rays that hit a surface, for layers that are means over hits.
    /// Samples with a non-finite radiance count too.
    pub first_hits: Vec<u16>,
    /// Sums of the layers of first hits, for each layer and pixel.
    pub layers: Vec<Vec<[f64; 3]>>,
}

/// Rectangle of pixels within a buffer whose rows may be wider.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rect {
    start: usize,
    width: usize,
    height: usize,
    stride: usize,
}

impl Rect {
    /// Returns the rectangle that covers a buffer of `width` × `height` pixels.
    pub fn for_whole_buffer(width: u32, height: u32) -> Self {
        Self {
            start: 0,
            width: width as usize,
            height: height as usize,
            stride: width as usize,
        }
    }

    /// Returns the rectangle of a tile in a film whose rows have `stride` pixels.
    pub fn for_film_tile(tile: Crop, stride: u32) -> Self {
        let start = tile.y as usize * stride as usize + tile.x as usize;
        Self {
            start,
            width: tile.width as usize,
            height: tile.height as usize,
            stride: stride as usize,
        }
    }

    /// Iterates over the rows of the rectangle, as index ranges of the buffer.
    pub fn row_ranges(self) -> impl Iterator<Item = Range<usize>> {
        (0..self.height)
            .map(move |row| self.start + row * self.stride)
            .map(move |start| start..start + self.width)
    }
}

/// Copies the rectangle `from` of the list `of` to the rectangle `to` of the list `into`. Does
/// nothing if `of` is empty.
pub(crate) fn copy_rect<T: Copy>(into: &mut [T], to: Rect, of: &[T], from: Rect) {
    if of.is_empty() {
        return;
    }
    for (to, from) in to.row_ranges().zip(from.row_ranges()) {
        into[to].copy_from_slice(&of[from]);
    }
}

/// Returns the values of a list within a rectangle, row by row; empty if the list is empty.
fn extract_rect<T: Copy>(of: &[T], from: Rect) -> Vec<T> {
    if of.is_empty() {
        Vec::new()
    } else {
        from.row_ranges()
            .flat_map(|row| of[row].iter().copied())
            .collect()
    }
}

impl ReplicateBuffer {
    /// Returns a buffer of zeros for all pixels of a film.
    pub fn zeroed(plan: &FilmPlan) -> Self {
        let n = plan.pixel_count();
        Self {
            sums: vec![[0.0; 3]; n],
            partial_blocks: Vec::new(),
            samples: vec![0; n],
            covered: vec![0; if plan.alpha { n } else { 0 }],
            shadowed: vec![0; if plan.backdrop.is_some() { n } else { 0 }],
            first_hits: vec![0; if plan.counts_first_hits() { n } else { 0 }],
            layers: plan.layers.mean.iter().map(|_| vec![[0.0; 3]; n]).collect(),
        }
    }

    /// Returns an empty buffer with capacity for `pixels` pixels, to be filled by
    /// [`Self::push_pixel`].
    pub fn with_capacity(plan: &FilmPlan, pixels: usize) -> Self {
        Self {
            sums: Vec::with_capacity(pixels),
            samples: Vec::with_capacity(pixels),
            layers: plan
                .layers
                .mean
                .iter()
                .map(|_| Vec::with_capacity(pixels))
                .collect(),
            ..Self::default()
        }
    }

    /// Appends the sums of the next pixel. `drawn` is the number of samples per pixel.
    pub fn push_pixel(&mut self, plan: &FilmPlan, pixel: &PixelSums, drawn: u32) {
        match has_partial_block(drawn) {
            true => {
                self.sums.push(pixel.sum);
                self.partial_blocks.push(pixel.partial_block);
            }
            false => self.sums.push(pixel.total()),
        }
        self.samples.push(pixel.samples);
        if plan.alpha {
            self.covered.push(pixel.covered);
        }
        if plan.backdrop.is_some() {
            self.shadowed.push(pixel.shadowed);
        }
    }

    /// Returns the sums of a pixel, from which sampling continues. `drawn` is the number of samples
    /// per pixel so far.
    pub fn pixel_sums(&self, pixel: usize, drawn: u32) -> PixelSums {
        if drawn == 0 {
            return PixelSums::default();
        }
        let value = self.sums[pixel];
        let (sum, open) = match (has_partial_block(drawn), drawn < BLOCK as u32) {
            (true, _) => (value, self.partial_blocks[pixel]),
            (false, true) => ([0.0; 3], value),
            (false, false) => (value, [0.0; 3]),
        };
        let [covered, shadowed] =
            [&self.covered, &self.shadowed].map(|of| of.get(pixel).copied().unwrap_or(0));
        PixelSums {
            sum,
            partial_block: open,
            spread: [0.0; 3],
            samples: self.samples[pixel],
            covered,
            shadowed,
        }
    }

    /// Returns the sum of all samples of a pixel.
    #[inline]
    pub fn pixel_total(&self, pixel: usize) -> [f64; 3] {
        let (sum, open) = (
            self.sums[pixel],
            self.partial_blocks.get(pixel).copied().unwrap_or([0.0; 3]),
        );
        core::array::from_fn(|i| sum[i] + open[i])
    }

    /// Copies the rectangle `from` of `buffer` to the rectangle `to` of this buffer.
    pub fn copy_rect_from(&mut self, to: Rect, buffer: &Self, from: Rect) {
        if self.partial_blocks.len() < self.sums.len() && !buffer.partial_blocks.is_empty() {
            self.partial_blocks.resize(self.sums.len(), [0.0; 3]);
        }
        copy_rect(&mut self.sums, to, &buffer.sums, from);
        match buffer.partial_blocks.is_empty() {
            false => copy_rect(&mut self.partial_blocks, to, &buffer.partial_blocks, from),
            true if self.partial_blocks.is_empty() => {}
            true => to
                .row_ranges()
                .for_each(|row| self.partial_blocks[row].fill([0.0; 3])),
        }
        copy_rect(&mut self.samples, to, &buffer.samples, from);
        copy_rect(&mut self.covered, to, &buffer.covered, from);
        copy_rect(&mut self.shadowed, to, &buffer.shadowed, from);
        copy_rect(&mut self.first_hits, to, &buffer.first_hits, from);
        for (into, of) in self.layers.iter_mut().zip(&buffer.layers) {
            copy_rect(into, to, of, from);
        }
    }

    /// Returns a copy of a rectangle as a buffer of its own.
    pub fn extract_rect(&self, from: Rect) -> Self {
        Self {
            sums: extract_rect(&self.sums, from),
            partial_blocks: extract_rect(&self.partial_blocks, from),
            samples: extract_rect(&self.samples, from),
            covered: extract_rect(&self.covered, from),
            shadowed: extract_rect(&self.shadowed, from),
            first_hits: extract_rect(&self.first_hits, from),
            layers: self
                .layers
                .iter()
                .map(|layer| extract_rect(layer, from))
                .collect(),
        }
    }

    pub fn bytes(&self) -> usize {
        let counts = 2 * (self.samples.len() + self.first_hits.len())
            + 4 * (self.covered.len() + self.shadowed.len());
        24 * (self.sums.len() + self.partial_blocks.len())
            + counts
            + self
                .layers
                .iter()
                .map(|layer| 24 * layer.len())
                .sum::<usize>()
    }
}
