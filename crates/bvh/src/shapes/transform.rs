//! Affine maps between the space of an instance or a transformed shape and the world.

use glam::{DAffine3, DMat3, DVec3};

use super::{PreparedRay, SurfacePoint, TextureCoordinates};
use crate::aabb::{Aabb, BoundingSphere};
use crate::math::double_double::DoubleDouble;
use crate::scalar::{Real, Vector};

/// An invertible affine map, with the inverse of its linear part.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Transform {
    /// Object-to-world map.
    pub(crate) to_world: DAffine3,
    /// World-to-object matrix. It is applied to a point after the translation of `to_world` is
    /// subtracted.
    pub(crate) inverse: DMat3,
    /// Upper bound of a length in object space: that of any vector whose world-space components are
    /// at most one.
    pub(super) magnification: f64,
}

impl Transform {
    /// Creates the transform from an object-to-world map; `None` if the map has no finite inverse.
    pub fn new(to_world: DAffine3) -> Option<Self> {
        let transform = Self::from_invertible(to_world);
        let invertible = to_world.matrix3.determinant() != 0.0
            && to_world.is_finite()
            && transform.inverse.is_finite();
        invertible.then_some(transform)
    }

    /// Creates the transform from an object-to-world map that is known to have an inverse. If
    /// rounding makes the map singular, mapped rays are NaN and hit nothing.
    pub(crate) fn from_invertible(to_world: DAffine3) -> Self {
        let inverse = invert_accurately(to_world.matrix3);
        let magnification =
            inverse.x_axis.length() + inverse.y_axis.length() + inverse.z_axis.length();
        Self {
            to_world,
            inverse,
            magnification,
        }
    }

    /// Returns the world-space box around the image of an object-space sphere.
    pub(crate) fn transform_sphere_bounds(&self, sphere: &BoundingSphere) -> Aabb {
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = self.to_world.matrix3;
        let half = (x * x + y * y + z * z).map(f64::sqrt) * f64::from(sphere.radius);
        Aabb::from_centre(
            self.to_world
                .transform_point3(DVec3::from_array(sphere.centre.map(f64::from))),
            half,
        )
    }

    /// Maps a world-space ray to object space. The direction is *not* normalised. So distances
    /// along the ray are the same numbers in both spaces, and hits and ranges need no conversion.
    #[inline]
    pub fn ray_to_object(&self, prepared_ray: &PreparedRay) -> PreparedRay {
        let [origin, direction] = self.map_ray(prepared_ray);
        PreparedRay::from_mapped_ray(origin, direction, prepared_ray.is_camera_ray)
    }

    /// Returns the origin and the direction of [`Self::ray_to_object`].
    #[inline(always)]
    pub(crate) fn map_ray(&self, prepared_ray: &PreparedRay) -> [DVec3; 2] {
        // The translation is subtracted first, so that the map does not magnify the rounding of a
        // cancelled sum.
        let offset = prepared_ray.origin - self.to_world.translation;
        [self.inverse * offset, self.inverse * prepared_ray.direction]
    }

    /// Maps a surface point from object space to the world. Positions are mapped by the map, the
    /// normal by the inverse transpose. The normal points outward even if the map reflects. The
    /// error bound includes the magnification and the rounding of the map. It also includes the
    /// rounding of the inverse map for a later ray from the point.
    pub fn surface_point_to_world(&self, s: &SurfacePoint) -> SurfacePoint {
        let DAffine3 {
            matrix3: matrix,
            translation,
        } = self.to_world;
        let (sizes, mapped_point) = (matrix.abs(), matrix * s.point);
        let round_trip_size = sizes * (self.inverse.abs() * mapped_point.abs());
        let magnitude = sizes * s.point.abs().max(s.above.abs()).max(s.below.abs())
            + round_trip_size
            + translation.abs();
        SurfacePoint {
            point: mapped_point + translation,
            above: matrix * s.above + translation,
            below: matrix * s.below + translation,
            normal: self.normal_to_world(s.normal).normalize(),
            error: s.error * (sizes * DVec3::ONE).max_element()
                + magnitude.max_element() * (f64::ROUNDOFF * 16.0),
        }
    }

    /// Maps a normal by the inverse transpose, without normalising it.
    pub fn normal_to_world(&self, normal: DVec3) -> DVec3 {
        self.inverse.transpose_mul_vec3(normal)
    }

    /// Maps texture coordinates to the world. Only the derivative dp/du and the flag `mirrored`
    /// change.
    pub fn texture_coordinates_to_world<R: Real>(
        &self,
        s: &TextureCoordinates<R>,
    ) -> TextureCoordinates<R> {
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = self.to_world.matrix3;
        let dpdu = R::Vec3::from_f64(self.to_world.matrix3 * s.dpdu.to_f64());
        TextureCoordinates {
            dpdu,
            mirrored: s.mirrored != (x.dot(y.cross(z)) < 0.0),
            ..*s
        }
    }
}

/// Greatest number of refinement steps for an inverse. Each step gains as many correct digits as
/// the first inverse has. A map that is barely invertible in f64 has few.
const MAX_REFINEMENTS: usize = 24;

/// Condition number above which an inverse is refined.
const ILL_CONDITIONED: f64 = 100.0;

/// Inverts a matrix with an error of a few roundings of the inverse's greatest entry.
///
/// Elimination alone loses as many digits as the condition number has. Consider a map that
/// stretches by 1000 in one direction and shrinks by 1000 in another. Its inverse would be wrong in
/// the tenth digit, and the map magnifies that error again.
///
/// So each column x of the inverse is refined. A step adds to x the product of the first inverse
/// and the residual of x, which is summed without rounding ("Accuracy and Stability of Numerical
/// Algorithms", Higham, 2nd edition 2002, chapter 12).
fn invert_accurately(matrix: DMat3) -> DMat3 {
    let first = matrix.inverse();
    let norm = |m: DMat3| {
        (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt()
    };
    if norm(matrix) * norm(first) < ILL_CONDITIONED {
        return first;
    }
    let refined = |mut x: DVec3, unit: DVec3| {
        for _ in 0..MAX_REFINEMENTS {
            let better = x + first * compute_residual(matrix, x, unit);
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

/// Computes the residual b − M·x of a linear system with the matrix M. Products are exact, and
/// their sum is double-double.
fn compute_residual(matrix: DMat3, x: DVec3, b: DVec3) -> DVec3 {
    let row = |i: usize| {
        let taken =
            |sum: DoubleDouble, j: usize| sum + DoubleDouble::from_product(-matrix.col(j)[i], x[j]);
        (0..3).fold(DoubleDouble::from(b[i]), taken).to_f64()
    };
    DVec3::new(row(0), row(1), row(2))
}

/// Returns the axis-aligned box around the image of a box under an affine map.
pub fn transform_bounds(map: &DAffine3, bounds: &Aabb) -> Aabb {
    Aabb::from_points(bounds.corners().map(|c: DVec3| map.transform_point3(c)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A signed integer of the given number of bits (SplitMix64).
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

    /// Protects: the inverse of a map with condition number from 10² to 10¹⁵ has an error of a few
    /// roundings of its greatest entry, compared with quotients of 128-bit integers. Elimination
    /// alone loses as many digits as the condition number has.
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
                invert_accurately(DMat3::from_cols(columns[0], columns[1], columns[2])).transpose();
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
