//! Measurement of combinations of rungs: a greedy walk from the scene's own setting and from the
//! baseline finds them, and promising settings are then measured on more tiles.

use super::super::ProgressListener;
use super::super::frontier::{FrontierPoint, LadderSteps, Surveyor, WalkDirection, pareto, walk};
use super::super::measurements::Measurements;
use super::super::recommendation::{AdviceCandidate, is_sound, recommend};
use super::super::renderer::GrowingReference;
use super::super::report::{FrontierCandidate, Recommendations};
use super::super::setting::Setting;
use super::plan::{MeasurementPlan, ROUNDS};
use super::{AGAIN, HALVES, MeasurementSession, RUNGS, WALKS};
use crate::ladder::{Ladder, RungChoice};
use crate::prepare::PrepareError;

/// Factor by which the number of tiles, and the expected time, grows per step.
const GROWTH: f64 = 1.3;
/// Largest number of promising settings that are measured on more tiles.
const MOST_AGAIN: usize = 6;
/// Largest number of measured settings up to which walks and pairs add settings.
const MOST_SETTINGS: usize = 56;

/// Measurement of the settings of a walk by a session.
struct SettingSurvey<'s, 'a, 'm> {
    session: &'s MeasurementSession<'a>,
    plan: &'s MeasurementPlan,
    measurements: &'s mut Measurements<'m>,
    listener: &'s mut dyn ProgressListener,
    failed: Option<PrepareError>,
}

impl Surveyor for SettingSurvey<'_, '_, '_> {
    fn is_possible(&self, setting: &Setting) -> bool {
        self.session.is_possible(setting)
    }

    fn measure(&mut self, setting: &Setting) -> Option<FrontierPoint> {
        let Self {
            session,
            plan,
            measurements,
            listener,
            failed,
        } = self;
        if measurements.settings().len() >= MOST_SETTINGS {
            return None;
        }
        listener.step(&format!("together: {setting}"), session.spent());
        let tiles = session.tiles_of(setting, plan.tiles, measurements.sample);
        match measurements.measure(
            setting,
            (tiles, session.rounds(setting)),
            None,
            false,
            session.instant_at(WALKS),
        ) {
            Ok(true) => session.point(setting, measurements),
            Ok(false) => None,
            Err(error) => {
                *failed = Some(error);
                None
            }
        }
    }

    fn is_beyond(&self, setting: &Setting, other: &Setting, direction: WalkDirection) -> bool {
        let Some(cost) = self.measurements.relative(setting, other) else {
            return false;
        };
        let is_better = match direction {
            WalkDirection::Faster => cost.time.high < 1.0,
            WalkDirection::MoreExact => cost.error.high < 1.0 && cost.error.low > 0.0,
        };
        is_better && self.session.is_sound(setting, self.measurements)
    }
}

impl MeasurementSession<'_> {
    /// Measures combinations of rungs by walks and pairs, and returns every measured setting.
    pub(super) fn walks(
        &mut self,
        plan: &MeasurementPlan,
        measurements: &mut Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<Vec<Setting>, PrepareError> {
        let steps: Vec<LadderSteps> = self
            .pictured
            .iter()
            .filter_map(|&ladder| self.steps(ladder, measurements))
            .collect();
        let mut failed = None;
        for start in [Setting::default(), self.base.clone()] {
            let Some(point) = self.point(&start, measurements) else {
                continue;
            };
            let steps = self.from(&start, &steps);
            let mut survey = SettingSurvey {
                session: self,
                plan,
                measurements,
                listener,
                failed: None,
            };
            walk(&steps, (&start, point), &mut survey);
            failed = failed.or(survey.failed);
            if start == self.base {
                break;
            }
        }
        // If the walks end early, the remaining time goes to more tiles.
        let end = self
            .instant_at(WALKS)
            .min((self.now)() + self.effort.budget.mul_f64(WALKS - RUNGS));
        for setting in self.sweep(measurements) {
            listener.step(&format!("together: {setting}"), self.spent());
            let tiles = self.tiles_of(&setting, plan.tiles, measurements.sample);
            let left = end.saturating_duration_since((self.now)()).as_secs_f64();
            let has_time = self.expected(&setting, tiles, &measurements.sample.grid) < left;
            let is_done = has_time
                && measurements.measure(
                    &setting,
                    (tiles, self.rounds(&setting)),
                    None,
                    false,
                    end,
                )?;
            if !is_done {
                break;
            }
        }
        failed.map_or_else(|| Ok(measurements.settings()), Err)
    }

    /// Returns pairs of a sample count and another rung that no walk measured, recommendable rungs
    /// first, up to the largest number of settings. The length of a walk depends on noise; with the
    /// pairs, the number of measured settings does not.
    fn sweep(&self, measurements: &Measurements<'_>) -> Vec<Setting> {
        let settings = measurements.settings();
        let is_paired =
            |ladder: &Ladder| *ladder != Ladder::Samples && !ladder.is_a_matter_of_taste();
        let ladders = self.pictured.iter().copied().filter(is_paired);
        let rungs = ladders.flat_map(|ladder| self.choices_of(ladder));
        let mut rungs: Vec<RungChoice> = rungs
            .filter(|&choice| !self.is_in_use(choice) && !self.beyond.contains(&choice))
            .collect();
        rungs.sort_by_key(|&choice| !self.is_sound(&self.setting(choice), measurements));
        let samples = self
            .choices_of(Ladder::Samples)
            .filter(|choice| !self.is_in_use(*choice));
        let samples: Vec<RungChoice> = samples
            .filter(|_| self.pictured.contains(&Ladder::Samples))
            .collect();
        let pair = |choice: RungChoice| {
            samples
                .iter()
                .map(move |&samples| Setting::single(samples).with(choice))
        };
        let mut pairs: Vec<Setting> = rungs.into_iter().flat_map(pair).collect();
        let maximum = HALVES.saturating_mul(self.settings.sampling.count());
        pairs.retain(|setting| {
            self.is_possible(setting)
                && self.samples(setting) <= maximum
                && !settings.contains(setting)
        });
        pairs.truncate(MOST_SETTINGS.saturating_sub(settings.len()));
        pairs
    }

    /// Returns the steps of a walk with the rungs of `start` as its starting rungs. Ladders without
    /// that rung are left out.
    fn from(&self, start: &Setting, steps: &[LadderSteps]) -> Vec<LadderSteps> {
        let at = |steps: &LadderSteps| {
            let rung_choice = start.rung(steps.ladder);
            let index = steps
                .rungs
                .iter()
                .position(|(rung, _)| *rung == rung_choice)?;
            Some(LadderSteps {
                start: index,
                ..steps.clone()
            })
        };
        steps.iter().filter_map(at).collect()
    }

    /// Returns the measured, recommendable rungs of a ladder with time and error; `None` if the
    /// scene's own rung was not measured.
    ///
    /// The error of a rung is its difference to the ladder's most exact rung with the same random
    /// numbers. The noise of few samples would hide this error, but with many samples the error
    /// dominates.
    fn steps(&self, ladder: Ladder, measurements: &Measurements<'_>) -> Option<LadderSteps> {
        let in_use = ladder.in_use(self.scene, &self.settings);
        let (exact, beside) = (self.most_exact(ladder), self.beside(ladder));
        let point = |setting: &Setting| {
            let point = self.point(setting, measurements)?;
            if !ladder.shares_random_numbers() {
                return Some(point);
            }
            let pair = if *setting == beside { &exact } else { setting };
            let error = if *setting == exact {
                0.0
            } else {
                measurements.alone(pair)?[1].value
            };
            Some(FrontierPoint { error, ..point })
        };
        let own = point(&beside)?;
        let mut rungs = Vec::new();
        for choice in self
            .choices_of(ladder)
            .filter(|choice| choice.rung() != in_use)
        {
            let setting = self.setting(choice);
            let is_step = ladder == Ladder::Reconstruction || self.is_sound(&setting, measurements);
            rungs.extend(
                point(&setting)
                    .filter(|_| is_step)
                    .map(|point| (Some(choice), point)),
            );
        }
        let below =
            |choice: &RungChoice| match (choice.rung().parse::<u32>(), in_use.parse::<u32>()) {
                (Ok(rung), Ok(own)) => Some(rung < own),
                _ => {
                    let place =
                        |name: &str| ladder.rungs().iter().position(|rung| rung.name == name);
                    Some(place(choice.rung())? < place(&in_use)?)
                }
            };
        let mut index = 0;
        for (choice, _) in &rungs {
            index += usize::from(choice.as_ref().map_or(Some(false), below)?);
        }
        rungs.insert(index, (None, own));
        Some(LadderSteps {
            ladder,
            rungs,
            start: index,
        })
    }

    fn point(&self, setting: &Setting, measurements: &Measurements<'_>) -> Option<FrontierPoint> {
        let measured = measurements.measured(setting, setting)?;
        // A clock may be too coarse for a tiny picture.
        Some(FrontierPoint {
            time: measured.seconds.value.max(1e-9),
            error: measured.errors.relmse.value,
        })
    }

    fn is_sound(&self, setting: &Setting, measurements: &Measurements<'_>) -> bool {
        let value_of = |setting: &Setting| measurements.measured(setting, setting);
        value_of(setting)
            .zip(value_of(&Setting::default()))
            .is_some_and(|(measured, own_measured)| is_sound(setting, &measured, &own_measured))
    }

    /// Measures promising settings on more tiles, chunk by chunk, or in more rounds if all tiles
    /// were measured. Some settings look good only by chance, which more tiles reveal.
    pub(super) fn again(
        &mut self,
        settings: &[Setting],
        measurements: &mut Measurements<'_>,
        exposure: &mut GrowingReference<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(), PrepareError> {
        let own_setting = Setting::default();
        let chosen_settings = self.promising(settings, measurements);
        let (sample, end) = (measurements.sample, self.instant_at(AGAIN));
        let mut tiles = measurements.known_tiles();
        if sample.is_whole(tiles) {
            return self.all_again(&chosen_settings, measurements, listener);
        }
        while tiles < sample.most() {
            let next = ((tiles as f64 * GROWTH) as usize).clamp(tiles + 1, sample.most());
            let before = (self.now)();
            listener.step(
                &format!("more tiles: {next} of {}", sample.grid.count()),
                self.spent(),
            );
            self.expose(exposure, measurements, next, end);
            if measurements.known_tiles() < next {
                break;
            }
            for setting in &chosen_settings {
                let tiles = self.tiles_of(setting, next, sample);
                if !measurements.measure(
                    setting,
                    (tiles, self.rounds(setting)),
                    None,
                    *setting == own_setting,
                    end,
                )? {
                    return Ok(());
                }
            }
            tiles = next;
            if sample.is_whole(tiles) {
                return self.all_again(&chosen_settings, measurements, listener);
            }
            // The time of the next chunk grows with its size.
            if (self.now)() + ((self.now)() - before).mul_f64(GROWTH) > end {
                break;
            }
        }
        Ok(())
    }

    /// Returns the settings to be measured on more tiles: the scene's own, common sample counts,
    /// the settings recommended so far, and others of the Pareto front.
    fn promising(&self, settings: &[Setting], measurements: &Measurements<'_>) -> Vec<Setting> {
        let own_setting = Setting::default();
        let recommendations = self.recommend(settings, measurements);
        let named = [&recommendations.half_the_error, &recommendations.same_error]
            .into_iter()
            .flatten()
            .map(|advice| advice.flags.clone());
        let named: Vec<Vec<String>> = named.collect();
        let mut others = self.unbeaten(settings, measurements);
        others.sort_by_key(|setting| !named.contains(&setting.flags()));
        let maximum = HALVES.saturating_mul(self.settings.sampling.count());
        others.retain(|setting| *setting != own_setting && self.samples(setting) <= maximum);
        others.truncate(MOST_AGAIN);
        let mut chosen_settings = vec![own_setting];
        for setting in self
            .numbers_of_samples()
            .into_iter()
            .filter(|setting| settings.contains(setting))
            .chain(others)
        {
            if !chosen_settings.contains(&setting) {
                chosen_settings.push(setting);
            }
        }
        chosen_settings
    }

    /// Measures settings on the tiles that they lack, because slow settings have fewer, and then in
    /// more rounds.
    fn all_again(
        &self,
        settings: &[Setting],
        measurements: &mut Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(), PrepareError> {
        let (tiles, grid, end) = (
            measurements.known_tiles(),
            measurements.sample.grid,
            self.instant_at(AGAIN),
        );
        for setting in settings {
            let lacking = tiles - measurements.tiles(setting).min(tiles);
            if lacking > 0 && self.expected(setting, lacking, &grid) < self.left(AGAIN) {
                listener.step(&format!("more tiles: {setting}"), self.spent());
                measurements.measure(setting, (tiles, self.rounds(setting)), None, false, end)?;
            }
        }
        let once =
            |setting: &Setting| self.expected(setting, tiles, &grid) / self.rounds(setting) as f64;
        let once: f64 = settings.iter().map(once).sum();
        for rounds in (ROUNDS + 1..=u64::from(self.effort.rounds)).rev() {
            if once * (rounds as f64) < self.left(AGAIN) {
                for setting in settings {
                    listener.step(&format!("once more: {setting}"), self.spent());
                    measurements.measure(
                        setting,
                        (tiles, rounds),
                        None,
                        *setting == Setting::default(),
                        end,
                    )?;
                }
                break;
            }
        }
        Ok(())
    }

    /// Returns the settings on the Pareto front with time and error, and the recommended settings.
    pub(super) fn frontier(
        &self,
        settings: &[Setting],
        measurements: &Measurements<'_>,
    ) -> (Vec<FrontierCandidate>, Recommendations) {
        let chosen_settings = self.unbeaten(settings, measurements);
        let candidates = chosen_settings
            .iter()
            .filter_map(|setting| self.candidate(setting, measurements));
        (candidates.collect(), self.recommend(settings, measurements))
    }

    pub(super) fn recommend(
        &self,
        settings: &[Setting],
        measurements: &Measurements<'_>,
    ) -> Recommendations {
        let own_setting = Setting::default();
        let contestant = |setting: &Setting| {
            let (measured, cost) = (
                measurements.measured(setting, &own_setting)?,
                measurements.relative(setting, &own_setting)?,
            );
            let is_sound = self.is_sound(setting, measurements);
            Some(AdviceCandidate {
                setting: setting.clone(),
                measured,
                cost,
                is_sound,
            })
        };
        recommend(
            settings.iter().filter_map(contestant).collect(),
            self.effort.budget.as_secs_f64(),
        )
    }

    /// Returns the measured, recommendable settings on the Pareto front. Of settings with equal
    /// time and error, the one with the fewest changed rungs is returned.
    pub(super) fn unbeaten(
        &self,
        known_settings: &[Setting],
        measurements: &Measurements<'_>,
    ) -> Vec<Setting> {
        let mut settings: Vec<Setting> = known_settings
            .iter()
            .filter(|setting| {
                **setting == Setting::default() || self.is_sound(setting, measurements)
            })
            .cloned()
            .collect();
        settings.sort_by_key(|setting| setting.flags().len());
        let known: Vec<(Setting, FrontierPoint)> = settings
            .into_iter()
            .filter_map(|setting| {
                self.point(&setting, measurements)
                    .map(|point| (setting, point))
            })
            .collect();
        let points: Vec<_> = known.iter().map(|(_, point)| *point).collect();
        pareto(&points)
            .into_iter()
            .map(|i| known[i].0.clone())
            .collect()
    }
}
