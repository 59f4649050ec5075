//! Boxes along a curve through space, on which clustering looks for neighbours.

use glam::DVec3;
use obvhs::ploc::morton::morton_encode_u64;
use rayon::prelude::*;

use crate::aabb::{PIECE, PaddedBox};

/// Cells along an axis among which the curve tells centres apart, all but one: the greatest centre
/// is in the last cell, not beyond it.
const CELLS: f64 = ((1 << 21) - 1) as f64;

/// An axis along which boxes reach less than this share of the longest axis is flat: cells are as
/// long there as along the longest. Otherwise clustering would look for neighbours of a terrain
/// above and below, where there are none. Measured: `../../../../benches/runs`.
const FLAT: f64 = 0.45;

/// A box on the curve.
#[derive(Clone, Copy)]
struct Place {
    code: u64,
    index: u32,
}

/// The places of boxes along the curve, and how many boxes were looked at for that.
pub(super) fn order(boxes: &[PaddedBox]) -> (Vec<u32>, u64) {
    let mut places: Vec<_> = (0..boxes.len() as u32)
        .into_par_iter()
        .map(|index| Place { code: 0, index })
        .collect();
    let looks = sort(&mut places, boxes);
    (places.par_iter().map(|place| place.index).collect(), looks)
}

/// The lengths that the curve divides into cells, for boxes that reach so far along the axes.
pub(super) fn cell_extent(extent: DVec3) -> DVec3 {
    let longest = DVec3::splat(extent.max_element());
    DVec3::select(extent.cmplt(longest * FLAT), longest, extent)
}

/// Twice the centre, which never leaves the range of f64.
fn centre(bounds: &PaddedBox) -> DVec3 {
    bounds.min.as_dvec3() + bounds.max.as_dvec3()
}

/// Sorts along the curve through the box of all centres, and what is in one cell along a curve
/// through that. What has one centre is sorted by size.
fn sort(places: &mut [Place], boxes: &[PaddedBox]) -> u64 {
    let bounds = |place: &Place| &boxes[place.index as usize];
    let centre = |place: &Place| centre(bounds(place));
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let both = |[a, b]: [DVec3; 2], [c, d]: [DVec3; 2]| [a.min(c), b.max(d)];
    let [low, high] = places
        .par_iter()
        .with_min_len(PIECE)
        .map(|place| [centre(place); 2])
        .reduce(|| none, both);
    let looks = places.len() as u64;
    if low == high {
        let size = |place: &Place| {
            (bounds(place).max.as_dvec3() - bounds(place).min.as_dvec3()).element_sum()
        };
        places.par_sort_unstable_by(|a, b| size(a).total_cmp(&size(b)).then(a.index.cmp(&b.index)));
        return looks;
    }
    let scale = CELLS / cell_extent(high - low);
    places.par_iter_mut().with_min_len(PIECE).for_each(|place| {
        let cell = (centre(place) - low) * scale;
        place.code = morton_encode_u64(cell.x as u32, cell.y as u32, cell.z as u32);
    });
    places.par_sort_unstable_by_key(|place| (place.code, place.index));
    let alike = places
        .chunk_by_mut(|a, b| a.code == b.code)
        .filter(|alike| alike.len() > 1);
    looks + alike.map(|alike| sort(alike, boxes)).sum::<u64>()
}
