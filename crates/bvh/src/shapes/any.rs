//! The closed set of shapes as an enum. Each arm calls the shape's own implementation.

use glam::DVec3;

use super::cylinder::CylinderEnds;
use super::{
    Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, OuterTransforms, Paraboloid, Plane,
    PreparedRay, Quad, SampleArea, Shape, ShapeHit, Sphere, SurfacePoint, TextureCoordinates,
    Torus, Triangle,
};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// Any of the shapes, for code that chooses the kind of a shape at run time.
#[derive(Clone, Copy, Debug)]
pub enum AnyShape<R: Real> {
    /// A sphere.
    Sphere(Sphere<R>),
    /// An infinite plane.
    Plane(Plane<R>),
    /// A disk.
    Disk(Disk<R>),
    /// A parallelogram.
    Quad(Quad<R>),
    /// An axis-aligned box.
    Cuboid(Cuboid<R>),
    /// A cylinder.
    Cylinder(Cylinder<R>),
    /// A cone, complete or truncated.
    Cone(Cone<R>),
    /// An ellipsoid.
    Ellipsoid(Ellipsoid<R>),
    /// A hyperboloid of one sheet.
    Hyperboloid(Hyperboloid<R>),
    /// A paraboloid.
    Paraboloid(Paraboloid<R>),
    /// A torus.
    Torus(Torus<R>),
    /// A triangle.
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

/// Evaluates an expression for a shape of finite area. For a plane and an infinite cylinder the
/// result is `None`.
macro_rules! each_finite {
    ($any:expr, $shape:ident => $result:expr) => {
        each!($any, AnyShape::Plane(_) | AnyShape::Cylinder(Cylinder { ends: CylinderEnds::None, .. }) => None, $shape => Some($result))
    };
}

impl<R: Real> Shape<R> for AnyShape<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        each!(self, shape => shape.support_function(direction))
    }

    fn bounds(&self) -> Option<Aabb> {
        each!(self, shape => shape.bounds())
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        each!(self, shape => shape.intersect(prepared_ray, range, side))
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        each!(self, shape => shape.locate_point_under_transforms(prepared_ray, hit, transform_chain))
    }

    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        each!(self, shape => shape.texture_coordinates(prepared_ray, hit))
    }
}

impl<R: Real> AnyShape<R> {
    /// Whether queries can test the shape. A bounded shape needs a box that is finite in f32. An
    /// unbounded shape needs finite parameters.
    pub fn is_finite(&self) -> bool {
        match self {
            AnyShape::Plane(plane) => plane.point.is_finite() && plane.normal.is_finite(),
            AnyShape::Cylinder(c) if c.ends == CylinderEnds::None => {
                c.base.is_finite() && c.axis.is_finite() && c.radius.is_finite()
            }
            // With an infinite slope the box would be finite: the box of a cylinder.
            AnyShape::Hyperboloid(h) if !h.slope.is_finite() => false,
            shape => shape.bounds().is_some_and(|b| b.to_padded().is_some()),
        }
    }

    /// Surface area; `None` if it is infinite.
    pub fn area(&self) -> Option<f64> {
        each_finite!(self, shape => shape.area())
    }

    /// Samples a point as [`SampleArea::sample_area`]; `None` for a shape of infinite area.
    pub fn sample_area(&self, u: R, v: R) -> Option<(SurfacePoint, f64)> {
        each_finite!(self, shape => shape.sample_area(u, v))
    }

    /// Density, per area, with which [`Self::sample_area`] samples the point, as
    /// [`SampleArea::area_density`]; `None` for a shape of infinite area.
    pub fn area_density(&self, point: &SurfacePoint) -> Option<f64> {
        each_finite!(self, shape => shape.area_density(point))
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
