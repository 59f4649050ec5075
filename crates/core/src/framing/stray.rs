//! Stray parts of a scene: surfaces so small and so far away that a view of the whole scene would
//! show nothing.

use glam::DVec3;
use raywright_bvh::Aabb;

/// Greatest number of surfaces that are examined. Of more surfaces, every n-th is.
const EXAMINED: usize = 1 << 14;
/// Greatest part of the surface that is stray.
const SHARE: f64 = 1e-3;
/// Least distance of a stray part from the other surfaces, in multiples of their extent.
const DISTANCE: f64 = 250.0;

/// Bounds and area of a surface.
pub(super) type Patch = (Aabb, f64);

/// Returns every n-th of some patches, so that few are examined.
pub(super) fn examine(patches: impl Iterator<Item = Patch>, count: usize) -> Vec<Patch> {
    patches
        .step_by(count.div_ceil(EXAMINED).max(1))
        .filter(|(bounds, area)| bounds.extent().is_finite() && area.is_finite())
        .collect()
}

/// Returns the bounds outside of which surfaces are stray; `None` if a greater part of the surface
/// lies there. The other surfaces have their centres within the quantiles of area on each axis.
pub(super) fn find_view_bounds(patches: &[Patch]) -> Option<Aabb> {
    let total: f64 = patches.iter().map(|(_, area)| area).sum();
    let mut centres = Aabb::EMPTY;
    let mut order: Vec<&Patch> = patches.iter().collect();
    for axis in 0..3 {
        let at = |patch: &Patch| patch.0.centre()[axis];
        order.sort_by(|a, b| at(a).total_cmp(&at(b)));
        let mut area = 0.0;
        for patch in &order {
            let before = area;
            area += patch.1;
            if area > SHARE * total && before < (1.0 - SHARE) * total {
                centres.min[axis] = centres.min[axis].min(at(patch));
                centres.max[axis] = centres.max[axis].max(at(patch));
            }
        }
    }
    let body = patches
        .iter()
        .filter(|(bounds, _)| contains(&centres, bounds.centre()))
        .fold(Aabb::EMPTY, |body, (bounds, _)| body.union(*bounds));
    if body.is_empty() {
        return None;
    }
    let margin = DVec3::splat(DISTANCE * body.extent().max_element());
    let view = Aabb {
        min: body.min - margin,
        max: body.max + margin,
    };
    let stray: f64 = patches
        .iter()
        .filter(|(bounds, _)| !contains(&view, bounds.centre()))
        .map(|(_, area)| area)
        .sum();
    (stray <= SHARE * total).then_some(view)
}

/// Whether a box contains a point.
pub(super) fn contains(bounds: &Aabb, point: DVec3) -> bool {
    point.cmpge(bounds.min).all() && point.cmple(bounds.max).all()
}
