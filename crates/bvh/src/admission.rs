//! Which hits of the textbook formulas count, and where: what makes them the same for scan and tree.
//!
//! A tree culls boxes, so it finds what lies in them. In f32 the textbook's roots may lie beside their shape, or before it by
//! many times its size; a scan finds all of those, a tree some. So a hit counts only if the ray enters the primitive's own
//! padded box, and no sooner than it does. Then no order of visits matters:
//!
//! Let e(B) be where a ray enters a box and x(B) where it leaves, as [`Slabs`] computes them. If the box A contains B, each
//! plane of A lies no further inside; subtraction and multiplication by a number of one sign keep order when they round, and
//! a NaN binds nothing. So e(A) ≤ e(B) and x(A) ≥ x(B). A hit that counts has e(B) ≤ x(B) and, moved to the box, t ≥ e(B).
//! Take the one that wins, the least t and of those the lowest id. Whatever was visited before it, the far end is still
//! above t, so for every box A on its way e(A) ≤ t < far, A is entered, and the hit is found. Nothing that is found besides
//! can beat it, because a scan would have found that too. An any-hit query keeps its far end, and the same holds of every
//! hit. A primitive offers its nearest root within the range; moved or not, that does not depend on the far end either.
//!
//! Hits of `robust` and `reference` need none of this. Their roots are decided in f64, and from beyond 1024 sizes measured from
//! close by, so that a ray which is exact, as along an axis, misses a ball by the distance's rounding in f64 and not by its
//! square: at 10⁸ radii that is 10⁻⁸ of the radius, less than a box is padded by. Otherwise a hit lies within a few units in the
//! last place of f32 from where the ray meets the shape, for which boxes are padded and exits widened. Tests pass balls by a
//! hair from 10⁴ to 10⁸ radii away and ask every accelerator.

use crate::aabb::Aabb;
use crate::ray::{Interval, Ray};
use crate::scalar::Real;
use crate::slabs::{FourBoxes, Slabs};

/// Where a hit counts of what lies in `bounds`: not before the padded box that a tree culls by, and nowhere unless the ray
/// enters that. What is without bounds stands outside any tree.
///
/// Moved, not refused: the distance to a flat box is as well rounded as any, and a mesh of flat triangles would have holes.
pub(crate) fn admitted<R: Real>(bounds: Option<Aabb>, ray: &Ray<R>, range: Interval<R>, t: R) -> Option<R> {
    let Some(bounds) = bounds else { return Some(t) };
    let mut four = FourBoxes::EMPTY;
    four.set(0, &bounds.padded()?);
    let (entered, entry) = Slabs::new(ray, range.min).enter(&four, R::INFINITY);
    let moved = t.max(Slabs::first(entry));
    (entered & 1 != 0 && range.contains(moved)).then_some(moved)
}
