//! Expected cost of settings, from the speed of the pilot pass.

use super::MeasurementSession;
use super::planned_settings::PlannedSetting;
use super::time_budget::{PILOTS_END, RUNGS_END};
use crate::accuracy::renderer::MARGIN;
use crate::accuracy::setting::RungSetting;
use crate::accuracy::tiles::{TileGrid, TileSample};

/// Samples per pixel of the reference: factor on the scene's own number, least number, greatest
/// number.
const BETTER: u32 = 4;
const LEAST_REFERENCE: u32 = 64;
pub(super) const MOST_REFERENCE: u32 = 16_384;
/// Least number of tiles of a setting, unless the picture has fewer.
pub(super) const FEWEST: usize = 6;
/// Share of the stage's time, 0 to 1, that the plan fills by expected times.
const CAREFUL: f64 = 0.5;
/// Number of renders per tile for most settings. Bias cannot be separated from noise with a single
/// render.
pub(super) const ROUNDS: u64 = 2;
/// Largest share of the time budget for rendering one denoised whole picture.
const WHOLE: f64 = 0.1;
/// Assumed time of a denoised picture divided by the time of the same picture without denoising.
pub(super) const FILTER: f64 = 1.3;

impl MeasurementSession<'_> {
    /// Returns the expected wall-clock seconds of a denoised whole picture with this number of
    /// samples per pixel.
    pub(super) fn whole_picture_seconds(&self, samples: u32) -> f64 {
        let [width, height] = self.settings.size.map(f64::from);
        self.seconds_per_sample * width * height * f64::from(samples) * FILTER
    }

    /// Returns the largest number of samples per pixel with which a denoised setting is rendered as
    /// a whole picture.
    pub(super) fn whole_picture_samples(&self) -> u32 {
        (WHOLE * self.effort.budget.as_secs_f64() / self.whole_picture_seconds(1).max(1e-12)) as u32
    }

    /// Whether a setting is denoised and has so few samples that it is rendered as a whole picture.
    pub(super) fn renders_denoised_whole_picture(&self, setting: &RungSetting) -> bool {
        let (_, settings) = setting.apply(self.scene, &self.settings);
        settings.denoise && settings.sampling.samples_per_pixel() <= self.whole_picture_samples()
    }

    /// Returns the least number of samples per pixel of the reference for this scene.
    pub(super) fn minimum_reference_samples(&self) -> u32 {
        self.settings
            .sampling
            .samples_per_pixel()
            .saturating_mul(BETTER)
            .clamp(LEAST_REFERENCE, u32::from(u16::MAX) * 4)
    }

    /// Returns the expected wall-clock seconds of one sample for each pixel of a tile.
    pub(super) fn tile_sample_seconds(&self, grid: &TileGrid) -> f64 {
        self.seconds_per_sample * f64::from(grid.size[0]) * f64::from(grid.size[1])
            / grid.tile_count() as f64
    }

    /// Returns the number of tiles for which the time suffices. Less important settings are
    /// measured on the share `rest`, 0 to 1, of these tiles.
    pub(super) fn affordable_tile_count(&self, grid: &TileGrid, rest: f64) -> usize {
        let (items, maximum) = (
            self.planned_settings(),
            self.samples_per_pixel_limit_for_all_tiles(grid),
        );
        let cost = |item: &PlannedSetting| {
            self.samples_per_tile_pixel(&item.setting, grid)
                .min(maximum)
                * if item.has_important_ladder() {
                    1.0
                } else {
                    rest
                }
        };
        let costs: f64 = items.iter().map(cost).sum();
        let whole = items
            .iter()
            .filter(|item| self.renders_denoised_whole_picture(&item.setting));
        let whole: f64 = whole
            .map(|item| self.expected_seconds(&item.setting, 0, grid))
            .sum();
        let a_tile = self.tile_sample_seconds(grid)
            * (self.reference_time_ratio * f64::from(self.minimum_reference_samples()) + costs);
        let time = (self.effort.budget.as_secs_f64() * (RUNGS_END - PILOTS_END) - whole).max(0.0)
            * CAREFUL;
        (time / a_tile.max(1e-12)) as usize
    }

    /// Returns the cost of a setting per pixel of a tile, in samples: samples per pixel times
    /// renders per tile, enlarged by the margin of a denoised tile. Zero for a setting that is
    /// rendered as a whole picture.
    pub(super) fn samples_per_tile_pixel(&self, setting: &RungSetting, grid: &TileGrid) -> f64 {
        if self.renders_denoised_whole_picture(setting) {
            return 0.0;
        }
        let is_denoised = setting.apply(self.scene, &self.settings).1.denoise;
        let edge = f64::from(grid.edge);
        let wide = if is_denoised {
            (edge + 2.0 * f64::from(MARGIN)) / edge
        } else {
            1.0
        };
        self.round_count(setting) as f64 * f64::from(self.sample_count(setting)) * wide * wide
    }

    /// Returns how often each tile is rendered with a setting. A setting with more samples than the
    /// scene is rendered once: its bias equals that of settings with fewer samples. A denoised
    /// whole picture is rendered once if it takes long.
    pub(super) fn round_count(&self, setting: &RungSetting) -> u64 {
        let samples = self.sample_count(setting);
        let is_long = self.renders_denoised_whole_picture(setting)
            && self.whole_picture_samples() / samples < ROUNDS as u32;
        if samples > self.settings.sampling.samples_per_pixel() || is_long {
            1
        } else {
            ROUNDS
        }
    }

    /// Returns the expected wall-clock seconds of all renders of a setting on this number of tiles.
    pub(super) fn expected_seconds(
        &self,
        setting: &RungSetting,
        tiles: usize,
        grid: &TileGrid,
    ) -> f64 {
        match self.renders_denoised_whole_picture(setting) {
            true => {
                self.round_count(setting) as f64
                    * self.whole_picture_seconds(self.sample_count(setting))
            }
            false => {
                self.tile_sample_seconds(grid)
                    * tiles as f64
                    * self.samples_per_tile_pixel(setting, grid)
            }
        }
    }

    /// Returns the cost, in samples per pixel of a tile, beyond which a setting is measured on
    /// fewer tiles.
    fn samples_per_pixel_limit_for_all_tiles(&self, grid: &TileGrid) -> f64 {
        2.0 * self.samples_per_tile_pixel(&RungSetting::default(), grid)
    }

    /// Returns the number of tiles on which a setting is measured: `tiles`, or fewer for a slow
    /// setting.
    pub(super) fn setting_tile_count(
        &self,
        setting: &RungSetting,
        tiles: usize,
        sample: &TileSample,
    ) -> usize {
        let share = (self.samples_per_pixel_limit_for_all_tiles(&sample.grid)
            / self.samples_per_tile_pixel(setting, &sample.grid))
        .min(1.0);
        ((tiles as f64 * share) as usize).max(FEWEST.min(tiles))
    }
}
