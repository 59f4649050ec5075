//! Directions drawn by a table over the sphere: rows of equal polar angle, columns of equal
//! azimuth, by the inverse of their running sums ("Physically Based Rendering", 4th edition, A.5.2
//! and 12.5). Within a cell, evenly over its solid angle.
//!
//! Tables of all cells of a large picture lie in no cache, and looking into them took a path longer
//! than its rays. So cells are drawn in blocks: first the block, by a table that a cache holds, and
//! then, only where a block is not nearly even, the cell in it. A sun of one cell is still drawn as
//! that cell.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use raywright_bvh::Real;

use super::cdf::{guide_len, pick, pick_guided, push_guide, push_shares, share};
use crate::number::sines_and_cosines;

/// Most blocks along azimuth and polar angle; guides tell up to 256 apart.
const BLOCKS: [usize; 2] = [128, 64];
/// A block is even whose brightest cell has so many times the radiance of its darkest one at most.
const EVEN: f64 = 1.25;
/// In place of where a block's cells lie: it is even.
const WHOLE: u32 = u32::MAX;

/// A density over the sphere that is even in each cell of an equirectangular grid.
#[derive(Clone, Debug)]
pub struct SphereGrid {
    width: usize,
    /// Columns and rows of cells in a block; those at the end may have fewer.
    block: [usize; 2],
    /// Share of a whole turn by which the grid is turned about +y.
    turn: f64,
    /// Running sum of the shares of rows of blocks.
    rows: Vec<f64>,
    /// The blocks of each of those rows, one row after the other.
    columns: Vec<f32>,
    /// Where searches begin in `rows`, and then in each row of `columns`.
    guides: Vec<u8>,
    /// Where a block's cells begin in `cells`, or [`WHOLE`].
    parts: Vec<u32>,
    /// Of each block that is not even: the running sum of its rows, and of the cells of each of
    /// them.
    cells: Vec<f32>,
    /// 1 − cos θ of the rows' edges as 2·sin²(θ/2): near the poles a cosine has no digits left.
    edges: Vec<f64>,
    /// Solid angle of a cell by row, and of a column of a block by row of blocks.
    angles: Vec<f64>,
    block_angles: Vec<f64>,
    flux: f64,
}

impl SphereGrid {
    /// From the mean radiance of each cell by column and row, the top row first; none where all of
    /// it is zero.
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
        let mut grid = Self {
            width,
            block: [width.div_ceil(BLOCKS[0]), height.div_ceil(BLOCKS[1])],
            turn,
            rows: Vec::new(),
            columns: Vec::new(),
            guides: Vec::new(),
            parts: Vec::new(),
            cells: Vec::new(),
            edges: (0..=height).map(edge).collect(),
            angles: (0..height)
                .map(|row| solid_angle(width, height, row))
                .collect(),
            block_angles: Vec::new(),
            flux: 0.0,
        };
        let mut fluxes = Vec::new();
        for first in (0..height).step_by(grid.block[1]) {
            let rows = first..(first + grid.block[1]).min(height);
            let weights: Vec<f64> = rows
                .clone()
                .flat_map(|row| (0..width).map(move |x| (x, row)))
                .map(|(x, row)| positive(radiance(x, row)))
                .collect();
            grid.block_angles
                .push(grid.angles[rows.clone()].iter().sum());
            fluxes.push(grid.push_blocks(&weights, rows.start));
        }
        grid.flux = push_shares(&mut grid.rows, &fluxes);
        push_guide(&mut grid.guides, &grid.rows);
        for row in grid.columns.chunks_exact(width.div_ceil(grid.block[0])) {
            push_guide(&mut grid.guides, row);
        }
        (grid.flux > 0.0 && grid.flux.is_finite()).then_some(grid)
    }

    /// Appends a row of blocks from its rows of cells and returns what they send.
    fn push_blocks(&mut self, weights: &[f64], first: usize) -> f64 {
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
            // A picture of more cells than 32 bits count is drawn by blocks where they do not fit.
            let place = if brightest <= darkest * EVEN {
                WHOLE
            } else {
                u32::try_from(self.cells.len()).unwrap_or(WHOLE)
            };
            self.parts.push(place);
            if place != WHOLE {
                push(&mut self.cells, &sent);
                rows.iter().for_each(|row| {
                    push(&mut self.cells, row);
                });
            }
            fluxes.push(sent.iter().sum());
        }
        push(&mut self.columns, &fluxes)
    }

    /// Radiance times solid angle, summed.
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// A unit direction for two numbers in [0, 1).
    pub fn direction(&self, [u, v]: [f64; 2]) -> DVec3 {
        let (guide, guides) = self.guides.split_at(guide_len(self.rows.len()));
        let (y, _, down) = pick_guided(&self.rows, guide, v);
        let (blocks, parts) = (
            self.columns_of(y),
            guide_len(self.width.div_ceil(self.block[0])),
        );
        let (x, _, along) = pick_guided(blocks, &guides[y * parts..][..parts], u);
        let ([left, top], [columns, rows]) = self.extent(x, y);
        let (place, height) = (self.parts[y * blocks.len() + x], self.angles.len());
        let (column, row, down, span) = if place == WHOLE {
            (left as f64 + along * columns as f64, top, down, rows)
        } else {
            let cells = &self.cells[place as usize..];
            let (row, _, down) = pick(&cells[..rows], down);
            let (column, _, along) = pick(&cells[rows + row * columns..][..columns], along);
            ((left + column) as f64 + along, top + row, down, 1)
        };
        // From the nearer pole.
        let upper = 2 * row < height;
        let edge = |row: usize| self.edges[if upper { row } else { height - row }];
        let h = edge(row) + (edge(row + span) - edge(row)) * down;
        let (y, ring) = (
            if upper { 1.0 - h } else { h - 1.0 },
            (h * (2.0 - h)).max(0.0).sqrt(),
        );
        let (sin, cos) = sine_and_cosine(TAU * (column / self.width as f64 + self.turn - 0.5));
        DVec3::new(ring * cos, y, ring * sin)
    }

    /// The density over solid angle of drawing a direction, by its place in an equirectangular
    /// picture, from 0 to 1 each way.
    pub fn density(&self, [u, v]: [f64; 2]) -> f64 {
        let (height, u) = (self.angles.len(), u - self.turn);
        let column = (((u - Real::floor(u)) * self.width as f64) as usize).min(self.width - 1);
        let row = ((v * height as f64) as usize).min(height - 1);
        let (x, y) = (column / self.block[0], row / self.block[1]);
        let blocks = self.columns_of(y);
        let probability = share(&self.rows, y) * share(blocks, x);
        let ([left, top], [columns, rows]) = self.extent(x, y);
        let place = self.parts[y * blocks.len() + x];
        if place == WHOLE {
            return probability / (self.block_angles[y] * columns as f64);
        }
        let (column, cells, line) = (column - left, &self.cells[place as usize..], row - top);
        let within =
            share(&cells[..rows], line) * share(&cells[rows + line * columns..][..columns], column);
        probability * within / self.angles[row]
    }

    /// First column and row of a block, and how many it has.
    fn extent(&self, x: usize, y: usize) -> ([usize; 2], [usize; 2]) {
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

    fn columns_of(&self, row: usize) -> &[f32] {
        let blocks = self.width.div_ceil(self.block[0]);
        &self.columns[row * blocks..][..blocks]
    }
}

/// Of any angle; in less time of one of up to a turn either way.
fn sine_and_cosine(angle: f64) -> (f64, f64) {
    if angle.abs() > TAU {
        return libm::sincos(angle);
    }
    let [[sine], [cosine]] = sines_and_cosines([angle.abs()]);
    (if angle < 0.0 { -sine } else { sine }, cosine)
}

fn positive(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x } else { 0.0 }
}

/// [`push_shares`] rounded: what a share is, is what it is drawn by, so that densities stay exact.
fn push(cumulative: &mut Vec<f32>, weights: &[f64]) -> f64 {
    let mut shares = Vec::with_capacity(weights.len());
    let total = push_shares(&mut shares, weights);
    cumulative.extend(shares.iter().map(|&share| share as f32));
    total
}

/// Of a cell in a row: the difference of the cosines of its edges as a product of sines, in which
/// nothing cancels.
fn solid_angle(width: usize, height: usize, row: usize) -> f64 {
    let (step, middle) = (PI / height as f64, PI * (row as f64 + 0.5) / height as f64);
    TAU / width as f64 * 2.0 * libm::sin(middle) * libm::sin(0.5 * step)
}

#[cfg(test)]
mod tests;
