//! Inputs and sums of a filter pass, row by row. All planes of a row are adjacent in memory, at
//! offsets that the compiler knows. A loop over many planes then needs few address registers.

use core::ops::Range;

use super::guide::FilterGuide;
use super::plane::{ColourPlanes, PixelPlane, Window};

/// Multiple to which the number of pixels of a vectorised loop is rounded up.
pub(super) const LANES: usize = 16;

/// Number of pixels in a row of the filter: the width of a tile with margins and padding.
pub(super) const ROW: usize = 192;

pub(super) type PixelRow = [f32; ROW];

/// Number of features of a surface: three of albedo, three of normal, one of distance.
pub(super) const FEATURES: usize = 7;

/// Row of pixels of a [`FilterGuide`], padded with zeros. The planes are those of the guide.
#[derive(Clone)]
pub(super) struct GuideRow {
    pub colour: [PixelRow; 3],
    pub variance: PixelRow,
    pub noise: PixelRow,
    pub inverse_noise: PixelRow,
    pub features: [PixelRow; FEATURES],
    pub tolerances: [PixelRow; FEATURES],
}

impl GuideRow {
    pub const BLACK: Self = Self {
        colour: [[0.0; ROW]; 3],
        variance: [0.0; ROW],
        noise: [0.0; ROW],
        inverse_noise: [0.0; ROW],
        features: [[0.0; ROW]; FEATURES],
        tolerances: [[0.0; ROW]; FEATURES],
    };

    /// Copies the rows `which` of all planes of a guide.
    pub fn copy_guide_rows(rows: &mut Vec<Self>, guide: &FilterGuide<'_>, which: Range<usize>) {
        rows.resize(guide.variance.height.max(rows.len()), Self::BLACK);
        for y in which {
            let row = &mut rows[y];
            for (to, of) in row.colour.iter_mut().zip(guide.colour) {
                copy_padded_row(to, of, y);
            }
            copy_padded_row(&mut row.variance, guide.variance, y);
            copy_padded_row(&mut row.noise, guide.noise, y);
            copy_padded_row(&mut row.inverse_noise, guide.inverse_noise, y);
            let to = row.features.iter_mut().zip(&mut row.tolerances);
            for ((feature, tolerance), of) in to.zip(guide.features) {
                copy_padded_row(feature, &of.0, y);
                copy_padded_row(tolerance, &of.1, y);
            }
        }
    }
}

/// Row of pixels of a filter's targets: the two pictures that the filter averages.
#[derive(Clone)]
pub(super) struct TargetRow {
    pub colours: [[PixelRow; 3]; 2],
    /// First column and end column of the row's pixels that are not black; `None` for a black row.
    lit: Option<(usize, usize)>,
}

impl TargetRow {
    const BLACK: Self = Self {
        colours: [[[0.0; ROW]; 3]; 2],
        lit: None,
    };

    /// Copies all rows of the two target pictures, and finds the range of columns in each row that
    /// is not black.
    pub fn copy_target_rows(rows: &mut Vec<Self>, colours: [&ColourPlanes; 2]) {
        let height = colours[0][0].height;
        rows.resize(height.max(rows.len()), Self::BLACK);
        for (y, row) in rows[..height].iter_mut().enumerate() {
            row.lit = None;
            let to = row.colours.as_flattened_mut().iter_mut();
            for (to, of) in to.zip(colours.into_iter().flatten()) {
                copy_padded_row(to, of, y);
                let is_lit = |of: &f32| *of != 0.0;
                if let Some(first) = to.iter().position(is_lit) {
                    let end = to.iter().rposition(is_lit).map_or(ROW, |last| last + 1);
                    row.lit = Some(match row.lit {
                        Some(lit) => (first.min(lit.0), end.max(lit.1)),
                        None => (first, end),
                    });
                }
            }
        }
    }
}

/// Returns the part of a block within `reach` rows and columns of pixels that are not black; `None`
/// if all those pixels are black.
pub(super) fn non_black_window(rows: &[TargetRow], block: Window, reach: usize) -> Option<Window> {
    let around = block.y.saturating_sub(reach)..(block.y + block.height + reach).min(rows.len());
    let lit = rows[around].iter().filter_map(|row| row.lit);
    let (first, end) = lit.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let left = first.saturating_sub(reach).max(block.x);
    let right = (end + reach).min(block.x + block.width);
    (left < right).then(|| Window {
        x: left,
        width: right - left,
        ..block
    })
}

/// Copies the row `y` of a plane and pads the copy with zeros.
fn copy_padded_row(to: &mut PixelRow, of: &PixelPlane, y: usize) {
    let (to, rest) = to.split_at_mut(of.width);
    to.copy_from_slice(of.row(y));
    rest.fill(0.0);
}

/// Row of a filter's sums: weighted colours of both targets, sums of weights, and the weight of
/// each pixel in its own sum.
#[derive(Clone)]
pub(super) struct WeightedSums {
    pub colours: [[PixelRow; 3]; 2],
    pub weights: PixelRow,
    pub own: PixelRow,
}

impl WeightedSums {
    pub const NOTHING: Self = Self {
        colours: [[[0.0; ROW]; 3]; 2],
        weights: [0.0; ROW],
        own: [0.0; ROW],
    };
}

#[cfg(test)]
mod tests {
    use super::super::plane::black_planes;
    use super::*;

    /// Protects: the filtered part of a block holds every pixel within reach of a lit one, to the
    /// last row and column, and nothing of a black block or of one far from any light.
    #[test]
    fn what_is_lit_is_filtered() {
        let mut colours = [(); 2].map(|()| black_planes([60, 40]));
        let part = |colours: &[ColourPlanes; 2], y: usize| {
            let mut rows = Vec::new();
            TargetRow::copy_target_rows(&mut rows, colours.each_ref());
            let block = Window {
                x: 5,
                y,
                width: 50,
                height: 4,
            };
            non_black_window(&rows, block, 3).map(|part| (part.x, part.x + part.width))
        };
        assert_eq!(part(&colours, 20), None);
        colours[0][1].values[20 * 60 + 59] = 1.0;
        assert_eq!(part(&colours, 20), None, "beyond the block and the reach");
        colours[0][1].values[20 * 60 + 59] = 0.0;
        colours[1][2].values[20 * 60 + 30] = -1.0;
        assert_eq!(
            [13, 14, 20, 23, 24].map(|y| part(&colours, y)),
            [None, Some((27, 34)), Some((27, 34)), Some((27, 34)), None]
        );
        colours[0][0].values[21 * 60 + 6] = 1.0;
        assert_eq!(part(&colours, 20), Some((5, 34)));
    }
}
