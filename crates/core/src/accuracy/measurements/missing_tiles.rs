//! Rendering of the tiles that a setting still lacks, in tiles or as a whole picture.

use std::ops::Range;
use std::time::Instant;

use super::tile_errors::TileRenders;
use super::{Measurements, SettingMeasurements};
use crate::accuracy::renderer::{MARGIN, TimedRender, UnfinishedRender};
use crate::accuracy::setting::RungSetting;
use crate::ladder::Ladder;
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Tiles that a setting lacks, and the comparison of their pictures.
pub(super) struct MissingTiles<'s> {
    /// Index of the setting among the measured settings.
    pub index: usize,
    /// Number of tiles after which the setting lacks none: the first tiles of the sample.
    pub count: usize,
    /// Setting with whose kept pictures the new pictures are compared.
    pub beside: Option<&'s RungSetting>,
    /// Whether the new pictures are kept.
    pub keep: bool,
    /// Instant at which an unfinished render is dropped.
    pub end: Instant,
}

impl Measurements<'_> {
    /// Renders and measures the tiles that a setting lacks, in tiles or as a whole picture,
    /// whichever has fewer pixels. Returns false if the time runs out.
    pub(super) fn measure_missing_tiles(
        &mut self,
        missing: &MissingTiles<'_>,
    ) -> Result<bool, PrepareError> {
        let SettingMeasurements {
            setting,
            rounds,
            tiles,
            ..
        } = &self.setting_measurements[missing.index];
        let (setting, rounds, positions) =
            (setting.clone(), 0..*rounds, tiles.len()..missing.count);
        if positions.is_empty() {
            return Ok(true);
        }
        let crops: Vec<Crop> = positions
            .clone()
            .map(|position| self.crop_for_tile(&setting, position))
            .collect();
        if self.sample.covers_picture(missing.count)
            || crops.iter().copied().map(pixel_count).sum::<f64>()
                >= pixel_count(self.whole_picture_crop())
            || self.is_denoised(&setting) && self.renders_whole_picture(&setting)
        {
            return self.measure_as_whole_picture(missing, &setting, rounds);
        }
        let Some(renders) = self.render_crops(&setting, &crops, rounds, missing.end)? else {
            return Ok(false);
        };
        let renders = positions
            .zip(crops)
            .enumerate()
            .map(|(i, (position, crop))| TileRenders {
                position,
                crop,
                share: self.tile_area_share(position, crop),
                renders: renders_of_crop(&renders, i),
            });
        self.record_tile_errors(
            missing.index,
            renders.collect(),
            missing.beside,
            missing.keep,
        );
        Ok(true)
    }

    /// Renders the whole picture, unless its renders are kept, and measures the missing tiles in
    /// it. A new render replaces all earlier tiles. Returns false if the time runs out.
    fn measure_as_whole_picture(
        &mut self,
        missing: &MissingTiles<'_>,
        setting: &RungSetting,
        rounds: Range<u64>,
    ) -> Result<bool, PrepareError> {
        let index = missing.index;
        let covers_picture = self.sample.covers_picture(missing.count);
        let mut renders = std::mem::take(&mut self.setting_measurements[index].whole_renders);
        let is_new = renders.is_empty();
        if is_new {
            let Some(new_renders) = self.render_crops(setting, &[], rounds, missing.end)? else {
                return Ok(false);
            };
            renders = new_renders.into_iter().flatten().collect();
            let figures = &mut self.setting_measurements[index];
            figures.tiles = Vec::new();
            figures.pictures = Vec::new();
            figures.first_picture = covers_picture.then(|| renders[0].picture.clone());
            figures.whole_seconds = Some(renders[0].seconds);
        }
        let first = self.setting_measurements[index].tiles.len();
        let tiles = (first..missing.count).map(|position| TileRenders {
            position,
            crop: self.whole_picture_crop(),
            share: self.tile_time_share(position),
            renders: renders.iter().collect(),
        });
        self.record_tile_errors(index, tiles.collect(), missing.beside, missing.keep);
        if self.is_denoised(setting) && !covers_picture {
            self.setting_measurements[index].whole_renders = renders;
            if is_new {
                self.estimate_errors_from_pilots();
            }
        }
        Ok(true)
    }

    /// Returns the share of the whole picture's render time, 0 to 1, that a tile takes. The share
    /// follows from the times of the pilot pass, or from the tile's pixels if all times are zero.
    fn tile_time_share(&self, position: usize) -> f64 {
        let sample = &self.sample;
        let pilot_seconds: f64 = sample
            .passes
            .iter()
            .map(|pilot_pass| pilot_pass.seconds)
            .sum();
        let picture_seconds =
            pilot_seconds * sample.grid.tile_count() as f64 / sample.drawable_tile_count() as f64;
        let pilot_pass = &sample.passes[position];
        if picture_seconds > 0.0 {
            pilot_pass.seconds / picture_seconds
        } else {
            sample.grid.pixel_count_of_tile(pilot_pass.tile)
                / pixel_count(self.whole_picture_crop())
        }
    }

    /// Returns the crop that is the whole picture.
    fn whole_picture_crop(&self) -> Crop {
        let [width, height] = self.sample.grid.size;
        Crop {
            x: 0,
            y: 0,
            width,
            height,
        }
    }

    /// Estimates the errors of all denoised whole pictures from the pilots (two noisy pictures).
    /// The denominators of the relative error come from the denoised picture with the most samples.
    fn estimate_errors_from_pilots(&mut self) {
        let samples = |figures: &SettingMeasurements| {
            figures
                .setting
                .apply(self.renderer.scene, self.renderer.settings)
                .1
                .sampling
                .samples_per_pixel()
        };
        let is_free = |figures: &&SettingMeasurements| {
            figures
                .setting
                .without_ladder(Ladder::Reconstruction)
                .is_free_of_bias()
        };
        let best = self
            .setting_measurements
            .iter()
            .filter(|figures| !figures.whole_renders.is_empty())
            .filter(is_free)
            .max_by_key(|figures| samples(figures));
        let Some((pilots, best)) = self
            .pilots
            .as_ref()
            .zip(best.map(|figures| figures.whole_renders[0].picture.clone()))
        else {
            return;
        };
        for figures in self
            .setting_measurements
            .iter_mut()
            .filter(|figures| !figures.whole_renders.is_empty())
        {
            figures.whole_errors = Some(pilots.estimate_errors(
                figures.whole_renders.iter().map(|render| &render.picture),
                &best,
            ));
        }
    }

    /// Returns the crop to render for a tile of the sample; a denoised setting gets a margin around
    /// the tile.
    pub(super) fn crop_for_tile(&self, setting: &RungSetting, position: usize) -> Crop {
        let (tile, grid) = (self.sample.passes[position].tile, self.sample.grid);
        if self.is_denoised(setting) {
            grid.tile_crop_with_margin(tile, MARGIN)
        } else {
            grid.tile_crop(tile)
        }
    }

    /// Returns the share of a crop's pixels, 0 to 1, that belong to its tile.
    pub(super) fn tile_area_share(&self, position: usize, part: Crop) -> f64 {
        self.sample
            .grid
            .pixel_count_of_tile(self.sample.passes[position].tile)
            / (f64::from(part.width) * f64::from(part.height))
    }

    /// Whether a denoised setting is rendered as a whole picture instead of tiles with margins,
    /// because it has few samples.
    fn renders_whole_picture(&self, setting: &RungSetting) -> bool {
        let (_, settings) = setting.apply(self.renderer.scene, self.renderer.settings);
        settings.sampling.samples_per_pixel() <= self.whole_samples
    }

    /// Renders crops of a setting several times with different random numbers. Returns one list of
    /// crops per repetition, or `None` if the time runs out.
    fn render_crops(
        &self,
        setting: &RungSetting,
        parts: &[Crop],
        rounds: Range<u64>,
        end: Instant,
    ) -> Result<Option<Vec<Vec<TimedRender>>>, PrepareError> {
        rounds
            .map(|round| {
                UnfinishedRender::none_if_interrupted(
                    self.renderer.render_setting(setting, parts, round, end),
                )
            })
            .collect()
    }
}

/// Returns the number of pixels of a crop.
fn pixel_count(crop: Crop) -> f64 {
    f64::from(crop.width) * f64::from(crop.height)
}

/// Returns the repeated renders of one crop. `renders` holds one list per repetition, with a render
/// of each crop.
fn renders_of_crop(renders: &[Vec<TimedRender>], part: usize) -> Vec<&TimedRender> {
    renders.iter().map(|all| &all[part]).collect()
}
