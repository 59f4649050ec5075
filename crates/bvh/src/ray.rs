//! Rays, intervals of accepted distances, and hits.

use crate::ray_ends::TriangleSlot;
use crate::scalar::{Real, Vector};

/// A ray. The direction has unit length up to rounding: the creator of a ray normalises it, so that
/// distances are lengths. Intersection tests use the stored direction unchanged and measure
/// distances in units of its length.
#[derive(Clone, Copy, Debug)]
#[doc(alias = "RTCRay")]
pub struct Ray<R: Real> {
    /// Start of the ray, in world units.
    pub origin: R::Vec3,
    /// Unit direction.
    pub direction: R::Vec3,
    /// Time, from 0 at the start of every motion to 1 at its end; other values are clamped to this
    /// range. Only moving instances depend on it.
    pub time: R,
    /// Whether the ray is a camera ray, which passes through the inside of [`Side::Culled`]
    /// surfaces.
    pub is_camera_ray: bool,
}

impl<R: Real> Ray<R> {
    /// Creates a ray at time 0 that is no camera ray. The direction must already have unit length.
    #[inline(always)]
    pub fn new(origin: R::Vec3, direction: R::Vec3) -> Self {
        Self {
            origin,
            direction,
            time: R::ZERO,
            is_camera_ray: false,
        }
    }

    /// Returns the ray at another time.
    #[inline(always)]
    pub fn with_time(self, time: R) -> Self {
        Self { time, ..self }
    }

    /// Returns the ray as a camera ray.
    #[inline(always)]
    pub fn as_camera_ray(self) -> Self {
        Self {
            is_camera_ray: true,
            ..self
        }
    }

    /// Computes the point of the ray at distance `t`.
    #[inline(always)]
    pub fn at(&self, t: R) -> R::Vec3 {
        self.origin + self.direction * t
    }

    /// Whether no number of the ray is NaN or infinite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        self.origin.is_finite() && self.direction.is_finite() && self.time.is_finite()
    }
}

/// Open interval of accepted distances: a hit counts iff `min < t < max`, for every query and every
/// accelerator.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(alias("tnear", "tfar", "tMax"))]
pub struct Interval<R> {
    /// Lower end, itself excluded.
    pub min: R,
    /// Upper end, itself excluded.
    pub max: R,
}

impl<R: Real> Interval<R> {
    /// Creates the interval of all positive distances.
    #[inline(always)]
    pub fn positive() -> Self {
        Self {
            min: R::ZERO,
            max: R::INFINITY,
        }
    }

    /// Whether the interval contains a distance; false for NaN.
    #[inline(always)]
    pub fn contains(&self, t: R) -> bool {
        self.min < t && t < self.max
    }
}

/// Sides of a surface that a ray can hit. The geometric normal points to the outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Both sides.
    #[default]
    Both,
    /// The outside only, by rays against the outward normal. For a closed shape this is the near
    /// root.
    Outside,
    /// The inside only, by rays along the outward normal. For a closed shape this is the far root,
    /// as for a room that is seen from inside.
    Inside,
    /// Back-face culling: camera rays can hit the outside only, all other rays both sides. So the
    /// camera sees through the back of a surface that still blocks light.
    Culled,
}

impl Side {
    /// Sides that a camera ray (`culls`) or any other ray can hit: never [`Side::Culled`].
    #[inline(always)]
    pub(crate) fn resolve_for_ray(self, culls: bool) -> Self {
        match self {
            Side::Culled if culls => Side::Outside,
            Side::Culled => Side::Both,
            side => side,
        }
    }

    /// Sides that a camera ray can hit. A light emits from the same sides.
    pub fn sides_visible_to_camera(self) -> Self {
        self.resolve_for_ray(true)
    }

    /// Whether a ray can hit the surface against (`true`) or along (`false`) its outward normal.
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
    /// No effect: any-hit queries ignore the object.
    None,
    /// Every hit ends the query, without a call of the caller's filter.
    #[default]
    Opaque,
    /// The caller's filter decides about each hit whether the query ends.
    Filtered,
}

/// Role of an object in queries: its visible sides, and its effect on occlusion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[doc(alias("ray mask", "backface culling"))]
pub struct Visibility {
    /// Sides that rays can hit.
    pub side: Side,
    /// Effect on any-hit queries.
    pub occlusion: Occlusion,
}

/// A hit: its distance, and the ids of the hit primitive. The surface point is computed only once,
/// after the query, so that this type stays small.
#[derive(Clone, Copy, Debug)]
#[doc(alias("RTCHit", "ShapeIntersection"))]
pub struct Hit<R> {
    /// Distance along the ray, in units of its direction's length.
    pub t: R,
    /// First shape-specific number: a barycentric coordinate, or the number of the hit part of the
    /// surface.
    pub u: R,
    /// Second shape-specific number: a barycentric coordinate, or whether the ray leaves a solid.
    pub v: R,
    /// Id of the hit object: in the instanced geometry if an instance was hit, otherwise in the set
    /// itself.
    pub object: u32,
    /// Id of the primitive within the object: the triangle's index in a mesh, 0 for a shape.
    pub primitive: u32,
    /// Id of the instance that was hit, or [`Hit::NO_INSTANCE`].
    pub instance: u32,
    /// Slot of the primitive in the set; for an instance, the slot of the instance and the slot in
    /// the instanced geometry.
    pub(crate) slots: [u32; 2],
}

impl<R> Hit<R> {
    /// Value of `instance` for a hit outside any instance.
    pub const NO_INSTANCE: u32 = u32::MAX;

    /// Id of the hit object in the outermost set: the id of the instance if an instance was hit,
    /// otherwise of the object.
    #[inline(always)]
    pub fn outermost_id(&self) -> u32 {
        if self.instance == Self::NO_INSTANCE {
            self.object
        } else {
            self.instance
        }
    }

    /// Returns the hit triangle, as the start of rays that leave it; none if it belongs to an
    /// instance.
    #[inline(always)]
    pub fn triangle_slot(&self) -> TriangleSlot {
        if self.instance == Self::NO_INSTANCE {
            TriangleSlot::new(self.slots[0])
        } else {
            TriangleSlot::NONE
        }
    }

    /// Sort key among hits at equal distance: the lowest key wins.
    #[inline(always)]
    pub fn tie_order(&self) -> [u32; 3] {
        [self.outermost_id(), self.object, self.primitive]
    }
}

/// Compares distances, shape-specific numbers and ids. The slots are ignored, so that hits of
/// different accelerators compare equal.
impl<R: PartialEq> PartialEq for Hit<R> {
    fn eq(&self, other: &Self) -> bool {
        (&self.t, &self.u, &self.v) == (&other.t, &other.u, &other.v)
            && (self.object, self.primitive, self.instance)
                == (other.object, other.primitive, other.instance)
    }
}
