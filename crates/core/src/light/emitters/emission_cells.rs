//! Importance sampling of triangles with varying emission, such as images of lamps. Most of such an
//! image is dark, and uniformly sampled points would mostly contribute nothing.
//!
//! The function [`sample_area`] maps the unit square onto the triangle. The square is divided into
//! cells, and cells are sampled in proportion to their emission.
//!
//! [`sample_area`]: raywright_bvh::shapes::SampleArea::sample_area

use glam::DVec3;
use raywright_bvh::allocate_fallibly;

use crate::light::cdf::{entry_probability, push_cdf, sample_index};

/// Greatest ratio of the brightest to the darkest cell at which a triangle is still sampled
/// uniformly.
const EVEN: f64 = 1.25;
/// Fraction of the mean emission that is added to every cell's weight: a dark point in the middle
/// does not prove that the whole cell is dark.
const LEAST: f64 = 0.1;

/// Reference to a triangle's cells: index of the first entry in the table, and number of cells
/// along each side of the square.
#[derive(Clone, Copy, Debug)]
pub(in crate::light) struct TriangleCells {
    start: u32,
    across: u32,
}

/// Table of the cells of all triangles with varying emission. A triangle's entries are the
/// cumulative distribution of its rows, followed by that of the cells in each row.
#[derive(Clone, Debug, Default)]
pub(super) struct EmissionCellTable {
    sums: Vec<f32>,
}

impl EmissionCellTable {
    /// Reserves memory for `triangles` triangles with `across` cells along each side. The amount
    /// equals the estimate before preparation, even if preparation uses less.
    pub fn reserve(&mut self, triangles: u64, across: u64) {
        let sums =
            usize::try_from(triangles.saturating_mul(across * (across + 1))).unwrap_or(usize::MAX);
        // If this allocation fails, the allocation of the triangles fails too and reports the
        // failure.
        let _ = allocate_fallibly(|| self.sums.try_reserve_exact(sums));
    }

    /// Adds the cells of a triangle. `found` holds the emission in the middle of each cell, row by
    /// row, with `across` cells in a row. Returns `None` if the emission is nearly uniform.
    pub fn push_triangle_cells(&mut self, across: usize, found: &[f64]) -> Option<TriangleCells> {
        let [darkest, brightest] = [
            found.iter().fold(f64::INFINITY, |a, &b| a.min(b)),
            found.iter().fold(0.0_f64, |a, &b| a.max(b)),
        ];
        // A table too large for 32-bit indices ends here.
        let start = u32::try_from(self.sums.len())
            .ok()
            .filter(|_| across > 1 && brightest > darkest * EVEN)?;
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        let cells: Vec<f64> = (0..found.len())
            .map(|cell| cell_weight(found, across, cell) + LEAST * mean)
            .collect();
        let rows: Vec<f64> = cells.chunks(across).map(|row| row.iter().sum()).collect();
        self.append_cdf(&rows);
        cells.chunks(across).for_each(|row| self.append_cdf(row));
        Some(TriangleCells {
            start,
            across: across as u32,
        })
    }

    fn append_cdf(&mut self, weights: &[f64]) {
        let mut shares = Vec::with_capacity(weights.len());
        push_cdf(&mut shares, weights);
        // The rounded share is the sampling probability.
        self.sums.extend(shares.iter().map(|&share| share as f32));
    }

    /// Returns the cumulative distributions of a triangle's rows, and of the cells in one row.
    fn row_cdfs(&self, TriangleCells { start, across }: TriangleCells, row: usize) -> [&[f32]; 2] {
        let (start, across) = (start as usize, across as usize);
        [
            &self.sums[start..][..across],
            &self.sums[start + across * (row + 1)..][..across],
        ]
    }

    /// Samples a point of the unit square by two uniform numbers in [0, 1). Returns the point and
    /// its density over the square.
    pub fn sample_point(&self, cells: TriangleCells, [u, v]: [f64; 2]) -> ([f64; 2], f64) {
        let across = f64::from(cells.across);
        let (y, of_row, down) = sample_index(self.row_cdfs(cells, 0)[0], v);
        let (x, of_cell, along) = sample_index(self.row_cdfs(cells, y)[1], u);
        (
            [(x as f64 + along) / across, (y as f64 + down) / across],
            of_row * of_cell * across * across,
        )
    }

    /// Returns the density over the unit square with which [`Self::sample_point`] returns a point.
    pub fn density(&self, cells: TriangleCells, [u, v]: [f64; 2]) -> f64 {
        let across = f64::from(cells.across);
        let at = |x: f64| ((x * across) as usize).min(cells.across as usize - 1);
        let [rows, row] = self.row_cdfs(cells, at(v));
        entry_probability(rows, at(v)) * entry_probability(row, at(u)) * across * across
    }

    pub fn bytes(&self) -> u64 {
        (self.sums.capacity() * size_of::<f32>()) as u64
    }
}

/// Returns the bytes of the cells of `triangles` triangles with `across` cells along each side.
pub(super) fn estimate_cell_bytes(triangles: u64, across: u64) -> u64 {
    triangles.saturating_mul(across * (across + 1) * size_of::<f32>() as u64)
}

/// Returns the weight of a cell. Half of the weight is the cell's own emission; half is the
/// greatest emission of the cell and its neighbours. A bright area in a neighbour may extend into
/// the cell.
fn cell_weight(found: &[f64], across: usize, cell: usize) -> f64 {
    let (x, y) = (cell % across, cell / across);
    let beside = |position: usize| position.saturating_sub(1)..=(position + 1).min(across - 1);
    let maximum = beside(y)
        .flat_map(|y| beside(x).map(move |x| found[y * across + x]))
        .fold(0.0_f64, f64::max);
    0.5 * (found[cell] + maximum)
}

/// Returns the coordinates in the unit square of a point of a triangle: the inverse of
/// `sample_area`.
pub(super) fn triangle_to_square([a, b, c]: [DVec3; 3], point: DVec3) -> [f64; 2] {
    let normal = (b - a).cross(c - a);
    let over = 1.0 / normal.length_squared();
    let of_b = (c - point).cross(a - point).dot(normal) * over;
    let of_c = (a - point).cross(b - point).dot(normal) * over;
    let root = (1.0 - of_b).clamp(0.0, 1.0);
    // A whole side of the square is folded onto the second corner of the triangle.
    let along = if root > 0.0 {
        (of_c / root).clamp(0.0, 1.0)
    } else {
        0.0
    };
    [root * root, along]
}

#[cfg(test)]
mod tests {
    use raywright_bvh::Vector;
    use raywright_bvh::shapes::{SampleArea, Triangle};

    use super::*;

    /// Cells after those of another triangle, the usual case.
    fn table(across: usize, found: &[f64]) -> (EmissionCellTable, TriangleCells) {
        let mut table = EmissionCellTable::default();
        table.push_triangle_cells(2, &[0.0, 0.0, 0.0, 1.0]);
        let cells = table
            .push_triangle_cells(across, found)
            .expect("it is bright in parts");
        (table, cells)
    }

    /// Protects: one bright cell of 64 and its neighbours have the weights by hand: 1 and eight
    /// times a half, plus a tenth of the mean of 1/64 everywhere; in a corner, three neighbours.
    /// Uniform emission has no cells.
    #[test]
    fn bright_cells_are_drawn_most() {
        for (bright, neighbours, beside, far) in [
            (3 * 8 + 5, 8.0, (4, 4), (0, 0)),
            (0, 3.0, (1, 1), (6, 3)),
            (63, 3.0, (6, 7), (3, 0)),
        ] {
            let mut found = [0.0; 64];
            found[bright] = 2.0;
            let (table, cells) = table(8, &found);
            let total = 1.0 + 0.5 * neighbours + 0.1;
            let density = |(x, y): (usize, usize)| {
                table.density(cells, [x, y].map(|i| (i as f64 + 0.4) / 8.0))
            };
            let by_hand = [1.0, 0.5, 0.0].map(|weight| 64.0 * (weight + 0.1 / 64.0) / total);
            let is = [(bright % 8, bright / 8), beside, far].map(density);
            assert!(
                is.iter()
                    .zip(by_hand)
                    .all(|(is, hand)| (is / hand - 1.0).abs() < 1e-4),
                "{is:?}, by hand {by_hand:?}"
            );
        }
        let mut table = EmissionCellTable::default();
        table.reserve(1, 2);
        assert!(
            table.push_triangle_cells(4, &[0.3; 16]).is_none()
                && table.push_triangle_cells(4, &[0.0; 16]).is_none()
                && table.push_triangle_cells(1, &[1.0]).is_none()
        );
        assert_eq!(table.bytes(), estimate_cell_bytes(1, 2));
        assert!(
            table
                .push_triangle_cells(2, &[1.0, 1.0, 1.0, 1.3])
                .is_some()
        );
        assert_eq!(table.bytes(), estimate_cell_bytes(1, 2));
    }

    /// Protects: the density at sampling equals the density at look-up; the mean of one over the
    /// density is the square's area; and a triangle's point maps back to its place in the square.
    #[test]
    fn places_are_drawn_as_densely_as_is_said() {
        let triangle = Triangle {
            vertices: [
                DVec3::new(0.2, 1.0, -0.3),
                DVec3::new(2.0, 0.5, 0.1),
                DVec3::new(-1.0, 0.7, 3.0),
            ],
        };
        for across in [2, 3, 8, 32] {
            let spots: Vec<f64> = (0..across * across)
                .map(|cell| {
                    if cell % 7 == 3 {
                        (1 + cell) as f64
                    } else {
                        0.0
                    }
                })
                .collect();
            let (table, cells) = table(across, &spots);
            let (mut area, count) = (0.0, 400);
            for i in 0..count * count {
                let numbers =
                    [i % count, i / count].map(|i| (f64::from(i) + 0.5) / f64::from(count));
                let (place, density) = table.sample_point(cells, numbers);
                let (point, _) = triangle.sample_area(place[0], place[1]);
                let found =
                    triangle_to_square(triangle.vertices, point.to_scalar::<f64>().point.to_f64());
                let apart = (found[0] - place[0]).abs().max((found[1] - place[1]).abs());
                assert!(apart < 1e-9, "{found:?} for {place:?}");
                assert_eq!(
                    table.density(cells, place),
                    density,
                    "{place:?} of {across}"
                );
                area += 1.0 / density / f64::from(count * count);
            }
            // The midpoints miss the borders of cells by at most half a step.
            assert!((area - 1.0).abs() < 0.02, "{area} for {across}");
        }
    }
}
