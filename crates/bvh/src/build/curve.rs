//! Order of boxes along the Morton curve. Clustering looks for the nearest neighbours of a box
//! along this order.

use glam::DVec3;
use obvhs::ploc::morton::morton_encode_u64;
use rayon::prelude::*;

use crate::aabb::{PaddedBox, TASK_SIZE};
use crate::memory::huge_page_vec;

/// Greatest integer coordinate of a cell of the Morton curve, on each axis.
const MAX_CELL: f64 = ((1 << 21) - 1) as f64;

/// Ratio of an axis' extent to the longest extent, below which the axis counts as flat. On a flat
/// axis, cells of the curve have the length of the longest axis' cells. Shorter cells would make
/// clustering look above and below the triangles of a terrain, where no triangles are. Measured:
/// `../../../../benches/runs`.
const FLAT_RATIO: f64 = 0.45;

/// Position of a box on the curve: the Morton code of the box's centre, and the index of the box.
#[derive(Clone, Copy)]
struct CurvePosition {
    code: u64,
    index: u32,
}

/// Returns the indices of the boxes in the order of the Morton curve, and the number of boxes that
/// the sorting visited.
pub(super) fn order_along_morton_curve(boxes: &[PaddedBox]) -> (Vec<u32>, u64) {
    let mut places = huge_page_vec(boxes.len());
    places.par_extend(
        (0..boxes.len() as u32)
            .into_par_iter()
            .map(|index| CurvePosition { code: 0, index }),
    );
    let looks = sort_along_morton_curve(&mut places, boxes);
    (places.par_iter().map(|place| place.index).collect(), looks)
}

/// Returns, for each axis, the length that the curve divides into cells. `extent` is the extent of
/// the box around all centres. A flat axis ([`FLAT_RATIO`]) has the longest extent as its length.
pub(super) fn morton_grid_extent(extent: DVec3) -> DVec3 {
    let longest = DVec3::splat(extent.max_element());
    DVec3::select(extent.cmplt(longest * FLAT_RATIO), longest, extent)
}

/// Returns twice the centre of a box. The sum of its corners is computed in f64, where it can't
/// overflow.
fn doubled_centre(bounds: &PaddedBox) -> DVec3 {
    bounds.min.as_dvec3() + bounds.max.as_dvec3()
}

/// Sorts boxes by the Morton codes of their centres, on a grid over the bounds of all these
/// centres. Boxes in the same cell are sorted again, on a grid over the bounds of their centres.
/// Boxes with the same centre are sorted by size. Returns the number of boxes visited.
fn sort_along_morton_curve(places: &mut [CurvePosition], boxes: &[PaddedBox]) -> u64 {
    let bounds = |place: &CurvePosition| &boxes[place.index as usize];
    let centre = |place: &CurvePosition| doubled_centre(bounds(place));
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let both = |[a, b]: [DVec3; 2], [c, d]: [DVec3; 2]| [a.min(c), b.max(d)];
    let [low, high] = places
        .par_iter()
        .with_min_len(TASK_SIZE)
        .map(|place| [centre(place); 2])
        .reduce(|| none, both);
    let looks = places.len() as u64;
    if low == high {
        let size = |place: &CurvePosition| {
            (bounds(place).max.as_dvec3() - bounds(place).min.as_dvec3()).element_sum()
        };
        places.par_sort_unstable_by(|a, b| size(a).total_cmp(&size(b)).then(a.index.cmp(&b.index)));
        return looks;
    }
    let scale = MAX_CELL / morton_grid_extent(high - low);
    places
        .par_iter_mut()
        .with_min_len(TASK_SIZE)
        .for_each(|place| {
            let cell = (centre(place) - low) * scale;
            place.code = morton_encode_u64(cell.x as u32, cell.y as u32, cell.z as u32);
        });
    places.par_sort_unstable_by_key(|place| (place.code, place.index));
    let alike = places
        .chunk_by_mut(|a, b| a.code == b.code)
        .filter(|alike| alike.len() > 1);
    looks
        + alike
            .map(|alike| sort_along_morton_curve(alike, boxes))
            .sum::<u64>()
}
