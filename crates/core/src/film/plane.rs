//! What is kept of each pixel in one replicate, of a tile or of the whole film, and how one is put
//! into the other.

use core::ops::Range;

use super::sums::{BLOCK, has_open};
use super::{Plan, Sums};
use crate::settings::Crop;

/// One replicate of a rectangle of pixels, row by row. What a picture does not ask for is empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReplicateBuffer {
    /// Of the full blocks; of all samples where there is but one block.
    pub sums: Vec<[f64; 3]>,
    /// Of a block that is not full and not the only one; empty while there is none.
    pub open: Vec<[f64; 3]>,
    /// Samples that entered.
    pub samples: Vec<u16>,
    /// What of them something covers, in parts of [`WHOLE`](super::sums::WHOLE), for the alpha.
    pub covered: Vec<u32>,
    /// What of them is a ground's shadow, in such parts.
    pub shadowed: Vec<u32>,
    /// Camera rays that hit something first, for layers that are means over those; they include
    /// dropped samples.
    pub first_hits: Vec<u16>,
    /// Sums of the layers that come from first hits.
    pub layers: Vec<Vec<[f64; 3]>>,
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
        Self {
            start: 0,
            width: width as usize,
            height: height as usize,
            stride: width as usize,
        }
    }

    /// A tile in a film whose rows have `stride` pixels.
    pub fn within(tile: Crop, stride: u32) -> Self {
        let start = tile.y as usize * stride as usize + tile.x as usize;
        Self {
            start,
            width: tile.width as usize,
            height: tile.height as usize,
            stride: stride as usize,
        }
    }

    /// Its rows as ranges of the buffer.
    pub fn rows(self) -> impl Iterator<Item = Range<usize>> {
        (0..self.height)
            .map(move |row| self.start + row * self.stride)
            .map(move |start| start..start + self.width)
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

/// A rectangle of a buffer; nothing of one that is not kept.
fn cut<T: Copy>(of: &[T], from: Rect) -> Vec<T> {
    if of.is_empty() {
        Vec::new()
    } else {
        from.rows()
            .flat_map(|row| of[row].iter().copied())
            .collect()
    }
}

impl ReplicateBuffer {
    /// Zeros for a whole film.
    pub fn zero(plan: &Plan) -> Self {
        let n = plan.pixels();
        Self {
            sums: vec![[0.0; 3]; n],
            open: Vec::new(),
            samples: vec![0; n],
            covered: vec![0; if plan.alpha { n } else { 0 }],
            shadowed: vec![0; if plan.backdrop.is_some() { n } else { 0 }],
            first_hits: vec![0; if plan.counts_first_hits() { n } else { 0 }],
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

    /// Adds the next pixel's sums, of so many samples drawn.
    pub fn push(&mut self, plan: &Plan, pixel: &Sums, drawn: u32) {
        match has_open(drawn) {
            true => {
                self.sums.push(pixel.sum);
                self.open.push(pixel.open);
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

    /// What a pixel's sums were after so many samples, to go on with.
    pub fn pixel(&self, pixel: usize, drawn: u32) -> Sums {
        if drawn == 0 {
            return Sums::default();
        }
        let of = self.sums[pixel];
        let (sum, open) = match (has_open(drawn), drawn < BLOCK as u32) {
            (true, _) => (of, self.open[pixel]),
            (false, true) => ([0.0; 3], of),
            (false, false) => (of, [0.0; 3]),
        };
        let [covered, shadowed] =
            [&self.covered, &self.shadowed].map(|of| of.get(pixel).copied().unwrap_or(0));
        Sums {
            sum,
            open,
            spread: [0.0; 3],
            samples: self.samples[pixel],
            covered,
            shadowed,
        }
    }

    /// Sum of all of a pixel's samples.
    #[inline]
    pub fn total(&self, pixel: usize) -> [f64; 3] {
        let (sum, open) = (
            self.sums[pixel],
            self.open.get(pixel).copied().unwrap_or([0.0; 3]),
        );
        core::array::from_fn(|i| sum[i] + open[i])
    }

    /// Takes over a rectangle of another one.
    pub fn copy(&mut self, to: Rect, of: &Self, from: Rect) {
        if self.open.len() < self.sums.len() && !of.open.is_empty() {
            self.open.resize(self.sums.len(), [0.0; 3]);
        }
        copy(&mut self.sums, to, &of.sums, from);
        match of.open.is_empty() {
            false => copy(&mut self.open, to, &of.open, from),
            true if self.open.is_empty() => {}
            true => to.rows().for_each(|row| self.open[row].fill([0.0; 3])),
        }
        copy(&mut self.samples, to, &of.samples, from);
        copy(&mut self.covered, to, &of.covered, from);
        copy(&mut self.shadowed, to, &of.shadowed, from);
        copy(&mut self.first_hits, to, &of.first_hits, from);
        for (into, of) in self.layers.iter_mut().zip(&of.layers) {
            copy(into, to, of, from);
        }
    }

    /// A rectangle as a plane of its own.
    pub fn cut(&self, from: Rect) -> Self {
        Self {
            sums: cut(&self.sums, from),
            open: cut(&self.open, from),
            samples: cut(&self.samples, from),
            covered: cut(&self.covered, from),
            shadowed: cut(&self.shadowed, from),
            first_hits: cut(&self.first_hits, from),
            layers: self.layers.iter().map(|layer| cut(layer, from)).collect(),
        }
    }

    pub fn bytes(&self) -> usize {
        let counts = 2 * (self.samples.len() + self.first_hits.len())
            + 4 * (self.covered.len() + self.shadowed.len());
        24 * (self.sums.len() + self.open.len())
            + counts
            + self
                .layers
                .iter()
                .map(|layer| 24 * layer.len())
                .sum::<usize>()
    }
}
