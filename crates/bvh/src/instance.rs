//! Another geometry under an affine map, as one primitive.

use std::sync::Arc;

use glam::DAffine3;

use crate::aabb::Aabb;
use crate::error::GeometryError;
use crate::geometry::Geometry;
use crate::ray::{Hit, Interval};
use crate::scalar::{Precision, Real};
use crate::shapes::{Located, Maps, Parameters, Probe};
use crate::tally::Tally;
use crate::transform::{Transform, transform_bounds};

/// Another geometry under an affine map.
#[derive(Clone, Debug)]
pub(crate) struct Instance<P: Precision> {
    geometry: Arc<Geometry<P>>,
    transform: Transform<P::Core>,
    bounds: Option<Aabb>,
}

impl<P: Precision> Instance<P> {
    pub fn new(geometry: Arc<Geometry<P>>, to_world: DAffine3) -> Result<Self, GeometryError> {
        // A hit names one instance, so there would be no way back to what was hit.
        if geometry.instance_count() > 0 {
            return Err(GeometryError::Nested);
        }
        let transform = Transform::new(to_world).ok_or(GeometryError::Singular)?;
        // Nothing stays nothing, wherever it is: the map would make its infinite corners no numbers, and what is no number
        // has come from something too large.
        let mapped = |b: Aabb| if b.is_empty() { Aabb::EMPTY } else { transform_bounds(&to_world, &b) };
        let bounds = geometry.bounds().map(mapped);
        if bounds.is_some_and(|b| b != Aabb::EMPTY && b.padded().is_none()) {
            return Err(GeometryError::NotFinite);
        }
        Ok(Self { geometry, transform, bounds })
    }

    /// None where the geometry has something without bounds.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }

    #[inline(never)]
    pub fn closest<T: Tally>(&self, probe: &Probe<P>, range: Interval<P::Real>, id: u32, tally: &mut T) -> Option<Hit<P::Real>> {
        let inner = self.transform.probe_to_object(probe);
        let hit = self.geometry.closest_probe::<T, true>(&inner, range, tally)?;
        Some(Hit { instance: id, ..hit })
    }

    #[inline(never)]
    pub fn any<T: Tally>(
        &self,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        id: u32,
        accept: &mut dyn FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let inner = self.transform.probe_to_object(probe);
        self.geometry.any_probe::<T, true>(&inner, range, &mut |hit| accept(&Hit { instance: id, ..*hit }), tally)
    }

    pub fn locate(&self, probe: &Probe<P>, hit: &Hit<P::Real>) -> Located<P::Core> {
        let inner = self.transform.probe_to_object(probe);
        let maps = Maps::new(&self.transform, None);
        self.transform.located_to_world(&self.geometry.locate(&inner, &own(hit), Some(maps)))
    }

    pub fn parameters(&self, probe: &Probe<P>, hit: &Hit<P::Real>) -> Parameters<P::Real> {
        let inner = self.transform.probe_to_object(probe);
        self.transform.parameters_to_world(&self.geometry.parameters_probe(&inner, &own(hit)))
    }
}

/// The hit as the instanced geometry knows it.
fn own<R: Real>(hit: &Hit<R>) -> Hit<R> {
    Hit { instance: Hit::<R>::NO_INSTANCE, ..*hit }
}
