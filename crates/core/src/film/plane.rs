//! What is kept of each pixel in one replicate, of a tile or of the whole film, and how one is put into the other.

use core::ops::Range;

use super::{Plan, Sums};
use crate::settings::Crop;

/// One replicate of a rectangle of pixels, row by row. What a picture does not ask for is empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plane {
    pub sums: Vec<[f64; 3]>,
    /// Samples that entered.
    pub samples: Vec<u16>,
    /// Those of them that hit something, for the alpha.
    pub hits: Vec<u16>,
    /// Camera rays that hit something first, for layers that are means over those; they include dropped samples.
    pub first_hits: Vec<u16>,
    /// Means of the layers that come from first hits.
    pub layers: Vec<Vec<[f32; 3]>>,
}

/// Where a rectangle lies in rows of a wider one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rect {
    start: usize,
    width: usize,
    height: usize,
    stride: usize,
}

impl Rect {
    /// All of a buffer of so many pixels.
    pub fn all(width: u32, height: u32) -> Self {
        Self { start: 0, width: width as usize, height: height as usize, stride: width as usize }
    }

    /// A tile in a film whose rows have `stride` pixels.
    pub fn within(tile: Crop, stride: u32) -> Self {
        let start = tile.y as usize * stride as usize + tile.x as usize;
        Self { start, width: tile.width as usize, height: tile.height as usize, stride: stride as usize }
    }

    /// Its rows as ranges of the buffer.
    pub fn rows(self) -> impl Iterator<Item = Range<usize>> {
        (0..self.height).map(move |row| self.start + row * self.stride).map(move |start| start..start + self.width)
    }
}

/// Copies a rectangle; where nothing is kept there is nothing to copy.
pub(crate) fn copy<T: Copy>(into: &mut [T], to: Rect, of: &[T], from: Rect) {
    if of.is_empty() {
        return;
    }
    for (to, from) in to.rows().zip(from.rows()) {
        into[to].copy_from_slice(&of[from]);
    }
}

impl Plane {
    /// Zeros for a whole film.
    pub fn zero(plan: &Plan) -> Self {
        let n = plan.pixels();
        let counts = |kept: bool| if kept { vec![0; n] } else { Vec::new() };
        Self {
            sums: vec![[0.0; 3]; n],
            samples: vec![0; n],
            hits: counts(plan.alpha),
            first_hits: counts(plan.counts_first_hits()),
            layers: plan.layers.mean.iter().map(|_| vec![[0.0; 3]; n]).collect(),
        }
    }

    /// Room for a tile whose pixels are pushed.
    pub fn with_room(plan: &Plan, pixels: usize) -> Self {
        Self {
            sums: Vec::with_capacity(pixels),
            samples: Vec::with_capacity(pixels),
            layers: vec![Vec::new(); plan.layers.mean.len()],
            ..Self::default()
        }
    }

    /// Adds the next pixel's sums.
    pub fn push(&mut self, plan: &Plan, pixel: &Sums) {
        self.sums.push(pixel.sum);
        self.samples.push(pixel.samples);
        if plan.alpha {
            self.hits.push(pixel.hits);
        }
    }

    /// Takes over a rectangle of another one.
    pub fn copy(&mut self, to: Rect, of: &Self, from: Rect) {
        copy(&mut self.sums, to, &of.sums, from);
        copy(&mut self.samples, to, &of.samples, from);
        copy(&mut self.hits, to, &of.hits, from);
        copy(&mut self.first_hits, to, &of.first_hits, from);
        for (into, of) in self.layers.iter_mut().zip(&of.layers) {
            copy(into, to, of, from);
        }
    }

    pub fn bytes(&self) -> usize {
        let counts = self.samples.len() + self.hits.len() + self.first_hits.len();
        24 * self.sums.len() + 2 * counts + self.layers.iter().map(|layer| 12 * layer.len()).sum::<usize>()
    }
}
