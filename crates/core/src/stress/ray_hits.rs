//! Hits of a ray that looks through surfaces.

use raywright_bvh::{Geometry, Hit, Interval, Ray, Real};

/// Greatest number of surfaces that a ray is followed through. A ray that passes as many counts as
/// unblocked.
pub(super) const HITS: usize = 64;

/// Half the length around a hit in which other surfaces count as being in the same place, in units of
/// the hit's error, and the greatest number of surfaces that are looked for there.
pub(super) const PLACE_REACH: f64 = 64.0;
pub(super) const PLACE_HITS: usize = 8;

/// Returns the hits of a ray within a range, by distance. Of several hits at the same distance a
/// single one is returned.
pub(super) fn hits_along_ray<'a, R: Real>(
    geometry: &'a Geometry<R>,
    ray: &'a Ray<R>,
    mut range: Interval<R>,
) -> impl Iterator<Item = Hit<R>> + use<'a, R> {
    core::iter::from_fn(move || {
        let hit = geometry.closest(ray, range, &mut ())?;
        range.min = hit.t;
        Some(hit)
    })
}
