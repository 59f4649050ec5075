//! Russian roulette: paths of low throughput end by chance, and the throughput of surviving paths
//! is divided by their probability of survival.

use raywright_bvh::{Real, Vector};

use super::PathState;
use crate::settings::RouletteStart;

/// Number of segments after which a path of any throughput may end. Without this limit, paths in a
/// white room without absorption would never end. From here on a path has twenty more segments on
/// average; the depth limit may end the path earlier.
pub(super) const FORCED_ROULETTE_SEGMENTS: u32 = 64;

/// Greatest probability of survival from [`FORCED_ROULETTE_SEGMENTS`] segments on, before the next
/// surface absorbs.
const FORCED_SURVIVAL: f64 = 0.95;

impl<R: Real> PathState<R> {
    /// Returns the survival scale at the path's next vertex, see [`survival_scale`].
    #[inline(always)]
    pub fn survival_scale(&self, roulette: RouletteStart) -> R {
        survival_scale(self.segments_traced, self.throughput, roulette)
    }
}

/// Returns the factor from a path's throughput to its probability of survival after `traced`
/// segments; infinite if Russian roulette does not apply yet. `throughput` is that of the path
/// before its next surface.
///
/// By default a path goes on for certain while its throughput is a half or more. With the
/// probability of its absorption alone, a path through glass to a grey floor would end there in
/// 40 % of all cases: time to equal noise is .56 of that in such a scene, and .94 in the mean of 26
/// (`benches/runs/2026-12-01-roulette.md`).
#[inline(always)]
pub(super) fn survival_scale<R: Real>(
    traced: u32,
    throughput: R::Vec3,
    roulette: RouletteStart,
) -> R {
    let (first, scale) = match roulette {
        RouletteStart::Early => (1, R::ONE),
        RouletteStart::Late => (3, R::ONE + R::ONE),
        RouletteStart::Off => (FORCED_ROULETTE_SEGMENTS, R::ONE),
    };
    if traced < first {
        R::INFINITY
    } else if traced < FORCED_ROULETTE_SEGMENTS {
        scale
    } else {
        scale.min(R::from_f64(FORCED_SURVIVAL) / throughput.max_element())
    }
}

/// Applies Russian roulette. Returns the new throughput, and whether the path survives.
///
/// The survival probability is the greatest component of the throughput, times `scale`, at most
/// one. An infinite `scale` means no roulette. The function has no branches: the compiler can
/// vectorise it over several paths.
#[inline(always)]
pub(super) fn apply_roulette<R: Real>(
    throughput: R::Vec3,
    scale: R,
    u_roulette: R,
) -> (R::Vec3, bool) {
    let survival = (throughput.max_element() * scale).min(R::ONE);
    let divided = throughput * (R::ONE / survival);
    // NaN ends the path too, because every comparison with NaN is false.
    (
        divided,
        (u_roulette < survival) & is_nonzero::<R>(divided) & has_finite_components::<R>(divided),
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
        for (throughput, scale) in [
            (DVec3::new(0.3, 0.1, 0.05), 1.0),
            (DVec3::new(0.3, 0.1, 0.05), 2.0),
            (DVec3::new(0.6, 0.1, 0.05), 2.0),
            (DVec3::new(3.0, 1.0, 0.5), 0.3),
            (DVec3::new(3.0, 1.0, 0.5), 1.0),
            (DVec3::new(0.3, 0.1, 0.0), f64::INFINITY),
        ] {
            let each = (0..COUNT).map(|i| {
                apply_roulette::<f64>(throughput, scale, (f64::from(i) + 0.5) / f64::from(COUNT))
            });
            let (mut sum, mut ended) = (DVec3::ZERO, 0);
            for (throughput, continues) in each {
                sum += if continues { throughput } else { DVec3::ZERO };
                ended += u32::from(!continues);
            }
            let off = (sum / f64::from(COUNT) - throughput).abs().max_element();
            assert!(
                off < 1e-3 * throughput.max_element(),
                "{throughput} at {scale}: {off} off"
            );
            let requested = 1.0 - (throughput.x * scale).min(1.0);
            assert!(
                (f64::from(ended) / f64::from(COUNT) - requested).abs() < 1e-3,
                "{throughput} at {scale}: {ended} ended"
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
                    .all(|&scale| !apply_roulette::<f64>(nothing, scale, 0.0).1),
                "{nothing}"
            );
        }
    }

    /// Tests throughputs from a thousandth to 1e-30, or nearly one: the survival probability is
    /// above zero and at most one, and survivors count for ended paths to within rounding.
    fn is_unbiased<R: Real>() {
        for (share, scale) in [1e-3, 1e-10, 1e-20, 1e-30, 0.999_999, 1.0, 7.0]
            .into_iter()
            .flat_map(|share| [(share, 1.0), (share, 2.0), (share, 0.1)])
        {
            let throughput = R::Vec3::from_f64(DVec3::new(share, 0.5 * share, 0.0));
            let survival = (R::from_f64(share) * R::from_f64(scale)).min(R::ONE);
            let below = R::from_f64(survival.to_f64() * (1.0 - 1e-6));
            let (left, continues) = apply_roulette::<R>(throughput, R::from_f64(scale), below);
            assert!(
                continues && survival > R::ZERO && survival <= R::ONE,
                "{share:e} at {scale}"
            );
            let mean = left.to_f64() * survival.to_f64();
            let off = (mean - throughput.to_f64()).abs().max_element() / share;
            assert!(
                off <= 4.0 * R::ROUNDOFF.to_f64(),
                "{share:e} at {scale}: {off:e} off"
            );
            assert!(
                !apply_roulette::<R>(throughput, R::from_f64(scale), survival).1,
                "{share:e} at {scale} never ends"
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
            for (traced, share) in (FORCED_ROULETTE_SEGMENTS..200)
                .flat_map(|traced| [1e-30, 0.3, 0.5, 1.0, 1e30].map(|share| (traced, share)))
            {
                let throughput = DVec3::new(share, 0.0, 0.5 * share);
                let scale = survival_scale::<f64>(traced, throughput, rule);
                assert!(
                    scale > 0.0 && !apply_roulette::<f64>(throughput, scale, 0.951).1,
                    "{rule:?}, {traced} segments, {share}"
                );
            }
        }
    }

    /// Protects: by default a path may end from its third segment on, and only if its throughput is
    /// below a half.
    #[test]
    fn bright_paths_go_on_for_certain() {
        let goes_on = |traced, share| {
            let throughput = DVec3::splat(share);
            let scale = survival_scale::<f64>(traced, throughput, RouletteStart::Late);
            apply_roulette::<f64>(throughput, scale, 0.999_999).1
        };
        assert!(goes_on(2, 1e-6) && goes_on(3, 0.5) && goes_on(63, 0.5));
        assert!(!goes_on(3, 0.499) && !goes_on(3, 1e-6) && !goes_on(64, 1.0));
    }
}
