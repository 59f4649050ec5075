//! Rays, the interval of accepted distances, and what a hit is.

use crate::scalar::{Real, Vector};

/// A half-line. The direction has unit length up to its rounding: whoever makes a ray normalises
/// it, and every distance is a length. Tests take the stored direction as it is, whatever its
/// length, and distances in units of that.
#[derive(Clone, Copy, Debug)]
pub struct Ray<R: Real> {
    /// Start, in world units.
    pub origin: R::Vec3,
    /// Unit direction.
    pub direction: R::Vec3,
    /// When it is asked, from 0, where every motion starts, to 1, where it ends: where a moving
    /// instance is met. Times beyond mean the nearer end. What does not move asks nobody.
    pub time: R,
    /// Whether it is a camera's, which passes the backs of what is [`Side::Culled`].
    pub culls: bool,
}

impl<R: Real> Ray<R> {
    /// A ray at time 0, whose direction is already of unit length.
    #[inline(always)]
    pub fn new(origin: R::Vec3, direction: R::Vec3) -> Self {
        Self {
            origin,
            direction,
            time: R::ZERO,
            culls: false,
        }
    }

    /// The same ray at another time.
    #[inline(always)]
    pub fn at_time(self, time: R) -> Self {
        Self { time, ..self }
    }

    /// The same ray as one of a camera.
    #[inline(always)]
    pub fn culling(self) -> Self {
        Self {
            culls: true,
            ..self
        }
    }

    /// The point at distance `t`.
    #[inline(always)]
    pub fn at(&self, t: R) -> R::Vec3 {
        self.origin + self.direction * t
    }

    /// No NaN and no infinity in it.
    #[inline]
    pub fn is_finite(&self) -> bool {
        self.origin.is_finite() && self.direction.is_finite() && self.time.is_finite()
    }
}

/// The open interval of accepted distances: a hit counts iff `min < t < max`, for every query and
/// every accelerator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval<R> {
    /// Excluded lower end.
    pub min: R,
    /// Excluded upper end.
    pub max: R,
}

impl<R: Real> Interval<R> {
    /// From zero, excluded, without end.
    #[inline(always)]
    pub fn positive() -> Self {
        Self {
            min: R::ZERO,
            max: R::INFINITY,
        }
    }

    /// Whether a distance is accepted; never for NaN.
    #[inline(always)]
    pub fn contains(&self, t: R) -> bool {
        self.min < t && t < self.max
    }
}

/// Which sides of a surface a ray can hit. The outside is where the geometric normal points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Hits from either side count.
    #[default]
    Both,
    /// Only hits by rays that arrive against the outward normal: the near root of a closed shape.
    Outside,
    /// Only hits from within: the far root of a closed shape, a room seen from inside.
    Inside,
    /// Hits from either side count, but of a camera's rays only those against the outward normal:
    /// back-face culling. Light does not pass the back that a camera looks through.
    Culled,
}

impl Side {
    /// The sides that a ray of this kind can hit.
    #[inline(always)]
    pub(crate) fn to(self, culls: bool) -> Self {
        match self {
            Side::Culled if culls => Side::Outside,
            Side::Culled => Side::Both,
            side => side,
        }
    }

    /// The sides that a camera sees: those that give off light where the surface does.
    pub fn seen(self) -> Self {
        self.to(true)
    }

    /// Whether a ray counts that arrives against (`true`) or along (`false`) the outward normal.
    #[inline(always)]
    pub fn accepts(self, from_outside: bool) -> bool {
        match self {
            Side::Both | Side::Culled => true,
            Side::Outside => from_outside,
            Side::Inside => !from_outside,
        }
    }
}

/// What any-hit queries make of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Occlusion {
    /// Nothing: it is not there for them.
    None,
    /// A hit of it ends the query, and nobody is asked.
    #[default]
    Opaque,
    /// The caller is asked about each hit.
    Ask,
}

/// How an object takes part, besides its shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visibility {
    /// Which sides can be hit.
    pub side: Side,
    /// What it is to any-hit queries.
    pub occlusion: Occlusion,
}

/// An intersection, and whose it is: small on purpose. The surface point is made once, afterwards.
#[derive(Clone, Copy, Debug)]
pub struct Hit<R> {
    /// Distance along the unit direction.
    pub t: R,
    /// First number of the shape's own: a barycentric coordinate or the part of the surface.
    pub u: R,
    /// Second one: a barycentric coordinate, or whether the ray leaves a body.
    pub v: R,
    /// The object that was hit, in the set where it lies: the scene's own, or what the instance
    /// shows.
    pub object: u32,
    /// Which of the object's primitives: the triangle of a mesh, 0 for a shape.
    pub primitive: u32,
    /// The object of the scene's own set that is an instance and shows it, or [`Hit::NO_INSTANCE`].
    pub instance: u32,
    /// The way to the primitive's data: its slot, and in an instance the slot in what that shows.
    pub(crate) slots: [u32; 2],
}

impl<R> Hit<R> {
    /// The hit lies in the scene's own set, not in an instance.
    pub const NO_INSTANCE: u32 = u32::MAX;

    /// The object of the scene's own set: the one that was hit, or the instance that shows it.
    #[inline(always)]
    pub fn outermost(&self) -> u32 {
        if self.instance == Self::NO_INSTANCE {
            self.object
        } else {
            self.instance
        }
    }

    /// What decides between hits at one distance: the lowest wins.
    #[inline(always)]
    pub fn order(&self) -> [u32; 3] {
        [self.outermost(), self.object, self.primitive]
    }
}

/// Hits are the same whatever structure found them; where that keeps the primitive is its own
/// affair.
impl<R: PartialEq> PartialEq for Hit<R> {
    fn eq(&self, other: &Self) -> bool {
        (&self.t, &self.u, &self.v) == (&other.t, &other.u, &other.v)
            && (self.object, self.primitive, self.instance)
                == (other.object, other.primitive, other.instance)
    }
}
