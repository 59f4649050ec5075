//! What one instance is: which part it shows, and where.

use glam::DAffine3;

use crate::aabb::Aabb;
use crate::error::GeometryError;
use crate::scalar::Precision;
use crate::transform::{Transform, transform_bounds};

/// A part of a group under an affine map.
#[derive(Clone, Debug)]
pub(crate) struct Instance<P: Precision> {
    /// Which part.
    pub part: u32,
    pub transform: Transform<P::Core>,
    bounds: Option<Aabb>,
}

impl<P: Precision> Instance<P> {
    /// `bounds`: the part's own, none where something in it has no end.
    pub fn new(part: u32, bounds: Option<Aabb>, to_world: DAffine3) -> Result<Self, GeometryError> {
        let transform = Transform::new(to_world).ok_or(GeometryError::Singular)?;
        // Nothing stays nothing, wherever it is: the map would make its infinite corners no numbers, and what is no number
        // has come from something too large.
        let mapped = |b: Aabb| if b.is_empty() { Aabb::EMPTY } else { transform_bounds(&to_world, &b) };
        let bounds = bounds.map(mapped);
        if bounds.is_some_and(|b| b != Aabb::EMPTY && b.padded().is_none()) {
            return Err(GeometryError::NotFinite);
        }
        Ok(Self { part, transform, bounds })
    }

    /// In the world; none where the part has something without bounds.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }
}
