//! A ray with what every test of it needs, made once per query.

use super::{CoreVec, num};
use crate::ray::Ray;
use crate::scalar::{Precision, Real, Robust, Vector, convert, convert_vec};

/// So many sizes of a shape are far: from there f32 tells distances to 2⁻¹⁴ of the shape.
pub(crate) const FAR: f64 = 1024.0;

/// A ray in the scalar of the core, where tests compute.
#[derive(Clone, Copy, Debug)]
pub struct Probe<P: Precision> {
    /// The ray as it is stored.
    pub ray: Ray<P::Real>,
    /// Origin in the core's scalar.
    pub origin: CoreVec<P>,
    /// Direction in the core's scalar; of unit length only up to the rounding of the stored one, and of any length in the
    /// space of an instance.
    pub direction: CoreVec<P>,
    /// Whether this is the space of a placed shape or an instance. There a rounding of the distance, moved along the surface
    /// by projecting it back, may come out of the map magnified, so that points are made from unrounded distances.
    pub mapped: bool,
    /// Squared length of `direction`.
    pub length_squared: P::Core,
    /// The same, less by more than the rounding of any sum of a few products with it: a discriminant made with it is never
    /// below zero where one from the same coefficients, or from the exact ones, is not.
    pub shortened: P::Core,
    /// One over it.
    pub inverse_length_squared: P::Core,
    /// Two vectors across the direction, such that (first, second, direction) is right-handed: they span the plane onto
    /// which triangles are projected. As long as the largest component of the direction at least.
    pub across: [CoreVec<P>; 2],
}

impl Probe<crate::scalar::Robust> {
    /// What [`Probe::shortened`] is of the squared length.
    pub(crate) const SHORTER: f64 = 1.0 - f64::EPSILON * 0.5 * 64.0;
}

impl<P: Precision> Probe<P> {
    /// Prepares a ray.
    #[inline(always)]
    pub fn new(ray: Ray<P::Real>) -> Self {
        Self::of(ray, true)
    }

    /// Prepares a ray, for triangles and quads too or not.
    #[inline(always)]
    pub(crate) fn of(ray: Ray<P::Real>, faces: bool) -> Self {
        let origin = convert_vec::<P::Real, P::Core>(ray.origin);
        let direction = convert_vec::<P::Real, P::Core>(ray.direction);
        Self::with(ray, origin, direction, false, faces)
    }

    /// Prepares a ray of a mapped space, in the core's scalar and of any length: distances are in units of that length.
    #[inline(always)]
    pub fn from_core(origin: CoreVec<P>, direction: CoreVec<P>) -> Self {
        let ray = Ray::new(convert_vec::<P::Core, P::Real>(origin), convert_vec::<P::Core, P::Real>(direction));
        Self::with(ray, origin, direction, true, true)
    }

    /// The same in f64.
    pub(crate) fn widened(&self) -> Probe<Robust> {
        let wide = |v: CoreVec<P>| convert_vec::<P::Core, f64>(v);
        Probe {
            ray: Ray::new(self.ray.origin.to_f32(), self.ray.direction.to_f32()),
            origin: wide(self.origin),
            direction: wide(self.direction),
            mapped: self.mapped,
            length_squared: self.length_squared.to_f64(),
            shortened: self.shortened.to_f64(),
            inverse_length_squared: self.inverse_length_squared.to_f64(),
            across: self.across.map(wide),
        }
    }

    #[inline(always)]
    fn with(ray: Ray<P::Real>, origin: CoreVec<P>, direction: CoreVec<P>, mapped: bool, faces: bool) -> Self {
        let length_squared = direction.dot(direction);
        let inverse_length_squared = P::Core::ONE / length_squared;
        let shortened = length_squared * (P::Core::ONE - P::Core::ROUNDOFF * num(64.0));
        let across = if faces { across::<P>(direction) } else { [Vector::ZERO; 2] };
        Self { ray, origin, direction, mapped, length_squared, shortened, inverse_length_squared, across }
    }

    /// Whether a point made from a stored distance could lie beside the hit by as much as 2⁻¹⁴ of a shape of this size. Such
    /// a point is made from the unrounded distance instead, and always in a map's space.
    #[inline(always)]
    pub(crate) fn needs_unrounded(&self, t: P::Real, size: P::Real) -> bool {
        P::ROBUST && (self.mapped || t > size * num(FAR))
    }

    /// The point at a stored distance.
    #[inline(always)]
    pub(crate) fn at(&self, t: P::Real) -> CoreVec<P> {
        self.origin + self.direction * convert::<P::Real, P::Core>(t)
    }
}

/// The shear of "Watertight Ray/Triangle Intersection" (Woop, Benthin, Wald 2013) without its division: a point's shear
/// coordinates times the direction's largest component.
#[inline(always)]
fn across<P: Precision>(d: CoreVec<P>) -> [CoreVec<P>; 2] {
    let zero = P::Core::ZERO;
    let (size, turned) = (d.abs(), -d);
    let sign = |major: P::Core| P::Core::ONE.copysign(major);
    if size.x() > size.y() && size.x() > size.z() {
        let s = sign(d.x());
        [CoreVec::<P>::new(turned.y(), d.x(), zero) * s, CoreVec::<P>::new(turned.z(), zero, d.x())]
    } else if size.y() > size.z() {
        let s = sign(d.y());
        [CoreVec::<P>::new(zero, turned.z(), d.y()) * s, CoreVec::<P>::new(d.y(), turned.x(), zero)]
    } else {
        let s = sign(d.z());
        [CoreVec::<P>::new(d.z(), zero, turned.x()) * s, CoreVec::<P>::new(zero, d.z(), turned.y())]
    }
}
