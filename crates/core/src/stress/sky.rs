//! Texels of a sky map that are far brighter than most of the sky. Their light by way of mirrors and
//! glass is noisy.

use super::*;
use crate::scene::PixelData;

/// A texel is bright if it is so many times as bright as the median. Greatest share of the sky that
/// bright texels may cover, for a finding.
const SPIKE: f64 = 1e4;
const FEW: f64 = 1e-4;

impl SceneFacts<'_> {
    /// Returns a finding about texels of a sky map that are far brighter than most of the sky.
    pub fn sky_spike_finding(&self) -> Option<Fault> {
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
        let finding = SkySpikes.fault(Subject::Sky,
            format!("a few points of the sky are over {SPIKE:.0} times as bright as most of it: their light by way of mirrors and glass is noisy"),
            "remove the sun from the sky image and add a directional light in its place, or render with more --spp",
        );
        let total = pixels.len() as u64;
        (count > 0 && share < FEW)
            .then(|| finding.with_count(count, total, "texels", "are that bright"))
    }
}
