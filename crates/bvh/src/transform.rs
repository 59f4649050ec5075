//! Affine maps between the space of an instance or a placed shape and the world.

use glam::{DAffine3, DVec3};

use crate::scalar::{Precision, Real, Vector, convert_vec};
use crate::shapes::{Located, Parameters, Probe};

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
    pub fn located_to_world(&self, s: &Located<C>) -> Located<C> {
        let [x, y, z] = self.columns;
        let p = s.point;
        let (ax, ay, az, size) = (x.abs(), y.abs(), z.abs(), p.abs());
        let magnitude = ax * size.x() + ay * size.y() + az * size.z() + self.translation.abs();
        Located {
            point: x * p.x() + y * p.y() + z * p.z() + self.translation,
            normal: self.normal_to_world(s.normal).normalize(),
            error: s.error * (ax + ay + az).max_element() + magnitude.max_element() * (C::ROUNDOFF * C::from_f64(16.0)),
        }
    }

    /// A normal by the inverse transpose, not brought to unit length.
    pub fn normal_to_world(&self, normal: C::Vec3) -> C::Vec3 {
        let [x, y, z] = self.inverse_columns;
        C::Vec3::new(x.dot(normal), y.dot(normal), z.dot(normal))
    }

    /// Texture coordinates of object space in the world: the derivative turns with the map.
    pub fn parameters_to_world<R: Real>(&self, s: &Parameters<R>) -> Parameters<R> {
        let [x, y, z] = self.columns;
        let d = convert_vec::<R, C>(s.dpdu);
        Parameters { dpdu: convert_vec::<C, R>(x * d.x() + y * d.y() + z * d.z()), ..*s }
    }
}

/// The box around a mapped box.
pub fn transform_bounds(map: &DAffine3, bounds: &crate::Aabb) -> crate::Aabb {
    crate::Aabb::from_points(bounds.corners().map(|c: DVec3| map.transform_point3(c)))
}
