//! Lobes of a sky whose integrals have a closed form: importance sampling of directions, and
//! densities.

use core::f64::consts::TAU;

use glam::DVec3;
use raywright_bvh::{Real, SimdTask, run_widest};

use super::grid::PolarDirection;
use crate::number::{expm1, log1p, sines_and_cosines};

/// Number of directions sampled together.
const LANES: usize = 8;

/// A lobe of a sky, normalised by its integral in closed form.
#[derive(Clone, Copy, Debug)]
pub(super) enum SkyLobe {
    /// Radiance that is linear in the height of the direction: `bottom` at the nadir, `top` at the
    /// zenith.
    Linear { bottom: f64, top: f64 },
    /// Radiance proportional to cosⁿ, with the cosine of the angle to `axis` and n = `exponent`.
    Power { axis: DVec3, exponent: u32 },
}

impl SkyLobe {
    /// Samples a unit direction in proportion to the lobe's radiance, for two uniform numbers in
    /// [0, 1).
    pub fn sample_direction(&self, [u, v]: [f64; 2]) -> DVec3 {
        match *self {
            Self::Linear { bottom, top } => {
                // The inverse of the integral of a linear density, without cancellation.
                let root = (bottom * bottom * (1.0 - u) + top * top * u).sqrt();
                let height =
                    2.0 * u * (bottom + top) / (bottom + root).max(f64::MIN_POSITIVE) - 1.0;
                PolarDirection::at_height(height, v).to_direction()
            }
            Self::Power { axis, exponent } => {
                let mut waiting = PowerLobeLanes::<1>::default();
                waiting.push_lobe(axis, exponent, [u, v]);
                let [x, y, z] = PowerLobeLanes::run(waiting).map(|[x]| x);
                DVec3::new(x, y, z)
            }
        }
    }

    /// Returns the density by solid angle of a unit direction.
    pub fn density(&self, direction: DVec3) -> f64 {
        match *self {
            Self::Linear { bottom, top } => {
                let s = (0.5 * (direction.y + 1.0)).clamp(0.0, 1.0);
                (bottom * (1.0 - s) + top * s) / (bottom + top).max(f64::MIN_POSITIVE) / TAU
            }
            Self::Power { axis, exponent } => {
                let cosine = axis.dot(direction).clamp(0.0, 1.0);
                (f64::from(exponent) + 1.0) / TAU * Real::powi(cosine, exponent)
            }
        }
    }
}

/// Samples a direction of each lobe as [`SkyLobe::sample_direction`] does, and appends the
/// directions in order. Faster than single calls: several power lobes are sampled together.
pub(super) fn sample_directions<'a>(
    drawn: impl Iterator<Item = (&'a SkyLobe, [f64; 2])>,
    out: &mut Vec<DVec3>,
) {
    let mut waiting = PowerLobeLanes::<LANES>::default();
    let mut places = [0; LANES];
    let flush =
        |waiting: &mut PowerLobeLanes<LANES>, places: &[usize; LANES], out: &mut Vec<DVec3>| {
            let [x, y, z] = run_widest(*waiting);
            for (lane, &index) in places.iter().enumerate().take(waiting.len) {
                out[index] = DVec3::new(x[lane], y[lane], z[lane]);
            }
            waiting.len = 0;
        };
    for (lobe, numbers) in drawn {
        if let SkyLobe::Power { axis, exponent } = *lobe {
            places[waiting.len] = out.len();
            waiting.push_lobe(axis, exponent, numbers);
            out.push(axis);
        } else {
            out.push(lobe.sample_direction(numbers));
        }
        if waiting.len == LANES {
            flush(&mut waiting, &places, out);
        }
    }
    if waiting.len > 0 {
        flush(&mut waiting, &places, out);
    }
}

/// Power lobes to be sampled together in SIMD lanes, each with two uniform numbers in [0, 1).
#[derive(Clone, Copy)]
struct PowerLobeLanes<const N: usize> {
    len: usize,
    axis: [[f64; N]; 3],
    exponent: [f64; N],
    numbers: [[f64; N]; 2],
}

impl<const N: usize> Default for PowerLobeLanes<N> {
    fn default() -> Self {
        Self {
            len: 0,
            axis: [[1.0; N]; 3],
            exponent: [0.0; N],
            numbers: [[0.0; N]; 2],
        }
    }
}

impl<const N: usize> PowerLobeLanes<N> {
    #[inline(always)]
    fn push_lobe(&mut self, axis: DVec3, exponent: u32, [u, v]: [f64; 2]) {
        let lane = self.len;
        self.len += 1;
        (self.axis[0][lane], self.axis[1][lane], self.axis[2][lane]) = (axis.x, axis.y, axis.z);
        self.exponent[lane] = exponent.into();
        (self.numbers[0][lane], self.numbers[1][lane]) = (u, v);
    }
}

impl<const N: usize> SimdTask for PowerLobeLanes<N> {
    type Output = [[f64; N]; 3];
    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut turns = [0.0; N];
        for (turn, v) in turns.iter_mut().zip(self.numbers[1]) {
            *turn = TAU * v;
        }
        let [sines, cosines] = sines_and_cosines(turns);
        let mut out = [[0.0; N]; 3];
        for i in 0..N {
            // 1 − cos, which keeps its digits where the lobe is narrow.
            let h = -expm1(log1p(-self.numbers[0][i]) / (self.exponent[i] + 1.0));
            let rest = h * (2.0 - h);
            let ring = (if rest > 0.0 { rest } else { 0.0 }).sqrt();
            let axis = DVec3::new(self.axis[0][i], self.axis[1][i], self.axis[2][i]);
            let (x, y) = axis.any_orthonormal_pair();
            let direction = axis * (1.0 - h) + (x * cosines[i] + y * sines[i]) * ring;
            (out[0][i], out[1][i], out[2][i]) = (direction.x, direction.y, direction.z);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: lobes of a sky are sampled by their density, suns of every width too. The share of
    /// numbers between two directions over the solid angle between them lies between the two
    /// densities, since a lobe is monotonic.
    #[test]
    fn m02_lobes_of_a_sky_are_as_dense_as_drawn() {
        const STEPS: u32 = 1000;
        let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
        let suns = [0, 1, 2, 7, 30, 1000, 1_000_000]
            .map(|exponent| (SkyLobe::Power { axis, exponent }, axis));
        let linear = [[0.0, 1.0], [3.0, 1.0], [2.0, 2.0]]
            .map(|[bottom, top]| (SkyLobe::Linear { bottom, top }, DVec3::NEG_Y));
        for (lobe, axis) in suns.into_iter().chain(linear) {
            let at = |step: u32| {
                let direction = lobe.sample_direction([f64::from(step) / f64::from(STEPS), 0.3]);
                // 1 − cos of the angle to the axis, with its digits.
                (
                    0.5 * (direction - axis).length_squared(),
                    lobe.density(direction),
                )
            };
            for step in 0..STEPS - 1 {
                let ((from, first), (to, second)) = (at(step), at(step + 1));
                let drawn = 1.0 / (f64::from(STEPS) * TAU * (to - from));
                let (minimum, maximum) = (
                    first.min(second) * (1.0 - 1e-6),
                    first.max(second) * (1.0 + 1e-6),
                );
                assert!(
                    (minimum..=maximum).contains(&drawn),
                    "{lobe:?}, {step}: {drawn} is not within {minimum} and {maximum}"
                );
            }
        }
    }
}
