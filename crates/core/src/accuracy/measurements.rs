//! Measurements of each setting, tile by tile, from which the errors and times of the whole picture
//! are estimated.

mod estimates;
mod rung_cost;
mod turn_timing;

use std::ops::Range;
use std::time::Instant;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

pub(super) use estimates::RelativeCost;

use super::estimate::{ReferenceTile, TileErrors, total_radiance};
use super::pilot::{PictureBlockErrors, PilotPicturePair};
use super::renderer::{MARGIN, SettingRenderer, TimedRender, UnfinishedRender};
use super::setting::RungSetting;
use super::tiles::TileSample;
use crate::display::Display;
use crate::ladder::Ladder;
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Errors, times and rays of a setting in a tile.
struct TileMeasurement {
    errors: TileErrors,
    /// Render time of the tile in seconds, without its margin, for each repetition (round). Each
    /// time is divided by the number of rounds, so that their sum is the mean.
    seconds: Vec<f64>,
    /// Seconds of the first repetition: the time of the rendered crop times the share of its pixels
    /// that lie in the tile.
    first_seconds: f64,
    rays: f64,
    /// Sum of the tile's radiance before denoising.
    noisy_light: f64,
}

/// Input of the comparison of a tile with the reference: index of the tile in the sample, rendered
/// crop, share of the crop's time that the tile gets, and repeated renders of the crop.
type TileRenderInput<'r> = (usize, Crop, f64, Vec<&'r TimedRender>);

/// Returns the repeated renders of one crop. `renders` holds one list per repetition, with a render
/// of each crop.
fn renders_of_crop(renders: &[Vec<TimedRender>], part: usize) -> Vec<&TimedRender> {
    renders.iter().map(|all| &all[part]).collect()
}

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
        if self.setting_measurements[index].rounds < rounds {
            let known_figures = std::mem::replace(
                &mut self.setting_measurements[index],
                SettingMeasurements::new(setting, rounds),
            );
            let is_done = self.measure_missing_tiles(index, count, beside, keep, end)?;
            if !is_done {
                self.setting_measurements[index] = known_figures;
            }
            return Ok(is_done);
        }
        self.measure_missing_tiles(index, count, beside, keep, end)
    }

    /// Renders and measures the tiles before `count` that a setting lacks, in tiles or as a whole
    /// picture, whichever has fewer pixels. Returns false if the time runs out.
    fn measure_missing_tiles(
        &mut self,
        index: usize,
        count: usize,
        beside: Option<&RungSetting>,
        keep: bool,
        end: Instant,
    ) -> Result<bool, PrepareError> {
        let SettingMeasurements {
            setting,
            rounds,
            tiles,
            ..
        } = &self.setting_measurements[index];
        let (setting, rounds, from) = (setting.clone(), 0..*rounds, tiles.len());
        if from >= count {
            return Ok(true);
        }
        let is_denoised = self.is_denoised(&setting);
        let grid = self.sample.grid;
        let area = |crop: Crop| f64::from(crop.width) * f64::from(crop.height);
        let whole_crop = Crop {
            x: 0,
            y: 0,
            width: grid.size[0],
            height: grid.size[1],
        };
        let of_parts: f64 = (from..count)
            .map(|position| area(self.crop_for_tile(&setting, position)))
            .sum();
        let is_all = self.sample.covers_picture(count);
        if is_all
            || of_parts >= area(whole_crop)
            || is_denoised && self.renders_whole_picture(&setting)
        {
            let mut renders = std::mem::take(&mut self.setting_measurements[index].whole_renders);
            let is_new = renders.is_empty();
            if is_new {
                let Some(taken_renders) = self.render_crops(&setting, &[], rounds, end)? else {
                    return Ok(false);
                };
                renders = taken_renders.into_iter().flatten().collect();
            }
            let looked: f64 = self
                .sample
                .passes
                .iter()
                .map(|pilot_pass| pilot_pass.seconds)
                .sum();
            let looked =
                looked * grid.tile_count() as f64 / self.sample.drawable_tile_count() as f64;
            let first = is_all.then(|| renders[0].picture.clone());
            let figures = &mut self.setting_measurements[index];
            if is_new {
                (figures.tiles, figures.pictures, figures.first_picture) =
                    (Vec::new(), Vec::new(), first);
                figures.whole_seconds = Some(renders[0].seconds);
            }
            let from = self.setting_measurements[index].tiles.len();
            let share = |position: usize| {
                let pilot_pass = &self.sample.passes[position];
                if looked > 0.0 {
                    pilot_pass.seconds / looked
                } else {
                    grid.pixel_count_of_tile(pilot_pass.tile) / area(whole_crop)
                }
            };
            let all = || renders.iter().collect::<Vec<_>>();
            self.record_tile_errors(
                index,
                (from..count)
                    .map(|position| (position, whole_crop, share(position), all()))
                    .collect(),
                beside,
                keep,
            );
            if is_denoised && !is_all {
                self.setting_measurements[index].whole_renders = renders;
                if is_new {
                    self.estimate_errors_from_pilots();
                }
            }
            return Ok(true);
        }
        let parts: Vec<Crop> = (from..count)
            .map(|position| self.crop_for_tile(&setting, position))
            .collect();
        let Some(renders) = self.render_crops(&setting, &parts, rounds, end)? else {
            return Ok(false);
        };
        let renders = parts.iter().enumerate().map(|(i, &part)| {
            (
                from + i,
                part,
                self.tile_area_share(from + i, part),
                renders_of_crop(&renders, i),
            )
        });
        self.record_tile_errors(index, renders.collect(), beside, keep);
        Ok(true)
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
    fn crop_for_tile(&self, setting: &RungSetting, position: usize) -> Crop {
        let (tile, grid) = (self.sample.passes[position].tile, self.sample.grid);
        if self.is_denoised(setting) {
            grid.tile_crop_with_margin(tile, MARGIN)
        } else {
            grid.tile_crop(tile)
        }
    }

    /// Returns the share of a crop's pixels, 0 to 1, that belong to its tile.
    fn tile_area_share(&self, position: usize, part: Crop) -> f64 {
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

    pub(super) fn is_denoised(&self, setting: &RungSetting) -> bool {
        setting
            .apply(self.renderer.scene, self.renderer.settings)
            .1
            .denoise
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
                UnfinishedRender::interrupted_as_none(
                    self.renderer.render_setting(setting, parts, round, end),
                )
            })
            .collect()
    }

    /// Returns the seconds that tracing takes per tile, without denoising, for a denoised setting
    /// that is rendered with margins. The times were measured for the same setting without
    /// denoising. The crop's time cannot be divided by pixels: tiles are drawn in noisy places,
    /// where tracing takes longer than in the margin. Empty for other settings.
    fn tracing_seconds_without_denoising(&self, index: usize) -> Vec<f64> {
        let figures = &self.setting_measurements[index];
        if !self.is_denoised(&figures.setting) || figures.whole_seconds.is_some() {
            return Vec::new();
        }
        let own_figures = self
            .setting_measurements
            .iter()
            .find(|other| self.differs_only_in_denoising(&other.setting, &figures.setting));
        own_figures.map_or(Vec::new(), |own_figures| {
            own_figures
                .tiles
                .iter()
                .map(|tile| tile.seconds.iter().sum())
                .collect()
        })
    }

    /// Whether `noisy` and `denoised` are the same setting except for denoising.
    fn differs_only_in_denoising(&self, noisy: &RungSetting, denoised: &RungSetting) -> bool {
        let without = |setting: &RungSetting| setting.without_ladder(Ladder::Reconstruction);
        without(noisy) == without(denoised) && !self.is_denoised(noisy)
    }

    /// Compares renders of crops with the reference, one tile per crop, and appends the
    /// measurements of the tiles. A tile gets its share of the crop's time.
    fn record_tile_errors(
        &mut self,
        index: usize,
        renders: Vec<TileRenderInput<'_>>,
        beside: Option<&RungSetting>,
        keep: bool,
    ) {
        let other = beside.and_then(|setting| self.find_setting_measurements(setting));
        let noisy_seconds = self.tracing_seconds_without_denoising(index);
        let seconds =
            |position: usize, share: f64, render: &TimedRender| match noisy_seconds.get(position) {
                Some(tracing) => tracing + share * render.denoising_seconds,
                None => share * render.seconds,
            };
        let judged: Vec<(TileMeasurement, Vec<Picture>)> = renders
            .into_par_iter()
            .map(|(position, part, share, renders)| {
                let tile = self
                    .sample
                    .grid
                    .tile_crop(self.sample.passes[position].tile);
                let pictures: Vec<Picture> = renders
                    .iter()
                    .map(|render| crop_picture(&render.picture, part, tile))
                    .collect();
                let by_chance = renders.iter().any(|render| render.is_random);
                let other = other
                    .and_then(|each_figures| each_figures.pictures.get(position))
                    .map_or(&[][..], Vec::as_slice);
                let count = renders.len() as f64;
                let noisy = pictures
                    .iter()
                    .zip(&renders)
                    .map(|(picture, render)| total_radiance(picture) / render.light_ratio);
                let figures = TileMeasurement {
                    errors: self.reference_tiles[position].measure_tile_errors(
                        &pictures,
                        by_chance,
                        other,
                        self.display,
                    ),
                    seconds: renders
                        .iter()
                        .map(|render| seconds(position, share, render) / count)
                        .collect(),
                    first_seconds: share * renders[0].seconds,
                    rays: share * renders.iter().map(|render| render.rays as f64).sum::<f64>()
                        / count,
                    noisy_light: noisy.sum::<f64>() / count,
                };
                (figures, pictures)
            })
            .collect();
        let each_figures = &mut self.setting_measurements[index];
        for (figures, pictures) in judged {
            each_figures.tiles.push(figures);
            if each_figures.first_picture.is_none() {
                each_figures.first_picture = pictures.first().cloned();
            }
            if keep {
                each_figures.pictures.push(pictures);
            }
        }
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

/// Cuts a tile out of the picture of a crop; both rectangles are in pixels of the whole picture.
pub(super) fn crop_picture(picture: &Picture, part: Crop, tile: Crop) -> Picture {
    let (x, y) = ((tile.x - part.x) as usize, (tile.y - part.y) as usize);
    let rows = picture
        .rgb
        .chunks_exact(picture.width as usize)
        .skip(y)
        .take(tile.height as usize);
    let rgb = rows
        .flat_map(|row| &row[x..x + tile.width as usize])
        .copied()
        .collect();
    Picture {
        rgb,
        ..Picture::new(tile.width, tile.height)
    }
}
