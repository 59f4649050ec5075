//! Measurement of combinations of rungs (quality levels). Greedy walks from the scene's own setting
//! and from the baseline find the combinations. Promising settings are then measured on more tiles.

use super::super::ProgressListener;
use super::super::frontier::{
    FrontierPoint, LadderSteps, SettingMeasurer, WalkDirection, pareto_front_indices, walk_frontier,
};
use super::super::measurements::Measurements;
use super::super::recommendation::{RecommendationCandidate, is_recommendable, recommend_settings};
use super::super::renderer::IncrementalReference;
use super::super::report::{FrontierSetting, Recommendations};
use super::super::setting::RungSetting;
use super::plan::{MeasurementPlan, ROUNDS};
use super::{HALVING_SAMPLES, MeasurementSession, REFINEMENT_END, RUNGS_END, WALKS_END};
use crate::ladder::{Ladder, RungChoice};
use crate::prepare::PrepareError;

/// Factor by which the number of tiles grows per step, and with it the expected time.
const GROWTH: f64 = 1.3;
/// Largest number of promising settings that are measured on more tiles.
const MOST_AGAIN: usize = 6;
/// Number of measured settings at which no further combinations are added.
const MOST_SETTINGS: usize = 56;

/// Measures the settings that the greedy search visits, with the plan and clock of the session.
struct SessionMeasurer<'s, 'a, 'm> {
    session: &'s MeasurementSession<'a>,
    plan: &'s MeasurementPlan,
    measurements: &'s mut Measurements<'m>,
    listener: &'s mut dyn ProgressListener,
    failed: Option<PrepareError>,
}

impl SettingMeasurer for SessionMeasurer<'_, '_, '_> {
    fn is_valid_setting(&self, setting: &RungSetting) -> bool {
        self.session.is_valid_setting(setting)
    }

    fn measure_setting(&mut self, setting: &RungSetting) -> Option<FrontierPoint> {
        let Self {
            session,
            plan,
            measurements,
            listener,
            failed,
        } = self;
        if measurements.measured_settings().len() >= MOST_SETTINGS {
            return None;
        }
        listener.report_step(
            &format!("combination: {setting}"),
            session.spent_budget_share(),
        );
        let tiles = session.setting_tile_count(setting, plan.tiles, measurements.sample);
        match measurements.measure_setting(
            setting,
            (tiles, session.round_count(setting)),
            None,
            false,
            session.instant_of_budget_share(WALKS_END),
        ) {
            Ok(true) => session.frontier_point(setting, measurements),
            Ok(false) => None,
            Err(error) => {
                *failed = Some(error);
                None
            }
        }
    }

    fn is_certain_improvement(
        &self,
        setting: &RungSetting,
        other: &RungSetting,
        direction: WalkDirection,
    ) -> bool {
        let Some(cost) = self.measurements.relative_cost(setting, other) else {
            return false;
        };
        let is_better = match direction {
            WalkDirection::Faster => cost.time.high < 1.0,
            WalkDirection::MoreExact => cost.error.high < 1.0 && cost.error.low > 0.0,
        };
        is_better && self.session.is_recommendable(setting, self.measurements)
    }
}

impl MeasurementSession<'_> {
    /// Measures combinations of rungs (quality levels) by a greedy search, then pairs that the
    /// search did not visit. Returns every measured setting.
    pub(super) fn measure_combinations(
        &mut self,
        plan: &MeasurementPlan,
        measurements: &mut Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<Vec<RungSetting>, PrepareError> {
        let steps: Vec<LadderSteps> = self
            .picture_ladders
            .iter()
            .filter_map(|&ladder| self.ladder_steps(ladder, measurements))
            .collect();
        let mut failed = None;
        for start in [RungSetting::default(), self.baseline.clone()] {
            let Some(point) = self.frontier_point(&start, measurements) else {
                continue;
            };
            let steps = self.ladder_steps_from(&start, &steps);
            let mut survey = SessionMeasurer {
                session: self,
                plan,
                measurements,
                listener,
                failed: None,
            };
            walk_frontier(&steps, (&start, point), &mut survey);
            failed = failed.or(survey.failed);
            if start == self.baseline {
                break;
            }
        }
        // If the walks end early, the remaining time goes to more tiles.
        let end = self
            .instant_of_budget_share(WALKS_END)
            .min((self.now)() + self.effort.budget.mul_f64(WALKS_END - RUNGS_END));
        for setting in self.unmeasured_rung_pairs(measurements) {
            listener.report_step(
                &format!("combination: {setting}"),
                self.spent_budget_share(),
            );
            let tiles = self.setting_tile_count(&setting, plan.tiles, measurements.sample);
            let left = end.saturating_duration_since((self.now)()).as_secs_f64();
            let has_time = self.expected_seconds(&setting, tiles, &measurements.sample.grid) < left;
            let is_done = has_time
                && measurements.measure_setting(
                    &setting,
                    (tiles, self.round_count(&setting)),
                    None,
                    false,
                    end,
                )?;
            if !is_done {
                break;
            }
        }
        failed.map_or_else(|| Ok(measurements.measured_settings()), Err)
    }

    /// Returns the pairs of a sample count and another rung (quality level) that the search did not
    /// measure, up to the largest number of settings. Recommendable rungs come first. The number of
    /// settings found by the search depends on noise; filled up with pairs, the number is always
    /// the same.
    fn unmeasured_rung_pairs(&self, measurements: &Measurements<'_>) -> Vec<RungSetting> {
        let settings = measurements.measured_settings();
        let is_paired =
            |ladder: &Ladder| *ladder != Ladder::Samples && !ladder.has_equal_accuracy();
        let ladders = self.picture_ladders.iter().copied().filter(is_paired);
        let rungs = ladders.flat_map(|ladder| self.applicable_rungs(ladder));
        let mut rungs: Vec<RungChoice> = rungs
            .filter(|&choice| !self.is_in_use(choice) && !self.infeasible_rungs.contains(&choice))
            .collect();
        rungs.sort_by_key(|&choice| {
            !self.is_recommendable(&self.setting_of_rung(choice), measurements)
        });
        let samples = self
            .applicable_rungs(Ladder::Samples)
            .filter(|choice| !self.is_in_use(*choice));
        let samples: Vec<RungChoice> = samples
            .filter(|_| self.picture_ladders.contains(&Ladder::Samples))
            .collect();
        let pair = |choice: RungChoice| {
            samples
                .iter()
                .map(move |&samples| RungSetting::from_rung(samples).with_rung(choice))
        };
        let mut pairs: Vec<RungSetting> = rungs.into_iter().flat_map(pair).collect();
        let maximum = HALVING_SAMPLES.saturating_mul(self.settings.sampling.samples_per_pixel());
        pairs.retain(|setting| {
            self.is_valid_setting(setting)
                && self.sample_count(setting) <= maximum
                && !settings.contains(setting)
        });
        pairs.truncate(MOST_SETTINGS.saturating_sub(settings.len()));
        pairs
    }

    /// Returns the rungs (quality levels) of each ladder for a search that starts at the setting
    /// `start`. A ladder is left out if its rung in `start` was not measured.
    fn ladder_steps_from(&self, start: &RungSetting, steps: &[LadderSteps]) -> Vec<LadderSteps> {
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

    /// Returns the measured, recommendable rungs (quality levels) of a ladder with time and error;
    /// `None` if the scene's own rung was not measured.
    ///
    /// The error of a rung is its difference to the ladder's most exact rung with the same random
    /// numbers. Noise of few samples would hide this difference in the total error. With many
    /// samples, it dominates the total error.
    fn ladder_steps(&self, ladder: Ladder, measurements: &Measurements<'_>) -> Option<LadderSteps> {
        let in_use = ladder.current_rung_name(self.scene, &self.settings);
        let (exact, beside) = (
            self.most_exact_setting(ladder),
            self.baseline_for_ladder(ladder),
        );
        let point = |setting: &RungSetting| {
            let point = self.frontier_point(setting, measurements)?;
            if !ladder.shares_random_numbers() {
                return Some(point);
            }
            let pair = if *setting == beside { &exact } else { setting };
            let error = if *setting == exact {
                0.0
            } else {
                measurements.paired_differences(pair)?[1].value
            };
            Some(FrontierPoint { error, ..point })
        };
        let own = point(&beside)?;
        let mut rungs = Vec::new();
        for choice in self
            .applicable_rungs(ladder)
            .filter(|choice| choice.rung() != in_use)
        {
            let setting = self.setting_of_rung(choice);
            let is_step =
                ladder == Ladder::Reconstruction || self.is_recommendable(&setting, measurements);
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

    fn frontier_point(
        &self,
        setting: &RungSetting,
        measurements: &Measurements<'_>,
    ) -> Option<FrontierPoint> {
        let measured = measurements.summarise_setting(setting, setting)?;
        // A clock may be too coarse for a tiny picture.
        Some(FrontierPoint {
            time: measured.seconds.value.max(1e-9),
            error: measured.errors.relmse.value,
        })
    }

    fn is_recommendable(&self, setting: &RungSetting, measurements: &Measurements<'_>) -> bool {
        let value_of = |setting: &RungSetting| measurements.summarise_setting(setting, setting);
        value_of(setting)
            .zip(value_of(&RungSetting::default()))
            .is_some_and(|(measured, own_measured)| {
                is_recommendable(setting, &measured, &own_measured)
            })
    }

    /// Measures promising settings on more tiles, in chunks of growing size, or with more renders
    /// per tile if all tiles were measured. More tiles reveal the settings that look good only by
    /// chance.
    pub(super) fn measure_promising_on_more_tiles(
        &mut self,
        settings: &[RungSetting],
        measurements: &mut Measurements<'_>,
        exposure: &mut IncrementalReference<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(), PrepareError> {
        let own_setting = RungSetting::default();
        let chosen_settings = self.promising_settings(settings, measurements);
        let (sample, end) = (
            measurements.sample,
            self.instant_of_budget_share(REFINEMENT_END),
        );
        let mut tiles = measurements.reference_tile_count();
        if sample.covers_picture(tiles) {
            return self.measure_on_all_tiles(&chosen_settings, measurements, listener);
        }
        while tiles < sample.drawable_tile_count() {
            let next =
                ((tiles as f64 * GROWTH) as usize).clamp(tiles + 1, sample.drawable_tile_count());
            let before = (self.now)();
            listener.report_step(
                &format!(
                    "measuring promising settings on {next} of {} tiles",
                    sample.grid.tile_count()
                ),
                self.spent_budget_share(),
            );
            self.add_reference_tiles(exposure, measurements, next, end);
            if measurements.reference_tile_count() < next {
                break;
            }
            for setting in &chosen_settings {
                let tiles = self.setting_tile_count(setting, next, sample);
                if !measurements.measure_setting(
                    setting,
                    (tiles, self.round_count(setting)),
                    None,
                    *setting == own_setting,
                    end,
                )? {
                    return Ok(());
                }
            }
            tiles = next;
            if sample.covers_picture(tiles) {
                return self.measure_on_all_tiles(&chosen_settings, measurements, listener);
            }
            // The time of the next chunk grows with its size.
            if (self.now)() + ((self.now)() - before).mul_f64(GROWTH) > end {
                break;
            }
        }
        Ok(())
    }

    /// Returns the settings to be measured on more tiles: the scene's own, common sample counts,
    /// the settings recommended so far, and further settings on the Pareto front.
    fn promising_settings(
        &self,
        settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> Vec<RungSetting> {
        let own_setting = RungSetting::default();
        let recommendations = self.recommend_settings(settings, measurements);
        let named = [&recommendations.half_the_error, &recommendations.same_error]
            .into_iter()
            .flatten()
            .map(|advice| advice.flags.clone());
        let named: Vec<Vec<String>> = named.collect();
        let mut others = self.pareto_settings(settings, measurements);
        others.sort_by_key(|setting| !named.contains(&setting.flags()));
        let maximum = HALVING_SAMPLES.saturating_mul(self.settings.sampling.samples_per_pixel());
        others.retain(|setting| *setting != own_setting && self.sample_count(setting) <= maximum);
        others.truncate(MOST_AGAIN);
        let mut chosen_settings = vec![own_setting];
        for setting in self
            .common_sample_settings()
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

    /// Measures each setting on the tiles that it lacks, then with more renders per tile. Slow
    /// settings have fewer tiles than fast settings.
    fn measure_on_all_tiles(
        &self,
        settings: &[RungSetting],
        measurements: &mut Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(), PrepareError> {
        let (tiles, grid, end) = (
            measurements.reference_tile_count(),
            measurements.sample.grid,
            self.instant_of_budget_share(REFINEMENT_END),
        );
        for setting in settings {
            let lacking = tiles - measurements.measured_tile_count(setting).min(tiles);
            if lacking > 0
                && self.expected_seconds(setting, lacking, &grid)
                    < self.seconds_until_budget_share(REFINEMENT_END)
            {
                listener.report_step(
                    &format!("on more tiles: {setting}"),
                    self.spent_budget_share(),
                );
                measurements.measure_setting(
                    setting,
                    (tiles, self.round_count(setting)),
                    None,
                    false,
                    end,
                )?;
            }
        }
        let once = |setting: &RungSetting| {
            self.expected_seconds(setting, tiles, &grid) / self.round_count(setting) as f64
        };
        let once: f64 = settings.iter().map(once).sum();
        for rounds in (ROUNDS + 1..=u64::from(self.effort.rounds)).rev() {
            if once * (rounds as f64) < self.seconds_until_budget_share(REFINEMENT_END) {
                for setting in settings {
                    listener.report_step(
                        &format!("in more rounds: {setting}"),
                        self.spent_budget_share(),
                    );
                    measurements.measure_setting(
                        setting,
                        (tiles, rounds),
                        None,
                        *setting == RungSetting::default(),
                        end,
                    )?;
                }
                break;
            }
        }
        Ok(())
    }

    /// Returns the settings on the Pareto front with time and error, and the recommended settings.
    pub(super) fn frontier_report(
        &self,
        settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> (Vec<FrontierSetting>, Recommendations) {
        let chosen_settings = self.pareto_settings(settings, measurements);
        let candidates = chosen_settings
            .iter()
            .filter_map(|setting| self.frontier_setting(setting, measurements));
        (
            candidates.collect(),
            self.recommend_settings(settings, measurements),
        )
    }

    pub(super) fn recommend_settings(
        &self,
        settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> Recommendations {
        let own_setting = RungSetting::default();
        let contestant = |setting: &RungSetting| {
            let (measured, cost) = (
                measurements.summarise_setting(setting, &own_setting)?,
                measurements.relative_cost(setting, &own_setting)?,
            );
            let is_sound = self.is_recommendable(setting, measurements);
            Some(RecommendationCandidate {
                setting: setting.clone(),
                measured,
                cost,
                is_recommendable: is_sound,
            })
        };
        recommend_settings(
            settings.iter().filter_map(contestant).collect(),
            self.effort.budget.as_secs_f64(),
        )
    }

    /// Returns the measured, recommendable settings on the Pareto front. Of settings with equal
    /// time and error, the one with the fewest changes from the scene's own is returned.
    pub(super) fn pareto_settings(
        &self,
        known_settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> Vec<RungSetting> {
        let mut settings: Vec<RungSetting> = known_settings
            .iter()
            .filter(|setting| {
                **setting == RungSetting::default() || self.is_recommendable(setting, measurements)
            })
            .cloned()
            .collect();
        settings.sort_by_key(|setting| setting.flags().len());
        let known: Vec<(RungSetting, FrontierPoint)> = settings
            .into_iter()
            .filter_map(|setting| {
                self.frontier_point(&setting, measurements)
                    .map(|point| (setting, point))
            })
            .collect();
        let points: Vec<_> = known.iter().map(|(_, point)| *point).collect();
        pareto_front_indices(&points)
            .into_iter()
            .map(|i| known[i].0.clone())
            .collect()
    }
}
