//! Directions drawn by a table over the sphere: rows of equal polar angle, columns of equal azimuth, by the inverse of their
//! running sums ("Physically Based Rendering", 4th edition, A.5.2 and 12.5). Within a cell, evenly over its solid angle.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use raywright_bvh::Real;
use raywright_bvh::shapes::equirectangular;

use super::cdf::{pick, push_shares, share};

/// A density over the sphere that is even in each cell of an equirectangular grid.
#[derive(Clone, Debug)]
pub struct SphereGrid {
    width: usize,
    /// Share of a whole turn by which the grid is turned about +y.
    turn: f64,
    rows: Vec<f64>,
    /// The columns of each row, one row after the other.
    columns: Vec<f64>,
    flux: f64,
}

impl SphereGrid {
    /// From the mean radiance of each cell by column and row, the top row first; none where all of it is zero.
    pub fn new(width: usize, height: usize, turn: f64, radiance: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let mut grid = Self { width, turn, rows: Vec::with_capacity(height), columns: Vec::new(), flux: 0.0 };
        grid.columns.reserve_exact(width * height);
        let mut fluxes = Vec::with_capacity(height);
        for row in 0..height {
            let weights: Vec<f64> = (0..width).map(|column| radiance(column, row)).map(positive).collect();
            let sum = push_shares(&mut grid.columns, &weights);
            fluxes.push(sum * solid_angle(width, height, row));
        }
        grid.flux = push_shares(&mut grid.rows, &fluxes);
        (grid.flux > 0.0 && grid.flux.is_finite()).then_some(grid)
    }

    /// Radiance times solid angle, summed.
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// A unit direction for two numbers in [0, 1).
    pub fn direction(&self, [u, v]: [f64; 2]) -> DVec3 {
        let height = self.rows.len();
        let (row, _, down) = pick(&self.rows, v);
        let (column, _, along) = pick(self.columns_of(row), u);
        // 1 − cos θ from the nearer pole, as 2·sin²(θ/2): there a cosine has no digits left.
        let upper = 2 * row < height;
        let edge = |row: usize| {
            let angle = PI * if upper { row } else { height - row } as f64 / height as f64;
            let half = libm::sin(0.5 * angle);
            2.0 * half * half
        };
        let h = edge(row) + (edge(row + 1) - edge(row)) * down;
        let (y, ring) = (if upper { 1.0 - h } else { h - 1.0 }, (h * (2.0 - h)).max(0.0).sqrt());
        let angle = TAU * ((column as f64 + along) / self.width as f64 + self.turn - 0.5);
        DVec3::new(ring * libm::cos(angle), y, ring * libm::sin(angle))
    }

    /// The density over solid angle of drawing a unit direction.
    pub fn density(&self, direction: DVec3) -> f64 {
        let [u, v] = equirectangular::<f64>(direction);
        let (height, u) = (self.rows.len(), u - self.turn);
        let column = (((u - Real::floor(u)) * self.width as f64) as usize).min(self.width - 1);
        let row = ((v * height as f64) as usize).min(height - 1);
        let probability = share(&self.rows, row) * share(self.columns_of(row), column);
        probability / solid_angle(self.width, height, row)
    }

    fn columns_of(&self, row: usize) -> &[f64] {
        &self.columns[row * self.width..][..self.width]
    }
}

fn positive(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x } else { 0.0 }
}

/// Of a cell in a row: the difference of the cosines of its edges as a product of sines, in which nothing cancels.
fn solid_angle(width: usize, height: usize, row: usize) -> f64 {
    let (step, middle) = (PI / height as f64, PI * (row as f64 + 0.5) / height as f64);
    TAU / width as f64 * 2.0 * libm::sin(middle) * libm::sin(0.5 * step)
}

#[cfg(test)]
mod tests;
