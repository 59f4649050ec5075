//! Shapes: bounds, intersection with rays, and the surface at a hit.
//!
//! A shape is stored in f32 or f64. Its intersection test computes in f64, and returns a distance
//! and two shape-specific numbers. Only for the closest hit, [`Shape::locate_surface_point`] then
//! computes the surface point. Texture coordinates are computed on demand.

mod any;
mod border;
mod cone;
mod cuboid;
mod cylinder;
mod disk;
mod edges;
mod ellipsoid;
mod frame;
mod hyperboloid;
mod paraboloid;
mod plane;
mod prepared_ray;
mod quad;
mod quadratic;
pub(crate) mod quartic;
mod revolution;
mod sample;
mod spawn_offset;
mod sphere;
mod surface;
mod torus;
mod transform;
mod transformed_shape;
mod triangle;

pub use any::AnyShape;
pub use cone::Cone;
pub use cuboid::Cuboid;
pub use cylinder::{Cylinder, CylinderEnds};
pub use disk::Disk;
pub(crate) use edges::{EDGE_ON_RATIO, TriangleHit};
pub use ellipsoid::Ellipsoid;
pub use hyperboloid::Hyperboloid;
pub use paraboloid::Paraboloid;
pub use plane::Plane;
pub(crate) use prepared_ray::FAR_RATIO;
pub use prepared_ray::PreparedRay;
pub use quad::Quad;
pub use sample::SampleArea;
pub use spawn_offset::TransformChain;
pub use sphere::{Sphere, equirectangular_coordinates};
pub use surface::{Surface, SurfacePoint, TextureCoordinates};
pub use torus::Torus;
pub use transform::{Transform, transform_bounds};
pub use transformed_shape::TransformedShape;
pub use triangle::Triangle;

use glam::DVec3;

use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::Real;

/// Rounding error bound of an intersection test that computes with lengths up to `scale`. It is 16
/// roundings of `scale`. The longest chain of operations in any shape has about ten roundings.
#[inline(always)]
pub(crate) fn rounding_bound(scale: f64) -> f64 {
    scale * (f64::ROUNDOFF * 16.0)
}

/// Result of an intersection test: the distance, and two numbers whose meaning depends on the
/// shape, see the fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeHit<R> {
    /// Distance along the ray.
    pub t: R,
    /// First shape-specific number. It is a barycentric weight, the number of the hit part of the
    /// surface, or zero.
    pub u: R,
    /// Second shape-specific number. It is a barycentric weight, or one where the ray leaves a
    /// solid and zero elsewhere. Distances alone do not separate entry and exit: in a thin solid
    /// both may have the same stored distance.
    pub v: R,
}

impl<R: Real> ShapeHit<R> {
    /// Creates a hit at a distance. Both shape-specific numbers are zero.
    #[inline(always)]
    pub fn from_distance(t: R) -> Self {
        Self {
            t,
            u: R::ZERO,
            v: R::ZERO,
        }
    }

    /// Creates a hit at the distance where the ray leaves a solid.
    #[inline(always)]
    pub fn from_exit_distance(t: R) -> Self {
        Self {
            t,
            u: R::ZERO,
            v: R::ONE,
        }
    }

    /// Whether the ray leaves a solid at the hit.
    #[inline(always)]
    pub fn is_exit(&self) -> bool {
        self.v > R::ZERO
    }
}

/// Maps from the space of a ray to the world, for [`Shape::locate_surface_point`]; `None` in world
/// space.
pub type OuterTransforms<'a> = Option<TransformChain<'a>>;

/// A surface that rays can hit: its bounds, its intersection test, and the surface point of a hit.
pub trait Shape<R: Real> {
    /// Support function: the maximum of p·direction over all points p of the shape. `None` for an
    /// unbounded shape; NaN if a parameter of the shape is NaN.
    fn support_function(&self, direction: DVec3) -> Option<f64>;

    /// Returns the smallest axis-aligned box around the shape; `None` for an unbounded shape, which
    /// no tree holds.
    fn bounds(&self) -> Option<Aabb> {
        Aabb::from_support(|direction| self.support_function(direction))
    }

    /// Returns the nearest hit whose distance lies in the open interval `range`. `side` is the side
    /// of the surface that the ray can hit.
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>>;

    /// Computes the surface point of a hit, in f64 and in the space of the ray. `hit` must be the
    /// result of [`Shape::intersect`] for the same ray. `transform_chain` holds the maps from the
    /// ray's space to the world. These maps determine how far ray origins must be from edges and
    /// from curved surfaces.
    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint;

    /// Computes the surface point as [`Shape::locate_point_under_transforms`], for a shape in world
    /// space.
    #[inline(always)]
    fn locate_surface_point(&self, prepared_ray: &PreparedRay, hit: ShapeHit<R>) -> SurfacePoint {
        self.locate_point_under_transforms(prepared_ray, hit, None)
    }

    /// Computes the texture coordinates at a hit. `hit` must be the result of [`Shape::intersect`]
    /// for the same ray.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R>;

    /// Computes the surface at a hit, rounded to the stored scalar. `hit` must be the result of
    /// [`Shape::intersect`] for the same ray.
    #[inline]
    fn surface(&self, prepared_ray: &PreparedRay, hit: ShapeHit<R>) -> Surface<R> {
        self.locate_surface_point(prepared_ray, hit).to_scalar()
    }
}

/// Returns the hit at the first of two ordered distances that lies in the range and on an accepted
/// side. A ray enters a closed shape at `near` and leaves it at `far`.
#[inline(always)]
pub(crate) fn first_accepted_root<R: Real>(
    near: R,
    far: R,
    range: Interval<R>,
    side: Side,
) -> Option<ShapeHit<R>> {
    if side.accepts(true) && range.contains(near) {
        Some(ShapeHit::from_distance(near))
    } else if side.accepts(false) && range.contains(far) {
        Some(ShapeHit::from_exit_distance(far))
    } else {
        None
    }
}
