//! Rays, intervals of accepted distances, and hits.

use crate::scalar::{Real, Vector};

/// A half-line. The direction has unit length up to rounding: the creator of a ray normalises it,
/// so that distances are lengths. Intersection tests use the stored direction unchanged, with
/// distances in units of its length.
#[derive(Clone, Copy, Debug)]
#[doc(alias = "RTCRay")]
pub struct Ray<R: Real> {
    /// Start, in world units.
    pub origin: R::Vec3,
    /// Unit direction.
    pub direction: R::Vec3,
    /// Time, from 0 at the start of every motion to 1 at its end; values beyond are clamped. Only
    /// moving instances depend on it.
    pub time: R,
    /// Whether this is a camera ray, which passes through the back of [`Side::Culled`] surfaces.
    pub culls: bool,
}

impl<R: Real> Ray<R> {
    /// A ray at time 0. The direction must already have unit length.
    #[inline(always)]
    pub fn new(origin: R::Vec3, direction: R::Vec3) -> Self {
        Self {
            origin,
            direction,
            time: R::ZERO,
            culls: false,
        }
    }

    /// This ray at another time.
    #[inline(always)]
    pub fn at_time(self, time: R) -> Self {
        Self { time, ..self }
    }

    /// This ray as a camera ray.
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

    /// Whether no component is NaN or infinite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        self.origin.is_finite() && self.direction.is_finite() && self.time.is_finite()
    }
}

/// The open interval of accepted distances: a hit counts iff `min < t < max`, for every query and
/// every accelerator.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(alias("tnear", "tfar", "tMax"))]
pub struct Interval<R> {
    /// Excluded lower end.
    pub min: R,
    /// Excluded upper end.
    pub max: R,
}

impl<R: Real> Interval<R> {
    /// All positive distances.
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
    /// Only hits by rays against the outward normal: the near root of a closed shape.
    Outside,
    /// Only hits by rays along the outward normal: the far root of a closed shape, as for a room
    /// seen from inside.
    Inside,
    /// Back-face culling: camera rays hit only against the outward normal, all other rays hit from
    /// either side. So light does not pass through the back, though the camera sees through it.
    Culled,
}

impl Side {
    /// The effective sides for a camera ray (`culls`) or any other ray.
    #[inline(always)]
    pub(crate) fn to(self, culls: bool) -> Self {
        match self {
            Side::Culled if culls => Side::Outside,
            Side::Culled => Side::Both,
            side => side,
        }
    }

    /// The sides visible to a camera, which are also the emitting sides of a light.
    pub fn seen(self) -> Self {
        self.to(true)
    }

    /// Whether a ray against (`true`) or along (`false`) the outward normal can hit.
    #[inline(always)]
    pub fn accepts(self, from_outside: bool) -> bool {
        match self {
            Side::Both | Side::Culled => true,
            Side::Outside => from_outside,
            Side::Inside => !from_outside,
        }
    }
}

/// Effect of an object on any-hit queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Occlusion {
    /// No effect: the object is ignored.
    None,
    /// Any hit ends the query without a call of the filter.
    #[default]
    Opaque,
    /// The caller's filter decides about each hit.
    Ask,
}

/// How an object takes part in queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[doc(alias("ray mask", "backface culling"))]
pub struct Visibility {
    /// Which sides can be hit.
    pub side: Side,
    /// Effect on any-hit queries.
    pub occlusion: Occlusion,
}

/// An intersection and the ids of the hit primitive. Kept small; the surface point is computed
/// once, after the query.
#[derive(Clone, Copy, Debug)]
#[doc(alias("RTCHit", "ShapeIntersection"))]
pub struct Hit<R> {
    /// Distance along the unit direction.
    pub t: R,
    /// First shape-specific number: a barycentric coordinate, or the part of the surface.
    pub u: R,
    /// Second shape-specific number: a barycentric coordinate, or whether the ray leaves a solid.
    pub v: R,
    /// The hit object: its id in the instanced geometry if an instance was hit, otherwise in the
    /// set itself.
    pub object: u32,
    /// Primitive within the object: the triangle's index in a mesh, 0 for a shape.
    pub primitive: u32,
    /// Id of the instance that was hit, or [`Hit::NO_INSTANCE`].
    pub instance: u32,
    /// Slot of the primitive; for an instance, its slot and the slot in the instanced geometry.
    pub(crate) slots: [u32; 2],
}

impl<R> Hit<R> {
    /// Value of `instance` for a hit outside any instance.
    pub const NO_INSTANCE: u32 = u32::MAX;

    /// Id in the outermost set: of the instance if one was hit, otherwise of the object.
    #[inline(always)]
    pub fn outermost(&self) -> u32 {
        if self.instance == Self::NO_INSTANCE {
            self.object
        } else {
            self.instance
        }
    }

    /// Order among hits at equal distance: the lowest wins.
    #[inline(always)]
    pub fn order(&self) -> [u32; 3] {
        [self.outermost(), self.object, self.primitive]
    }
}

/// Hits of different accelerators compare equal; the storage slots are ignored.
impl<R: PartialEq> PartialEq for Hit<R> {
    fn eq(&self, other: &Self) -> bool {
        (&self.t, &self.u, &self.v) == (&other.t, &other.u, &other.v)
            && (self.object, self.primitive, self.instance)
                == (other.object, other.primitive, other.instance)
    }
}
