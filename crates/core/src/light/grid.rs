//! Importance sampling of directions by an equirectangular table over the sphere. Rows have equal
//! polar angles, columns equal azimuths. Both are sampled by the inverse of their cumulative
//! distributions ("Physically Based Rendering", 4th edition, A.5.2 and 12.5). Directions are
//! uniform by solid angle within a cell.
//!
//! The cells of a large image exceed every cache. Reading them took longer than tracing the rays of
//! a path. Sampling therefore has two steps: first a block of cells, by a table that fits in the
//! cache; then a cell of the block, unless the block is nearly uniform. A sun of a single cell is
//! still sampled as that cell.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use raywright_bvh::{Real, SimdTask, prefetch, run_widest};

use super::cdf::{
    entry_probability, guide_table_len, push_cdf, push_guide_table, push_rounded_cdf,
    sample_index_guided, sample_short_index,
};
use crate::number::sines_and_cosines;

/// Greatest numbers of blocks along azimuth and along polar angle. Guide tables index at most 256
/// entries.
const BLOCKS: [usize; 2] = [128, 64];
/// Greatest ratio of the brightest to the darkest cell in a block that counts as uniform.
const EVEN: f64 = 1.25;
/// Number of directions sampled together.
const LANES: usize = 8;
/// Marks a uniform block, in place of the start of the block's cells.
const WHOLE: u32 = u32::MAX;

/// A probability density over the sphere, constant in each cell of an equirectangular grid.
#[derive(Clone, Debug)]
pub struct SphereGrid {
    width: usize,
    /// Columns and rows of cells in a block; the last block of a row or column may be smaller.
    block: [usize; 2],
    /// Number of blocks in a row of blocks.
    blocks_across: usize,
    /// Rotation of the grid about +y, in revolutions.
    turn: f64,
    /// Cumulative distribution of the rows of blocks.
    rows: Vec<f64>,
    /// Cumulative distribution of the blocks in each row of blocks, row after row.
    columns: Vec<f32>,
    /// Guide table of `rows`, followed by the guide table of each row in `columns`.
    guides: Vec<u8>,
    /// Start in `cells` of each block's cells; [`WHOLE`] for a uniform block.
    cell_starts: Vec<u32>,
    /// For each block that is not uniform: the cumulative distribution of its rows of cells,
    /// followed by that of the cells in each row.
    cells: Vec<f32>,
    /// 1 − cos θ for the polar angle θ of each edge between rows of cells, computed as 2·sin²(θ/2):
    /// a cosine would lose its digits near the poles.
    edges: Vec<f64>,
    /// Solid angle in steradians of a cell, for each row of cells.
    angles: Vec<f64>,
    /// Density by solid angle in each uniform block; the probability of any other block.
    densities: Vec<f64>,
    flux: f64,
}

impl SphereGrid {
    /// Builds the table from the mean radiance of each cell, given by column and row from the top.
    /// `turn` is the rotation about +y in revolutions. `None` if all radiance is zero.
    pub fn new(
        width: usize,
        height: usize,
        turn: f64,
        radiance: impl Fn(usize, usize) -> f64,
    ) -> Option<Self> {
        let edge = |row| {
            let half = libm::sin(0.5 * PI * row as f64 / height as f64);
            2.0 * half * half
        };
        let block = [width.div_ceil(BLOCKS[0]), height.div_ceil(BLOCKS[1])];
        let mut grid = Self {
            width,
            block,
            blocks_across: width.div_ceil(block[0]),
            turn,
            rows: Vec::new(),
            columns: Vec::new(),
            guides: Vec::new(),
            cell_starts: Vec::new(),
            cells: Vec::new(),
            edges: (0..=height).map(edge).collect(),
            angles: (0..height)
                .map(|row| cell_solid_angle(width, height, row))
                .collect(),
            densities: Vec::new(),
            flux: 0.0,
        };
        // Solid angle in steradians of one column of cells, for each row of blocks.
        let (mut fluxes, mut block_angles) = (Vec::new(), Vec::new());
        for first in (0..height).step_by(grid.block[1]) {
            let rows = first..(first + grid.block[1]).min(height);
            let weights: Vec<f64> = rows
                .clone()
                .flat_map(|row| (0..width).map(move |x| (x, row)))
                .map(|(x, row)| positive_or_zero(radiance(x, row)))
                .collect();
            block_angles.push(grid.angles[rows.clone()].iter().sum::<f64>());
            fluxes.push(grid.push_block_row(&weights, rows.start));
        }
        grid.flux = push_cdf(&mut grid.rows, &fluxes);
        push_guide_table(&mut grid.guides, &grid.rows);
        for row in grid.columns.chunks_exact(grid.blocks_across) {
            push_guide_table(&mut grid.guides, row);
        }
        for (y, angle) in block_angles.iter().enumerate() {
            for x in 0..grid.blocks_across {
                let share = entry_probability(grid.block_row_cdf(y), x);
                let probability = entry_probability(&grid.rows, y) * share;
                let is_uniform = grid.cell_starts[y * grid.blocks_across + x] == WHOLE;
                let (_, [columns, _]) = grid.block_extent(x, y);
                grid.densities.push(if is_uniform {
                    probability / (angle * columns as f64)
                } else {
                    probability
                });
            }
        }
        (grid.flux > 0.0 && grid.flux.is_finite()).then_some(grid)
    }

    /// Appends a row of blocks. `weights` holds the radiance of its cells, `first` is its first row
    /// of cells. Returns the flux of the row of blocks.
    fn push_block_row(&mut self, weights: &[f64], first: usize) -> f64 {
        let (width, angles) = (self.width, &self.angles[first..]);
        let mut fluxes = Vec::with_capacity(BLOCKS[0]);
        for start in (0..width).step_by(self.block[0]) {
            let columns = start..(start + self.block[0]).min(width);
            let rows: Vec<&[f64]> = weights
                .chunks_exact(width)
                .map(|row| &row[columns.clone()])
                .collect();
            let sent: Vec<f64> = rows
                .iter()
                .zip(angles)
                .map(|(row, angle)| row.iter().sum::<f64>() * angle)
                .collect();
            let cells = || rows.iter().copied().flatten();
            let [darkest, brightest] = [
                cells().fold(f64::INFINITY, |a, &b| a.min(b)),
                cells().fold(0.0_f64, |a, &b| a.max(b)),
            ];
            // Cells beyond the range of 32-bit indices are not stored: their block counts as
            // uniform.
            let index = if brightest <= darkest * EVEN {
                WHOLE
            } else {
                u32::try_from(self.cells.len()).unwrap_or(WHOLE)
            };
            self.cell_starts.push(index);
            if index != WHOLE {
                push_rounded_cdf(&mut self.cells, &sent);
                rows.iter().for_each(|row| {
                    push_rounded_cdf(&mut self.cells, row);
                });
            }
            fluxes.push(sent.iter().sum());
        }
        push_rounded_cdf(&mut self.columns, &fluxes)
    }

    /// Returns the integral of the radiance over the sphere.
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// Samples a unit direction for two uniform numbers in [0, 1).
    pub fn sample_direction(&self, numbers: [f64; 2]) -> DVec3 {
        self.sample_in_block(self.sample_block(numbers))
            .to_direction()
    }

    /// Samples many directions as [`Self::sample_direction`] does, and calls `visit` with each
    /// direction in order. Prefetching and vectorised trigonometry make this faster than single
    /// calls.
    pub fn sample_directions(
        &self,
        mut numbers: impl Iterator<Item = [f64; 2]>,
        mut visit: impl FnMut(DVec3),
    ) {
        loop {
            let (mut blocks, mut count) = ([BlockPoint::default(); LANES], 0);
            for (block, numbers) in blocks.iter_mut().zip(numbers.by_ref()) {
                *block = self.sample_block(numbers);
                prefetch(&self.cells, block.part as usize);
                count += 1;
            }
            let places = blocks[..count].iter();
            visit_directions(places.map(|&block| self.sample_in_block(block)), &mut visit);
            if count < LANES {
                return;
            }
        }
    }

    /// Samples a block by two uniform numbers in [0, 1). Returns the block, and the numbers
    /// rescaled to [0, 1) within the block.
    #[inline(always)]
    fn sample_block(&self, [u, v]: [f64; 2]) -> BlockPoint {
        let (guide, guides) = self.guides.split_at(guide_table_len(self.rows.len()));
        let (y, _, down) = sample_index_guided(&self.rows, guide, v);
        let (blocks, parts) = (self.block_row_cdf(y), guide_table_len(self.blocks_across));
        let (x, _, along) = sample_index_guided(blocks, &guides[y * parts..][..parts], u);
        BlockPoint {
            at: [x, y],
            part: self.cell_starts[y * blocks.len() + x],
            numbers: [along, down],
        }
    }

    /// Returns the direction for a sampled point of a block.
    #[inline(always)]
    fn sample_in_block(&self, place: BlockPoint) -> PolarDirection {
        let BlockPoint {
            at: [x, y],
            part,
            numbers: [along, down],
        } = place;
        let ([left, top], [columns, rows]) = self.block_extent(x, y);
        let (column, row, down, span) = if part == WHOLE {
            (left as f64 + along * columns as f64, top, down, rows)
        } else {
            let cells = &self.cells[part as usize..];
            let (row, _, down) = sample_short_index(&cells[..rows], down);
            let (column, _, along) =
                sample_short_index(&cells[rows + row * columns..][..columns], along);
            ((left + column) as f64 + along, top + row, down, 1)
        };
        // Distance along the axis, counted from the nearer pole.
        let height = self.angles.len();
        let upper = 2 * row < height;
        let edge = |row: usize| self.edges[if upper { row } else { height - row }];
        let from_pole = edge(row) + (edge(row + span) - edge(row)) * down;
        PolarDirection {
            height: if upper {
                1.0 - from_pole
            } else {
                from_pole - 1.0
            },
            squared_ring: from_pole * (2.0 - from_pole),
            angle: TAU * (column / self.width as f64 + self.turn - 0.5),
        }
    }

    /// Returns the density by solid angle of a direction, given by its coordinates in the
    /// equirectangular image, each in [0, 1].
    pub fn density(&self, [u, v]: [f64; 2]) -> f64 {
        let (height, u) = (self.angles.len(), u - self.turn);
        let column = (((u - Real::floor(u)) * self.width as f64) as usize).min(self.width - 1);
        let row = ((v * height as f64) as usize).min(height - 1);
        // Quotients of 32 bits take less time.
        let along = |cell: usize, axis: usize| (cell as u32 / self.block[axis] as u32) as usize;
        let (x, y) = (along(column, 0), along(row, 1));
        let block = y * self.blocks_across + x;
        let (index, probability) = (self.cell_starts[block], self.densities[block]);
        if index == WHOLE {
            return probability;
        }
        let ([left, top], [columns, rows]) = self.block_extent(x, y);
        let (column, cells, line) = (column - left, &self.cells[index as usize..], row - top);
        let within = entry_probability(&cells[..rows], line)
            * entry_probability(&cells[rows + line * columns..][..columns], column);
        probability * within / self.angles[row]
    }

    /// Returns two pairs for the block in column `x` and row `y` of blocks: its first column and
    /// row of cells, and its numbers of columns and rows of cells.
    fn block_extent(&self, x: usize, y: usize) -> ([usize; 2], [usize; 2]) {
        let [width, height] = self.block;
        let (left, top) = (x * width, y * height);
        (
            [left, top],
            [
                width.min(self.width - left),
                height.min(self.angles.len() - top),
            ],
        )
    }

    fn block_row_cdf(&self, row: usize) -> &[f32] {
        &self.columns[row * self.blocks_across..][..self.blocks_across]
    }
}

/// A block sampled from the grid, and a point within the block.
#[derive(Clone, Copy, Default)]
struct BlockPoint {
    /// Column and row of the block.
    at: [usize; 2],
    /// Start of the block's cells in the grid's `cells`, or [`WHOLE`] for a uniform block.
    part: u32,
    /// Position within the block along azimuth and polar angle, each uniform in [0, 1).
    numbers: [f64; 2],
}

/// A unit direction about the y axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PolarDirection {
    /// The component y.
    pub height: f64,
    /// Square of the distance from the y axis, 1 − y², with its digits near the poles.
    pub squared_ring: f64,
    /// Azimuth in radians.
    pub angle: f64,
}

impl PolarDirection {
    /// Creates the direction with the component `y` and the azimuth `turn`, in revolutions.
    pub fn at_height(y: f64, turn: f64) -> Self {
        Self {
            height: y.clamp(-1.0, 1.0),
            squared_ring: (1.0 - y) * (1.0 + y),
            angle: TAU * turn,
        }
    }

    pub fn to_direction(self) -> DVec3 {
        let mut lanes = PolarDirectionLanes::<1>::default();
        lanes.set_lane(0, self);
        let [x, y, z] = lanes.run().map(|[x]| x);
        DVec3::new(x, y, z)
    }
}

/// Calls `visit` with many directions in order, each that of [`PolarDirection::to_direction`].
/// Vectorised trigonometry makes this faster than single calls.
#[inline(always)]
pub(super) fn visit_directions(
    mut places: impl Iterator<Item = PolarDirection>,
    mut visit: impl FnMut(DVec3),
) {
    loop {
        let (mut lanes, mut count) = (PolarDirectionLanes::<LANES>::default(), 0);
        for (lane, place) in (0..LANES).zip(&mut places) {
            lanes.set_lane(lane, place);
            count += 1;
        }
        if count == 0 {
            return;
        }
        let [x, y, z] = run_widest(lanes);
        (0..count).for_each(|lane| visit(DVec3::new(x[lane], y[lane], z[lane])));
        if count < LANES {
            return;
        }
    }
}

/// Directions in `N` SIMD lanes, before the sines and cosines of their azimuths are computed.
struct PolarDirectionLanes<const N: usize> {
    height: [f64; N],
    squared_ring: [f64; N],
    angle: [f64; N],
}

impl<const N: usize> Default for PolarDirectionLanes<N> {
    fn default() -> Self {
        let [height, squared_ring, angle] = [[0.0; N]; 3];
        Self {
            height,
            squared_ring,
            angle,
        }
    }
}

impl<const N: usize> PolarDirectionLanes<N> {
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, direction: PolarDirection) {
        self.height[lane] = direction.height;
        self.squared_ring[lane] = direction.squared_ring;
        self.angle[lane] = direction.angle;
    }
}

impl<const N: usize> SimdTask for PolarDirectionLanes<N> {
    type Output = [[f64; N]; 3];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let turns = self.angle.map(f64::abs);
        let [mut sines, mut cosines] = sines_and_cosines(turns);
        for (sine, angle) in sines.iter_mut().zip(self.angle) {
            *sine = if angle < 0.0 { -*sine } else { *sine };
        }
        if turns.iter().fold(false, |far, &turn| far | (turn > TAU)) {
            for i in 0..N {
                if turns[i] > TAU {
                    (sines[i], cosines[i]) = libm::sincos(self.angle[i]);
                }
            }
        }
        let (mut x, mut z) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let ring = self.squared_ring[i].max(0.0).sqrt();
            (x[i], z[i]) = (ring * cosines[i], ring * sines[i]);
        }
        [x, self.height, z]
    }
}

fn positive_or_zero(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x } else { 0.0 }
}

/// Returns the solid angle in steradians of a cell in a row. The difference of the edges' cosines
/// is computed as a product of sines, without cancellation.
fn cell_solid_angle(width: usize, height: usize, row: usize) -> f64 {
    let (step, middle) = (PI / height as f64, PI * (row as f64 + 0.5) / height as f64);
    TAU / width as f64 * 2.0 * libm::sin(middle) * libm::sin(0.5 * step)
}

#[cfg(test)]
mod tests;
