//! Time and memory of rungs (quality levels) that do not change the picture, such as the build
//! quality of the tree.

use std::time::{Duration, Instant};

use super::super::renderer::{TimedRender, UnfinishedRender};
use super::super::report::RungCost;
use super::super::setting::RungSetting;
use super::Measurements;
use crate::bench::SampleQuantiles;
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Number of repetitions of the timing of a rung (quality level) that does not change the picture.
const PRICE_ROUNDS: u64 = 3;
/// Greatest number of tiles that one repetition renders.
const PRICE_TILES: usize = 4;
/// Time limit for rendering with the changed rung (quality level), as a multiple of the time for
/// the unchanged setting in the same repetition. The limit is at least [`LEAST_PATIENCE`].
const PATIENCE: f64 = 20.0;
/// Least time limit of a repetition with the changed rung.
const LEAST_PATIENCE: Duration = Duration::from_secs(1);

impl Measurements<'_> {
    /// Measures time and memory of a setting whose picture must equal that of the setting `beside`.
    /// Each repetition prepares and renders the first tiles with `beside`, then with `setting`.
    /// Returns `None` if no repetition ends within its time limit and before `end`.
    pub fn measure_rung_cost(
        &self,
        setting: &RungSetting,
        beside: &RungSetting,
        end: Instant,
    ) -> Result<Option<RungCost>, PrepareError> {
        let tiles = self
            .sample
            .passes
            .iter()
            .take(PRICE_TILES.min(self.measured_tile_count(beside)));
        let crops: Vec<Crop> = tiles
            .map(|pilot_pass| self.sample.grid.tile_crop(pilot_pass.tile))
            .collect();
        let now = self.renderer.now;
        let own_seconds = self
            .summarise_setting(beside, beside)
            .map_or(0.0, |measured| measured.seconds.value);
        let (mut preparing, mut ratios, mut geometry, mut same_bits) =
            (Vec::new(), Vec::new(), 0, true);
        for round in 0..PRICE_ROUNDS {
            let before = now();
            let Some(renders) = UnfinishedRender::none_if_interrupted(
                self.renderer
                    .prepare_and_render_crops(beside, &crops, round, end),
            )?
            else {
                break;
            };
            let timeout = (now() - before).mul_f64(PATIENCE).max(LEAST_PATIENCE);
            let end = end.min(now() + timeout);
            let Some(others) = UnfinishedRender::none_if_interrupted(
                self.renderer
                    .prepare_and_render_crops(setting, &crops, round, end),
            )?
            else {
                break;
            };
            let seconds = |each_renders: &[TimedRender]| {
                each_renders
                    .iter()
                    .map(|render| render.seconds)
                    .sum::<f64>()
            };
            preparing.extend(others.first().map(|render| render.preparing_seconds));
            ratios.push(seconds(&others) / seconds(&renders).max(1e-9));
            geometry = others.first().map_or(0, |render| render.geometry_bytes);
            same_bits &= renders
                .iter()
                .zip(&others)
                .all(|(own_render, other)| own_render.picture == other.picture);
        }
        let [preparing, ratio] = [preparing, ratios]
            .map(|list| (!list.is_empty()).then(|| SampleQuantiles::from_samples(&list)));
        let rung_cost = preparing.zip(ratio);
        Ok(rung_cost.map(|(preparing, ratio)| RungCost {
            preparing,
            seconds: ratio.scale(own_seconds),
            ratio,
            geometry,
            same_bits,
        }))
    }
}
