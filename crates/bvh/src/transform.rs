//! Affine maps between the space of an instance or a placed shape and the world.

use glam::{DAffine3, DVec3};

use crate::scalar::{Precision, Real, Vector, convert, convert_vec};
use crate::shapes::{Probe, Surface};

/// An invertible affine map in the core's scalar, with its inverse.
#[derive(Clone, Copy, Debug)]
pub struct Transform<C: Real> {
    columns: [C::Vec3; 3],
    translation: C::Vec3,
    inverse_columns: [C::Vec3; 3],
    inverse_translation: C::Vec3,
}

impl<C: Real> Transform<C> {
    /// From an f64 map; none when it can't be inverted in finite numbers.
    pub fn new(to_world: DAffine3) -> Option<Self> {
        let inverse = to_world.inverse();
        let determinant = to_world.matrix3.determinant();
        let columns = |m: &DAffine3| [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis].map(C::Vec3::from_f64);
        (determinant != 0.0 && to_world.is_finite() && inverse.is_finite()).then(|| Self {
            columns: columns(&to_world),
            translation: C::Vec3::from_f64(to_world.translation),
            inverse_columns: columns(&inverse),
            inverse_translation: C::Vec3::from_f64(inverse.translation),
        })
    }

    /// A world ray in the space of the object. Its direction is *not* brought to unit length there: distances along it stay
    /// world distances, so hits and ranges need no conversion.
    #[inline]
    pub fn probe_to_object<P: Precision<Core = C>>(&self, probe: &Probe<P>) -> Probe<P> {
        let [x, y, z] = self.inverse_columns;
        let turn = |v: C::Vec3| x * v.x() + y * v.y() + z * v.z();
        Probe::from_core(turn(probe.origin) + self.inverse_translation, turn(probe.direction))
    }

    /// A surface of object space in the world: the point by the map, the normal by the inverse transpose, outward still
    /// outward where the map mirrors, the error bound grown by the map and its own rounding.
    pub fn surface_to_world<P: Precision<Core = C>>(&self, s: &Surface<P::Real>) -> Surface<P::Real> {
        let [x, y, z] = self.columns;
        let point = convert_vec::<P::Real, C>(s.point);
        let linear = x * point.x() + y * point.y() + z * point.z();
        let world: <P::Real as Real>::Vec3 = convert_vec::<C, P::Real>(linear + self.translation);
        let normal = convert_vec::<P::Real, C>(s.normal);
        let [ix, iy, iz] = self.inverse_columns;
        let normal = C::Vec3::new(ix.dot(normal), iy.dot(normal), iz.dot(normal)).normalize();
        let dpdu = convert_vec::<P::Real, C>(s.dpdu);
        let growth = x.abs() + y.abs() + z.abs();
        let magnitude = (x.abs() * point.x().abs() + y.abs() * point.y().abs() + z.abs() * point.z().abs()).max_element()
            + self.translation.abs().max_element();
        let rounding = P::Real::ROUNDOFF * P::Real::from_f64(4.0);
        Surface {
            point: world,
            error: s.error * convert::<C, P::Real>(growth.max_element()) + convert::<C, P::Real>(magnitude) * rounding,
            normal: convert_vec::<C, P::Real>(normal),
            u: s.u,
            v: s.v,
            dpdu: convert_vec::<C, P::Real>(x * dpdu.x() + y * dpdu.y() + z * dpdu.z()),
        }
    }
}

/// The box around a mapped box.
pub fn transform_bounds(map: &DAffine3, bounds: &crate::Aabb) -> crate::Aabb {
    crate::Aabb::from_points(bounds.corners().map(|c: DVec3| map.transform_point3(c)))
}
