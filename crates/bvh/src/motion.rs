//! Motion of an instance: its map at a given time, and a proof that the map has an inverse at every
//! time.

use glam::{DAffine3, DMat3, DVec3};

use crate::error::GeometryError;
use crate::math::double_double::DoubleDouble;
use crate::shapes::Transform;

/// Motion of an instance: an object-to-world map that changes from time 0 to time 1. Each matrix
/// entry is interpolated linearly.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    ends: [DAffine3; 2],
}

impl Motion {
    /// Creates the motion between two invertible maps.
    ///
    /// # Errors
    /// - [`GeometryError::SingularDuringMotion`] if the interpolated map has no inverse at some
    ///   time in [0, 1], or if the proof of its inverse fails.
    /// - [`GeometryError::NotFinite`] if the entries of the two maps differ by more than the range
    ///   of f64.
    pub fn new(ends: [DAffine3; 2]) -> Result<Self, GeometryError> {
        let motion = Self { ends };
        // The midpoint of ends further apart than the greatest f64 is not finite.
        if !motion.map_at(0.5).is_finite() {
            return Err(GeometryError::NotFinite);
        }
        let invertible = has_constant_sign(
            bernstein_coefficients(ends.map(|end| end.matrix3)),
            MAX_BISECTIONS,
        );
        invertible
            .then_some(motion)
            .ok_or(GeometryError::SingularDuringMotion)
    }

    /// Returns the transform at a time, clamped to [0, 1], with an accurate inverse. A ray hits the
    /// instance with the same bits as an instance at rest under this transform.
    #[inline(never)]
    pub(crate) fn transform_at(&self, time: f64) -> Transform {
        Transform::from_invertible(self.map_at(time.clamp(0.0, 1.0)))
    }

    /// Returns the map at a time in [0, 1]. Each entry is the exact interpolated value, rounded
    /// once, since the sum is computed in double-double arithmetic. So the error bounds of a
    /// constant map hold for a moving map too, even near the origin between distant maps. At times
    /// 0 and 1 the result is exactly the given map. Entries that are equal in both maps stay
    /// constant.
    pub fn map_at(&self, time: f64) -> DAffine3 {
        let [start, end] = self.ends.map(|end| end.to_cols_array());
        let entry = |i: usize| {
            (DoubleDouble::from(start[i])
                + (DoubleDouble::from(end[i]) + DoubleDouble::from(-start[i])) * time)
                .to_f64()
        };
        DAffine3::from_cols_array(&core::array::from_fn(entry))
    }
}

/// Greatest number of bisections of the time interval [0, 1] in the proof of a constant sign. About
/// thirty suffice: near a zero the error bounds end the recursion.
const MAX_BISECTIONS: u32 = 64;

/// An f64 number and an upper bound of its absolute error.
#[derive(Clone, Copy, Debug)]
struct BoundedValue {
    value: f64,
    error: f64,
}

impl BoundedValue {
    /// Whether the exact value certainly has the given sign, 1 or −1. False for NaN.
    fn has_sign(&self, sign: f64) -> bool {
        self.value * sign > self.error
    }

    /// Computes the midpoint of two numbers, with its error bound.
    fn midpoint(a: Self, b: Self) -> Self {
        let value = 0.5 * (a.value + b.value);
        Self {
            value,
            error: 0.5 * (a.error + b.error) + value.abs() * f64::EPSILON,
        }
    }
}

/// Computes the determinant x·(y × z) in double-double arithmetic. Also returns the sum of the
/// absolute values of its six products. The error of the determinant is below 2⁻⁹⁶ of that sum.
fn determinant([x, y, z]: [DVec3; 3]) -> (DoubleDouble, f64) {
    let terms = [
        (0, 1, 2, 1.0),
        (1, 2, 0, 1.0),
        (2, 0, 1, 1.0),
        (0, 2, 1, -1.0),
        (1, 0, 2, -1.0),
        (2, 1, 0, -1.0),
    ];
    terms
        .into_iter()
        .fold(Default::default(), |(sum, size), (i, j, k, sign)| {
            (
                sum + DoubleDouble::from_product(y[j], z[k]) * (sign * x[i]),
                size + (x[i] * y[j] * z[k]).abs(),
            )
        })
}

/// Computes the four Bernstein coefficients of the interpolated map's determinant, a cubic
/// polynomial in time. The determinant is linear in each column of the map. So coefficient i is a
/// mean of determinants: over all choices of i columns from the end map, with the other columns
/// from the start map.
fn bernstein_coefficients(ends: [DMat3; 2]) -> [BoundedValue; 4] {
    let mut sums = [(DoubleDouble::default(), 0.0); 4];
    for choice in 0..8_usize {
        let (value, size) =
            determinant([0, 1, 2].map(|column| ends[choice >> column & 1].col(column)));
        let sum = &mut sums[choice.count_ones() as usize];
        *sum = (sum.0 + value, sum.1 + size);
    }
    let choices = [1.0, 3.0, 3.0, 1.0];
    core::array::from_fn(|i| {
        let value = sums[i].0.to_f64() / choices[i];
        BoundedValue {
            value,
            error: sums[i].1 * 2_f64.powi(-96) + value.abs() * f64::EPSILON,
        }
    })
}

/// Whether a cubic polynomial certainly has the same sign on all of [0, 1]. `b` holds its Bernstein
/// coefficients. The cubic lies between the least and the greatest coefficient. If these differ in
/// sign, the interval is halved by de Casteljau's algorithm, and each half is examined ("Curves and
/// Surfaces for CAGD", Farin, 5th edition 2002, chapters 5 and 6). At most `halvings` bisections
/// are nested. Returns false if the sign may change, or if the cubic is zero within its error
/// bounds.
fn has_constant_sign(b: [BoundedValue; 4], halvings: u32) -> bool {
    let on_side = |sign: f64| {
        (
            b.iter().all(|b| b.has_sign(sign)),
            b[0].has_sign(sign) && b[3].has_sign(sign),
        )
    };
    let (above, below) = (on_side(1.0), on_side(-1.0));
    if above.0 || below.0 {
        return true;
    }
    // The first and the last coefficient are the cubic's values at the ends.
    if !(above.1 || below.1) || halvings == 0 {
        return false;
    }
    let [ab, bc, cd] = [0, 1, 2].map(|i| BoundedValue::midpoint(b[i], b[i + 1]));
    let (abc, bcd) = (
        BoundedValue::midpoint(ab, bc),
        BoundedValue::midpoint(bc, cd),
    );
    let half = BoundedValue::midpoint(abc, bcd);
    has_constant_sign([b[0], ab, abc, half], halvings - 1)
        && has_constant_sign([half, bcd, cd, b[3]], halvings - 1)
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DQuat, DVec3};

    use super::Motion;
    use crate::error::GeometryError;

    fn refused(start: DAffine3, end: DAffine3) -> Option<GeometryError> {
        Motion::new([start, end]).err()
    }

    fn turn(degrees: f64) -> DAffine3 {
        DAffine3::from_axis_angle(DVec3::new(0.3, -0.5, 0.8).normalize(), degrees.to_radians())
    }

    /// Protects: a motion that is singular at any time is refused. The cases are times that
    /// bisection reaches and other times, zeros that the determinant crosses and zeros that it only
    /// touches, at any scale and flatness. A motion that only comes near to a singular map, or
    /// grows from almost nothing, is accepted.
    #[test]
    fn maps_singular_during_motion() {
        let scale = |x: f64, y: f64, z: f64| DAffine3::from_scale(DVec3::new(x, y, z));
        let (one, on_the_way) = (
            DAffine3::IDENTITY,
            Some(GeometryError::SingularDuringMotion),
        );
        for flat in [
            one,
            scale(1e6, 1e-6, 1.0) * turn(40.0),
            scale(1e-20, 1e-20, 1e-20),
            scale(1e20, 1e19, -1e20),
        ] {
            for (end, expected) in [
                // The determinant touches zero at 1/2, 1/3 and 3/4; crosses zero at 1/2 and 1/3;
                // and crosses zero twice.
                (scale(-1.0, -1.0, 1.0), on_the_way),
                (scale(-2.0, -2.0, 1.0), on_the_way),
                (scale(-1.0 / 3.0, 5.0, -1.0 / 3.0), on_the_way),
                (scale(1.0, -1.0, 1.0), on_the_way),
                (scale(-2.0, 1.0, 1.0), on_the_way),
                (scale(-1.0, -1.000_001, 1.0), on_the_way),
                (scale(1e-12, 1e-12, 1e-12), None),
                (scale(1.0, 3.0, 0.5), None),
            ] {
                assert_eq!(refused(flat, flat * end), expected, "{flat} to {end}");
                assert_eq!(refused(flat * end, flat), expected, "{end} to {flat}");
            }
        }
        assert_eq!(refused(turn(20.0), turn(200.0)), on_the_way);
        assert_eq!(refused(turn(20.0), turn(199.9)), None);
        let thin = turn(70.0) * scale(1e6, 1e-6, 1.0) * turn(40.0);
        assert_eq!(
            refused(thin, DAffine3::from_translation(DVec3::X) * thin),
            None
        );
        assert_eq!(refused(thin, turn(50.0) * thin), None);
    }

    /// Protects: ends too far apart for a finite midpoint are refused.
    #[test]
    fn nothing_between_ends_without_end() {
        let far = DAffine3::from_translation(DVec3::X * 1.5e308);
        assert_eq!(refused(far, far.inverse()), Some(GeometryError::NotFinite));
    }

    /// Protects: an interpolated entry is the exact value rounded once, compared with 128-bit
    /// integers, even under heavy cancellation. Both ends are exact, and equal entries stay
    /// constant.
    #[test]
    fn entries_are_rounded_once() {
        let (unit, mut state, mut cancelled) = (2_f64.powi(-24), 1_u64, 0);
        let mut whole = |bits: u32| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> (64 - bits)) as i64
        };
        for _ in 0..5000 {
            let (time, from) = (whole(24), whole(52));
            // The end is chosen so that the motion passes zero at about that time.
            let to = (-i128::from(from) * ((1 << 24) - i128::from(time)) / i128::from(time.max(1)))
                .clamp(-(1 << 53), 1 << 53);
            let exact = i128::from(from) * ((1 << 24) - i128::from(time)) + to * i128::from(time);
            cancelled += u32::from(exact.abs() < 1 << 25);
            let [start, end] =
                [from as f64, to as f64].map(|x| DAffine3::from_translation(DVec3::new(x, 0.1, x)));
            let motion = Motion::new([start, end]).unwrap();
            let found = motion.map_at(time as f64 * unit);
            assert_eq!(
                found.translation,
                DVec3::new(exact as f64 * unit, 0.1, exact as f64 * unit),
                "{from} {to} {time}"
            );
            assert_eq!((motion.map_at(0.0), motion.map_at(1.0)), (start, end));
        }
        assert!(cancelled > 1000, "{cancelled}");
        let ends = [DAffine3::from_quat(DQuat::from_rotation_x(0.7)), turn(33.0)];
        let motion = Motion::new(ends).unwrap();
        assert_eq!((motion.map_at(0.0), motion.map_at(1.0)), (ends[0], ends[1]));
    }
}
