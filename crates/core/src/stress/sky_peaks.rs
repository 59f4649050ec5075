//! Small bright places of a sky that is given by an expression. Samples of such a sky are spread
//! evenly, so that they hit a small place by chance.

use core::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;
use raywright_bvh::{Real, Vector};

use super::RayDeadline;
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use crate::dispatch::{PreparedSceneTask, ReadyScene};
use crate::prepare::PreparedScene;
use crate::settings::Settings;

/// Numbers of rows and columns of directions. Each stands for the same solid angle, a tenth of that
/// of the sun's disc.
const ROWS: usize = 1024;
const COLUMNS: usize = 2048;
/// A direction is bright if its radiance is so many times the mean.
const BRIGHT: f64 = 100.0;
/// Least reported noise: that of a surface lit by the sky alone, as a share of its radiance.
const NOISY: f64 = 1.0;

/// Returns a finding if small bright places of the sky's expression make the picture noisy.
pub(super) fn check_sky_peaks(
    ready: &ReadyScene,
    settings: &Settings,
    deadline: &RayDeadline<'_>,
) -> Option<StressFinding> {
    let is_sampled = ready.is_path_traced() && !deadline.has_passed();
    let peaks = is_sampled.then(|| ready.run_task(&SkyPeakTask)).flatten()?;
    let samples = f64::from(settings.sampling.samples_per_pixel().max(1));
    let noise = (peaks.variance / samples).sqrt();
    if noise < NOISY || peaks.count == 0 {
        return None;
    }
    let total = (ROWS * COLUMNS) as u64;
    let reason = format!(
        "small places of its expression, over {BRIGHT} times as bright as the mean, send {:.0} % of its light: samples of an expression are spread evenly over the sky and hit these places only by chance",
        100.0 * peaks.share
    );
    let remedy = "describe the sun by an entry in `suns` of a `gradient` sky or by a directional light, limit the expression with `min`, or render with more --spp";
    let (code, severity) = (FindingCode::SkySpikes, Severity::SlowOrNoisy);
    let finding = StressFinding::new(code, severity, FindingSubject::Sky, reason, remedy);
    Some(finding.with_count(peaks.count, total, "directions", "are that bright"))
}

/// Bright directions of a sky.
struct SkyPeaks {
    /// Number of bright directions, and their share of the light.
    count: u64,
    share: f64,
    /// Variance of a sample of the sky's light, in units of the squared mean.
    variance: f64,
}

/// Sums over directions: the radiance and its square.
#[derive(Clone, Copy, Default)]
struct RadianceSums {
    sum: f64,
    squares: f64,
}

struct SkyPeakTask;

impl PreparedSceneTask for SkyPeakTask {
    type Output = Option<SkyPeaks>;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Option<SkyPeaks> {
        let sky = &prepared.lights.sky;
        if !sky.is_expression() {
            return None;
        }
        let radiance = |row: usize, column: usize| {
            let z = 1.0 - 2.0 * (row as f64 + 0.5) / ROWS as f64;
            let (sin, cos) = libm::sincos(TAU * (column as f64 + 0.5) / COLUMNS as f64);
            let ring = (1.0 - z * z).sqrt();
            let direction = R::Vec3::from_f64(DVec3::new(ring * cos, z, ring * sin));
            let radiance = sky.radiance(R::Vec3::ZERO, direction).to_f64();
            let mean = radiance.max(DVec3::ZERO).element_sum() / 3.0;
            if mean.is_finite() { mean } else { 0.0 }
        };
        let row_sums = |row: usize| {
            (0..COLUMNS).fold(RadianceSums::default(), |sums, column| {
                let radiance = radiance(row, column);
                RadianceSums {
                    sum: sums.sum + radiance,
                    squares: sums.squares + radiance * radiance,
                }
            })
        };
        // The order of the additions does not depend on the threads.
        let rows: Vec<RadianceSums> = (0..ROWS).into_par_iter().map(row_sums).collect();
        let number = (ROWS * COLUMNS) as f64;
        let mean = rows.iter().map(|row| row.sum).sum::<f64>() / number;
        let squares = rows.iter().map(|row| row.squares).sum::<f64>() / number;
        if mean <= 0.0 {
            return None;
        }
        let bright_in_row = |row: usize| {
            let all = (0..COLUMNS).map(|column| radiance(row, column));
            let bright = all.filter(|&radiance| radiance > BRIGHT * mean);
            bright.fold((0, 0.0), |(count, sum), radiance| {
                (count + 1, sum + radiance)
            })
        };
        let bright: Vec<(u64, f64)> = (0..ROWS).into_par_iter().map(bright_in_row).collect();
        Some(SkyPeaks {
            count: bright.iter().map(|(count, _)| count).sum(),
            share: bright.iter().map(|(_, sum)| sum).sum::<f64>() / (number * mean),
            variance: squares / (mean * mean) - 1.0,
        })
    }
}
