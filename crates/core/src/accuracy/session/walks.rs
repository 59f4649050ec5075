//! Combinations of rungs that are worth their time: found by steps from the base setting, then
//! measured on more tiles.

use super::super::Listener;
use super::super::answer::{AdviceCandidate, answer, is_sound};
use super::super::frontier::{Direction, Point, Steps, Surveyor, pareto, walk};
use super::super::measurements::Measurements;
use super::super::renderer::Exposure;
use super::super::report::{Answer, Candidate};
use super::super::setting::Setting;
use super::plan::{MeasurementPlan, ROUNDS};
use super::{AGAIN, HALVES, RUNGS, Session, WALKS};
use crate::ladder::{Choice, Ladder};
use crate::prepare::PrepareError;

/// Expected growth of the time per step when more tiles are added.
const GROWTH: f64 = 1.3;
/// Most settings measured on more tiles, by their promise.
const MOST_AGAIN: usize = 6;
/// Most settings in all that walks and pairs may measure.
const MOST_SETTINGS: usize = 56;

/// A walk through a session's measurements.
struct SettingSurvey<'s, 'a, 'm> {
    session: &'s Session<'a>,
    plan: &'s MeasurementPlan,
    measurements: &'s mut Measurements<'m>,
    listener: &'s mut dyn Listener,
    failed: Option<PrepareError>,
}

impl Surveyor for SettingSurvey<'_, '_, '_> {
    fn is_possible(&self, setting: &Setting) -> bool {
        self.session.is_possible(setting)
    }

    fn measure(&mut self, setting: &Setting) -> Option<Point> {
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
            session.at(WALKS),
        ) {
            Ok(true) => session.point(setting, measurements),
            Ok(false) => None,
            Err(error) => {
                *failed = Some(error);
                None
            }
        }
    }

    fn is_beyond(&self, setting: &Setting, other: &Setting, direction: Direction) -> bool {
        let Some(cost) = self.measurements.relative(setting, other) else {
            return false;
        };
        let is_better = match direction {
            Direction::Faster => cost.time.high < 1.0,
            Direction::MoreExact => cost.error.high < 1.0 && cost.error.low > 0.0,
        };
        is_better && self.session.is_sound(setting, self.measurements)
    }
}

impl Session<'_> {
    /// Returns every measured setting, including the results of walks.
    pub(super) fn walks(
        &mut self,
        plan: &MeasurementPlan,
        measurements: &mut Measurements<'_>,
        listener: &mut dyn Listener,
    ) -> Result<Vec<Setting>, PrepareError> {
        let steps: Vec<Steps> = self
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
        // Where the walks end early, the remaining time goes to more tiles.
        let end = self
            .at(WALKS)
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

    /// Returns pairs of a sample count and another rung that no walk measured, the sound ones
    /// first, up to a total number of settings. The end of a walk depends on noise; the number of
    /// measured settings must not.
    fn sweep(&self, measurements: &Measurements<'_>) -> Vec<Setting> {
        let known = measurements.settings();
        let is_paired =
            |ladder: &Ladder| *ladder != Ladder::Samples && !ladder.is_a_matter_of_taste();
        let ladders = self.pictured.iter().copied().filter(is_paired);
        let rungs = ladders.flat_map(|ladder| self.choices_of(ladder));
        let mut rungs: Vec<Choice> = rungs
            .filter(|&choice| !self.is_in_use(choice) && !self.beyond.contains(&choice))
            .collect();
        rungs.sort_by_key(|&choice| !self.is_sound(&self.setting(choice), measurements));
        let samples = self
            .choices_of(Ladder::Samples)
            .filter(|choice| !self.is_in_use(*choice));
        let samples: Vec<Choice> = samples
            .filter(|_| self.pictured.contains(&Ladder::Samples))
            .collect();
        let pair = |choice: Choice| {
            samples
                .iter()
                .map(move |&samples| Setting::one(samples).with(choice))
        };
        let mut pairs: Vec<Setting> = rungs.into_iter().flat_map(pair).collect();
        let most = HALVES.saturating_mul(self.settings.sampling.count());
        pairs.retain(|setting| {
            self.is_possible(setting) && self.samples(setting) <= most && !known.contains(setting)
        });
        pairs.truncate(MOST_SETTINGS.saturating_sub(known.len()));
        pairs
    }

    /// Returns the steps of a walk that starts at a setting.
    fn from(&self, start: &Setting, steps: &[Steps]) -> Vec<Steps> {
        let at = |steps: &Steps| {
            let chosen = start.rung(steps.ladder);
            let place = steps.rungs.iter().position(|(rung, _)| *rung == chosen)?;
            Some(Steps {
                start: place,
                ..steps.clone()
            })
        };
        steps.iter().filter_map(at).collect()
    }

    /// Returns the measured, sound rungs of a ladder; `None` where the scene's own rung is not
    /// among them.
    ///
    /// The error of a rung is its difference to the ladder's most exact rung with the same random
    /// numbers. Against the noise of few samples this error would be invisible, and yet it decides
    /// the value of many samples.
    fn steps(&self, ladder: Ladder, measurements: &Measurements<'_>) -> Option<Steps> {
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
            Some(Point { error, ..point })
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
        let below = |choice: &Choice| match (choice.rung().parse::<u32>(), in_use.parse::<u32>()) {
            (Ok(rung), Ok(own)) => Some(rung < own),
            _ => {
                let place = |name: &str| ladder.rungs().iter().position(|rung| rung.name == name);
                Some(place(choice.rung())? < place(&in_use)?)
            }
        };
        let mut place = 0;
        for (choice, _) in &rungs {
            place += usize::from(choice.as_ref().map_or(Some(false), below)?);
        }
        rungs.insert(place, (None, own));
        Some(Steps {
            ladder,
            rungs,
            start: place,
        })
    }

    fn point(&self, setting: &Setting, measurements: &Measurements<'_>) -> Option<Point> {
        let measured = measurements.measured(setting, setting)?;
        // A clock may be too coarse for a tiny picture.
        Some(Point {
            time: measured.seconds.value.max(1e-9),
            error: measured.errors.relmse.value,
        })
    }

    fn is_sound(&self, setting: &Setting, measurements: &Measurements<'_>) -> bool {
        let of = |setting: &Setting| measurements.measured(setting, setting);
        of(setting)
            .zip(of(&Setting::default()))
            .is_some_and(|(measured, own)| is_sound(setting, &measured, &own))
    }

    /// Measures promising settings on more tiles, chunk by chunk, or with more random numbers where
    /// all tiles were measured. The best of many settings is partly the luckiest.
    pub(super) fn again(
        &mut self,
        known: &[Setting],
        measurements: &mut Measurements<'_>,
        exposure: &mut Exposure<'_>,
        listener: &mut dyn Listener,
    ) -> Result<(), PrepareError> {
        let own = Setting::default();
        let chosen = self.promising(known, measurements);
        let (sample, end) = (measurements.sample, self.at(AGAIN));
        let mut tiles = measurements.known();
        if sample.is_whole(tiles) {
            return self.all_again(&chosen, measurements, listener);
        }
        while tiles < sample.most() {
            let next = ((tiles as f64 * GROWTH) as usize).clamp(tiles + 1, sample.most());
            let before = (self.now)();
            listener.step(
                &format!("more tiles: {next} of {}", sample.grid.count()),
                self.spent(),
            );
            self.expose(exposure, measurements, next, end);
            if measurements.known() < next {
                break;
            }
            for setting in &chosen {
                let tiles = self.tiles_of(setting, next, sample);
                if !measurements.measure(
                    setting,
                    (tiles, self.rounds(setting)),
                    None,
                    *setting == own,
                    end,
                )? {
                    return Ok(());
                }
            }
            tiles = next;
            if sample.is_whole(tiles) {
                return self.all_again(&chosen, measurements, listener);
            }
            // The next chunk takes longer in proportion to its size.
            if (self.now)() + ((self.now)() - before).mul_f64(GROWTH) > end {
                break;
            }
        }
        Ok(())
    }

    /// Returns the setting in use, common sample counts, the settings named so far, and others by
    /// their promise.
    fn promising(&self, known: &[Setting], measurements: &Measurements<'_>) -> Vec<Setting> {
        let own = Setting::default();
        let answer = self.answer(known, measurements);
        let named = [&answer.half_the_error, &answer.same_error]
            .into_iter()
            .flatten()
            .map(|advice| advice.flags.clone());
        let named: Vec<Vec<String>> = named.collect();
        let mut others = self.unbeaten(known, measurements);
        others.sort_by_key(|setting| !named.contains(&setting.flags()));
        let most = HALVES.saturating_mul(self.settings.sampling.count());
        others.retain(|setting| *setting != own && self.samples(setting) <= most);
        others.truncate(MOST_AGAIN);
        let mut chosen = vec![own];
        for setting in self
            .numbers_of_samples()
            .into_iter()
            .filter(|setting| known.contains(setting))
            .chain(others)
        {
            if !chosen.contains(&setting) {
                chosen.push(setting);
            }
        }
        chosen
    }

    /// Measures settings on all tiles that they lack, since slow settings have fewer, and then in
    /// more rounds.
    fn all_again(
        &self,
        chosen: &[Setting],
        measurements: &mut Measurements<'_>,
        listener: &mut dyn Listener,
    ) -> Result<(), PrepareError> {
        let (tiles, grid, end) = (
            measurements.known(),
            measurements.sample.grid,
            self.at(AGAIN),
        );
        for setting in chosen {
            let lacking = tiles - measurements.tiles(setting).min(tiles);
            if lacking > 0 && self.expected(setting, lacking, &grid) < self.left(AGAIN) {
                listener.step(&format!("more tiles: {setting}"), self.spent());
                measurements.measure(setting, (tiles, self.rounds(setting)), None, false, end)?;
            }
        }
        let once =
            |setting: &Setting| self.expected(setting, tiles, &grid) / self.rounds(setting) as f64;
        let once: f64 = chosen.iter().map(once).sum();
        for rounds in (ROUNDS + 1..=u64::from(self.effort.rounds)).rev() {
            if once * (rounds as f64) < self.left(AGAIN) {
                for setting in chosen {
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

    /// Returns the settings on the Pareto front, and the report's first sentences.
    pub(super) fn frontier(
        &self,
        known: &[Setting],
        measurements: &Measurements<'_>,
    ) -> (Vec<Candidate>, Answer) {
        let chosen = self.unbeaten(known, measurements);
        let candidates = chosen
            .iter()
            .filter_map(|setting| self.candidate(setting, measurements));
        (candidates.collect(), self.answer(known, measurements))
    }

    pub(super) fn answer(&self, known: &[Setting], measurements: &Measurements<'_>) -> Answer {
        let own = Setting::default();
        let contestant = |setting: &Setting| {
            let (measured, cost) = (
                measurements.measured(setting, &own)?,
                measurements.relative(setting, &own)?,
            );
            let is_sound = self.is_sound(setting, measurements);
            Some(AdviceCandidate {
                setting: setting.clone(),
                measured,
                cost,
                is_sound,
            })
        };
        answer(
            known.iter().filter_map(contestant).collect(),
            self.effort.budget.as_secs_f64(),
        )
    }

    /// Returns the measured, sound settings on the Pareto front; of two of equal value, the simpler
    /// one.
    pub(super) fn unbeaten(
        &self,
        known: &[Setting],
        measurements: &Measurements<'_>,
    ) -> Vec<Setting> {
        let mut settings: Vec<Setting> = known
            .iter()
            .filter(|setting| {
                **setting == Setting::default() || self.is_sound(setting, measurements)
            })
            .cloned()
            .collect();
        settings.sort_by_key(|setting| setting.flags().len());
        let known: Vec<(Setting, Point)> = settings
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
