//! Sums and moments against two passes in f64.

use glam::{DVec3, Vec3};
use proptest::prelude::*;

use crate::film::sums::{
    BlockAccumulator, COVERAGE_UNITS, MomentAccumulator, PixelSums, SampleAccumulator,
    SumAccumulator, quantise_coverage,
};

fn gathered<B: BlockAccumulator<f32>>(samples: impl IntoIterator<Item = f32>) -> PixelSums {
    let mut pixel = SampleAccumulator::<f32, B>::default();
    for sample in samples {
        pixel.add_sample(Vec3::splat(sample), [COVERAGE_UNITS, 0]);
    }
    pixel.finish_pixel()
}

/// Σ(x − mean)² of f32 samples, in f64 and two passes.
fn moment(samples: &[f32]) -> f64 {
    let mean = samples.iter().map(|&x| f64::from(x)).sum::<f64>() / samples.len() as f64;
    samples.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum()
}

/// Samples spread about 10⁴ by 10⁻² at most, as f32 has them: in steps of 2⁻¹⁰.
fn close_together(count: u32) -> Vec<f32> {
    (0..count)
        .map(|i| 1e4 + 1e-2 * ((i.wrapping_mul(2_654_435_761) >> 8) as f32 / 8_388_608.0 - 1.0))
        .collect()
}

/// Protects: a long sum agrees with the f64 sum of the same samples to six digits, where a plain
/// f32 sum has two.
#[test]
fn m12_long_sums_keep_their_digits() {
    let sample =
        |i: u32| 0.7 + 0.2 * ((i.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0 - 0.5);
    let (mut plain, mut exact, mut expected) = (0.0, 0.0, 0.0);
    const EACH: u32 = 62_500;
    for replicate in 0..160 {
        let samples = move || (EACH * replicate..EACH * (replicate + 1)).map(sample);
        plain += gathered::<SumAccumulator<f32>>(samples()).total()[0];
        exact += gathered::<MomentAccumulator>(samples()).total()[0];
        expected += samples().map(f64::from).sum::<f64>();
    }
    assert!(
        (plain / expected - 1.0).abs() < 1e-6,
        "{plain} instead of {expected}"
    );
    assert!(
        (exact / expected - 1.0).abs() < 1e-13,
        "{exact} instead of {expected}"
    );
}

/// Protects: the moment of samples that differ in their last digits only, in any number, agrees
/// with two passes in f64.
#[test]
fn m13_moments_of_nearly_equal_samples() {
    for count in [2, 15, 16, 17, 250, 65_535] {
        let samples = close_together(count);
        let (found, expected) = (
            f64::from(gathered::<MomentAccumulator>(samples.clone()).spread[1]).powi(2),
            moment(&samples),
        );
        assert!(
            (found / expected - 1.0).abs() < 1e-6,
            "{count} samples: {found} instead of {expected}"
        );
    }
    // Their variance per sample, checked by hand: for a uniform spread of ±10⁻², 10⁻⁴/3.
    let variance = moment(&close_together(65_535)) / 65_534.0;
    assert!((variance / (1e-4 / 3.0) - 1.0).abs() < 0.02, "{variance}");
}

/// Protects: a single sample and equal samples have a moment of exactly zero.
#[test]
fn m13_equal_samples_do_not_vary() {
    for value in [0.0, 0.1, 1e4, 3e38] {
        for count in [1, 16, 40] {
            assert_eq!(
                gathered::<MomentAccumulator>(vec![value; count]).spread,
                [0.0; 3],
                "{count} of {value}"
            );
        }
    }
}

/// Protects: a sample that is not finite is dropped and reported, its neighbours in the block stay,
/// and the next pixel starts clean.
#[test]
fn f04_not_finite_samples_are_dropped() {
    fn check<B: BlockAccumulator<f32>>(spread: f32) {
        let mut pixel = SampleAccumulator::<f32, B>::default();
        for _ in 0..2 {
            assert!(pixel.add_sample(Vec3::ONE, [COVERAGE_UNITS, 1]));
            assert!(!pixel.add_sample(Vec3::new(f32::NAN, 0.0, 0.0), [COVERAGE_UNITS; 2]));
            assert!(!pixel.add_sample(Vec3::new(0.0, f32::INFINITY, 0.0), [COVERAGE_UNITS; 2]));
            assert!(pixel.add_sample(Vec3::splat(3.0), [0, 5]));
            assert_eq!(
                pixel.finish_pixel(),
                PixelSums {
                    partial_block: [4.0; 3],
                    sum: [0.0; 3],
                    spread: [spread; 3],
                    samples: 2,
                    covered: COVERAGE_UNITS,
                    shadowed: 6
                }
            );
        }
    }
    check::<SumAccumulator<f32>>(0.0);
    check::<MomentAccumulator>(2.0_f32.sqrt());
}

proptest! {
    /// Protects: moments of any samples, of any size, with any number dropped, agree with two
    /// passes in f64 over the finite ones, and are never negative.
    #[test]
    fn m13_moments_agree_with_two_passes(
        samples in proptest::collection::vec((-1e3_f32..1e3, any::<bool>()), 1..100),
        offset in -1e6_f32..1e6,
        scale in -30_i32..30,
    ) {
        let mut pixel = SampleAccumulator::<f64, MomentAccumulator>::default();
        let mut entered = Vec::new();
        for (sample, drop) in samples {
            let sample = if drop { f64::NAN } else { f64::from(sample + offset) * 2.0_f64.powi(scale) };
            pixel.add_sample(DVec3::splat(sample), [COVERAGE_UNITS, 0]);
            entered.extend((!drop).then_some(sample));
        }
        let sums = pixel.finish_pixel();
        let n = entered.len() as f64;
        let mean = entered.iter().sum::<f64>() / n.max(1.0);
        let expected = entered.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>().sqrt();
        prop_assert_eq!(usize::from(sums.samples), entered.len());
        prop_assert!((sums.total()[2] - mean * n).abs() <= 1e-12 * mean.abs() * n);
        // Rounding of the samples themselves limits the accuracy of any formula.
        let allowed = 1e-6 * expected + 1e-13 * mean.abs() * n;
        prop_assert!((f64::from(sums.spread[2]) - expected).abs() <= allowed, "{} instead of {expected}", sums.spread[2]);
    }
}

/// Protects: coverage is counted to the nearest unit, with zero and one exact, and the sum over the
/// most samples fits. The least coverage counts as a hit; zero and NaN do not.
#[test]
fn coverage_is_counted_in_parts() {
    assert_eq!(
        [0.0, 0.25, 1.0, 1.0 + f32::EPSILON, f32::NAN].map(quantise_coverage),
        [0, COVERAGE_UNITS / 4, COVERAGE_UNITS, COVERAGE_UNITS, 0]
    );
    assert_eq!(
        [1.0 / 3.0, 2.0 / 3.0].map(|share: f64| quantise_coverage(share)),
        [21_845, 43_691]
    );
    assert!(COVERAGE_UNITS.checked_mul(u32::from(u16::MAX)).is_some());
    let mut pixel = SampleAccumulator::<f32, SumAccumulator<f32>>::default();
    for covered in [0, 1, COVERAGE_UNITS] {
        pixel.add_sample(Vec3::ONE, [covered, 1]);
    }
    assert_eq!(
        (pixel.finish_pixel().covered, pixel.hits),
        (COVERAGE_UNITS + 1, 2)
    );
}

/// Protects: sums continued at any point end with the bits of a single run, where rounding
/// distinguishes orders: in f32 the block of 16 samples of 1/3 is not sixteen times one of them.
#[test]
fn sums_go_on_where_they_were() {
    fn check<B: BlockAccumulator<f32>>() {
        let sample = |i: u32| Vec3::splat(1.0 / (3.0 + i as f32));
        let once = |n: u32| {
            let mut pixel = SampleAccumulator::<f32, B>::default();
            (0..n).for_each(|i| {
                _ = pixel.add_sample(
                    sample(i),
                    [1.0, 2.0].map(|k| quantise_coverage(k * i as f32 / 3.0 % 1.0)),
                )
            });
            pixel.finish_pixel()
        };
        for (n, m) in (0..40).flat_map(|n| (n..70).map(move |m| (n, m))) {
            let mut pixel = SampleAccumulator::<f32, B>::default();
            // As a film stores it: in one number where no block is open.
            let sums = once(n);
            let sums = if n > 0 && n % 16 == 0 {
                PixelSums {
                    sum: sums.total(),
                    partial_block: [0.0; 3],
                    ..sums
                }
            } else {
                sums
            };
            pixel.resume_pixel(sums, n);
            (n..m).for_each(|i| {
                _ = pixel.add_sample(
                    sample(i),
                    [1.0, 2.0].map(|k| quantise_coverage(k * i as f32 / 3.0 % 1.0)),
                )
            });
            let (found_sums, expected) = (pixel.finish_pixel(), once(m));
            assert_eq!(
                (found_sums.total(), found_sums.samples, found_sums.covered),
                (expected.total(), expected.samples, expected.covered),
                "{n} of {m}"
            );
        }
    }
    check::<SumAccumulator<f32>>();
    check::<MomentAccumulator>();
}
