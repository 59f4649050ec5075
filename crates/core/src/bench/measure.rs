//! Benchmark of one scene with one set of rays. Linear scan and BVH intersect the same rays. Their
//! hits are compared first, then both are timed alternately.

use std::hint::black_box;

use raywright_bvh::{AcceleratorKind, BuildQuality, Geometry, Hit, Interval, Ray, TraversalStats};
use serde::Serialize;

use super::clock::time_sample;
use super::statistics::SampleQuantiles;

/// Extent of a benchmark: number of repetitions, duration of a timed sample, and build quality of
/// the BVH.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BenchOptions {
    /// Number of alternating timings of scan and BVH, at least one.
    pub repeats: usize,
    /// Intended duration of a timed sample (a repeated set of rays) in seconds. In a much shorter
    /// sample, the error of the clock dominates.
    pub sample_seconds: f64,
    /// Build quality of the BVH.
    pub build: BuildQuality,
}

impl BenchOptions {
    /// Returns the two compared accelerators, linear scan and BVH.
    pub(super) fn accelerator_kinds(&self) -> [AcceleratorKind; 2] {
        [AcceleratorKind::Linear, AcceleratorKind::Tree(self.build)]
    }
}

/// Least number of rays in a timed sample.
const FEWEST_RAYS: usize = 16;
/// Largest ratio of a linear scan's expected time per sample to the intended time. A linear scan
/// above this ratio is not timed.
const PATIENCE: f64 = 8.0;

/// Geometry with one accelerator, linear scan or BVH.
pub(super) struct BenchedGeometry {
    pub geometry: Geometry<f32>,
    /// Seconds of a build.
    pub build: SampleQuantiles,
}

/// Costs of one accelerator: time and tests per closest-hit query, build time and memory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct QueryCost {
    /// Nanoseconds per closest-hit query.
    pub nanoseconds: SampleQuantiles,
    /// Number of different rays that are timed. They are all rays, or an evenly spaced subset if a
    /// query takes long.
    pub rays: usize,
    /// Mean number of visited nodes per ray.
    pub nodes_per_ray: f64,
    /// Mean number of tested primitives per ray.
    pub tests_per_ray: f64,
    /// Milliseconds to build the accelerator on the current thread pool.
    pub build_milliseconds: SampleQuantiles,
    /// Bytes of primitives and accelerator.
    pub bytes: usize,
}

/// Costs of linear scan and BVH on one scene, for closest-hit queries with the same rays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScanTreeTiming {
    /// Number of primitives in the scene.
    pub primitives: usize,
    /// Share of the rays, 0 to 1, that hit a primitive.
    pub hit_share: f64,
    /// Cost of the linear scan, which tests every primitive. `None` if a timed sample would take
    /// too long.
    pub scan: Option<QueryCost>,
    /// Cost of closest-hit queries by the BVH.
    pub tree: QueryCost,
    /// Time of the linear scan divided by that of the BVH, over pairs of consecutive samples.
    /// `None` if the scan was not timed.
    pub ratio: Option<SampleQuantiles>,
}

/// Error: linear scan and BVH find different hits for a ray. A comparison of their times is then
/// meaningless.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "internal error: linear scan and tree find different hits for ray {ray} in a scene of {primitives} primitives (scan: {scan}; tree: {tree}); please report this with the scene"
)]
pub struct HitMismatch {
    /// Index of the ray for which the hits differ.
    pub ray: usize,
    /// Number of primitives in the scene.
    pub primitives: usize,
    /// Debug text of the hit by the scan.
    pub scan: String,
    /// Debug text of the hit by the BVH.
    pub tree: String,
}

/// Compares the hits of linear scan and BVH, then times both alternately. A scan of which a sample
/// would take too long is left out. `rays` must not be empty.
pub(super) fn measure_scan_and_tree(
    [scan, tree]: &[BenchedGeometry; 2],
    rays: &[Ray<f32>],
    options: &BenchOptions,
) -> Result<ScanTreeTiming, HitMismatch> {
    let tree_sample = RaySample::from_intended_duration(&tree.geometry, rays, options);
    let scan_sample = RaySample::from_intended_duration(&scan.geometry, rays, options);
    let longest = PATIENCE * options.sample_seconds;
    let scan_sample = Some(scan_sample).filter(|sample| sample.expected_seconds() <= longest);
    if let Some(sample) = &scan_sample {
        sample.compare_hits(&scan.geometry, &tree.geometry)?;
    }
    let (mut of_scan, mut of_tree) = (Vec::new(), Vec::new());
    for _ in 0..options.repeats.max(1) {
        let scanned = scan_sample
            .as_ref()
            .map(|sample| sample.time_per_ray(&scan.geometry));
        of_scan.extend(scanned);
        of_tree.push(tree_sample.time_per_ray(&tree.geometry));
    }
    let is_hit = |ray: &&Ray<f32>| closest_hit(&tree.geometry, ray).is_some();
    Ok(ScanTreeTiming {
        primitives: tree.geometry.len(),
        hit_share: rays.iter().filter(is_hit).count() as f64 / rays.len() as f64,
        ratio: time_ratio(&of_scan, &of_tree),
        scan: scan_sample.map(|sample| sample.query_cost(scan, &of_scan)),
        tree: tree_sample.query_cost(tree, &of_tree),
    })
}

/// Returns the times of a scan over those of a tree, timed in turns; `None` without a time of the scan.
fn time_ratio(scan: &[f64], tree: &[f64]) -> Option<SampleQuantiles> {
    let ratios: Vec<f64> = scan
        .iter()
        .zip(tree)
        .map(|(scan, tree)| scan / tree)
        .collect();
    (!ratios.is_empty()).then(|| SampleQuantiles::from_samples(&ratios))
}

fn closest_hit(geometry: &Geometry<f32>, ray: &Ray<f32>) -> Option<Hit<f32>> {
    geometry.closest(ray, Interval::positive(), &mut ())
}

/// Rays that are timed together: every `step`-th ray of a list, traced `passes` times.
struct RaySample<'a> {
    rays: &'a [Ray<f32>],
    step: usize,
    passes: usize,
    seconds_per_ray: f64,
}

impl<'a> RaySample<'a> {
    /// Returns a sample that takes about the intended time. Trial runs determine its size; they
    /// also warm up caches and branch predictors.
    fn from_intended_duration(
        geometry: &Geometry<f32>,
        rays: &'a [Ray<f32>],
        options: &BenchOptions,
    ) -> Self {
        let mut sample = Self {
            rays,
            step: rays.len(),
            passes: 1,
            seconds_per_ray: f64::INFINITY,
        };
        loop {
            sample.seconds_per_ray = sample.time_per_ray(geometry);
            let spent = sample.seconds_per_ray * sample.rays_per_pass() as f64;
            if spent >= options.sample_seconds * 0.25 || sample.step == 1 {
                break;
            }
            sample.step = (sample.step / 4).max(1);
        }
        let requested = ((options.sample_seconds / sample.seconds_per_ray.max(1e-12)) as usize)
            .max(FEWEST_RAYS);
        sample.step = (rays.len() / requested).max(1);
        sample.passes = (requested / rays.len()).max(1);
        sample
    }

    fn selected_rays(&self) -> impl Iterator<Item = &'a Ray<f32>> + use<'a> {
        self.rays.iter().step_by(self.step)
    }

    /// Compares the hits of scan and BVH to the bit: distance, surface parameters, primitive and
    /// instance.
    fn compare_hits(&self, scan: &Geometry<f32>, tree: &Geometry<f32>) -> Result<(), HitMismatch> {
        let bits = |hit: &Option<Hit<f32>>| {
            hit.map(|h| ([h.t, h.u, h.v].map(f32::to_bits), h.tie_order()))
        };
        for (index, ray) in self.selected_rays().enumerate() {
            let [a, b] = [scan, tree].map(|geometry| closest_hit(geometry, ray));
            if bits(&a) != bits(&b) {
                return Err(HitMismatch {
                    ray: index * self.step,
                    primitives: tree.len(),
                    scan: format!("{a:?}"),
                    tree: format!("{b:?}"),
                });
            }
        }
        Ok(())
    }

    /// Returns the number of rays that are traced once per pass.
    fn rays_per_pass(&self) -> usize {
        self.rays.len().div_ceil(self.step)
    }

    /// Returns the expected seconds of the sample.
    fn expected_seconds(&self) -> f64 {
        self.seconds_per_ray * (self.rays_per_pass() * self.passes) as f64
    }

    /// Runs the sample once and returns the seconds per ray.
    fn time_per_ray(&self, geometry: &Geometry<f32>) -> f64 {
        let rays = self.rays_per_pass() * self.passes;
        let mut trace = || {
            for _ in 0..self.passes {
                for ray in self.selected_rays() {
                    black_box(closest_hit(geometry, black_box(ray)));
                }
            }
            (rays * geometry.len()) as u64
        };
        time_sample(&mut trace) / rays as f64
    }

    /// Returns the cost per query. `seconds` are the seconds per ray of several timings of the
    /// sample.
    fn query_cost(&self, contestant: &BenchedGeometry, seconds: &[f64]) -> QueryCost {
        let mut stats = TraversalStats::default();
        for ray in self.selected_rays() {
            contestant
                .geometry
                .closest(ray, Interval::positive(), &mut stats);
        }
        let rays = self.rays_per_pass();
        QueryCost {
            nanoseconds: SampleQuantiles::from_samples(seconds).scale(1e9),
            rays,
            nodes_per_ray: stats.nodes as f64 / rays as f64,
            tests_per_ray: stats.primitives as f64 / rays as f64,
            build_milliseconds: contestant.build.scale(1e3),
            bytes: contestant.geometry.memory_bytes(),
        }
    }
}

/// Limit of the total time of an accelerator's repeated builds, as a multiple of the intended
/// duration of a sample.
const BUILD_PATIENCE: f64 = 8.0;
/// Largest number of builds that are timed together.
const LARGEST_BATCH: usize = 256;

/// Builds an accelerator several times. Returns the last accelerator and the seconds per build.
/// `input` creates the input of a build before the clock starts. Builds that are too short for the
/// clock are timed in batches.
pub(super) fn time_builds<I, G>(
    options: &BenchOptions,
    input: impl Fn() -> I,
    build: impl Fn(I) -> G,
) -> (G, SampleQuantiles) {
    let batch = |size: usize| {
        let inputs: Vec<I> = (0..size).map(|_| input()).collect();
        let mut inputs = inputs.into_iter();
        let mut built = None;
        let mut work = || {
            for input in inputs.by_ref() {
                built = Some(black_box(build(input)));
            }
            size as u64
        };
        let seconds = time_sample(&mut work);
        // A result is always present, because no batch is empty.
        (
            built.unwrap_or_else(|| build(input())),
            seconds / size as f64,
        )
    };
    // The first build warms up and does not count, unless it alone takes all the time.
    let (mut built, first) = batch(1);
    let size = ((options.sample_seconds * 0.1 / first.max(1e-9)) as usize).clamp(1, LARGEST_BATCH);
    let (mut seconds, mut spent) = (Vec::new(), first);
    while seconds.len() < options.repeats.max(1) && spent < BUILD_PATIENCE * options.sample_seconds
    {
        let (again, took) = batch(size);
        built = again;
        seconds.push(took);
        spent += took * size as f64;
    }
    if seconds.is_empty() {
        seconds.push(first);
    }
    (built, SampleQuantiles::from_samples(&seconds))
}

#[cfg(test)]
mod tests;
