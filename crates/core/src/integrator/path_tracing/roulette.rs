//! Russian roulette: paths of low throughput end by chance, and the throughput of surviving paths
//! is divided by their probability of survival.

use raywright_bvh::{Real, Vector};

use super::PathState;
use crate::settings::RouletteStart;

/// Number of segments after which a path of any throughput may end. Without this limit, paths in a
/// white room without absorption would never end. From here on a path has twenty more segments on
/// average; the depth limit may end the path earlier.
pub(super) const FORCED_ROULETTE_SEGMENTS: u32 = 64;

/// Greatest probability of survival from [`FORCED_ROULETTE_SEGMENTS`] segments on.
const FORCED_SURVIVAL: f64 = 0.95;

impl<R: Real> PathState<R> {
    /// Returns the upper limit on the survival probability at the path's next vertex; infinite if
    /// Russian roulette does not apply yet.
    #[inline(always)]
    pub fn max_survival(&self, roulette: RouletteStart) -> R {
        max_survival_after(self.segments_traced, roulette)
    }
}

/// Returns the upper limit on the survival probability after `traced` segments; infinite if Russian
/// roulette does not apply yet.
#[inline(always)]
pub(super) fn max_survival_after<R: Real>(traced: u32, roulette: RouletteStart) -> R {
    // Before the fourth segment, roulette adds more noise than it saves time in most scenes.
    let first = match roulette {
        RouletteStart::Early => 1,
        RouletteStart::Late => 4,
        RouletteStart::Off => FORCED_ROULETTE_SEGMENTS,
    };
    if traced < first {
        R::INFINITY
    } else if traced < FORCED_ROULETTE_SEGMENTS {
        R::ONE
    } else {
        R::from_f64(FORCED_SURVIVAL)
    }
}

/// Applies Russian roulette. Returns the new throughput, and whether the path survives.
///
/// The survival probability is the greatest component of the throughput, at most `maximum`. An
/// infinite `maximum` means no roulette. The function has no branches: the compiler can vectorise
/// it over several paths.
#[inline(always)]
pub(super) fn apply_roulette<R: Real>(
    throughput: R::Vec3,
    maximum: R,
    u_roulette: R,
) -> (R::Vec3, bool) {
    // NaN ends the path too, because every comparison with NaN is false.
    let survival = throughput.max_element().min(maximum);
    let may_end = maximum < R::INFINITY;
    let divided = throughput * (R::ONE / survival);
    let throughput = if may_end { divided } else { throughput };
    (
        throughput,
        (!may_end | (u_roulette < survival))
            & is_nonzero::<R>(throughput)
            & has_finite_components::<R>(throughput),
    )
}

/// Whether any component of a throughput is not zero; true for NaN.
#[inline(always)]
pub(super) fn is_nonzero<R: Real>(v: R::Vec3) -> bool {
    (v.x() != R::ZERO) | (v.y() != R::ZERO) | (v.z() != R::ZERO)
}

/// Whether all components of a throughput are finite. Otherwise the path's sample is invalid: it is
/// dropped and counted.
#[inline(always)]
pub(super) fn has_finite_components<R: Real>(v: R::Vec3) -> bool {
    let (x, y, z) = (Real::abs(v.x()), Real::abs(v.y()), Real::abs(v.z()));
    (x < R::INFINITY) & (y < R::INFINITY) & (z < R::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Protects: survivors count for ended paths: the mean over all numbers is the original
    /// throughput, for any colour; zero and non-finite throughputs end without roulette too.
    #[test]
    fn m07_survivors_count_for_what_ends() {
        const COUNT: u32 = 10_000;
        for (throughput, maximum) in [
            (DVec3::new(0.3, 0.1, 0.05), 1.0),
            (DVec3::new(3.0, 1.0, 0.5), 0.95),
            (DVec3::new(3.0, 1.0, 0.5), 1.0),
            (DVec3::new(0.3, 0.1, 0.0), f64::INFINITY),
        ] {
            let each = (0..COUNT).map(|i| {
                apply_roulette::<f64>(throughput, maximum, (f64::from(i) + 0.5) / f64::from(COUNT))
            });
            let (mut sum, mut ended) = (DVec3::ZERO, 0);
            for (throughput, continues) in each {
                sum += if continues { throughput } else { DVec3::ZERO };
                ended += u32::from(!continues);
            }
            let off = (sum / f64::from(COUNT) - throughput).abs().max_element();
            assert!(
                off < 1e-3 * throughput.max_element(),
                "{throughput} at {maximum}: {off} off"
            );
            let requested = if maximum == f64::INFINITY {
                0.0
            } else {
                1.0 - throughput.x.min(maximum)
            };
            assert!(
                (f64::from(ended) / f64::from(COUNT) - requested).abs() < 1e-3,
                "{throughput} at {maximum}: {ended} ended"
            );
        }
        for nothing in [
            DVec3::ZERO,
            DVec3::NAN,
            DVec3::new(1.0, f64::NAN, 0.0),
            DVec3::INFINITY,
        ] {
            assert!(
                [1.0, f64::INFINITY]
                    .iter()
                    .all(|&maximum| !apply_roulette::<f64>(nothing, maximum, 0.0).1),
                "{nothing}"
            );
        }
    }

    /// Tests throughputs from a thousandth to 1e-30, or nearly one: the survival probability is
    /// above zero and at most one, and survivors count for ended paths to within rounding.
    fn is_unbiased<R: Real>() {
        for (share, maximum) in [1e-3, 1e-10, 1e-20, 1e-30, 0.999_999, 1.0, 7.0]
            .into_iter()
            .flat_map(|share| [(share, 1.0), (share, FORCED_SURVIVAL)])
        {
            let throughput = R::Vec3::from_f64(DVec3::new(share, 0.5 * share, 0.0));
            let survival = R::from_f64(share).min(R::from_f64(maximum));
            let below = R::from_f64(survival.to_f64() * (1.0 - 1e-6));
            let (left, continues) = apply_roulette::<R>(throughput, R::from_f64(maximum), below);
            assert!(
                continues && survival > R::ZERO && survival <= R::ONE,
                "{share:e} at {maximum}"
            );
            let mean = left.to_f64() * survival.to_f64();
            let off = (mean - throughput.to_f64()).abs().max_element() / share;
            assert!(
                off <= 4.0 * R::ROUNDOFF.to_f64(),
                "{share:e} at {maximum}: {off:e} off"
            );
            assert!(
                !apply_roulette::<R>(throughput, R::from_f64(maximum), survival).1,
                "{share:e} at {maximum} never ends"
            );
        }
    }

    /// Protects: roulette is unbiased for very low and very high throughput, in both precisions;
    /// and at any brightness, a path may end from the 64th segment on, by every rule.
    #[test]
    fn m07_next_to_nothing_and_all() {
        is_unbiased::<f32>();
        is_unbiased::<f64>();
        for rule in [
            RouletteStart::Early,
            RouletteStart::Late,
            RouletteStart::Off,
        ] {
            let may_end = |maximum: f64| maximum > 0.0 && maximum < 1.0;
            assert!(
                (FORCED_ROULETTE_SEGMENTS..200)
                    .all(|traced| may_end(max_survival_after(traced, rule))),
                "{rule:?}"
            );
        }
    }
}
