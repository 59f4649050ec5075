//! Shapes: each knows its bounds, how a ray hits it, and what its surface is like at a hit.
//!
//! A shape is stored in the precision's scalar; its test computes in [`Precision::Core`]. `t`, `u` and `v` are all that a
//! test returns: the surface point is made once, by [`Shape::surface`], when the closest hit is known.

mod plane;
mod sphere;
mod triangle;

pub use plane::Plane;
pub use sphere::Sphere;
pub use triangle::Triangle;

use crate::aabb::Aabb;
use crate::ray::{Interval, Ray, Side};
use crate::scalar::{Precision, Real, Vec3Of, Vector, convert_vec};

/// A ray with what every test of it needs, made once per query: the core's copy of it.
#[derive(Clone, Copy, Debug)]
pub struct Probe<P: Precision> {
    /// The ray itself.
    pub ray: Ray<P::Real>,
    /// Origin in the core's scalar.
    pub origin: <P::Core as Real>::Vec3,
    /// Direction in the core's scalar; of unit length only up to the rounding of the stored one.
    pub direction: <P::Core as Real>::Vec3,
    /// One over the squared length of `direction` in the core's scalar.
    pub inverse_length_squared: P::Core,
}

impl<P: Precision> Probe<P> {
    /// Prepares a ray.
    #[inline(always)]
    pub fn new(ray: Ray<P::Real>) -> Self {
        let origin = convert_vec::<P::Real, P::Core>(ray.origin);
        let direction = convert_vec::<P::Real, P::Core>(ray.direction);
        Self { ray, origin, direction, inverse_length_squared: P::Core::ONE / direction.dot(direction) }
    }

    /// Prepares a ray given in the core's scalar, of any length: distances are in units of that length.
    #[inline(always)]
    pub fn from_core(origin: <P::Core as Real>::Vec3, direction: <P::Core as Real>::Vec3) -> Self {
        let ray = Ray::new(convert_vec::<P::Core, P::Real>(origin), convert_vec::<P::Core, P::Real>(direction));
        Self { ray, origin, direction, inverse_length_squared: P::Core::ONE / direction.dot(direction) }
    }
}

/// What a shape's test returns: distance and surface parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeHit<R> {
    /// Distance along the ray.
    pub t: R,
    /// First surface parameter, zero where the shape makes it from the point.
    pub u: R,
    /// Second surface parameter.
    pub v: R,
}

impl<R: Real> ShapeHit<R> {
    /// A hit without parameters.
    #[inline(always)]
    pub fn at(t: R) -> Self {
        Self { t, u: R::ZERO, v: R::ZERO }
    }
}

/// The surface at a hit.
#[derive(Clone, Copy, Debug)]
pub struct Surface<R: Real> {
    /// The hit point, moved onto the surface where the shape can.
    pub point: R::Vec3,
    /// Bound on the distance, in each axis, of `point` from the exact surface point ("Managing Rounding Error",
    /// Physically Based Rendering, 4th edition, 6.8). Spawned rays start outside it.
    pub error: R,
    /// Geometric unit normal, pointing outwards whichever side was hit.
    pub normal: R::Vec3,
    /// Texture coordinate u.
    pub u: R,
    /// Texture coordinate v.
    pub v: R,
    /// Derivative of the point by u; not normalised, zero where it vanishes.
    pub dpdu: R::Vec3,
}

/// A surface that rays can hit.
pub trait Shape<R: Real> {
    /// A box around it; none for a shape without bounds, which then stays outside any tree.
    fn bounds(&self) -> Option<Aabb>;

    /// The nearest hit within `range` (open at both ends) on an accepted side.
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>>;

    /// The surface at a hit that [`Shape::intersect`] returned for the same ray.
    fn surface<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Surface<R>;
}

/// The first of two ordered roots that lies in the range on an accepted side: rays enter a closed shape at `near` and
/// leave it at `far`.
#[inline(always)]
pub(crate) fn first_root<R: Real>(near: R, far: R, range: Interval<R>, side: Side) -> Option<R> {
    if side.accepts(true) && range.contains(near) {
        Some(near)
    } else if side.accepts(false) && range.contains(far) {
        Some(far)
    } else {
        None
    }
}

/// Largest magnitude of any component.
#[inline(always)]
pub(crate) fn magnitude<P: Precision>(v: Vec3Of<P>) -> P::Real {
    v.abs().max_element()
}
