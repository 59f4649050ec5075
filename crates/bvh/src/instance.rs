//! What one instance is: which part it shows, and where.

use glam::DAffine3;

use crate::aabb::Aabb;
use crate::error::GeometryError;
use crate::shapes::{Transform, transform_bounds};

/// No motion: beyond the end of any list of them.
const STILL: u32 = u32::MAX;

/// A part of a group under an affine map.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    /// Which part.
    pub part: u32,
    /// Which of the group's motions; none of them for one that stands still. It lies where the map's alignment left room, so
    /// that those take nothing for it.
    pub motion: u32,
    /// Where it stands, or where its motion starts.
    pub transform: Transform,
    bounds: Option<Aabb>,
}

impl Instance {
    /// `bounds`: the part's own, none where something in it has no end.
    pub fn new(part: u32, bounds: Option<Aabb>, to_world: DAffine3) -> Result<Self, GeometryError> {
        let transform = Transform::new(to_world).ok_or(GeometryError::Singular)?;
        // Nothing stays nothing, wherever it is: the map would make its infinite corners no numbers, and what is no number
        // has come from something too large.
        let mapped = |b: Aabb| if b.is_empty() { Aabb::EMPTY } else { transform_bounds(&to_world, &b) };
        Ok(Self { part, motion: STILL, transform, bounds: checked(bounds.map(mapped))? })
    }

    /// One that goes from the first map to the second. On the way a point is between its two ends, so the box around both ends'
    /// boxes holds it at any time, and no smaller box would at all of them.
    pub fn moving(part: u32, bounds: Option<Aabb>, to_world: [DAffine3; 2], motion: u32) -> Result<Self, GeometryError> {
        let [start, end] = to_world.map(|map| Self::new(part, bounds, map));
        let (start, end) = (start?, end?);
        let both = start.bounds.zip(end.bounds).map(|(start, end)| start.union(end));
        Ok(Self { motion, bounds: checked(both)?, ..start })
    }

    /// In the world, at any time; none where the part has something without bounds.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }
}

/// Refuses what no tree can hold. Nothing at all is fine.
fn checked(bounds: Option<Aabb>) -> Result<Option<Aabb>, GeometryError> {
    let refused = bounds.is_some_and(|b| b != Aabb::EMPTY && b.padded().is_none());
    if refused { Err(GeometryError::NotFinite) } else { Ok(bounds) }
}
