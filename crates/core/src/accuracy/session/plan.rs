//! Plan of a measurement, made once from the speed of the pilot pass. It contains the number of
//! samples of the reference, and the number of tiles on which each setting is measured at first.
//!
//! Every plan has the same settings in the same order. It reserves twice their expected time, so
//! that no setting is dropped when the machine becomes slower. The remaining time goes to more
//! tiles for promising settings.

use super::super::ProgressListener;
use super::super::measurements::Measurements;
use super::super::pilot::PilotPicturePair;
use super::super::renderer::{MARGIN, UnfinishedRender};
use super::super::setting::RungSetting;
use super::super::tiles::{TileGrid, TileSample};
use super::{
    HALVING_SAMPLES, MeasurementSession, PILOTS_END, REFERENCE_END, RUNGS_END, rung_sample_count,
};
use crate::ladder::{Ladder, RungChoice};
use crate::prepare::PrepareError;

/// Samples per pixel of the reference: factor on the scene's own number, least number, greatest
/// number.
const BETTER: u32 = 4;
const LEAST_REFERENCE: u32 = 64;
const MOST_REFERENCE: u32 = 16_384;
/// Least number of tiles of a setting, unless the picture has fewer.
const FEWEST: usize = 6;
/// Share of the stage's time, 0 to 1, that the plan fills by expected times.
const CAREFUL: f64 = 0.5;
/// Largest share of the time budget that samples of the reference beyond the necessary number may
/// take.
const SPARE: f64 = 0.1;
/// Largest share of the remaining time that a single setting may take.
const MOST_OF_REST: f64 = 0.35;
/// Number of renders per tile for most settings. Bias cannot be separated from noise with a single
/// render.
pub(super) const ROUNDS: u64 = 2;
/// Share of the tiles on which settings of less important ladders are measured if the time is
/// short.
const REST: f64 = 1.0 / 3.0;
/// Largest share of the time budget for rendering one denoised whole picture.
const WHOLE: f64 = 0.1;
/// Largest share of the time budget for the two pilots, noisy whole pictures.
const BOTH_PILOTS: f64 = 0.16;
/// Ladders that most users change: number of samples, and denoising.
const NUMBERS: [Ladder; 2] = [Ladder::Samples, Ladder::Reconstruction];
/// Assumed time of a denoised picture divided by the time of the same picture without denoising.
const FILTER: f64 = 1.3;

/// Plan of a measurement: samples of the reference, and numbers of tiles and settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasurementPlan {
    /// Samples per pixel of the reference.
    pub reference_samples: u32,
    /// Number of tiles of the most important settings; slow settings get fewer.
    pub tiles: usize,
    /// Number of tiles of all other settings.
    secondary_tiles: usize,
    /// Number of planned settings.
    settings: usize,
}

impl MeasurementPlan {
    /// Returns the description of the plan that the progress listener shows.
    pub(super) fn description(&self, sample: &TileSample) -> String {
        let Self {
            reference_samples,
            tiles,
            settings,
            secondary_tiles: rest,
            ..
        } = self;
        let rest = if rest < tiles {
            format!("{rest} or ")
        } else {
            String::new()
        };
        format!(
            "plan: {settings} settings on {rest}{tiles} of {} tiles, reference of {reference_samples} samples",
            sample.grid.tile_count()
        )
    }
}

/// Setting to be measured, and the ladder (quality setting) that it changes.
struct PlannedSetting {
    setting: RungSetting,
    ladder: Ladder,
    compared_setting: Option<RungSetting>,
    keeps_pictures: bool,
}

impl PlannedSetting {
    /// Whether the setting belongs to one of the most important ladders, which are measured on more
    /// tiles.
    fn has_important_ladder(&self) -> bool {
        matches!(
            self.ladder,
            Ladder::Samples | Ladder::Reconstruction | Ladder::Integrator
        )
    }
}

impl MeasurementSession<'_> {
    /// Returns the plan for the tiles of this sample.
    pub(super) fn make_plan(&self, sample: &TileSample) -> MeasurementPlan {
        let grid = &sample.grid;
        let (tile_sample, budget) = (
            self.tile_sample_seconds(grid),
            self.effort.budget.as_secs_f64(),
        );
        let mut reference_samples = self.minimum_reference_samples();
        let fitting = self.affordable_tile_count(grid, 1.0);
        // If nearly all tiles fit, all are measured.
        let is_all = fitting + fitting / 4 >= sample.drawable_tile_count();
        let enough = |tiles: usize| tiles.max(FEWEST).min(sample.drawable_tile_count());
        let tiles = if is_all {
            sample.drawable_tile_count()
        } else {
            enough(self.affordable_tile_count(grid, REST))
        };
        let rest = if is_all {
            tiles
        } else {
            enough((tiles as f64 * REST) as usize)
        };
        if sample.covers_picture(tiles) {
            let whole = tile_sample * self.reference_time_ratio * tiles as f64;
            while reference_samples < MOST_REFERENCE
                && 4.0 * f64::from(reference_samples) * whole < SPARE * budget
            {
                reference_samples *= 4;
            }
        }
        MeasurementPlan {
            reference_samples,
            tiles,
            secondary_tiles: rest,
            settings: self.planned_settings().len(),
        }
    }

    /// Renders the pilots, two noisy whole pictures, with as many samples as their share of the
    /// time allows. No pilots are needed if all tiles are measured, or no setting is denoised.
    pub(super) fn render_pilots(
        &self,
        plan: &MeasurementPlan,
        measurements: &mut Measurements<'_>,
    ) -> Result<(), PrepareError> {
        let is_needed = self
            .planned_settings()
            .iter()
            .any(|item| measurements.is_denoised(&item.setting));
        if !is_needed || measurements.sample.covers_picture(plan.tiles) {
            return Ok(());
        }
        measurements.whole_samples = self.whole_picture_samples();
        let own = self.settings.sampling.samples_per_pixel();
        let cost = 2.0 * self.whole_picture_seconds(1) / FILTER;
        let maximum =
            ((BOTH_PILOTS * self.effort.budget.as_secs_f64() / cost.max(1e-12)) as u32).min(own);
        if maximum < 2 {
            return Ok(());
        }
        // Low-discrepancy sequences are most uniform at powers of two.
        let samples = 1 << maximum.ilog2();
        let render = |round| {
            UnfinishedRender::interrupted_as_none(measurements.renderer.render_pilot(
                samples,
                round,
                self.instant_of_budget_share(REFERENCE_END),
            ))
        };
        if let (Some(one), Some(other)) = (render(0)?, render(1)?) {
            measurements.pilots = Some(PilotPicturePair([one, other]));
        }
        Ok(())
    }

    /// Returns the expected wall-clock seconds of a denoised whole picture with this number of
    /// samples per pixel.
    fn whole_picture_seconds(&self, samples: u32) -> f64 {
        let [width, height] = self.settings.size.map(f64::from);
        self.seconds_per_sample * width * height * f64::from(samples) * FILTER
    }

    /// Returns the largest number of samples per pixel with which a denoised setting is rendered as
    /// a whole picture.
    fn whole_picture_samples(&self) -> u32 {
        (WHOLE * self.effort.budget.as_secs_f64() / self.whole_picture_seconds(1).max(1e-12)) as u32
    }

    /// Whether a setting is denoised and has so few samples that it is rendered as a whole picture.
    fn renders_denoised_whole_picture(&self, setting: &RungSetting) -> bool {
        let (_, settings) = setting.apply(self.scene, &self.settings);
        settings.denoise && settings.sampling.samples_per_pixel() <= self.whole_picture_samples()
    }

    /// Returns the least number of samples per pixel of the reference for this scene.
    fn minimum_reference_samples(&self) -> u32 {
        self.settings
            .sampling
            .samples_per_pixel()
            .saturating_mul(BETTER)
            .clamp(LEAST_REFERENCE, u32::from(u16::MAX) * 4)
    }

    /// Returns the expected wall-clock seconds of one sample for each pixel of a tile.
    fn tile_sample_seconds(&self, grid: &TileGrid) -> f64 {
        self.seconds_per_sample * f64::from(grid.size[0]) * f64::from(grid.size[1])
            / grid.tile_count() as f64
    }

    /// Returns the number of tiles for which the time suffices. Less important settings are
    /// measured on the share `rest`, 0 to 1, of these tiles.
    pub(super) fn affordable_tile_count(&self, grid: &TileGrid, rest: f64) -> usize {
        let (items, maximum) = (self.planned_settings(), self.full_tile_cost_limit(grid));
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
    fn full_tile_cost_limit(&self, grid: &TileGrid) -> f64 {
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
        let share = (self.full_tile_cost_limit(&sample.grid)
            / self.samples_per_tile_pixel(setting, &sample.grid))
        .min(1.0);
        ((tiles as f64 * share) as usize).max(FEWEST.min(tiles))
    }

    /// Returns the settings that change samples or denoising alone, with sample counts up to those
    /// that halve the error. Denoised settings are included if they are rendered as whole pictures.
    pub(super) fn common_sample_settings(&self) -> Vec<RungSetting> {
        let is_near = |setting: &RungSetting| {
            self.sample_count(setting)
                <= HALVING_SAMPLES.saturating_mul(self.settings.sampling.samples_per_pixel())
        };
        let is_one = |setting: &RungSetting| {
            setting
                .choices()
                .iter()
                .all(|choice| NUMBERS.contains(&choice.ladder()))
        };
        let is_cheap = |setting: &RungSetting| {
            setting.rung(Ladder::Reconstruction).is_none()
                || self.renders_denoised_whole_picture(setting)
        };
        let all = self.planned_settings().into_iter().map(|item| item.setting);
        all.filter(|setting| is_one(setting) && is_near(setting) && is_cheap(setting))
            .collect()
    }

    /// Returns every setting of the plan in order of importance. First come the scene's own setting
    /// and the baseline, the scene with fewer samples; then sample counts up to those that halve
    /// the error, with and without denoising; then the rungs (quality levels) of all other ladders,
    /// each ladder's most exact rung first; last larger sample counts.
    fn planned_settings(&self) -> Vec<PlannedSetting> {
        let item = |setting: RungSetting, ladder: Ladder| PlannedSetting {
            setting,
            ladder,
            compared_setting: None,
            keeps_pictures: false,
        };
        let own = PlannedSetting {
            keeps_pictures: true,
            ..item(RungSetting::default(), Ladder::Samples)
        };
        let near = |choice: &RungChoice| {
            rung_sample_count(*choice).is_some_and(|n| {
                n <= HALVING_SAMPLES.saturating_mul(self.settings.sampling.samples_per_pixel())
            })
        };
        let all = self
            .applicable_rungs(Ladder::Samples)
            .filter(|_| self.picture_ladders.contains(&Ladder::Samples));
        let (samples, far): (Vec<RungChoice>, Vec<RungChoice>) = all.partition(near);
        let denoised = Ladder::Reconstruction.choices().find(|choice| {
            self.picture_ladders.contains(&Ladder::Reconstruction) && !self.is_in_use(*choice)
        });
        let base = PlannedSetting {
            keeps_pictures: true,
            ..item(self.baseline.clone(), Ladder::Samples)
        };
        let mut all = vec![own, base];
        for setting in samples
            .into_iter()
            .map(|choice| self.setting_of_rung(choice))
            .chain([RungSetting::default()])
        {
            all.push(item(setting.clone(), Ladder::Samples));
            let other = denoised.map(|choice| setting.with_rung(choice));
            all.extend(
                other
                    .filter(|other| self.is_valid_setting(other))
                    .map(|other| item(other, Ladder::Reconstruction)),
            );
        }
        for &ladder in self
            .picture_ladders
            .iter()
            .filter(|&&ladder| ladder != Ladder::Samples)
        {
            let (exact, beside) = (
                self.most_exact_setting(ladder),
                self.baseline_for_ladder(ladder),
            );
            let is_paired = ladder.shares_random_numbers();
            let pair = |setting: &RungSetting| is_paired.then(|| setting.clone());
            let others = self
                .applicable_rungs(ladder)
                .filter(|choice| !self.infeasible_rungs.contains(choice))
                .map(|choice| self.setting_of_rung(choice));
            all.push(PlannedSetting {
                compared_setting: pair(&beside),
                keeps_pictures: true,
                ..item(exact.clone(), ladder)
            });
            all.extend(others.map(|other| PlannedSetting {
                compared_setting: pair(&exact),
                ..item(other, ladder)
            }));
        }
        all.extend(
            far.into_iter()
                .map(|choice| item(self.setting_of_rung(choice), Ladder::Samples)),
        );
        let mut settings: Vec<RungSetting> = Vec::new();
        all.retain(|item| {
            let is_new = !settings.contains(&item.setting) && self.is_valid_setting(&item.setting);
            settings.push(item.setting.clone());
            is_new
        });
        all
    }

    /// Measures every setting of the plan. Returns the settings that were compared with another
    /// setting under the same random numbers, each with its ladder.
    pub(super) fn measure_rungs(
        &mut self,
        plan: &MeasurementPlan,
        measurements: &mut Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<Vec<(RungSetting, Ladder)>, PrepareError> {
        let mut pairs = Vec::new();
        if measurements.sample.covers_picture(plan.tiles) {
            // The first picture of a size also includes the time of memory allocation, so it is not
            // measured.
            let first = measurements.renderer.render_setting(
                &RungSetting::default(),
                &[],
                0,
                self.instant_of_budget_share(RUNGS_END),
            );
            UnfinishedRender::interrupted_as_none(first)?;
        }
        for (i, item) in self.planned_settings().into_iter().enumerate() {
            let (
                is_telling,
                PlannedSetting {
                    setting,
                    ladder,
                    compared_setting: beside,
                    keeps_pictures: is_kept,
                },
            ) = (item.has_important_ladder(), item);
            listener.report_step(&setting.to_string(), self.spent_budget_share());
            let tiles = if is_telling {
                plan.tiles
            } else {
                plan.secondary_tiles
            };
            let tiles = self.setting_tile_count(&setting, tiles, measurements.sample);
            let left = self.seconds_until_budget_share(RUNGS_END);
            let expected = self.expected_seconds(&setting, tiles, &measurements.sample.grid);
            if i > 0 && expected > MOST_OF_REST * left {
                // This setting would take the time of many others, and perhaps not finish.
                self.cut_short = true;
                continue;
            }
            // Without the scene's own picture the report is empty, so this picture may take all
            // remaining time.
            let end = self.instant_of_budget_share(if i == 0 { 1.0 } else { RUNGS_END });
            let rounds = self.round_count(&setting);
            self.cut_short |= !measurements.measure_setting(
                &setting,
                (tiles, rounds),
                beside.as_ref(),
                is_kept,
                end,
            )?;
            if beside.is_some() {
                pairs.push((setting, ladder));
            }
        }
        Ok(pairs)
    }
}
