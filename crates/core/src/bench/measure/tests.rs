//! Results of the benchmark for given times, by hand.

use super::*;
use crate::bench::{GeneratedPrimitive, generate_primitives};

/// Protects: the ratio is the time of the scan over that of the tree, sample by sample: of 6 and 2,
/// 5 and 2, and 8 and 4 seconds, the median is 2.5. Without a timed scan it is `None`.
#[test]
fn a_ratio_is_scan_over_tree() {
    let ratio = time_ratio(&[6.0, 5.0, 8.0], &[2.0, 2.0, 4.0]).expect("it was timed");
    assert_eq!((ratio.min, ratio.median, ratio.max), (2.0, 2.5, 3.0));
    assert_eq!(time_ratio(&[], &[2.0]), None);
}

/// Protects: a sample fills its intended time: at ten nanoseconds a test and three primitives, 30
/// ns a ray, 3333 rays fill 0.1 ms. Many rays are thinned out evenly, few are repeated, with at
/// least sixteen.
#[test]
fn samples_fill_their_time() {
    let geometry = Geometry::<f32>::new(
        generate_primitives(GeneratedPrimitive::Spheres, 3, 1).unwrap(),
        AcceleratorKind::Linear,
    );
    let sized = |rays: u32, sample_seconds| {
        let options = BenchOptions {
            repeats: 1,
            sample_seconds,
            build: BuildQuality::Fast,
        };
        let rays = crate::bench::generate_rays(rays, 1);
        let sample = RaySample::from_intended_duration(&geometry, &rays, &options);
        assert!((sample.seconds_per_ray - 3e-8).abs() < 1e-20);
        (rays.len(), sample.step, sample.passes)
    };
    assert_eq!(sized(1 << 16, 1e-4), (65536, 65536 / 3333, 1));
    assert_eq!(sized(1 << 8, 1e-4), (256, 1, 3333 / 256));
    assert_eq!(sized(1 << 8, 1e-9), (256, 256 / FEWEST_RAYS, 1));
}
