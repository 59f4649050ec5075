//! Instances: geometries placed by a transform.

use glam::DAffine3;

use crate::aabb::{Aabb, BoundingSphere};
use crate::error::{GeometryError, check_bounds};
use crate::shapes::{Transform, transform_bounds};

/// Motion index of an instance at rest, beyond the end of any list of motions.
const NO_MOTION: u32 = u32::MAX;

/// An instance: one of the parts of a primitive set, placed in the world by an affine map. A part
/// is a geometry of its own.
///
/// The fields are in an order in which a ray that enters the instance reads only its last two cache
/// lines: the translation, the inverse and all that follows.
#[derive(Clone, Debug)]
#[repr(C, align(128))]
pub(crate) struct Instance {
    /// World-space box around the instance at all times; `None` if the part is unbounded.
    pub bounds: Option<Aabb>,
    /// Object-to-world map; for a moving instance, the map at time 0.
    pub transform: Transform,
    /// Index of the instanced geometry among the set's parts.
    pub part: u32,
    /// Index of the instance's motion; `NO_MOTION` for an instance at rest.
    motion: u32,
}

impl Instance {
    /// Creates an instance at rest. `bounds` is the object-space box of the part; `None` if the
    /// part is unbounded.
    pub fn new(part: u32, bounds: Option<Aabb>, to_world: DAffine3) -> Result<Self, GeometryError> {
        let transform = Transform::new(to_world).ok_or(GeometryError::Singular)?;
        // An empty box stays empty. The map would turn its infinite corners into NaN, and a NaN box
        // is refused as too large.
        let mapped = |b: Aabb| {
            if b.is_empty() {
                Aabb::EMPTY
            } else {
                transform_bounds(&to_world, &b)
            }
        };
        Ok(Self {
            bounds: check_bounds(bounds.map(mapped))?,
            transform,
            part,
            motion: NO_MOTION,
        })
    }

    /// Creates a moving instance, whose map is interpolated from the first map at time 0 to the
    /// second at time 1. Each point moves along a line segment. So the union of the boxes at both
    /// times is the smallest box that contains the instance at every time.
    pub fn new_moving(
        part: u32,
        bounds: Option<Aabb>,
        to_world: [DAffine3; 2],
        motion: u32,
    ) -> Result<Self, GeometryError> {
        let [start, end] = to_world.map(|map| Self::new(part, bounds, map));
        let (start, end) = (start?, end?);
        let both = start
            .bounds
            .zip(end.bounds)
            .map(|(start, end)| start.union(end));
        Ok(Self {
            motion,
            bounds: check_bounds(both)?,
            ..start
        })
    }

    /// Index of the instance's motion; `None` for an instance at rest.
    #[inline(always)]
    pub fn motion(&self) -> Option<usize> {
        (self.motion != NO_MOTION).then_some(self.motion as usize)
    }

    /// Returns the intersection of the instance's world-space box `bounds` with the box around the
    /// part's mapped bounding sphere. For a rotated part the sphere's box may be smaller. A moving
    /// instance keeps `bounds`.
    pub fn tighten_bounds(&self, bounds: Aabb, sphere: &BoundingSphere) -> Aabb {
        if bounds.is_empty() || self.motion().is_some() {
            return bounds;
        }
        let both = bounds.intersection(self.transform.transform_sphere_bounds(sphere));
        // Where the sphere's box is NaN or too large, the box stays unchanged.
        if both.is_empty() { bounds } else { both }
    }
}
