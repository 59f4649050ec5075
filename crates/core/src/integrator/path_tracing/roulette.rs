//! Russian roulette: chance ends paths that carry little, and those that go on count for them.

use raywright_bvh::{Real, Vector};

use super::PathState;
use crate::settings::Roulette;

/// From so many segments on a path ends by chance however bright it is, so that one in a white room, of which nothing is ever lost, has an end
/// too: twenty more on average. Paths that are limited end before.
const ENDS_FROM: u32 = 64;

/// Chance to go on from there.
const GOES_ON: f64 = 0.95;

impl<R: Real> PathState<R> {
    /// The greatest chance to go on at the vertex in the making; infinite where chance has no say.
    #[inline(always)]
    pub fn most_survival(&self, roulette: Roulette) -> R {
        // Before the fourth segment, chance costs more noise than it saves time in most scenes.
        let first = match roulette {
            Roulette::Early => 1,
            Roulette::Late => 4,
            Roulette::Off => ENDS_FROM,
        };
        if self.traced < first {
            R::INFINITY
        } else if self.traced < ENDS_FROM {
            R::ONE
        } else {
            R::from_f64(GOES_ON)
        }
    }
}

/// What a path counts that goes on by a chance of at most so much, and whether it does; chance has no say where that is infinite. Without a
/// branch, for several side by side.
#[inline(always)]
pub(super) fn survive<R: Real>(throughput: R::Vec3, most: R, u_roulette: R) -> (R::Vec3, bool) {
    // Also ends what is no number.
    let survival = throughput.max_element().min(most);
    let may_end = most < R::INFINITY;
    let divided = throughput * (R::ONE / survival);
    let throughput = if may_end { divided } else { throughput };
    (throughput, (!may_end | (u_roulette < survival)) & is_some::<R>(throughput) & is_number::<R>(throughput))
}

/// Whether something is left of what light brings, a number or not.
#[inline(always)]
pub(super) fn is_some<R: Real>(v: R::Vec3) -> bool {
    (v.x() != R::ZERO) | (v.y() != R::ZERO) | (v.z() != R::ZERO)
}

/// Whether it is a number. A path that carries none makes its sample none, which is then dropped and counted.
#[inline(always)]
pub(super) fn is_number<R: Real>(v: R::Vec3) -> bool {
    let (x, y, z) = (Real::abs(v.x()), Real::abs(v.y()), Real::abs(v.z()));
    (x < R::INFINITY) & (y < R::INFINITY) & (z < R::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Protects: of what chance ends, the rest counts for it: the mean over all numbers is what came, whatever the colour; what carries
    /// nothing, or is no number, ends without it too.
    #[test]
    fn m07_survivors_count_for_what_ends() {
        const COUNT: u32 = 10_000;
        for (throughput, most) in [
            (DVec3::new(0.3, 0.1, 0.05), 1.0),
            (DVec3::new(3.0, 1.0, 0.5), 0.95),
            (DVec3::new(3.0, 1.0, 0.5), 1.0),
            (DVec3::new(0.3, 0.1, 0.0), f64::INFINITY),
        ] {
            let each = (0..COUNT).map(|i| survive::<f64>(throughput, most, (f64::from(i) + 0.5) / f64::from(COUNT)));
            let (mut sum, mut ended) = (DVec3::ZERO, 0);
            for (throughput, goes_on) in each {
                sum += if goes_on { throughput } else { DVec3::ZERO };
                ended += u32::from(!goes_on);
            }
            let off = (sum / f64::from(COUNT) - throughput).abs().max_element();
            assert!(off < 1e-3 * throughput.max_element(), "{throughput} at {most}: {off} off");
            let wanted = if most == f64::INFINITY { 0.0 } else { 1.0 - throughput.x.min(most) };
            assert!((f64::from(ended) / f64::from(COUNT) - wanted).abs() < 1e-3, "{throughput} at {most}: {ended} ended");
        }
        for nothing in [DVec3::ZERO, DVec3::NAN, DVec3::new(1.0, f64::NAN, 0.0), DVec3::INFINITY] {
            assert!([1.0, f64::INFINITY].iter().all(|&most| !survive::<f64>(nothing, most, 0.0).1), "{nothing}");
        }
    }
}
