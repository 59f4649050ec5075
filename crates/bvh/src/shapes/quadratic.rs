//! Where a ray crosses a quadric: the two roots of a·t² + 2b·t + c, told apart by the direction of
//! the crossing.

use super::prepared_ray::FAR;
use super::{PreparedRay, ShapeHit, first_root};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};
use glam::DVec3;

/// A quadric along a ray: a·t² + 2b·t + c is negative inside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quadratic {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    /// A quarter of the discriminant, b² − a·c, by the least cancelling formula that the quadric
    /// has.
    pub discriminant: f64,
}

/// Distances at which a ray goes into a quadric and out of it. Infinite where it does so never.
/// With a positive leading coefficient the inside lies between them, with a negative one it is all
/// the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossings {
    pub enter: f64,
    pub leave: f64,
}

impl Quadratic {
    /// With the discriminant from the coefficients.
    #[inline(always)]
    pub fn new(a: f64, b: f64, c: f64) -> Self {
        Self {
            a,
            b,
            c,
            discriminant: b * b - a * c,
        }
    }

    /// The roots; none when there are none. The one that would cancel comes from the product of the
    /// two, which also survives a leading coefficient of zero.
    #[inline(always)]
    pub fn roots(&self) -> Option<Crossings> {
        let met = self.discriminant >= 0.0;
        if !met {
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
    /// The same crossings seen from a point that lies `distance` before the one they were measured
    /// from.
    #[inline(always)]
    pub fn moved(self, distance: f64) -> Self {
        Self {
            enter: self.enter + distance,
            leave: self.leave + distance,
        }
    }

    /// The nearest crossing in the range, on an accepted side, that `keep` keeps.
    #[inline(always)]
    pub fn nearest<R: Real>(
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
            // By the unrounded distances: from far away the stored ones are equal.
            (Some(_), Some(b)) if self.leave < self.enter => Some(ShapeHit::leaving(b)),
            (Some(a), _) => Some(ShapeHit::at(a)),
            (None, b) => b.map(ShapeHit::leaving),
        }
    }

    /// The crossing that was returned as `hit`, unrounded.
    #[inline(always)]
    pub fn unrounded<R: Real>(&self, hit: ShapeHit<R>) -> f64 {
        if hit.leaves() { self.leave } else { self.enter }
    }
}

/// Where to measure from: the ray's point nearest to `centre` if `close`, so that no coefficient
/// carries the distance of the origin, or the origin itself. Returns the distance to that point and
/// the point relative to `centre`.
///
/// From the origin the discriminant is wrong by (D/r)²·2⁻⁵³ and some of it, which is all of it at
/// D/r = 10⁸; from close by the way costs (D/r)·2⁻⁵³. A ray need not be rounded more than that:
/// along an axis it is exact however far it comes from. A surface point is always made from close
/// by.
#[inline(always)]
pub(crate) fn approach(probe: &PreparedRay, centre: DVec3, close: bool) -> (f64, DVec3) {
    let f = probe.origin - centre;
    if !close {
        return (0.0, f);
    }
    let ahead = -f.dot(probe.direction) * probe.inverse_length_squared;
    (ahead, f + probe.direction * ahead)
}

/// Whether a test of a shape of this size at `centre` measures from close by: of what is stored in
/// f32, where both are right, the shorter way is taken up to [`FAR`] sizes away.
#[inline(always)]
pub(crate) fn tests_close<R: Real>(probe: &PreparedRay, centre: R::Vec3, size: R) -> bool {
    let far = || {
        let (f, size) = (probe.origin - centre.to_f64(), size.to_f64());
        f.dot(f) > size * size * (FAR * FAR)
    };
    !R::IS_SINGLE || far()
}

/// Does out of line what few rays ask for. What it refers to is to be moved in: a reference to it
/// would make others store it.
#[cold]
#[inline(never)]
pub(crate) fn rarely<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Where the ray is at a hit that one of `crossings` gave: at the unrounded distance.
#[inline(always)]
pub(crate) fn point_at<R: Real>(
    probe: &PreparedRay,
    crossings: Option<Crossings>,
    hit: ShapeHit<R>,
) -> DVec3 {
    match crossings {
        Some(c) => probe.origin + probe.direction * c.unrounded(hit),
        None => probe.at(hit.t),
    }
}

/// The range of distances that a convex body covers: an intersection of ranges, each with a number
/// for the part of the surface that bounds it there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub near: f64,
    pub far: f64,
    pub near_part: u8,
    pub far_part: u8,
}

impl Span {
    /// A range bounded at both ends by the same part.
    #[inline(always)]
    pub fn of(near: f64, far: f64, part: u8) -> Self {
        Self {
            near,
            far,
            near_part: part,
            far_part: part,
        }
    }

    /// A range between two faces, each with its part: from the first one on where the ray rises,
    /// otherwise from the second.
    #[inline(always)]
    pub fn between(low: f64, high: f64, [low_part, high_part]: [u8; 2], rises: bool) -> Self {
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

    /// What both have.
    #[inline(always)]
    pub fn cut(self, other: Self) -> Self {
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

    /// Its two ends.
    #[inline(always)]
    pub fn crossings(self) -> Crossings {
        Crossings {
            enter: self.near,
            leave: self.far,
        }
    }

    /// The first end in the range on an accepted side, with its part as the hit's first number.
    #[inline(always)]
    pub fn nearest<R: Real>(&self, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let covered = self.near < self.far;
        if !covered {
            return None;
        }
        // A ray never enters without leaving, however thin the body is where it passes.
        let near = R::from_f64(self.near);
        let far = R::from_f64(self.far).max(near.next_up());
        let hit = first_root(near, far, range, side)?;
        let part = if hit.leaves() {
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
