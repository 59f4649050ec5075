//! The closed set of shapes: each arm only hands on to its own file.

use glam::DVec3;

use super::cylinder::Ends;
use super::{
    Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Parameters, Plane,
    PreparedRay, Quad, SampleArea, Shape, ShapeHit, Sphere, SurfacePoint, Torus, Triangle, Under,
};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// Any shape.
#[derive(Clone, Copy, Debug)]
pub enum AnyShape<R: Real> {
    /// The sphere.
    Sphere(Sphere<R>),
    /// The infinite plane.
    Plane(Plane<R>),
    /// The disk.
    Disk(Disk<R>),
    /// The parallelogram.
    Quad(Quad<R>),
    /// The axis-parallel box.
    Cuboid(Cuboid<R>),
    /// The cylinder.
    Cylinder(Cylinder<R>),
    /// The cone, whole or truncated.
    Cone(Cone<R>),
    /// The ellipsoid.
    Ellipsoid(Ellipsoid<R>),
    /// The hyperboloid of one sheet.
    Hyperboloid(Hyperboloid<R>),
    /// The paraboloid.
    Paraboloid(Paraboloid<R>),
    /// The torus.
    Torus(Torus<R>),
    /// The triangle.
    Triangle(Triangle<R>),
}

macro_rules! each {
    ($any:expr, $shape:ident => $result:expr) => {
        each!($any, AnyShape::Plane($shape) => $result, $shape => $result)
    };
    ($any:expr, $first:pat => $own:expr, $shape:ident => $result:expr) => {
        match $any {
            $first => $own,
            AnyShape::Sphere($shape) => $result,
            AnyShape::Disk($shape) => $result,
            AnyShape::Quad($shape) => $result,
            AnyShape::Cuboid($shape) => $result,
            AnyShape::Cylinder($shape) => $result,
            AnyShape::Cone($shape) => $result,
            AnyShape::Ellipsoid($shape) => $result,
            AnyShape::Hyperboloid($shape) => $result,
            AnyShape::Paraboloid($shape) => $result,
            AnyShape::Torus($shape) => $result,
            AnyShape::Triangle($shape) => $result,
        }
    };
}

/// Those of finite area.
macro_rules! each_finite {
    ($any:expr, $shape:ident => $result:expr) => {
        each!($any, AnyShape::Plane(_) | AnyShape::Cylinder(Cylinder { ends: Ends::None, .. }) => None, $shape => Some($result))
    };
}

impl<R: Real> Shape<R> for AnyShape<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        each!(self, shape => shape.support(direction))
    }

    fn bounds(&self) -> Option<Aabb> {
        each!(self, shape => shape.bounds())
    }

    #[inline]
    fn intersect(
        &self,
        probe: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        each!(self, shape => shape.intersect(probe, range, side))
    }

    fn locate_under(&self, probe: &PreparedRay, hit: ShapeHit<R>, maps: Under<'_>) -> SurfacePoint {
        each!(self, shape => shape.locate_under(probe, hit, maps))
    }

    fn parameters(&self, probe: &PreparedRay, hit: ShapeHit<R>) -> Parameters<R> {
        each!(self, shape => shape.parameters(probe, hit))
    }
}

impl<R: Real> AnyShape<R> {
    /// Whether it can be hit safely: its box is one of finite f32 numbers or, without a box, its
    /// parameters are finite.
    pub fn is_finite(&self) -> bool {
        match self {
            AnyShape::Plane(plane) => plane.point.is_finite() && plane.normal.is_finite(),
            AnyShape::Cylinder(c) if c.ends == Ends::None => {
                c.base.is_finite() && c.axis.is_finite() && c.radius.is_finite()
            }
            // With an infinite slope the box is that of a cylinder.
            AnyShape::Hyperboloid(h) if !h.slope.is_finite() => false,
            shape => shape.bounds().is_some_and(|b| b.padded().is_some()),
        }
    }

    /// Area of the surface; none when it is infinite.
    pub fn area(&self) -> Option<f64> {
        each_finite!(self, shape => shape.area())
    }

    /// [`SampleArea::sample_area`]; none for a shape of infinite area.
    pub fn sample_area(&self, u: R, v: R) -> Option<(SurfacePoint, f64)> {
        each_finite!(self, shape => shape.sample_area(u, v))
    }

    /// [`SampleArea::density`]; none for a shape of infinite area.
    pub fn density(&self, point: &SurfacePoint) -> Option<f64> {
        each_finite!(self, shape => shape.density(point))
    }
}

macro_rules! from {
    ($($shape:ident),*) => {
        $(impl<R: Real> From<$shape<R>> for AnyShape<R> {
            fn from(shape: $shape<R>) -> Self {
                Self::$shape(shape)
            }
        })*
    };
}

from!(
    Sphere,
    Plane,
    Disk,
    Quad,
    Cuboid,
    Cylinder,
    Cone,
    Ellipsoid,
    Hyperboloid,
    Paraboloid,
    Torus,
    Triangle
);
