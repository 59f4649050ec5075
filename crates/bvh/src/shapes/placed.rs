//! A shape under an affine map.

use glam::{DAffine3, DVec3};

use super::sample::area_by_quadrature;
use super::{AnyShape, CoreVec, Located, Parameters, Probe, Shape, ShapeHit, num};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector};
use crate::transform::Transform;

/// A shape in a space of its own, hit there and shaded in the world. Rays keep their parameter: a distance along the ray is
/// the same number in both spaces ("Improving Ray Tracing Precision by Object Space Intersection Computation", Dammertz,
/// Keller 2006).
#[derive(Clone, Copy, Debug)]
pub struct Placed<P: Precision> {
    shape: AnyShape<P::Real>,
    transform: Transform<P::Core>,
    to_world: DAffine3,
    /// Volume of the image of a unit cube.
    volume: f64,
}

impl<P: Precision> Placed<P> {
    /// Puts a shape under a map; none when the map can't be inverted in finite numbers.
    pub fn new(shape: AnyShape<P::Real>, to_world: DAffine3) -> Option<Self> {
        let volume = to_world.matrix3.determinant().abs();
        Transform::new(to_world).map(|transform| Self { shape, transform, to_world, volume })
    }

    /// How far the image reaches in a direction of the world.
    pub fn support(&self, direction: DVec3) -> Option<f64> {
        let own = self.to_world.matrix3.transpose() * direction;
        Some(self.shape.support(own)? + self.to_world.translation.dot(direction))
    }

    /// The least box around the image; none for a shape without bounds.
    pub fn bounds(&self) -> Option<Aabb> {
        Aabb::from_support(|d| self.support(d))
    }

    /// The nearest hit, as [`Shape::intersect`].
    #[inline]
    pub fn intersect(&self, probe: &Probe<P>, range: Interval<P::Real>, side: Side) -> Option<ShapeHit<P::Real>> {
        self.shape.intersect(&self.transform.probe_to_object(probe), range, side)
    }

    /// The surface at a hit, as [`Shape::locate`].
    pub fn locate(&self, probe: &Probe<P>, hit: ShapeHit<P::Real>) -> Located<P::Core> {
        self.transform.located_to_world(&self.shape.locate(&self.transform.probe_to_object(probe), hit))
    }

    /// Texture coordinates at a hit, as [`Shape::parameters`].
    pub fn parameters(&self, probe: &Probe<P>, hit: ShapeHit<P::Real>) -> Parameters<P::Real> {
        self.transform.parameters_to_world(&self.shape.parameters(&self.transform.probe_to_object(probe), hit))
    }

    /// How many times larger the image of a piece of surface is, by its unit normal in object space.
    fn stretch(&self, normal: DVec3) -> f64 {
        self.volume * self.transform.normal_to_world(CoreVec::<P>::from_f64(normal)).to_f64().length()
    }

    /// Area of the image, by quadrature; none when it is infinite.
    pub fn area(&self) -> Option<f64> {
        self.shape.area()?;
        Some(area_by_quadrature(|u, v| self.sample_area(num(u), num(v)).map_or(0.0, |(_, density)| 1.0 / density.to_f64())))
    }

    /// A point of the image and the density per area of the world with which it is drawn, as
    /// [`super::SampleArea::sample_area`]; none when the area is infinite.
    pub fn sample_area(&self, u: P::Real, v: P::Real) -> Option<(Located<P::Core>, P::Core)> {
        let (own, density) = self.shape.sample_area::<P>(u, v)?;
        let stretch: P::Core = num(self.stretch(own.normal.to_f64()));
        Some((self.transform.located_to_world(&own), density / stretch))
    }

    /// The density per area of drawing the point at a hit; none when the area is infinite.
    pub fn density(&self, probe: &Probe<P>, hit: ShapeHit<P::Real>) -> Option<P::Core> {
        let own = self.shape.locate(&self.transform.probe_to_object(probe), hit);
        let stretch: P::Core = num(self.stretch(own.normal.to_f64()));
        Some(self.shape.density::<P>(&own)? / stretch)
    }
}
