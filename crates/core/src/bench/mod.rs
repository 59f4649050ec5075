//! Benchmark of closest-hit queries by linear scan and by BVH (called tree). The module prints
//! nothing.
//!
//! Every ray is traced on the calling thread. Its CPU time is measured (see [`clock`]), which other
//! programs hardly change. Accelerators are built on the current thread pool. Both accelerators
//! trace the same rays, and their hits are compared to the bit before they are timed. Timed samples
//! of the two accelerators alternate, so that a change of the machine's speed affects both.

pub mod clock;
mod comparison;
mod generated;
mod measure;
mod statistics;

use raywright_bvh::{Geometry, GeometryError, PrimitiveSet};
use serde::Serialize;

use crate::prepare::PrepareError;
use measure::{BenchedGeometry, measure_scan_and_tree, time_builds};

pub use comparison::{SceneComparison, compare_scene};
pub use generated::{GeneratedPrimitive, TOTAL_SPHERE_VOLUME};
pub(crate) use generated::{generate_primitives, generate_rays};
pub use measure::{BenchOptions, HitMismatch, QueryCost, ScanTreeTiming};
pub use statistics::{Crossover, PowerLaw, SampleQuantiles};

/// Reason why a benchmark has no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BenchError {
    /// Linear scan and BVH find different hits, which is an error in the program.
    #[error(transparent)]
    Disagreement(#[from] HitMismatch),
    /// The scene has more primitives than a BVH can address.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// The scene cannot be prepared.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The scene has no object.
    #[error("the scene has no object, so no ray can be timed; add an object")]
    Empty,
}

/// Number of rays through a generated scene.
const RAYS: u32 = 1 << 16;
/// Seed of the scenes, and seed of the rays through them.
const SEEDS: [u64; 2] = [0x5eed_0001, 0x5eed_0002];
/// Least number of primitives of the scenes to which a power law is fitted. In smaller scenes,
/// caches and constant costs dominate.
pub const FIT_FROM: f64 = 1e3;

/// Costs of linear scan and BVH on generated scenes of growing size, and how these costs grow with
/// the number of primitives.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GeneratedSceneTimings {
    /// Kind of the primitives.
    pub kind: GeneratedPrimitive,
    /// Results by ascending number of primitives.
    pub rows: Vec<ScanTreeTiming>,
    /// Number of primitives from which on the BVH is faster than the scan. `None` if the scan was
    /// never timed.
    pub crossover: Option<Crossover>,
    /// Power law of the BVH's time per ray from 1000 primitives on; `None` with fewer than three
    /// sizes of at least 1000 primitives.
    pub tree_growth: Option<PowerLaw>,
    /// Power law of the scan's time per ray from 1000 primitives on; `None` with fewer than three
    /// timed sizes.
    pub scan_growth: Option<PowerLaw>,
}

/// Returns the numbers of primitives of generated scenes, ascending up to `largest`: powers of two
/// to 32, then 1 and 3 times each power of ten from 100 on, and `largest` itself.
pub fn generated_sizes(largest: u32) -> Vec<u32> {
    let small = [1, 2, 4, 8, 16, 32].into_iter();
    let decades = (2..10).flat_map(|e| {
        [
            10_u32.pow(e),
            3 * 10_u32.saturating_pow(e).min(u32::MAX / 3),
        ]
    });
    let mut sizes: Vec<u32> = small.chain(decades).filter(|&n| n < largest).collect();
    sizes.push(largest);
    sizes
}

/// Times closest-hit queries by linear scan and by BVH on generated scenes. `sizes` are numbers of
/// primitives, above zero and ascending. `on_row` is called with the result of each size.
///
/// # Errors
/// See [`BenchError`].
pub fn measure_generated(
    kind: GeneratedPrimitive,
    sizes: &[u32],
    options: &BenchOptions,
    on_row: &mut dyn FnMut(&ScanTreeTiming),
) -> Result<GeneratedSceneTimings, BenchError> {
    let rays = generate_rays(RAYS, SEEDS[1]);
    let mut rows = Vec::with_capacity(sizes.len());
    for &size in sizes {
        let group: PrimitiveSet<f32> = generate_primitives(kind, size, SEEDS[0])?;
        let build = |kind| {
            time_builds(
                options,
                || group.clone(),
                |group| Geometry::new(group, kind),
            )
        };
        let pair = options.accelerator_kinds().map(build);
        let pair = pair.map(|(geometry, build)| BenchedGeometry { geometry, build });
        let row = measure_scan_and_tree(&pair, &rays, options)?;
        on_row(&row);
        rows.push(row);
    }
    Ok(GeneratedSceneTimings::from_timings(kind, rows))
}

impl GeneratedSceneTimings {
    /// Determines crossover and growth from the results of all sizes.
    fn from_timings(kind: GeneratedPrimitive, rows: Vec<ScanTreeTiming>) -> Self {
        let ratios = rows
            .iter()
            .filter_map(|row| Some((row.primitives as f64, row.ratio?)));
        let crossover = Crossover::from_time_ratios(&ratios.collect::<Vec<_>>());
        let growth = |cost: fn(&ScanTreeTiming) -> Option<QueryCost>| {
            let points = rows
                .iter()
                .filter_map(|row| Some((row.primitives as f64, cost(row)?.nanoseconds.median)));
            PowerLaw::fit(&points.filter(|&(n, _)| n >= FIT_FROM).collect::<Vec<_>>())
        };
        Self {
            kind,
            crossover,
            tree_growth: growth(|row| Some(row.tree)),
            scan_growth: growth(|row| row.scan),
            rows,
        }
    }
}

#[cfg(test)]
mod tests {
    use raywright_bvh::{AcceleratorKind, BuildQuality};

    use super::*;

    /// Options that run everything without a meaningful measurement: the clock of tests counts work.
    fn hasty(sample_seconds: f64) -> BenchOptions {
        BenchOptions {
            repeats: 2,
            sample_seconds,
            build: BuildQuality::Fast,
        }
    }

    /// Protects: rows are complete and plausible, and the scan tests exactly N primitives: the
    /// timed work is the claimed work.
    #[test]
    fn a_series_of_each_kind() {
        for (_, kind) in GeneratedPrimitive::ALL {
            let mut seen = Vec::new();
            let series = measure_generated(kind, &[1, 14, 15, 200], &hasty(1e-4), &mut |row| {
                seen.push(row.primitives)
            })
            .unwrap();
            assert_eq!(seen, [1, 14, 15, 200]);
            for row in &series.rows {
                let scan = row.scan.expect("tiny scans are timed");
                assert_eq!(
                    (scan.tests_per_ray, scan.nodes_per_ray),
                    (row.primitives as f64, 0.0)
                );
                assert!(row.tree.tests_per_ray <= scan.tests_per_ray);
                // A small set that is tested as fast eight at a time has no nodes.
                let few = if kind == GeneratedPrimitive::Spheres {
                    160
                } else {
                    72
                };
                assert_eq!(
                    row.tree.nodes_per_ray > 0.0,
                    row.primitives > few,
                    "{}",
                    row.primitives
                );
                assert!(
                    scan.nanoseconds.min > 0.0
                        && row.tree.nanoseconds.min > 0.0
                        && row.hit_share > 0.0
                );
                assert!(row.tree.bytes >= scan.bytes && row.tree.build_milliseconds.median > 0.0);
            }
            assert!(series.tree_growth.is_none());
        }
    }

    /// Protects: a scan too slow for its sample is left out, the tree is still measured, and no
    /// ratio is reported.
    #[test]
    fn slow_scans_are_left_out() {
        let series = measure_generated(
            GeneratedPrimitive::Spheres,
            &[1000],
            &hasty(1e-9),
            &mut |_| (),
        )
        .unwrap();
        let row = &series.rows[0];
        assert!(row.scan.is_none() && row.ratio.is_none() && row.tree.nanoseconds.median > 0.0);
        assert_eq!(series.crossover, None);
    }

    /// Protects: structures with different hits are never timed.
    #[test]
    fn disagreement_is_an_error() {
        let geometry = |seed, kind| {
            Geometry::<f32>::new(
                generate_primitives(GeneratedPrimitive::Spheres, 50, seed).unwrap(),
                kind,
            )
        };
        let verdict = |seed| {
            let pair = [
                (seed, AcceleratorKind::Linear),
                (2, AcceleratorKind::default()),
            ];
            let pair = pair.map(|(seed, kind)| BenchedGeometry {
                geometry: geometry(seed, kind),
                build: SampleQuantiles::from_samples(&[1.0]),
            });
            measure_scan_and_tree(&pair, &generate_rays(4096, 1), &hasty(0.01))
        };
        assert!(verdict(2).is_ok());
        assert!(verdict(1).is_err());
    }

    /// Protects: sizes ascend without repetition, end with the largest, and reach 10⁶ in thirds of
    /// a decade.
    #[test]
    fn sizes_ascend_to_the_largest() {
        assert_eq!(generated_sizes(1), [1]);
        assert_eq!(generated_sizes(4), [1, 2, 4]);
        assert_eq!(generated_sizes(50), [1, 2, 4, 8, 16, 32, 50]);
        assert_eq!(
            generated_sizes(1_000_000)[6..],
            [
                100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000
            ]
        );
        assert!(generated_sizes(u32::MAX).is_sorted_by(|a, b| a < b));
    }
}
