//! Small bright places of a sky. Their light by way of mirrors and glass is noisy; samples of an
//! expression, which are spread evenly, hit a small place only by chance.

use super::*;
use crate::scene::{Colour, PixelData};

/// Numbers of rows and columns of directions. Each stands for the same solid angle, a tenth of that
/// of the sun's disc.
const ROWS: usize = 1024;
const COLUMNS: usize = 2048;
/// A direction is bright if its radiance is so many times the mean.
const BRIGHT: f64 = 100.0;
/// Least reported noise: that of a surface lit by the sky alone, as a share of its radiance.
const NOISY: f64 = 1.0;
/// A texel is bright if it is so many times as bright as the median. Greatest share of the sky that
/// bright texels may cover, for a finding.
const SPIKE: f64 = 1e4;
const FEW: f64 = 1e-4;

impl SceneFacts<'_> {
    pub fn is_sky_dark(&self) -> bool {
        matches!(self.scene.sky, None | Some(Sky::Constant(Colour::BLACK)))
    }

    /// Returns a finding about texels of a sky map that are far brighter than most of the sky.
    pub fn sky_spike_finding(&self) -> Option<StressFinding> {
        let Some(Sky::Map(map)) = &self.scene.sky else {
            return None;
        };
        let data = self.lookup.image(&map.image)?.data.as_deref()?;
        let PixelData::Linear(pixels) = &data.pixels else {
            return None;
        };
        // The brightness of each texel, and its share of the sky.
        let texel = |(index, pixel): (usize, &[f32; 4])| {
            let row_centre = (index / data.width as usize) as f64 + 0.5;
            let weight = (PI * row_centre / f64::from(data.height)).sin();
            (f64::from(pixel[0].max(pixel[1]).max(pixel[2])), weight)
        };
        let texels = pixels.iter().enumerate().map(texel);
        let mut texels: Vec<(f64, f64)> = texels.filter(|(bright, _)| bright.is_finite()).collect();
        texels.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (median, _) = *texels.get(texels.len() / 2)?;
        let from = texels.partition_point(|(bright, _)| *bright <= SPIKE * median.max(1e-6));
        let weight = |texels: &[(f64, f64)]| texels.iter().map(|(_, weight)| weight).sum::<f64>();
        let share = weight(&texels[from..]) / weight(&texels);
        let count = (texels.len() - from) as u64;
        let finding = FindingCode::SkySpikes.finding(
            SlowOrNoisy,
            FindingSubject::Sky,
            format!("a few points of the sky are over {SPIKE:.0} times as bright as most of it: their light by way of mirrors and glass is noisy"),
            "remove the sun from the sky image and add a directional light in its place, or render with more --spp",
        );
        let total = pixels.len() as u64;
        (count > 0 && share < FEW)
            .then(|| finding.with_count(count, total, "texels", "are that bright"))
    }

    /// Returns a finding if small bright places of the sky's expression make the picture noisy.
    pub fn sky_peak_finding(
        &self,
        ready: &ReadyScene,
        deadline: &RayDeadline<'_>,
    ) -> Option<StressFinding> {
        let is_sampled = ready.is_path_traced() && !deadline.has_passed();
        let is_expression = matches!(self.scene.sky, Some(Sky::Expression(_)));
        let radiances = (is_sampled && is_expression).then(|| ready.run_task(&SkyTask))?;
        let number = radiances.len() as f64;
        let sum = |of: fn(f64) -> f64| radiances.iter().map(|&x| of(x)).sum::<f64>();
        let mean = sum(|x| x) / number;
        let bright = || {
            radiances
                .iter()
                .filter(|&&radiance| radiance > BRIGHT * mean)
        };
        let (count, light) = (bright().count() as u64, bright().sum::<f64>());
        // The variance of a sample of the sky's light, in units of the squared mean.
        let variance = sum(|x| x * x) / number / (mean * mean) - 1.0;
        let samples = f64::from(self.settings.sampling.samples_per_pixel().max(1));
        let is_noisy = mean > 0.0 && count > 0 && (variance / samples).sqrt() >= NOISY;
        let finding = FindingCode::SkySpikes.finding(
            SlowOrNoisy,
            FindingSubject::Sky,
            format!(
                "small places of its expression, over {BRIGHT} times as bright as the mean, send {:.0} % of its light: samples of an expression are spread evenly over the sky and hit these places only by chance",
                100.0 * light / (number * mean)
            ),
            "describe the sun by an entry in `suns` of a `gradient` sky or by a directional light, limit the expression with `min`, or render with more --spp",
        );
        is_noisy.then(|| finding.with_count(count, number as u64, "directions", "are that bright"))
    }
}

/// Task that returns the radiance of the sky, the mean of three channels, in directions spread evenly.
struct SkyTask;

impl PreparedSceneTask for SkyTask {
    type Output = Vec<f64>;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Vec<f64> {
        let radiance = |index: usize| {
            let [row, column] = [index / COLUMNS, index % COLUMNS].map(|i| i as f64 + 0.5);
            let z = 1.0 - 2.0 * row / ROWS as f64;
            let (sin, cos) = libm::sincos(TAU * column / COLUMNS as f64);
            let ring = (1.0 - z * z).sqrt();
            let direction = R::Vec3::from_f64(DVec3::new(ring * cos, z, ring * sin));
            let radiance = prepared
                .lights
                .sky
                .radiance(R::Vec3::ZERO, direction)
                .to_f64();
            let mean = radiance.max(DVec3::ZERO).element_sum() / 3.0;
            if mean.is_finite() { mean } else { 0.0 }
        };
        (0..ROWS * COLUMNS).into_par_iter().map(radiance).collect()
    }
}
