//! Affine maps between the space of an instance or a placed shape and the world.

use glam::{DAffine3, DMat3, DVec3};

use crate::scalar::{Precision, Real, Vector, convert_vec};
use crate::shapes::{Located, Parameters, Probe};

/// An invertible affine map in the core's scalar, with the inverse of its linear part.
#[derive(Clone, Copy, Debug)]
pub struct Transform<C: Real> {
    columns: [C::Vec3; 3],
    inverse_columns: [C::Vec3; 3],
    translation: C::Vec3,
    magnification: C,
}

/// A matrix by its columns, times a vector.
#[inline(always)]
fn times<C: Real>([x, y, z]: [C::Vec3; 3], v: C::Vec3) -> C::Vec3 {
    x * v.x() + y * v.y() + z * v.z()
}

impl<C: Real> Transform<C> {
    /// From an f64 map; none when it can't be inverted in finite numbers.
    pub fn new(to_world: DAffine3) -> Option<Self> {
        let matrix = to_world.matrix3;
        let inverse = accurate_inverse(matrix);
        let columns = |m: DMat3| [m.x_axis, m.y_axis, m.z_axis].map(C::Vec3::from_f64);
        (matrix.determinant() != 0.0 && to_world.is_finite() && inverse.is_finite()).then(|| Self {
            columns: columns(matrix),
            inverse_columns: columns(inverse),
            translation: C::Vec3::from_f64(to_world.translation),
            magnification: C::from_f64(inverse.x_axis.length() + inverse.y_axis.length() + inverse.z_axis.length()),
        })
    }

    /// A world ray in the space of the object. Its direction is *not* brought to unit length there: distances along it stay
    /// world distances, so hits and ranges need no conversion.
    #[inline]
    pub fn probe_to_object<P: Precision<Core = C>>(&self, probe: &Probe<P>) -> Probe<P> {
        // The translation first: what it takes away is not magnified then.
        let turn = |v: C::Vec3| times::<C>(self.inverse_columns, v);
        Probe::from_core(turn(probe.origin - self.translation), turn(probe.direction))
    }

    /// A surface of object space in the world: the point by the map, the normal by the inverse transpose, outward still
    /// outward where the map mirrors, the error bound grown by the map, by its own rounding, and by that of the way back for
    /// a ray that starts at the point.
    pub fn located_to_world(&self, s: &Located<C>) -> Located<C> {
        let sizes = self.columns.map(Vector::abs);
        let there = times::<C>(self.columns, s.point);
        let point = there + self.translation;
        let there_and_back = times::<C>(sizes, times::<C>(self.inverse_columns.map(Vector::abs), there.abs()));
        let magnitude =
            times::<C>(sizes, s.point.abs().max(s.above.abs()).max(s.below.abs())) + there_and_back + self.translation.abs();
        Located {
            point,
            above: times::<C>(self.columns, s.above) + self.translation,
            below: times::<C>(self.columns, s.below) + self.translation,
            normal: self.normal_to_world(s.normal).normalize(),
            error: s.error * times::<C>(sizes, C::Vec3::ONE).max_element()
                + magnitude.max_element() * (C::ROUNDOFF * C::from_f64(16.0)),
        }
    }

    /// A surface of the world in object space, without a bound: the point by the inverse, the normal by the transpose.
    pub fn located_to_object(&self, s: &Located<C>) -> Located<C> {
        let [x, y, z] = self.columns;
        let normal = C::Vec3::new(x.dot(s.normal), y.dot(s.normal), z.dot(s.normal)).normalize();
        Located::new(times::<C>(self.inverse_columns, s.point - self.translation), normal, C::ZERO)
    }

    /// A normal by the inverse transpose, not brought to unit length.
    pub fn normal_to_world(&self, normal: C::Vec3) -> C::Vec3 {
        let [x, y, z] = self.inverse_columns;
        C::Vec3::new(x.dot(normal), y.dot(normal), z.dot(normal))
    }

    /// How long in object space at most is what is one in each axis of the world.
    pub fn magnification(&self) -> C {
        self.magnification
    }

    /// Texture coordinates of object space in the world: the derivative turns with the map.
    pub fn parameters_to_world<R: Real>(&self, s: &Parameters<R>) -> Parameters<R> {
        Parameters { dpdu: convert_vec::<C, R>(times::<C>(self.columns, convert_vec::<R, C>(s.dpdu))), ..*s }
    }
}

/// Above this product of the norms of a matrix and its inverse, the inverse is worth refining.
const ILL_CONDITIONED: f64 = 100.0;

/// The inverse, right to a few roundings of its greatest entry. Elimination alone loses the digits of the condition number:
/// the inverse of a map that stretches by 1000 one way and shrinks by 1000 another is wrong in the tenth digit, and such a map
/// magnifies that again. So the columns are refined: each is corrected by the inverse of what it lacks, which is summed
/// without rounding ("Accuracy and Stability of Numerical Algorithms", Higham, 2nd edition 2002, chapter 12).
fn accurate_inverse(matrix: DMat3) -> DMat3 {
    let first = matrix.inverse();
    let norm = |m: DMat3| (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt();
    if norm(matrix) * norm(first) < ILL_CONDITIONED {
        return first;
    }
    let refined = |start: DVec3, unit: DVec3| (0..3).fold(start, |x, _| x + first * lacking(matrix, x, unit));
    DMat3::from_cols(refined(first.x_axis, DVec3::X), refined(first.y_axis, DVec3::Y), refined(first.z_axis, DVec3::Z))
}

/// b − M·x, the products exact and their sum in twice the precision ("Accurate Sum and Dot Product", Ogita, Rump, Oishi 2005).
fn lacking(matrix: DMat3, x: DVec3, b: DVec3) -> DVec3 {
    let row = |i: usize| {
        let (mut sum, mut rest) = (b[i], 0.0);
        for j in 0..3 {
            let (a, y) = (-matrix.col(j)[i], x[j]);
            let product = a * y;
            let total = sum + product;
            let back = total - sum;
            rest += a.mul_add(y, -product) + ((sum - (total - back)) + (product - back));
            sum = total;
        }
        sum + rest
    };
    DVec3::new(row(0), row(1), row(2))
}

/// The box around a mapped box.
pub fn transform_bounds(map: &DAffine3, bounds: &crate::Aabb) -> crate::Aabb {
    crate::Aabb::from_points(bounds.corners().map(|c: DVec3| map.transform_point3(c)))
}
