//! Rays, intervals of accepted distances, and hits.

use crate::ray_ends::TriangleSlot;
use crate::scalar::{Real, Vector};

/// A ray. Whoever creates a ray normalises the direction, so its length is one up to rounding, and
/// distances are lengths. Intersection tests use the stored direction unchanged. They measure
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
    /// Creates a ray at time 0 that is not a camera ray. The direction must already have unit
    /// length.
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

/// Open interval of accepted distances. For every query and every accelerator, a hit counts if and
/// only if `min < t < max`.
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
    /// Both the outside and the inside.
    #[default]
    Both,
    /// The outside only, hit by rays against the outward normal. On a closed convex shape this is
    /// the nearer of two hits.
    Outside,
    /// The inside only, hit by rays along the outward normal, as in a room that is seen from
    /// inside. On a closed convex shape this is the farther of two hits.
    Inside,
    /// Back-face culling: camera rays can hit the outside only, all other rays both sides. So the
    /// back of a surface is invisible to the camera but still blocks light.
    Culled,
}

impl Side {
    /// Returns the sides that a ray can hit, never [`Side::Culled`]. `culls` is whether the ray is
    /// a camera ray.
    #[inline(always)]
    pub(crate) fn resolve_for_ray(self, culls: bool) -> Self {
        match self {
            Side::Culled if culls => Side::Outside,
            Side::Culled => Side::Both,
            side => side,
        }
    }

    /// Returns the sides that a camera ray can hit. An emitting surface emits from the same sides.
    pub fn sides_visible_to_camera(self) -> Self {
        self.resolve_for_ray(true)
    }

    /// Whether a ray can hit the surface. `from_outside` is whether the ray runs against the
    /// outward normal.
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
    /// The query calls the caller's filter for each hit. The query ends if the filter returns true.
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
    /// First shape-specific number. For a triangle it is the barycentric weight of the second
    /// corner. For some shapes it is the number of the hit part of the surface.
    pub u: R,
    /// Second shape-specific number. For a triangle it is the barycentric weight of the third
    /// corner. For a solid it is one where the ray leaves the solid.
    pub v: R,
    /// Id of the hit object. For a hit of an instance it is the id in the instanced geometry.
    pub object: u32,
    /// Id of the primitive within the object: the triangle's index in a mesh, 0 for a shape.
    pub primitive: u32,
    /// Id of the instance that was hit, or [`Hit::NO_INSTANCE`].
    pub instance: u32,
    /// Slots (the primitives' records in a set). The first is the slot in the outermost set. For a
    /// hit of an instance, the second is the slot in the instanced geometry.
    pub(crate) slots: [u32; 2],
}

impl<R> Hit<R> {
    /// Value of `instance` for a hit outside any instance.
    pub const NO_INSTANCE: u32 = u32::MAX;

    /// Id of the hit object in the outermost set. For a hit of an instance it is the id of the
    /// instance.
    #[inline(always)]
    pub fn outermost_id(&self) -> u32 {
        if self.instance == Self::NO_INSTANCE {
            self.object
        } else {
            self.instance
        }
    }

    /// Returns the hit triangle, as the start of a ray that leaves it; [`TriangleSlot::NONE`] for a
    /// hit of an instance.
    #[inline(always)]
    pub fn triangle_slot(&self) -> TriangleSlot {
        if self.instance == Self::NO_INSTANCE {
            TriangleSlot::new(self.slots[0])
        } else {
            TriangleSlot::NONE
        }
    }

    /// Returns the sort key among hits at equal distance: the hit with the lowest key is the
    /// closest.
    #[inline(always)]
    pub fn tie_order(&self) -> [u32; 3] {
        [self.outermost_id(), self.object, self.primitive]
    }
}

/// Compares distances, shape-specific numbers and ids. Slots are ignored, since they differ between
/// accelerators.
impl<R: PartialEq> PartialEq for Hit<R> {
    fn eq(&self, other: &Self) -> bool {
        (&self.t, &self.u, &self.v) == (&other.t, &other.u, &other.v)
            && (self.object, self.primitive, self.instance)
                == (other.object, other.primitive, other.instance)
    }
}
