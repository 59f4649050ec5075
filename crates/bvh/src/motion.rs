//! How an instance moves: its map at a time, and whether that has an inverse at every time.

use glam::{DAffine3, DMat3, DVec3};

use crate::error::GeometryError;
use crate::math::double_double::DoubleDouble;
use crate::shapes::Transform;

/// A map that runs from one at time 0 to another at time 1, each entry of it linearly.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    ends: [DAffine3; 2],
}

impl Motion {
    /// From one end to the other, each of which has an inverse.
    ///
    /// # Errors
    /// [`GeometryError::SingularOnTheWay`] where it can't be inverted, or can't be told from one
    /// that can't, at any time from 0 to 1; [`GeometryError::NotFinite`] for ends that are too far
    /// apart.
    pub fn new(ends: [DAffine3; 2]) -> Result<Self, GeometryError> {
        let motion = Self { ends };
        // What lies further apart than the greatest number has nothing halfway.
        if !motion.map(0.5).is_finite() {
            return Err(GeometryError::NotFinite);
        }
        let invertible = keeps_sign(determinants(ends.map(|end| end.matrix3)), HALVINGS);
        invertible
            .then_some(motion)
            .ok_or(GeometryError::SingularOnTheWay)
    }

    /// The map at a time, before 0 as at 0, after 1 as at 1. With an accurate inverse, as
    /// the map of an instance that stands there: both are hit with the same bits.
    #[inline(never)]
    pub(crate) fn at(&self, time: f64) -> Transform {
        Transform::of_invertible(self.map(time.clamp(0.0, 1.0)))
    }

    /// The map at a time from 0 to 1. Each entry is the exact one, rounded: it is summed in twice
    /// the precision. So it is wrong by a rounding of itself, also where the thing passes the
    /// origin on its way from far to far, and what bounds the error of a place under any map of f64
    /// holds here without a margin of its own. At both ends it is that end's, and what both have in
    /// common stays.
    pub fn map(&self, time: f64) -> DAffine3 {
        let [start, end] = self.ends.map(|end| end.to_cols_array());
        let entry = |i: usize| {
            (DoubleDouble::from(start[i])
                + (DoubleDouble::from(end[i]) + DoubleDouble::from(-start[i])) * time)
                .rounded()
        };
        DAffine3::from_cols_array(&core::array::from_fn(entry))
    }
}

/// How often the way is halved at most to tell the sign of the determinant. Far more than it takes:
/// where that comes near to zero, the bounds of the errors end it after some thirty.
const HALVINGS: u32 = 64;

/// A number with a bound on its error.
#[derive(Clone, Copy, Debug)]
struct Bounded {
    value: f64,
    error: f64,
}

impl Bounded {
    /// Whether it is surely above zero (`1`), or surely below (`-1`). Never for NaN.
    fn surely(&self, sign: f64) -> bool {
        self.value * sign > self.error
    }

    /// Halfway between two.
    fn middle(a: Self, b: Self) -> Self {
        let value = 0.5 * (a.value + b.value);
        Self {
            value,
            error: 0.5 * (a.error + b.error) + value.abs() * f64::EPSILON,
        }
    }
}

/// x·(y × z) in twice the precision, and the sum of the sizes of its products, of which it is wrong
/// by a share below 2⁻⁹⁶.
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
                sum + DoubleDouble::product(y[j], z[k]) * (sign * x[i]),
                size + (x[i] * y[j] * z[k]).abs(),
            )
        })
}

/// The determinant of the map on the way is a cubic in time: its coefficients over Bernstein's
/// polynomials. The determinant is linear in each column, so each coefficient is the mean of the
/// determinants of all choices of so many columns from the end.
fn determinants(ends: [DMat3; 2]) -> [Bounded; 4] {
    let mut sums = [(DoubleDouble::default(), 0.0); 4];
    for choice in 0..8_usize {
        let (value, size) =
            determinant([0, 1, 2].map(|column| ends[choice >> column & 1].col(column)));
        let sum = &mut sums[choice.count_ones() as usize];
        *sum = (sum.0 + value, sum.1 + size);
    }
    let choices = [1.0, 3.0, 3.0, 1.0];
    core::array::from_fn(|i| {
        let value = sums[i].0.rounded() / choices[i];
        Bounded {
            value,
            error: sums[i].1 * 2_f64.powi(-96) + value.abs() * f64::EPSILON,
        }
    })
}

/// Whether a cubic is surely on one side of zero between 0 and 1. It lies between its least and its
/// greatest coefficient over Bernstein's polynomials; where those do not tell, its halves are asked
/// ("Curves and Surfaces for CAGD", Farin, 5th edition 2002, chapters 5 and 6: de Casteljau). What
/// is zero up to the errors of the coefficients, or may be on both sides, is not.
fn keeps_sign(b: [Bounded; 4], halvings: u32) -> bool {
    let on_side = |sign: f64| {
        (
            b.iter().all(|b| b.surely(sign)),
            b[0].surely(sign) && b[3].surely(sign),
        )
    };
    let (above, below) = (on_side(1.0), on_side(-1.0));
    if above.0 || below.0 {
        return true;
    }
    // The first and the last coefficient are the cubic's values at both ends.
    if !(above.1 || below.1) || halvings == 0 {
        return false;
    }
    let [ab, bc, cd] = [0, 1, 2].map(|i| Bounded::middle(b[i], b[i + 1]));
    let (abc, bcd) = (Bounded::middle(ab, bc), Bounded::middle(bc, cd));
    let half = Bounded::middle(abc, bcd);
    keeps_sign([b[0], ab, abc, half], halvings - 1)
        && keeps_sign([half, bcd, cd, b[3]], halvings - 1)
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

    /// Protects: a map without an inverse at any time on the way is refused, at a time that halving
    /// meets and at one that it does not, where the determinant passes zero and where it only
    /// touches it, of any size and however flat the thing is; one that merely comes near is not,
    /// nor one that grows from next to nothing.
    #[test]
    fn singular_on_the_way() {
        let scale = |x: f64, y: f64, z: f64| DAffine3::from_scale(DVec3::new(x, y, z));
        let (one, on_the_way) = (DAffine3::IDENTITY, Some(GeometryError::SingularOnTheWay));
        for flat in [
            one,
            scale(1e6, 1e-6, 1.0) * turn(40.0),
            scale(1e-20, 1e-20, 1e-20),
            scale(1e20, 1e19, -1e20),
        ] {
            for (end, expected) in [
                // Touches zero halfway, at 1/3 and at 3/4; crosses there; crosses twice and comes
                // back.
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

    /// Protects: ends that are too far apart for a number between them.
    #[test]
    fn nothing_between_ends_without_end() {
        let far = DAffine3::from_translation(DVec3::X * 1.5e308);
        assert_eq!(refused(far, far.inverse()), Some(GeometryError::NotFinite));
    }

    /// Protects: an entry on the way is the exact one, rounded, against whole numbers of 128 bits,
    /// also where almost all of it cancels; both ends are met exactly, and what both have in common
    /// stays.
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
            // Such an end that the way passes zero at about that time.
            let to = (-i128::from(from) * ((1 << 24) - i128::from(time)) / i128::from(time.max(1)))
                .clamp(-(1 << 53), 1 << 53);
            let exact = i128::from(from) * ((1 << 24) - i128::from(time)) + to * i128::from(time);
            cancelled += u32::from(exact.abs() < 1 << 25);
            let [start, end] =
                [from as f64, to as f64].map(|x| DAffine3::from_translation(DVec3::new(x, 0.1, x)));
            let motion = Motion::new([start, end]).unwrap();
            let found = motion.map(time as f64 * unit);
            assert_eq!(
                found.translation,
                DVec3::new(exact as f64 * unit, 0.1, exact as f64 * unit),
                "{from} {to} {time}"
            );
            assert_eq!((motion.map(0.0), motion.map(1.0)), (start, end));
        }
        assert!(cancelled > 1000, "{cancelled}");
        let ends = [DAffine3::from_quat(DQuat::from_rotation_x(0.7)), turn(33.0)];
        let motion = Motion::new(ends).unwrap();
        assert_eq!((motion.map(0.0), motion.map(1.0)), (ends[0], ends[1]));
    }
}
