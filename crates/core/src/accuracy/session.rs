//! Course of a measurement: pilot pass over the tiles, choice of the reference's rungs, plan,
//! reference, every rung, combinations of rungs, more tiles for promising settings, costs of
//! effects. Each stage has its share of the time budget.

mod feasible;
mod plan;
mod price;
mod rows;
mod turns;
mod walks;

use std::time::Instant;
use std::vec;

use super::estimate::TruthTile;
use super::measurements::Measurements;
use super::outputs::outputs;
use super::renderer::{ClockFunction, GrowingReference, Renderer};
use super::report::{AccuracyReport, LadderReport, Reference, Tiles};
use super::setting::Setting;
use super::tiles::TileSample;
use super::{AccuracyEffort, KeptReference, MeasureError, MeasurementStart, ProgressListener};
use crate::bench::clock::Stopwatch;
use crate::denoise;
use crate::dispatch::collapsed;
use crate::display::Display;
use crate::effects::{EffectSet, detect};
use crate::ladder::{Ladder, RungChoice, RungValue, called_for, reached};
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

/// Shares of the time budget, 0 to 1, at which each stage of the measurement must end.
const LOOK: f64 = 0.06;
const REACH: f64 = 0.12;
const PILOTS: f64 = 0.27;
const REFERENCE: f64 = 0.45;
const RUNGS: f64 = 0.74;
const WALKS: f64 = 0.8;
const AGAIN: f64 = 0.87;
const TURNS: f64 = 0.92;
const PRICES: f64 = 0.94;
const COSTS: f64 = 0.96;

/// Number of samples per pixel with which rungs of other ladders are measured in a scene with more
/// samples. The effect of a rung is as visible, and more tiles can be measured.
const BASE_SAMPLES: u32 = 16;
/// Assumed ratio of the time of a reference sample to the time of a sample of the scene's own
/// setting, until the ratio is measured.
const EXACT: f64 = 1.8;
/// Multiple of the scene's sample count that halves its error. Sample counts up to this multiple
/// are measured first.
const HALVES: u32 = 4;

pub(super) struct MeasurementSession<'a> {
    scene: &'a Scene,
    settings: Settings,
    display: Display,
    effort: AccuracyEffort,
    observer: &'a dyn Observer,
    stopwatch: Stopwatch,
    now: ClockFunction<'a>,
    start: Instant,
    /// Setting to which rungs other than sample counts are applied: the scene's own, or the scene
    /// with fewer samples.
    base: Setting,
    /// Effects that the scene needs.
    present: EffectSet,
    pictured: Vec<Ladder>,
    priced: Vec<Ladder>,
    /// Rungs that take too long to measure on a trial tile.
    beyond: Vec<RungChoice>,
    /// Rungs whose precision cannot store the scene, so that they have no picture.
    unshown: Vec<RungChoice>,
    cut_short: bool,
    /// Wall-clock seconds per sample of a pixel.
    pace: f64,
    /// Ratio of the time of a reference sample to the time of a sample of the scene's own setting.
    exact_cost: f64,
}

impl<'a> MeasurementSession<'a> {
    pub fn new(
        scene: &'a Scene,
        settings: &Settings,
        display: Display,
        effort: AccuracyEffort,
        observer: &'a dyn Observer,
        (stopwatch, now): (Stopwatch, ClockFunction<'a>),
    ) -> Self {
        let effects = detect(scene, settings);
        let (mut pictured, priced): (Vec<Ladder>, Vec<Ladder>) = reached(scene, settings, &effects)
            .filter(|&ladder| ladder != Ladder::Output)
            .partition(|ladder| ladder.changes_pictures());
        // Ladders by descending usual benefit.
        const FIRST: [Ladder; 7] = [
            Ladder::Samples,
            Ladder::Reconstruction,
            Ladder::Integrator,
            Ladder::LightSampling,
            Ladder::PathLength,
            Ladder::Roulette,
            Ladder::TextureFilter,
        ];
        pictured.sort_by_key(|ladder| {
            FIRST
                .iter()
                .position(|first| first == ladder)
                .unwrap_or(FIRST.len())
        });
        let lost = |&choice: &RungChoice| {
            let (scene, settings) = Setting::single(choice).applied(scene, settings);
            !collapsed(&scene, settings.precision).is_empty()
        };
        let unshown = Ladder::Precision.choices().filter(lost).collect();
        let has_more =
            pictured.contains(&Ladder::Samples) && settings.sampling.count() > BASE_SAMPLES;
        let fewer = Ladder::Samples
            .choices()
            .find(|&choice| has_more && samples_of(choice) == Some(BASE_SAMPLES));
        let base = fewer.map(Setting::single).unwrap_or_default();
        let size = effort.size.unwrap_or(settings.size);
        let settings = Settings {
            size,
            crop: None,
            aovs: Vec::new(),
            max_error: None,
            ..settings.clone()
        };
        let start = now();
        Self {
            scene,
            settings,
            display,
            effort,
            observer,
            stopwatch,
            now,
            start,
            base,
            present: called_for(&effects),
            pictured,
            priced,
            beyond: Vec::new(),
            unshown,
            cut_short: false,
            pace: 0.0,
            exact_cost: EXACT,
        }
    }

    pub fn run(
        mut self,
        start: MeasurementStart<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(AccuracyReport, KeptReference), MeasureError> {
        let settings = self.settings.clone();
        let renderer = Renderer::new(
            self.scene,
            &settings,
            self.observer,
            (self.stopwatch, self.now),
        );
        let kept_reference = start.reference.as_ref();
        listener.step("looking at the picture", 0.0);
        let explained = |error| renderer.explained(error);
        let grid = self
            .grid(
                &renderer,
                kept_reference.map(|kept_reference| kept_reference.film.tile_size()),
            )
            .map_err(explained)?;
        let looks = self.look(&renderer, grid).map_err(explained)?;
        listener.step("looking how exact it can be", self.spent());
        let reached = self
            .within_reach(&renderer, grid, &looks)
            .map_err(explained)?;
        let exact =
            kept_reference.map_or(reached, |kept_reference| Setting::of(&kept_reference.rungs));
        let sample = TileSample::new(grid, &looks);
        let mut plan = self.plan(&sample);
        if let Some(kept_reference) = kept_reference {
            plan.reference_samples = plan
                .reference_samples
                .max(kept_reference.film.requested_samples().unwrap_or(0));
        }
        let mut exposure = renderer.reference(
            &exact,
            plan.reference_samples,
            grid,
            start,
            self.instant_at(RUNGS),
        )?;
        let mut measurements = Measurements::new(&renderer, &sample, self.display);
        listener.step(&plan.told(&sample), self.spent());
        self.pilots(&plan, &mut measurements)?;
        // An estimate needs at least two tiles.
        let minimum = 2.min(sample.most());
        self.expose(
            &mut exposure,
            &mut measurements,
            minimum,
            self.instant_at(AGAIN),
        );
        if measurements.known_tiles() < minimum {
            return Err(renderer.explained(PrepareError::Cancelled));
        }
        while measurements.known_tiles() < plan.tiles
            && (self.now)() < self.instant_at(REFERENCE)
            && !self.observer.is_cancelled()
        {
            let next = plan.tiles.min(4 * measurements.known_tiles());
            self.expose(
                &mut exposure,
                &mut measurements,
                next,
                self.instant_at(REFERENCE),
            );
        }
        let own_errors = self.rungs(&plan, &mut measurements, listener)?;
        let known_settings = self.walks(&plan, &mut measurements, listener)?;
        self.again(&known_settings, &mut measurements, &mut exposure, listener)?;
        let setting = Setting::default();
        let pixels = f64::from(settings.size[0]) * f64::from(settings.size[1]);
        // Output formats are measured before the stages that end by the clock, because their
        // duration follows from the number of pixels.
        let outputs = outputs(
            &measurements.kept(&setting),
            pixels,
            self.display,
            settings.output,
            self.stopwatch,
        );
        self.turns(&known_settings, &mut measurements, listener)?;
        let prices = self.prices(&measurements, listener)?;
        let costs = self.costs(listener)?;
        let Some(own_measured) = measurements.measured(&setting, &setting) else {
            return Err(renderer.explained(PrepareError::Cancelled));
        };
        let reference = Reference {
            samples: plan.reference_samples,
            rungs: exact.flags(),
            tiles: measurements.known_tiles(),
            standard_error: measurements.standard_error(),
            seconds: exposure.seconds,
            kept: exposure.is_kept(),
        };
        let (frontier, recommendations) = self.frontier(&known_settings, &measurements);
        let ladders: Vec<LadderReport> = self
            .pictured
            .iter()
            .map(|&ladder| self.ladder(ladder, &measurements, &own_errors))
            .collect();
        let called_for: Vec<Ladder> = self
            .pictured
            .iter()
            .chain(&self.priced)
            .chain(&[Ladder::Output])
            .copied()
            .collect();
        let report = AccuracyReport {
            size: settings.size,
            tiles: Tiles {
                edge: grid.edge,
                measured: own_measured.tiles,
                all: grid.count(),
                shown: [
                    grid.tile(sample.order[0].tile).x,
                    grid.tile(sample.order[0].tile).y,
                ],
            },
            reference,
            recommendations,
            outputs,
            own: own_measured,
            base: self.base_report(&measurements),
            ladders,
            combinations: self.combinations(&known_settings, &measurements),
            prices,
            not_called_for: Ladder::ALL
                .into_iter()
                .filter(|l| !called_for.contains(l))
                .map(Ladder::name)
                .collect(),
            costs,
            frontier,
            pictures: self.pictures(&measurements, &exposure.film),
            seconds: self.elapsed(),
            cut_short: self.cut_short || self.observer.is_cancelled(),
        };
        Ok((
            report,
            KeptReference {
                rungs: exact.choices().to_vec(),
                film: exposure.film,
            },
        ))
    }

    /// Renders the reference on the first `count` tiles of the sample and adds the new tiles to the
    /// measurements. Tiles that are not finished by `end` are not added.
    fn expose(
        &mut self,
        exposure: &mut GrowingReference<'_>,
        measurements: &mut Measurements<'_>,
        count: usize,
        end: Instant,
    ) {
        let (sample, from) = (measurements.sample, measurements.known_tiles());
        let new: Vec<u32> = sample.order[from..count.max(from)]
            .iter()
            .map(|pilot_pass| pilot_pass.tile)
            .collect();
        self.cut_short |= !exposure.expose(&new, end);
        let tile = |&tile: &u32| {
            let crop = sample.grid.tile(tile);
            let is_done = exposure.film.lacking(&crate::film::FilmPart {
                tiles: tile..tile + 1,
                ..exposure.film.whole_part()
            }) == 0;
            let means = exposure.film.means_of(tile).filter(|_| is_done)?;
            Some(TruthTile::new(
                [crop.width, crop.height],
                &means,
                self.display,
            ))
        };
        measurements.learn(new.iter().map_while(tile));
    }

    /// Returns the instant at which this share of the time budget, 0 to 1, is spent.
    fn instant_at(&self, share: f64) -> Instant {
        self.start + self.effort.budget.mul_f64(share)
    }

    /// Returns the wall-clock seconds until this share of the time budget is spent; zero if it is
    /// spent already.
    fn left(&self, share: f64) -> f64 {
        self.instant_at(share)
            .saturating_duration_since((self.now)())
            .as_secs_f64()
    }

    /// Returns the wall-clock seconds since the start of the measurement.
    fn elapsed(&self) -> f64 {
        ((self.now)() - self.start).as_secs_f64()
    }

    fn spent(&self) -> f64 {
        (self.elapsed() / self.effort.budget.as_secs_f64().max(1e-9)).min(1.0)
    }

    /// Returns the rungs of a ladder that change this scene's picture and whose precision can store
    /// the scene.
    fn choices_of(&self, ladder: Ladder) -> vec::IntoIter<RungChoice> {
        let choices = ladder
            .choices()
            .filter(|choice| choice.differs(self.present) && !self.unshown.contains(choice));
        choices.collect::<Vec<_>>().into_iter()
    }

    fn is_in_use(&self, choice: RungChoice) -> bool {
        choice.rung() == choice.ladder().in_use(self.scene, &self.settings)
    }

    /// Returns the setting to which a ladder's rungs are applied and compared: the scene's own for
    /// sample counts, else the baseline.
    fn beside(&self, ladder: Ladder) -> Setting {
        if ladder == Ladder::Samples {
            Setting::default()
        } else {
            self.base.clone()
        }
    }

    /// Returns the setting by which a rung is measured; for a rung in use, the setting without a
    /// change.
    fn setting(&self, choice: RungChoice) -> Setting {
        let beside = self.beside(choice.ladder());
        if self.is_in_use(choice) {
            beside
        } else {
            beside.with(choice)
        }
    }

    /// Returns the setting with the ladder's most exact rung that does not take too long.
    fn most_exact(&self, ladder: Ladder) -> Setting {
        let reached =
            |choice: &RungChoice| choice.can_be_reference() && !self.beyond.contains(choice);
        let choice = self.choices_of(ladder).rev().find(reached);
        choice.map_or_else(|| self.beside(ladder), |choice| self.setting(choice))
    }

    /// Returns the number of samples per pixel of a setting.
    fn samples(&self, setting: &Setting) -> u32 {
        setting
            .rung(Ladder::Samples)
            .and_then(samples_of)
            .unwrap_or(self.settings.sampling.count())
    }

    /// Whether a setting can be rendered: a denoised setting needs enough samples.
    fn is_possible(&self, setting: &Setting) -> bool {
        let (_, settings) = setting.applied(self.scene, &self.settings);
        !settings.denoise || denoise::is_possible(settings.sampling)
    }
}

/// Returns the number of samples per pixel of a rung of the samples ladder, or `None` for a rung of
/// another ladder.
fn samples_of(choice: RungChoice) -> Option<u32> {
    let RungValue::Samples(samples) = choice.value() else {
        return None;
    };
    Some(samples)
}

#[cfg(test)]
mod tests;
