//! Affine maps between the space of an instance or a placed shape and the world.

use glam::{DAffine3, DMat3, DVec3};

use super::{Parameters, PreparedRay, SurfacePoint};
use crate::aabb::{Aabb, BoundingSphere};
use crate::math::double_double::DoubleDouble;
use crate::scalar::{Real, Vector};

/// An invertible affine map, with the inverse of its linear part.
#[derive(Clone, Copy, Debug)]
pub struct Transform {
    pub(crate) to_world: DAffine3,
    /// The way back, once the translation is taken from a point.
    pub(crate) inverse: DMat3,
    /// How long in object space at most is what is one in each axis of the world.
    pub(super) magnification: f64,
}

impl Transform {
    /// From an f64 map; none when it can't be inverted in finite numbers.
    pub fn new(to_world: DAffine3) -> Option<Self> {
        let transform = Self::of_invertible(to_world);
        let invertible = to_world.matrix3.determinant() != 0.0
            && to_world.is_finite()
            && transform.inverse.is_finite();
        invertible.then_some(transform)
    }

    /// From an f64 map that is known to have an inverse. Where rounding has taken that, the way
    /// back leads to no numbers, and a ray of those hits nothing.
    pub(crate) fn of_invertible(to_world: DAffine3) -> Self {
        let inverse = accurate_inverse(to_world.matrix3);
        let magnification =
            inverse.x_axis.length() + inverse.y_axis.length() + inverse.z_axis.length();
        Self {
            to_world,
            inverse,
            magnification,
        }
    }

    /// The box of the world around a sphere of object space.
    pub(crate) fn sphere_bounds(&self, sphere: &BoundingSphere) -> Aabb {
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = self.to_world.matrix3;
        let half = (x * x + y * y + z * z).map(f64::sqrt) * f64::from(sphere.radius);
        Aabb::around(
            self.to_world
                .transform_point3(DVec3::from_array(sphere.centre.map(f64::from))),
            half,
        )
    }

    /// A world ray in the space of the object. Its direction is *not* brought to unit length there:
    /// distances along it stay world distances, so hits and ranges need no conversion.
    #[inline]
    pub fn probe_to_object(&self, probe: &PreparedRay) -> PreparedRay {
        // The translation first: what it takes away is not magnified then.
        let origin = self.inverse * (probe.origin - self.to_world.translation);
        PreparedRay::mapped(origin, self.inverse * probe.direction, probe.culls)
    }

    /// A surface of object space in the world: the point by the map, the normal by the inverse
    /// transpose, outward still outward where the map mirrors, the error bound grown by the map, by
    /// its own rounding, and by that of the way back for a ray that starts at the point.
    pub fn located_to_world(&self, s: &SurfacePoint) -> SurfacePoint {
        let DAffine3 {
            matrix3: matrix,
            translation,
        } = self.to_world;
        let (sizes, there) = (matrix.abs(), matrix * s.point);
        let there_and_back = sizes * (self.inverse.abs() * there.abs());
        let magnitude = sizes * s.point.abs().max(s.above.abs()).max(s.below.abs())
            + there_and_back
            + translation.abs();
        SurfacePoint {
            point: there + translation,
            above: matrix * s.above + translation,
            below: matrix * s.below + translation,
            normal: self.normal_to_world(s.normal).normalize(),
            error: s.error * (sizes * DVec3::ONE).max_element()
                + magnitude.max_element() * (f64::ROUNDOFF * 16.0),
        }
    }

    /// A normal by the inverse transpose, not brought to unit length.
    pub fn normal_to_world(&self, normal: DVec3) -> DVec3 {
        self.inverse.transpose_mul_vec3(normal)
    }

    /// Texture coordinates of object space in the world: the derivative turns with the map.
    pub fn parameters_to_world<R: Real>(&self, s: &Parameters<R>) -> Parameters<R> {
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = self.to_world.matrix3;
        let dpdu = R::Vec3::from_f64(self.to_world.matrix3 * s.dpdu.to_f64());
        Parameters {
            dpdu,
            mirrored: s.mirrored != (x.dot(y.cross(z)) < 0.0),
            ..*s
        }
    }
}

/// Steps that refining may take: each gains the digits that the first inverse has right, which of a
/// map that f64 can just invert are few.
const MOST_STEPS: usize = 24;

/// Above this product of the norms of a matrix and its inverse, the inverse is worth refining.
const ILL_CONDITIONED: f64 = 100.0;

/// The inverse, right to a few roundings of its greatest entry. Elimination alone loses the digits
/// of the condition number: the inverse of a map that stretches by 1000 one way and shrinks by 1000
/// another is wrong in the tenth digit, and such a map magnifies that again. So the columns are
/// refined: each is corrected by the inverse of what it lacks, which is summed without rounding
/// ("Accuracy and Stability of Numerical Algorithms", Higham, 2nd edition 2002, chapter 12).
fn accurate_inverse(matrix: DMat3) -> DMat3 {
    let first = matrix.inverse();
    let norm = |m: DMat3| {
        (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt()
    };
    if norm(matrix) * norm(first) < ILL_CONDITIONED {
        return first;
    }
    let refined = |mut x: DVec3, unit: DVec3| {
        for _ in 0..MOST_STEPS {
            let better = x + first * lacking(matrix, x, unit);
            if better == x {
                break;
            }
            x = better;
        }
        x
    };
    DMat3::from_cols(
        refined(first.x_axis, DVec3::X),
        refined(first.y_axis, DVec3::Y),
        refined(first.z_axis, DVec3::Z),
    )
}

/// b − M·x, the products exact and their sum in twice the precision.
fn lacking(matrix: DMat3, x: DVec3, b: DVec3) -> DVec3 {
    let row = |i: usize| {
        let taken =
            |sum: DoubleDouble, j: usize| sum + DoubleDouble::product(-matrix.col(j)[i], x[j]);
        (0..3).fold(DoubleDouble::from(b[i]), taken).rounded()
    };
    DVec3::new(row(0), row(1), row(2))
}

/// The box around a mapped box.
pub fn transform_bounds(map: &DAffine3, bounds: &Aabb) -> Aabb {
    Aabb::from_points(bounds.corners().map(|c: DVec3| map.transform_point3(c)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A whole number of so many bits and a sign (SplitMix64).
    fn whole(state: &mut u64, bits: u32) -> i64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) as i64) >> (63 - bits)
    }

    fn cross([a, b, c]: [i64; 3], [x, y, z]: [i64; 3]) -> [i128; 3] {
        let minor = |p: i64, q: i64, r: i64, s: i64| {
            i128::from(p) * i128::from(q) - i128::from(r) * i128::from(s)
        };
        [minor(b, z, c, y), minor(c, x, a, z), minor(a, y, b, x)]
    }

    fn norm(columns: [DVec3; 3]) -> f64 {
        columns
            .iter()
            .map(|column| column.length_squared())
            .sum::<f64>()
            .sqrt()
    }

    /// Protects: the inverse of a map of a condition from 10² to 10¹⁵ is right to a few roundings
    /// of its greatest entry, against the quotients of whole numbers of 128 bits. Elimination alone
    /// loses what the condition has of digits.
    #[test]
    fn inverses_of_flat_maps_keep_their_digits() {
        let (state, mut judged) = (&mut 3, 0);
        for thickness in [1, 5, 12, 20, 33].into_iter().cycle().take(4000) {
            let mut vector = || [(); 3].map(|()| whole(state, 41));
            let (x, y) = (vector(), vector());
            let off = vector().map(|far| far >> (41 - thickness));
            let z: [i64; 3] = core::array::from_fn(|i| x[i] + y[i] + off[i]);
            let rows = [cross(y, z), cross(z, x), cross(x, y)];
            let determinant: i128 = (0..3).map(|i| i128::from(x[i]) * rows[0][i]).sum();
            let columns = [x, y, z].map(|v| DVec3::from_array(v.map(|x| x as f64)));
            let exact =
                rows.map(|row| DVec3::from_array(row.map(|x| x as f64 / determinant as f64)));
            if !(1e2..1e15).contains(&(norm(columns) * norm(exact))) {
                continue;
            }
            let found =
                accurate_inverse(DMat3::from_cols(columns[0], columns[1], columns[2])).transpose();
            let greatest = exact.iter().fold(0.0_f64, |greatest, row| {
                greatest.max(row.abs().max_element())
            });
            for (found, exact) in [found.x_axis, found.y_axis, found.z_axis]
                .into_iter()
                .zip(exact)
            {
                let off = (found - exact).abs().max_element() / (greatest * f64::EPSILON);
                assert!(
                    off <= 2.0,
                    "{found} instead of {exact}, {off} roundings off"
                );
            }
            judged += 1;
        }
        assert!(judged > 3500, "{judged} judged");
    }
}
