//! One pass of non-local means: each pixel becomes a weighted mean of the pixels around it. A
//! neighbour's weight is large if both pixels have similar surroundings in a guide picture and
//! similar surface features.
//!
//! Squared differences in the guide are divided by the squared differences that noise alone would
//! cause (Rousselle, Knaus and Zwicker, "Adaptive Rendering with Non-Local Means Filtering", 2012).
//! They are averaged over three by three pixels. Features can only reduce a weight.

use core::ops::Range;
use std::sync::LazyLock;

use raywright_bvh::{SimdTask, run_widest};

use super::filter_rows::{
    GuideRow, LANES, PixelRow, ROW, TargetRow, WeightedSums, non_black_window,
};
use super::guide::FilterGuide;
use super::plane::{ColourPlanes, PixelPlane, Window, black_planes};
use super::row_kernels;

/// Two filtered pictures, and the weight of each pixel in its own filtered value, 0 to 1. Pictures
/// and weights are zero outside the filtered window.
pub(super) struct FilterOutput {
    pub means: [ColourPlanes; 2],
    pub own_weights: PixelPlane,
}

/// Offsets from a pixel to the neighbours over which it is averaged: rows down, then columns to the
/// right. The opposite of every offset is in the list too: the filter does not shift the picture.
pub(super) type NeighbourOffsets = Vec<[isize; 2]>;

/// Offsets of the first pass: a disc of two and a half pixels.
pub(super) static NEAR_OFFSETS: LazyLock<NeighbourOffsets> = LazyLock::new(|| disc_offsets(2));
/// Offsets of the second pass: a disc of four and a half pixels.
pub(super) static FAR_OFFSETS: LazyLock<NeighbourOffsets> = LazyLock::new(|| disc_offsets(4));

/// Returns all offsets within a distance of `radius` + ½ pixels.
fn disc_offsets(radius: isize) -> NeighbourOffsets {
    let square = (-radius..=radius).flat_map(|y| (-radius..=radius).map(move |x| [y, x]));
    square
        .filter(|&[y, x]| ((x * x + y * y) as f64) <= (radius as f64 + 0.5).powi(2))
        .collect()
}

/// Number of rows that are filtered together: their inputs fit into a cache.
const BLOCK: usize = 16;

/// Buffers of a filter pass, reused by the next pass.
#[derive(Default)]
pub(super) struct FilterWorkspace {
    guide_rows: Vec<GuideRow>,
    target_rows: Vec<TargetRow>,
    sums: Vec<WeightedSums>,
    /// The last three rows of the mean of each squared difference and its two neighbours in the
    /// row, for each horizontal offset.
    recent_rows: Vec<[PixelRow; 3]>,
}

/// Filters two target pictures within the window `core`. Pixels outside the given planes are
/// ignored. If the planes cover only a part of the picture, they must extend beyond `core` by the
/// greatest offset plus one pixel.
///
/// Areas are skipped and stay zero if the targets are black as far as the offsets reach.
pub(super) fn filter_non_local_means(
    guide: &FilterGuide<'_>,
    targets: [&ColourPlanes; 2],
    core: Window,
    offsets: &NeighbourOffsets,
    workspace: &mut FilterWorkspace,
) -> FilterOutput {
    let size = [guide.variance.width, guide.variance.height];
    let reach = offsets.last().map_or(0, |&[y, _]| y as usize);
    TargetRow::copy_target_rows(&mut workspace.target_rows, targets);
    let mut out = FilterOutput {
        means: [(); 2].map(|()| black_planes(size)),
        own_weights: PixelPlane::zero(size[0], size[1]),
    };
    let blocks = (core.y..core.y + core.height).step_by(BLOCK).map(|y| {
        let height = BLOCK.min(core.y + core.height - y);
        Window { y, height, ..core }
    });
    let lit: Vec<Window> = blocks
        .filter_map(|block| non_black_window(&workspace.target_rows[..size[1]], block, reach))
        .collect();
    let (Some(first), Some(last)) = (lit.first(), lit.last()) else {
        return out;
    };
    // Differences are also needed for one row above and one below.
    let rows = first.y.saturating_sub(reach + 1)..(last.y + last.height + reach + 1).min(size[1]);
    GuideRow::copy_guide_rows(&mut workspace.guide_rows, guide, rows);
    for block in lit {
        run_widest(FilterPass {
            inverse_tolerance: guide.inverse_tolerance,
            size,
            block,
            offsets,
            workspace,
        });
        out.write_weighted_means(block, &workspace.sums);
    }
    out
}

impl FilterOutput {
    /// Writes the weighted means of a window: its weighted sums divided by its sums of weights.
    fn write_weighted_means(&mut self, place: Window, sums: &[WeightedSums]) {
        let width = self.own_weights.width;
        for (y, sums) in sums[..place.height].iter().enumerate() {
            let position = (place.y + y) * width + place.x;
            let of = sums.colours.as_flattened().iter().chain([&sums.own]);
            let planes = self.means.as_flattened_mut().iter_mut();
            for (plane, of) in planes.chain([&mut self.own_weights]).zip(of) {
                let to = plane.values[position..][..place.width].iter_mut();
                to.zip(of)
                    .zip(&sums.weights)
                    .for_each(|((to, of), weights)| *to = of / weights);
            }
        }
    }
}

/// SIMD task: a filter pass over one block of rows.
struct FilterPass<'a> {
    inverse_tolerance: f32,
    /// Width and height of the planes in pixels.
    size: [usize; 2],
    block: Window,
    offsets: &'a NeighbourOffsets,
    workspace: &'a mut FilterWorkspace,
}

impl SimdTask for FilterPass<'_> {
    type Output = ();

    /// Processes all offsets of the same vertical step together, row by row. A row is then read
    /// once for all horizontal steps.
    #[inline(always)]
    fn run(mut self) {
        let sums = &mut self.workspace.sums;
        sums.clear();
        sums.resize(self.block.height, WeightedSums::NOTHING);
        for offsets in self.offsets.chunk_by(|a, b| a[0] == b[0]) {
            self.add_neighbours_at_offsets(offsets);
        }
    }
}

/// Returns the range of indices i in 0..`end` for which i + `step` also lies in 0..`end`.
fn indices_with_neighbour(step: isize, end: usize) -> (usize, usize) {
    (
        (-step).max(0) as usize,
        (end as isize - step.max(0)).max(0) as usize,
    )
}

fn shift_index(position: usize, step: isize) -> usize {
    (position as isize + step) as usize
}

/// Columns of a block whose neighbours at a horizontal offset lie inside the planes: without a
/// margin, and with a margin of one column.
struct BlockColumns {
    inner: Range<usize>,
    with_margin: Range<usize>,
}

impl BlockColumns {
    fn from_block(block: Window, step: isize, width: usize) -> Self {
        let (left, right) = indices_with_neighbour(step, width);
        let inner = block.x.max(left)..(block.x + block.width).min(right);
        let wide = inner.start.saturating_sub(1).max(left)..(inner.end + 1).min(right);
        Self {
            inner,
            with_margin: wide,
        }
    }
}

impl FilterPass<'_> {
    /// Adds to the block's weighted sums the neighbours at the given offsets, all of the same
    /// vertical step.
    #[inline(always)]
    fn add_neighbours_at_offsets(&mut self, offsets: &[[isize; 2]]) {
        let (block, [width, height], dy) = (self.block, self.size, offsets[0][0]);
        let lately = &mut self.workspace.recent_rows;
        lately.resize(offsets.len().max(lately.len()), [[0.0; ROW]; 3]);
        let (top, bottom) = indices_with_neighbour(dy, height);
        let lines = block.y.max(top)..(block.y + block.height).min(bottom);
        let mut next = lines.start.saturating_sub(1).max(top);
        for y in lines {
            let last = (y + 1).min(bottom - 1);
            let around = [y.saturating_sub(1).max(top) % 3, y % 3, last % 3];
            for (index, &[_, dx]) in offsets.iter().enumerate() {
                let columns = BlockColumns::from_block(block, dx, width);
                if !columns.inner.is_empty() {
                    for y in next..=last {
                        self.compare_guide_rows(
                            [y, shift_index(y, dy)],
                            dx,
                            &columns.with_margin,
                            index,
                        );
                    }
                    self.add_weighted_neighbours(
                        [y, shift_index(y, dy)],
                        dx,
                        &columns,
                        (index, around),
                    );
                }
            }
            next = last + 1;
        }
    }

    /// Computes the squared differences between the rows `y` and `other` of the guide, and the mean
    /// of each difference and its two neighbours in the row.
    #[inline(always)]
    fn compare_guide_rows(
        &mut self,
        [y, other]: [usize; 2],
        dx: isize,
        columns: &Range<usize>,
        index: usize,
    ) {
        let FilterWorkspace {
            guide_rows: compared,
            recent_rows: lately,
            ..
        } = &mut *self.workspace;
        let (length, padded) = (columns.len(), columns.len().next_multiple_of(LANES));
        let (x, beside) = (columns.start, shift_index(columns.start, dx));
        let (own, there) = (&compared[y], &compared[other]);
        let mut differences = [0.0; ROW];
        row_kernels::colour_distances(
            &mut differences[..padded],
            (&own.colour, x),
            (&there.colour, beside),
            [&own.variance[x..], &there.variance[beside..]],
            self.inverse_tolerance,
        );
        row_kernels::average_with_neighbours(&mut lately[index][y % 3], &differences, length);
    }

    /// Computes the weights of a row of neighbours, and adds their weighted colours to the sums.
    #[inline(always)]
    fn add_weighted_neighbours(
        &mut self,
        [y, other]: [usize; 2],
        dx: isize,
        columns: &BlockColumns,
        (index, around): (usize, [usize; 3]),
    ) {
        let FilterWorkspace {
            guide_rows: compared,
            target_rows: filtered,
            sums,
            recent_rows: lately,
        } = &mut *self.workspace;
        let (inner, length) = (
            columns.inner.start - columns.with_margin.start,
            columns.inner.len(),
        );
        let padded = length.next_multiple_of(LANES);
        let (x, beside) = (columns.inner.start, shift_index(columns.inner.start, dx));
        let mut weights = [0.0; ROW];
        row_kernels::neighbour_weights(
            &mut weights[..padded],
            around.map(|slot| &lately[index][slot][inner..]),
            (&compared[y], x),
            (&compared[other], beside),
        );
        weights[length..padded].fill(0.0);
        let weights = &weights[..padded];
        let (to, position) = (&mut sums[y - self.block.y], x - self.block.x);
        for (to, of) in to.colours.iter_mut().zip(&filtered[other].colours) {
            let [r, g, b] = to;
            row_kernels::add_weighted_colour(
                [&mut r[position..], &mut g[position..], &mut b[position..]],
                weights,
                of.each_ref().map(|row| &row[beside..]),
            );
        }
        row_kernels::add_row(&mut to.weights[position..], weights);
        if other == y && dx == 0 {
            to.own[position..][..padded].copy_from_slice(weights);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: offsets come in opposite pairs, so that no filter shifts a picture; 21 and 69 of
    /// them.
    #[test]
    fn offsets_are_symmetric() {
        for (offsets, count) in [(&*NEAR_OFFSETS, 21), (&*FAR_OFFSETS, 69)] {
            assert_eq!(offsets.len(), count);
            assert!(offsets.iter().all(|&[y, x]| offsets.contains(&[-y, -x])));
            assert_eq!(
                offsets.iter().filter(|&&offset| offset == [0, 0]).count(),
                1
            );
        }
    }
}
