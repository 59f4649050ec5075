//! Measurements of each setting, tile by tile, from which the errors and times of the whole picture
//! are estimated.

mod alternating_timing;
mod estimates;
mod missing_tiles;
mod rung_cost;
pub(super) mod tile_errors;

use std::time::Instant;

pub(super) use estimates::RelativeCost;
use missing_tiles::MissingTiles;
use tile_errors::TileMeasurement;

use super::estimate::ReferenceTile;
use super::pilot::{PictureBlockErrors, PilotPicturePair};
use super::renderer::{SettingRenderer, TimedRender};
use super::setting::RungSetting;
use super::tiles::TileSample;
use crate::display::Display;
use crate::picture::Picture;
use crate::prepare::PrepareError;

/// Measurements of a setting on the first tiles of the drawing order.
#[derive(Default)]
struct SettingMeasurements {
    setting: RungSetting,
    rounds: u64,
    tiles: Vec<TileMeasurement>,
    /// Repeated renders of each tile, kept for comparison with other settings; empty if not kept.
    pictures: Vec<Vec<Picture>>,
    /// First render of the first tile; of the whole picture if all tiles are measured.
    first_picture: Option<Picture>,
    /// Repeated renders of the whole picture. Further tiles are cut from them without a new render.
    /// Empty if tiles were rendered.
    whole_renders: Vec<TimedRender>,
    /// Errors of the whole picture, estimated from the pilots, a pair of noisy pictures.
    whole_errors: Option<PictureBlockErrors>,
    /// Seconds of the first render of the whole picture; `None` if tiles were rendered.
    whole_seconds: Option<f64>,
    /// Time of each repetition, measured while settings were rendered alternately (in turns),
    /// divided by the time of the first render. Empty if the setting was not timed in this way.
    turn_ratios: Vec<f64>,
}

impl SettingMeasurements {
    /// Creates the measurements of a setting that is not yet rendered.
    fn new(setting: &RungSetting, rounds: u64) -> Self {
        Self {
            setting: setting.clone(),
            rounds,
            ..Self::default()
        }
    }
}

/// Measurements of all settings and tiles of the reference, for one scene.
pub(super) struct Measurements<'a> {
    pub renderer: &'a SettingRenderer<'a>,
    pub sample: &'a TileSample,
    display: Display,
    reference_tiles: Vec<ReferenceTile>,
    setting_measurements: Vec<SettingMeasurements>,
    /// Pair of noisy pictures of the full size, from which errors of denoised pictures are
    /// estimated.
    pub pilots: Option<PilotPicturePair>,
    /// Largest number of samples per pixel with which denoised settings are rendered as whole
    /// pictures.
    pub whole_samples: u32,
    /// Whether settings were timed in turns (rendered alternately) or time was lacking for it.
    has_timed_in_turns: bool,
}

impl<'a> Measurements<'a> {
    /// Creates a collection without measurements.
    pub fn new(
        renderer: &'a SettingRenderer<'a>,
        sample: &'a TileSample,
        display: Display,
    ) -> Self {
        Self {
            renderer,
            sample,
            display,
            reference_tiles: Vec::new(),
            setting_measurements: Vec::new(),
            pilots: None,
            whole_samples: 0,
            has_timed_in_turns: false,
        }
    }

    /// Adds the next tiles of the reference, in the order in which tiles were drawn.
    pub fn add_reference_tiles(&mut self, tiles: impl Iterator<Item = ReferenceTile>) {
        self.reference_tiles.extend(tiles);
    }

    /// Returns the number of tiles whose reference is rendered.
    pub fn reference_tile_count(&self) -> usize {
        self.reference_tiles.len()
    }

    /// Returns the measurements of a setting; `None` if no tile was measured.
    fn find_setting_measurements(&self, setting: &RungSetting) -> Option<&SettingMeasurements> {
        self.setting_measurements
            .iter()
            .find(|figures| figures.setting == *setting && !figures.tiles.is_empty())
    }

    /// Returns all measured settings, in the order of their measurement.
    pub fn measured_settings(&self) -> Vec<RungSetting> {
        self.setting_measurements
            .iter()
            .filter(|figures| !figures.tiles.is_empty())
            .map(|figures| figures.setting.clone())
            .collect()
    }

    /// Returns the number of tiles on which a setting was measured.
    pub fn measured_tile_count(&self, setting: &RungSetting) -> usize {
        self.find_setting_measurements(setting)
            .map_or(0, |figures| figures.tiles.len())
    }

    /// Measures a setting on the first `count` tiles, each rendered as often as `rounds` says. Only
    /// missing tiles are rendered, unless `rounds` grows. The pictures are compared with the kept
    /// pictures of the setting `beside`. With `keep`, the pictures of this setting are kept for
    /// such comparisons. Returns false if the time runs out; an unfinished render does not count.
    pub fn measure_setting(
        &mut self,
        setting: &RungSetting,
        (count, rounds): (usize, u64),
        beside: Option<&RungSetting>,
        keep: bool,
        end: Instant,
    ) -> Result<bool, PrepareError> {
        let count = count.min(self.reference_tile_count());
        let index = self
            .setting_measurements
            .iter()
            .position(|figures| figures.setting == *setting)
            .unwrap_or(self.setting_measurements.len());
        if index == self.setting_measurements.len() {
            self.setting_measurements
                .push(SettingMeasurements::new(setting, rounds));
        }
        let missing = MissingTiles {
            index,
            count,
            beside,
            keep,
            end,
        };
        if self.setting_measurements[index].rounds < rounds {
            let known_figures = std::mem::replace(
                &mut self.setting_measurements[index],
                SettingMeasurements::new(setting, rounds),
            );
            let is_done = self.measure_missing_tiles(&missing)?;
            if !is_done {
                self.setting_measurements[index] = known_figures;
            }
            return Ok(is_done);
        }
        self.measure_missing_tiles(&missing)
    }

    /// Whether a setting denoises its pictures.
    pub(super) fn is_denoised(&self, setting: &RungSetting) -> bool {
        setting
            .apply(self.renderer.scene, self.renderer.settings)
            .1
            .denoise
    }

    /// Returns the first kept picture of each tile of a setting, with the tile's inclusion
    /// probability.
    pub fn kept_pictures(&self, setting: &RungSetting) -> Vec<(f64, &Picture)> {
        let pictures = self
            .find_setting_measurements(setting)
            .map_or(&[][..], |figures| &figures.pictures);
        let chances = self.sample.inclusion_probabilities(pictures.len());
        chances
            .into_iter()
            .zip(pictures)
            .filter_map(|(chance, all)| Some((chance, all.first()?)))
            .collect()
    }

    /// Returns a setting's first render of the first tile, or of the whole picture if all tiles
    /// were measured.
    pub fn first_picture(&self, setting: &RungSetting) -> Option<&Picture> {
        self.find_setting_measurements(setting)?
            .first_picture
            .as_ref()
    }

    /// Returns the reference picture of the first tile.
    pub fn reference_picture(&self) -> Option<&Picture> {
        self.reference_tiles.first().map(|tile| &tile.picture)
    }
}
