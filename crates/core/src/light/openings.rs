//! Where the sky can be seen from: sampling of the sky through openings, such as the windows of a
//! room.
//!
//! A sky sampled by its radiance alone wastes nearly every sample in a room: walls hide most of the
//! sky. The table divides space into cells, and the directions into bins of equal solid angle. For
//! a cell and a side of a surface it holds the light that reaches the cell from each bin, found by
//! rays before the first sample (`prepare/openings.rs`). Sampling mixes these shares with the sky's
//! own density, so that no direction is lost that the rays missed. Any table is unbiased; only noise
//! depends on it.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use raywright_bvh::{Aabb, Real, Vector, prefetch};

use super::cdf::{
    entry_probability, find_part, push_rounded_cdf, sample_index_in_part, sample_short_index,
};
use super::grid::PolarDirection;
use super::{SkyRadiance, SkySampler};
use crate::number::angle_above_axis;

/// Rows of bins from the nadir to the zenith, and columns about the vertical axis.
const ROWS: usize = 16;
const COLUMNS: usize = 32;
/// Number of bins of a cell.
pub(crate) const BINS: usize = ROWS * COLUMNS;
/// Bins between two numbers of a cell's distribution that are kept beside it, and how many there are.
const STEP: usize = 16;
const ENDS: usize = BINS / STEP;
/// Rows and columns of fine cells in a bin. In these the sky is sampled by its radiance.
const FINE: [usize; 2] = [8, 16];
/// Numbers of a bin in [`SkyBins::cumulative`]: the distribution of its columns, and that of the
/// rows in each column.
const FINE_NUMBERS: usize = FINE[1] + FINE[0] * FINE[1];

/// Greatest ratio r of two fine cells in a bin that is sampled evenly, which takes two reads of memory
/// less. The relative variance within such a bin is at most ((r − 1) / (r + 1))², 1.2 per cent.
const EVEN_RANGE: f64 = 1.25;

/// Number of cells along the diagonal of the scene.
const CELLS_ALONG_DIAGONAL: f64 = 24.0;
/// Sides of a cell, by the greatest component of the normal.
const SIDES: usize = 6;

/// Share of samples that follow the sky's own density. Less gains little where the table is right
/// (a fifth less variance in a room with a window). It loses where a small sun comes through a hole
/// that the rays missed: .1 gives 1.17 of the variance there, .4 gives 1.03.
const OWN_SHARE: f64 = 0.4;

/// Cells of space over the bounds of a scene, with the sides of surfaces in them.
#[derive(Clone, Debug)]
pub(crate) struct CellGrid {
    corner: DVec3,
    /// Cells per unit of length.
    per_length: f64,
    counts: [usize; 3],
}

impl CellGrid {
    /// Creates the grid of a scene's bounds; `None` without extent.
    pub fn new(bounds: &Aabb) -> Option<Self> {
        let per_length = CELLS_ALONG_DIAGONAL / bounds.extent().length();
        (!bounds.is_empty() && per_length.is_finite() && per_length > 0.0).then(|| Self {
            corner: bounds.min,
            per_length,
            counts: (bounds.extent() * per_length)
                .to_array()
                .map(|cells| cells as usize + 1),
        })
    }

    /// Number of cells, each side counted by itself.
    pub fn len(&self) -> usize {
        self.counts.iter().product::<usize>() * SIDES
    }

    /// Returns the index of a point's cell on the side of a unit normal. `None` outside the grid,
    /// and for a zero normal, of a point that receives light on both sides.
    #[inline]
    pub fn cell_index(&self, point: DVec3, normal: DVec3) -> Option<usize> {
        let place = (point - self.corner) * self.per_length;
        let is_inside = |axis: usize| place[axis] >= 0.0 && place[axis] < self.counts[axis] as f64;
        if normal == DVec3::ZERO || !(0..3).all(is_inside) {
            return None;
        }
        let [x, y, z] = place.to_array().map(|along| along as usize);
        let axis = normal.abs().max_position();
        let side = 2 * axis + usize::from(normal[axis] < 0.0);
        Some(((x * self.counts[1] + y) * self.counts[2] + z) * SIDES + side)
    }

    /// Iterates over the cells beside a cell, on the same side.
    pub fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        let [x, y, z] = self.counts;
        let place = cell / SIDES;
        let along = [place / (y * z), place / z % y, place % z];
        let steps = [y * z * SIDES, z * SIDES, SIDES];
        (0..3).flat_map(move |axis| {
            let before = (along[axis] > 0).then(|| cell - steps[axis]);
            let is_inside = along[axis] + 1 < [x, y, z][axis];
            let after = is_inside.then(|| cell + steps[axis]);
            before.into_iter().chain(after)
        })
    }
}

/// The sky by bins of directions.
#[derive(Clone, Debug)]
pub(crate) struct SkyBins {
    /// Share of the sky's flux in each bin.
    flux: Vec<f64>,
    /// Whether a bin is sampled evenly.
    is_even: Vec<bool>,
    /// Distribution of the flux within each bin, see [`FINE_NUMBERS`].
    cumulative: Vec<f32>,
}

impl SkyBins {
    /// Evaluates a sky at four directions of each fine cell.
    pub fn new<R: Real>(sky: &SkyRadiance<R>) -> Self {
        let mut bins = Self {
            flux: Vec::with_capacity(BINS),
            is_even: Vec::with_capacity(BINS),
            cumulative: Vec::with_capacity(BINS * FINE_NUMBERS),
        };
        let radiance = |row: f64, column: f64| {
            let direction = direction_in_grid(row, column).to_direction();
            let found = sky.radiance(R::Vec3::ZERO, R::Vec3::from_f64(direction));
            let sum = found.to_f64().element_sum();
            if sum.is_finite() { sum.max(0.0) } else { 0.0 }
        };
        let within = |bin: usize, row: usize, column: usize| {
            let [top, left] = [
                bin / COLUMNS * FINE[0] + row,
                bin % COLUMNS * FINE[1] + column,
            ];
            let quarter = |of: usize, k: usize| of as f64 + 0.25 + 0.5 * k as f64;
            (0..4)
                .map(|k| radiance(quarter(top, k / 2), quarter(left, k % 2)))
                .sum::<f64>()
        };
        for bin in 0..BINS {
            let (mut columns, mut rows) = ([0.0; FINE[1]], Vec::new());
            let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
            for (column, flux) in columns.iter_mut().enumerate() {
                let weights: [f64; FINE[0]] = core::array::from_fn(|row| within(bin, row, column));
                least = weights.into_iter().fold(least, f64::min);
                most = weights.into_iter().fold(most, f64::max);
                *flux = push_rounded_cdf(&mut rows, &weights);
            }
            bins.flux
                .push(push_rounded_cdf(&mut bins.cumulative, &columns));
            bins.cumulative.extend(rows);
            bins.is_even.push(most <= EVEN_RANGE * least);
        }
        let total: f64 = bins.flux.iter().sum();
        bins.flux.iter_mut().for_each(|flux| *flux /= total);
        bins
    }

    /// Share of the sky's flux in each bin.
    pub fn flux(&self) -> &[f64] {
        &self.flux
    }

    /// Returns the share of each bin among the directions of the sky's own sampler.
    pub fn sampling_shares<R: Real>(&self, sampler: &SkySampler) -> Vec<f64> {
        const SIDE: usize = 64;
        let middle = |i: usize| (i as f32 + 0.5) / SIDE as f32;
        let mut shares = vec![0.0; BINS];
        for i in 0..SIDE * SIDE {
            let direction = sampler.sample_direction::<R>([middle(i % SIDE), middle(i / SIDE)]);
            shares[self.bin_and_density(direction.to_f64()).0] += 1.0 / (SIDE * SIDE) as f64;
        }
        shares
    }

    /// Samples a direction in a bin by radiance, by two uniform numbers in [0, 1).
    pub fn sample_direction(&self, bin: usize, [u, v]: [f64; 2]) -> PolarDirection {
        let (row, column) = if self.is_even[bin] {
            (FINE[0] as f64 * v, FINE[1] as f64 * u)
        } else {
            let (columns, rows) = self.distributions(bin);
            let (column, _, u) = sample_short_index(columns, u);
            let (row, _, v) = sample_short_index(&rows[column * FINE[0]..][..FINE[0]], v);
            (row as f64 + v, column as f64 + u)
        };
        direction_in_grid(
            (bin / COLUMNS * FINE[0]) as f64 + row,
            (bin % COLUMNS * FINE[1]) as f64 + column,
        )
    }

    /// Returns the bin of a direction, and the density by solid angle of the direction in it.
    fn bin_and_density(&self, direction: DVec3) -> (usize, f64) {
        let [rows, columns] = [ROWS * FINE[0], COLUMNS * FINE[1]];
        let along = |share: f64, cells: usize| ((share * cells as f64) as usize).min(cells - 1);
        let row = along(0.5 + 0.5 * direction.y, rows);
        let turn = angle_above_axis(direction.z, direction.x) / TAU;
        let column = along(if direction.z < 0.0 { 1.0 - turn } else { turn }, columns);
        let bin = row / FINE[0] * COLUMNS + column / FINE[1];
        if self.is_even[bin] {
            return (bin, BINS as f64 / (4.0 * PI));
        }
        let (of_columns, of_rows) = self.distributions(bin);
        let (row, column) = (row % FINE[0], column % FINE[1]);
        let share = entry_probability(of_columns, column)
            * entry_probability(&of_rows[column * FINE[0]..][..FINE[0]], row);
        (bin, share * (rows * columns) as f64 / (4.0 * PI))
    }

    fn distributions(&self, bin: usize) -> (&[f32], &[f32]) {
        self.cumulative[bin * FINE_NUMBERS..][..FINE_NUMBERS].split_at(FINE[1])
    }
}

/// Returns the direction at a place of the grid of fine cells, given in rows from the nadir and
/// columns.
fn direction_in_grid(row: f64, column: f64) -> PolarDirection {
    let height = 2.0 * row / (ROWS * FINE[0]) as f64 - 1.0;
    PolarDirection::at_height(height, column / (COLUMNS * FINE[1]) as f64)
}

/// Adds to each bin the mean of its eight neighbours. A bin that few rays met thereby has as much
/// light as four times the rays would find.
pub(crate) fn smooth_bins(light: &[f64]) -> Vec<f64> {
    let at = |row: usize, column: usize| light[row * COLUMNS + column % COLUMNS];
    let around = |row: usize, column: usize| {
        let rows = row.saturating_sub(1)..=(row + 1).min(ROWS - 1);
        let columns = [COLUMNS - 1, 0, 1].map(|turn| column + turn);
        let square = rows.flat_map(|row| columns.map(|column| at(row, column)));
        (square.sum::<f64>() - at(row, column)) / 8.0
    };
    (0..BINS)
        .map(|bin| light[bin] + around(bin / COLUMNS, bin % COLUMNS))
        .collect()
}

/// Table of the light that reaches the cells of a scene through openings.
#[derive(Clone, Debug)]
pub struct Openings {
    grid: CellGrid,
    sky: SkyBins,
    /// For each cell: the index of its distribution, or [`Self::NONE`].
    indices: Vec<u32>,
    /// Cumulative distributions over the bins, one after the other, each after every [`STEP`]th of its
    /// numbers.
    bins: Vec<f32>,
}

impl Openings {
    const NONE: u32 = u32::MAX;

    /// Creates the table from the light of each bin that reaches the listed cells.
    pub(crate) fn new(grid: CellGrid, sky: SkyBins, cells: &[(usize, Vec<f64>)]) -> Self {
        let (mut indices, mut bins) = (vec![Self::NONE; grid.len()], Vec::new());
        for (index, (cell, light)) in cells.iter().enumerate() {
            indices[*cell] = index as u32;
            let mut cumulative = Vec::with_capacity(BINS);
            push_rounded_cdf(&mut cumulative, light);
            bins.extend(cumulative.iter().skip(STEP - 1).step_by(STEP));
            bins.extend(cumulative);
        }
        Self {
            grid,
            sky,
            indices,
            bins,
        }
    }

    /// Number of cells with a distribution.
    pub fn cell_count(&self) -> usize {
        self.bins.len() / (ENDS + BINS)
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> u64 {
        let numbers = self.bins.len() + self.indices.len() + self.sky.cumulative.len();
        4 * numbers as u64
    }

    /// Returns the cell for a point that receives light on the side of a unit normal; `None` where
    /// the sky is sampled by its own density alone. Prefetches what [`Self::bins`] reads.
    #[inline]
    pub(super) fn cell_at<R: Real>(&self, point: R::Vec3, normal: R::Vec3) -> Option<usize> {
        let cell = self.grid.cell_index(point.to_f64(), normal.to_f64())?;
        prefetch(&self.indices, cell);
        Some(cell)
    }

    /// Returns the distribution of a cell; `None` where the sky is sampled by its own density alone.
    /// Prefetches what [`CellBins::find_part`] reads.
    #[inline]
    pub(super) fn bins(&self, cell: usize) -> Option<CellBins<'_>> {
        let index = self.indices[cell];
        if index == Self::NONE {
            return None;
        }
        let numbers = &self.bins[index as usize * (ENDS + BINS)..][..ENDS + BINS];
        let (ends, bins) = numbers.split_at(ENDS);
        for k in [0, ENDS / 2, ENDS - 1] {
            prefetch(ends, k);
        }
        Some(CellBins { ends, bins })
    }

    /// Samples a direction by two uniform numbers in [0, 1), given the part of
    /// [`CellBins::find_part`]. Returns `Err` with two numbers for the sky's own density.
    pub(super) fn sample_direction(
        &self,
        CellBins { bins, .. }: CellBins<'_>,
        part: Option<usize>,
        [u, v]: [f32; 2],
    ) -> Result<PolarDirection, [f32; 2]> {
        let (u, v) = (f64::from(u), f64::from(v));
        let Some(part) = part else {
            let rest = (u / OWN_SHARE) as f32;
            return Err([rest.min(1.0_f32.next_down()), v as f32]);
        };
        let (bin, _, rest) = sample_index_in_part(bins, (part, STEP), beyond_own_share(u));
        Ok(self.sky.sample_direction(bin, [rest, v]))
    }

    /// Returns the place of a unit direction in a distribution. Prefetches what
    /// [`BinPlace::density`] reads.
    pub(super) fn locate<'a>(
        &self,
        CellBins { bins, .. }: CellBins<'a>,
        direction: DVec3,
    ) -> BinPlace<'a> {
        let (bin, within) = self.sky.bin_and_density(direction);
        prefetch(bins, bin.saturating_sub(1));
        prefetch(bins, bin);
        BinPlace { bins, bin, within }
    }

    /// Returns the density or probability of the mixture from that of the sky's own sampler and
    /// that of the table.
    pub(crate) fn mix(own: f64, table: f64) -> f64 {
        OWN_SHARE * own + (1.0 - OWN_SHARE) * table
    }
}

/// Returns the number within the share of the table, for a uniform number beyond [`OWN_SHARE`].
fn beyond_own_share(u: f64) -> f64 {
    (u - OWN_SHARE) / (1.0 - OWN_SHARE)
}

/// Cumulative distribution over the bins in a cell, and every [`STEP`]th of its numbers.
#[derive(Clone, Copy)]
pub(super) struct CellBins<'a> {
    ends: &'a [f32],
    bins: &'a [f32],
}

impl CellBins<'_> {
    /// Returns the part of the distribution in which the bin for a uniform number in [0, 1) lies, and
    /// prefetches this part. `None` if the number selects the sky's own density.
    pub fn find_part(self, u: f32) -> Option<usize> {
        let u = f64::from(u);
        if u < OWN_SHARE {
            return None;
        }
        let part = find_part(self.ends, beyond_own_share(u));
        prefetch(self.bins, part * STEP);
        prefetch(self.bins, part * STEP + STEP - 1);
        Some(part)
    }
}

/// Place of a direction in the distribution of a cell.
#[derive(Clone, Copy)]
pub(super) struct BinPlace<'a> {
    bins: &'a [f32],
    bin: usize,
    /// Density by solid angle of the direction in its bin.
    within: f64,
}

impl BinPlace<'_> {
    /// Returns the density by solid angle of the direction, given the sky's own density.
    pub fn density(self, own: f64) -> f64 {
        Openings::mix(own, entry_probability(self.bins, self.bin) * self.within)
    }
}

#[cfg(test)]
mod tests;
