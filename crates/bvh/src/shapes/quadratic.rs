//! Intersection of a ray with a quadric. The distances at which the ray enters and leaves the
//! quadric are the two roots of a·t² + 2b·t + c.

use super::prepared_ray::FAR_RATIO;
use super::{PreparedRay, ShapeHit, first_accepted_root};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};
use glam::DVec3;

/// A quadric along a ray, as the polynomial a·t² + 2b·t + c in the distance t. The polynomial is
/// negative inside the quadric.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quadratic {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    /// A quarter of the discriminant: b² − a·c, computed by the formula with the least cancellation
    /// for the quadric.
    pub discriminant: f64,
}

/// Distances at which a ray enters and leaves a quadric. A distance is infinite if the ray never
/// enters, or never leaves. If a, the leading coefficient, is positive, the inside lies between
/// both distances; otherwise it lies beyond them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossings {
    pub enter: f64,
    pub leave: f64,
}

impl Quadratic {
    /// Creates a quadratic from its coefficients. Its `discriminant` is computed as b² − a·c.
    #[inline(always)]
    pub fn new(a: f64, b: f64, c: f64) -> Self {
        Self {
            a,
            b,
            c,
            discriminant: b * b - a * c,
        }
    }

    /// Computes the roots; `None` if they are not real. The root that would suffer from
    /// cancellation is computed from the product of both roots. This formula works for a leading
    /// coefficient of zero too.
    #[inline(always)]
    pub fn roots(&self) -> Option<Crossings> {
        let is_hit = self.discriminant >= 0.0;
        if !is_hit {
            return None;
        }
        let root = self.discriminant.sqrt();
        Some(if self.b >= 0.0 {
            let sum = -self.b - root;
            Crossings {
                enter: sum / self.a,
                leave: self.c / sum,
            }
        } else {
            let sum = root - self.b;
            Crossings {
                enter: self.c / sum,
                leave: sum / self.a,
            }
        })
    }
}

impl Crossings {
    /// Adds `distance` to both crossings.
    #[inline(always)]
    pub fn shift(self, distance: f64) -> Self {
        Self {
            enter: self.enter + distance,
            leave: self.leave + distance,
        }
    }

    /// Returns the nearest crossing that lies in the range and on an accepted side, and for which
    /// `keep` returns true.
    #[inline(always)]
    pub fn nearest_hit<R: Real>(
        &self,
        range: Interval<R>,
        side: Side,
        keep: impl Fn(f64) -> bool,
    ) -> Option<ShapeHit<R>> {
        let candidate = |t: f64, from_outside: bool| {
            let stored = R::from_f64(t);
            (side.accepts(from_outside) && range.contains(stored) && keep(t)).then_some(stored)
        };
        match (candidate(self.enter, true), candidate(self.leave, false)) {
            // Unrounded distances are compared, since far away the stored distances may be equal.
            (Some(_), Some(b)) if self.leave < self.enter => Some(ShapeHit::from_exit_distance(b)),
            (Some(a), _) => Some(ShapeHit::from_distance(a)),
            (None, b) => b.map(ShapeHit::from_exit_distance),
        }
    }

    /// Returns the unrounded distance of `hit`, which must be a hit of these crossings.
    #[inline(always)]
    pub fn unrounded_distance<R: Real>(&self, hit: ShapeHit<R>) -> f64 {
        if hit.is_exit() {
            self.leave
        } else {
            self.enter
        }
    }
}

/// Returns two values of the reference point of an intersection test: its distance along the ray
/// from the origin, and its position relative to `centre`. With `close` it is the ray's point
/// nearest to `centre`, so no coefficient contains the distance of the origin. Otherwise it is the
/// origin.
///
/// Let D be the distance of the origin from the shape, and r the size of the shape. With the origin
/// as reference point, the discriminant has a relative error of about (D/r)²·2⁻⁵³. So no digit is
/// left at D/r = 10⁸. With the nearest point the error is (D/r)·2⁻⁵³. Some rays have smaller
/// errors: along a coordinate axis the discriminant is exact at any distance. Surface points always
/// use the nearest point.
#[inline(always)]
pub(crate) fn choose_reference_point(
    prepared_ray: &PreparedRay,
    centre: DVec3,
    close: bool,
) -> (f64, DVec3) {
    let f = prepared_ray.origin - centre;
    if !close {
        return (0.0, f);
    }
    let ahead = -f.dot(prepared_ray.direction) * prepared_ray.inverse_length_squared;
    (ahead, f + prepared_ray.direction * ahead)
}

/// Whether the intersection test of a shape of the given size at `centre` uses the ray's point
/// nearest to the centre as reference point ([`choose_reference_point`]). For shapes stored in f32
/// the ray's origin is faster. It is precise enough up to [`FAR_RATIO`] sizes away.
#[inline(always)]
pub(crate) fn uses_near_reference_point<R: Real>(
    prepared_ray: &PreparedRay,
    centre: R::Vec3,
    size: R,
) -> bool {
    let far = || {
        let (f, size) = (prepared_ray.origin - centre.to_f64(), size.to_f64());
        f.dot(f) > size * size * (FAR_RATIO * FAR_RATIO)
    };
    !R::IS_SINGLE || far()
}

/// Calls a closure out of line, for work that few rays need. The closure should own its captured
/// values: a captured reference would force the value into memory for all rays.
#[cold]
#[inline(never)]
pub(crate) fn call_cold<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Returns the point of the ray at a hit. If `crossings` are given, the point is at their unrounded
/// distance, otherwise at the stored distance.
#[inline(always)]
pub(crate) fn point_at_hit<R: Real>(
    prepared_ray: &PreparedRay,
    crossings: Option<Crossings>,
    hit: ShapeHit<R>,
) -> DVec3 {
    match crossings {
        Some(c) => prepared_ray.origin + prepared_ray.direction * c.unrounded_distance(hit),
        None => prepared_ray.at(hit.t),
    }
}

/// Range of distances at which a ray is inside a convex solid. `near_part` and `far_part` are the
/// numbers of the surface parts (such as wall or cap) at its ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySpan {
    pub near: f64,
    pub far: f64,
    pub near_part: u8,
    pub far_part: u8,
}

impl RaySpan {
    /// Creates a range with the same surface part at both ends.
    #[inline(always)]
    pub fn from_range(near: f64, far: f64, part: u8) -> Self {
        Self {
            near,
            far,
            near_part: part,
            far_part: part,
        }
    }

    /// Creates the range between two parallel faces, each given by distance and part number. If
    /// `rises` is set, the ray enters through the low face, otherwise through the high face.
    #[inline(always)]
    pub fn from_faces(low: f64, high: f64, [low_part, high_part]: [u8; 2], rises: bool) -> Self {
        if rises {
            Self {
                near: low,
                far: high,
                near_part: low_part,
                far_part: high_part,
            }
        } else {
            Self {
                near: high,
                far: low,
                near_part: high_part,
                far_part: low_part,
            }
        }
    }

    /// Returns the intersection of two ranges. It is empty if `near` is not below `far`.
    #[inline(always)]
    pub fn intersection(self, other: Self) -> Self {
        let (near, near_part) = if other.near > self.near {
            (other.near, other.near_part)
        } else {
            (self.near, self.near_part)
        };
        let (far, far_part) = if other.far < self.far {
            (other.far, other.far_part)
        } else {
            (self.far, self.far_part)
        };
        Self {
            near,
            far,
            near_part,
            far_part,
        }
    }

    /// Converts the range to crossings, without the part numbers.
    #[inline(always)]
    pub fn to_crossings(self) -> Crossings {
        Crossings {
            enter: self.near,
            leave: self.far,
        }
    }

    /// Returns the hit at the first end of this range that lies in the open interval `range` and on
    /// an accepted side. The first shape-specific number of the hit is the part number of that end.
    #[inline(always)]
    pub fn nearest_hit<R: Real>(&self, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let covered = self.near < self.far;
        if !covered {
            return None;
        }
        // A ray that enters a solid also leaves it, even where the solid is thinner than the
        // rounding of distances.
        let near = R::from_f64(self.near);
        let far = R::from_f64(self.far).max(near.next_up());
        let hit = first_accepted_root(near, far, range, side)?;
        let part = if hit.is_exit() {
            self.far_part
        } else {
            self.near_part
        };
        Some(ShapeHit {
            u: R::from_f64(part.into()),
            ..hit
        })
    }
}
