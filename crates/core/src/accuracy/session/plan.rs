//! What will be measured, decided once by how fast the first look was: how many samples the reference has, and on how many tiles all
//! settings are measured before any has more.
//!
//! Every plan has the same settings in the same order, and reserves twice the time that they are expected to take, so that a machine that
//! gets slower drops none. What is left goes to more tiles for those that are worth naming.

use super::super::Listener;
use super::super::measurements::Measurements;
use super::super::renderer::{MARGIN, Unfinished};
use super::super::setting::Setting;
use super::super::tiles::{Grid, TileSample};
use super::{HALVES, REACH, RUNGS, Session, samples_of};
use crate::ladder::{Choice, Ladder};
use crate::prepare::PrepareError;

/// Samples of the reference over those in use, and at least.
const BETTER: u32 = 4;
const LEAST_REFERENCE: u32 = 64;
const MOST_REFERENCE: u32 = 16_384;
/// Time that the reference takes a sample over that of the picture: all of it is f64, and on the most exact rungs.
const EXACT: f64 = 1.8;
/// Tiles that settings are measured on at least, where the picture has so many.
const FEWEST: usize = 6;
/// The share of the time for rungs that they are expected to take.
const CAREFUL: f64 = 0.5;
/// The share of all time that a reference of more samples than it needs may take.
const SPARE: f64 = 0.1;
/// The share of the time that is left which one setting may take.
const MOST_OF_REST: f64 = 0.35;
/// Rounds of most settings. One says nothing of bias.
pub(super) const ROUNDS: u64 = 2;

/// What will be measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasurementPlan {
    pub reference_samples: u32,
    /// Tiles that all settings are measured on first, apart from those that take long.
    pub tiles: usize,
    /// Settings that are measured on them.
    settings: usize,
    /// Wall-clock seconds that a sample of a tile takes.
    pub tile_sample: f64,
}

impl MeasurementPlan {
    /// In words.
    pub(super) fn told(&self, sample: &TileSample) -> String {
        let Self { reference_samples, tiles, settings, .. } = self;
        format!("plan: {settings} settings on {tiles} of {} tiles, reference of {reference_samples} samples", sample.grid.count())
    }
}

/// A setting with what its pictures are held beside, and whether they are kept for that.
struct Item {
    setting: Setting,
    ladder: Ladder,
    beside: Option<Setting>,
    is_kept: bool,
}

impl Session<'_> {
    pub(super) fn plan(&self, sample: &TileSample, pace: f64) -> MeasurementPlan {
        let grid = &sample.grid;
        let (tile_sample, budget) = (self.tile_sample(grid, pace), self.effort.budget.as_secs_f64());
        let mut reference_samples = self.least_reference();
        let fitting = self.fitting(grid, pace);
        // A few tiles more than what is there are not worth leaving out.
        let tiles = if fitting + fitting / 4 >= sample.most() { sample.most() } else { fitting.max(FEWEST).min(sample.most()) };
        if sample.is_whole(tiles) {
            let whole = tile_sample * EXACT * tiles as f64;
            while reference_samples < MOST_REFERENCE && 4.0 * f64::from(reference_samples) * whole < SPARE * budget {
                reference_samples *= 4;
            }
        }
        MeasurementPlan { reference_samples, tiles, settings: self.items().len(), tile_sample }
    }

    fn least_reference(&self) -> u32 {
        self.settings.sampling.count().saturating_mul(BETTER).clamp(LEAST_REFERENCE, u32::from(u16::MAX) * 4)
    }

    /// Wall-clock seconds of a sample of all pixels of a tile.
    fn tile_sample(&self, grid: &Grid, pace: f64) -> f64 {
        pace * f64::from(grid.size[0]) * f64::from(grid.size[1]) / grid.count() as f64
    }

    /// Tiles that there is time for.
    pub(super) fn fitting(&self, grid: &Grid, pace: f64) -> usize {
        let (items, most) = (self.items(), self.most(grid));
        let costs: f64 = items.iter().map(|item| self.cost(&item.setting, grid).min(most)).sum();
        let a_tile = self.tile_sample(grid, pace) * (EXACT * f64::from(self.least_reference()) + costs);
        let time = self.effort.budget.as_secs_f64() * (RUNGS - REACH) * CAREFUL;
        (time / a_tile.max(1e-12)) as usize
    }

    /// Samples that a tile of a setting takes in all its rounds, what is around it for the denoiser included.
    pub(super) fn cost(&self, setting: &Setting, grid: &Grid) -> f64 {
        let is_denoised = setting.applied(self.scene, &self.settings).1.denoise;
        let edge = f64::from(grid.edge);
        let wide = if is_denoised { (edge + 2.0 * f64::from(MARGIN)) / edge } else { 1.0 };
        self.rounds(setting) as f64 * f64::from(self.samples(setting)) * wide * wide
    }

    /// Those of many samples are rendered once: they have the bias of those of few.
    pub(super) fn rounds(&self, setting: &Setting) -> u64 {
        if self.samples(setting) > self.settings.sampling.count() { 1 } else { ROUNDS }
    }

    /// What a setting may take on a tile, in samples, before it has fewer tiles than others.
    fn most(&self, grid: &Grid) -> f64 {
        2.0 * self.cost(&Setting::default(), grid)
    }

    /// Tiles that a setting is measured on where most have so many.
    pub(super) fn tiles_of(&self, setting: &Setting, tiles: usize, sample: &TileSample) -> usize {
        let share = (self.most(&sample.grid) / self.cost(setting, &sample.grid)).min(1.0);
        ((tiles as f64 * share) as usize).max(FEWEST.min(tiles))
    }

    /// Every setting of a plan, the most telling first: the scene as it is, numbers of samples that may be worth their time, with and without
    /// denoising, what the other rungs are put on, these, each ladder's most exact one first, and more samples than anyone needs who has so many.
    fn items(&self) -> Vec<Item> {
        let item = |setting: Setting, ladder: Ladder| Item { setting, ladder, beside: None, is_kept: false };
        let own = Item { is_kept: true, ..item(Setting::default(), Ladder::Samples) };
        let near =
            |choice: &Choice| samples_of(*choice).is_some_and(|n| n <= HALVES.saturating_mul(self.settings.sampling.count()));
        let all = self.choices_of(Ladder::Samples).filter(|_| self.pictured.contains(&Ladder::Samples));
        let (samples, far): (Vec<Choice>, Vec<Choice>) = all.partition(near);
        let denoised = Ladder::Reconstruction
            .choices()
            .find(|choice| self.pictured.contains(&Ladder::Reconstruction) && !self.is_in_use(*choice));
        let base = Item { is_kept: true, ..item(self.base.clone(), Ladder::Samples) };
        let mut all = vec![own, base];
        for setting in samples.into_iter().map(|choice| self.setting(choice)).chain([Setting::default()]) {
            all.push(item(setting.clone(), Ladder::Samples));
            let other = denoised.map(|choice| setting.with(choice));
            all.extend(other.filter(|other| self.is_possible(other)).map(|other| item(other, Ladder::Reconstruction)));
        }
        for &ladder in self.pictured.iter().filter(|&&ladder| ladder != Ladder::Samples) {
            let (exact, beside) = (self.most_exact(ladder), self.beside(ladder));
            let is_paired = ladder.shares_random_numbers();
            let pair = |setting: &Setting| is_paired.then(|| setting.clone());
            let others =
                self.choices_of(ladder).filter(|choice| !self.beyond.contains(choice)).map(|choice| self.setting(choice));
            all.push(Item { beside: pair(&beside), is_kept: true, ..item(exact.clone(), ladder) });
            all.extend(others.map(|other| Item { beside: pair(&exact), ..item(other, ladder) }));
        }
        all.extend(far.into_iter().map(|choice| item(self.setting(choice), Ladder::Samples)));
        let mut known: Vec<Setting> = Vec::new();
        all.retain(|item| {
            let is_new = !known.contains(&item.setting) && self.is_possible(&item.setting);
            known.push(item.setting.clone());
            is_new
        });
        all
    }

    /// Measures every setting of the plan in turn. Gives those that were held beside others, with the ladders that they were held on.
    pub(super) fn rungs(
        &mut self,
        plan: &MeasurementPlan,
        measurements: &mut Measurements<'_>,
        listener: &mut dyn Listener,
    ) -> Result<Vec<(Setting, Ladder)>, PrepareError> {
        let mut pairs = Vec::new();
        if measurements.sample.is_whole(plan.tiles) {
            // The first picture of a size also takes the time for its memory.
            let first = measurements.renderer.take(&Setting::default(), &[], 0, self.at(RUNGS));
            Unfinished::allow(first)?;
        }
        for (i, Item { setting, ladder, beside, is_kept }) in self.items().into_iter().enumerate() {
            listener.step(&setting.to_string(), self.spent());
            let tiles = self.tiles_of(&setting, plan.tiles, measurements.sample);
            let left = self.at(RUNGS).saturating_duration_since((self.now)()).as_secs_f64();
            let expected = plan.tile_sample * tiles as f64 * self.cost(&setting, &measurements.sample.grid);
            if i > 0 && expected > MOST_OF_REST * left {
                // It would take the time of many others, and perhaps not be there in the end.
                self.cut_short = true;
                continue;
            }
            // Without the scene's own picture there is nothing to tell, so that one may take what there is.
            let end = self.at(if i == 0 { 1.0 } else { RUNGS });
            let rounds = self.rounds(&setting);
            self.cut_short |= !measurements.measure(&setting, (tiles, rounds), beside.as_ref(), is_kept, end)?;
            if beside.is_some() {
                pairs.push((setting, ladder));
            }
        }
        Ok(pairs)
    }
}
