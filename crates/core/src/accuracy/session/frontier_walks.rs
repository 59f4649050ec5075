//! Measurement of combinations of rungs (quality levels). Greedy walks from the scene's own setting
//! and from the baseline find the combinations.

use super::measurement_plan::MeasurementPlan;
use super::time_budget::{RUNGS_END, WALKS_END};
use super::{HALVING_SAMPLES, MeasurementSession};
use crate::accuracy::ProgressListener;
use crate::accuracy::frontier::{
    FrontierPoint, LadderSteps, SettingMeasurer, WalkDirection, walk_frontier,
};
use crate::accuracy::measurements::Measurements;
use crate::accuracy::setting::RungSetting;
use crate::ladder::{Ladder, RungChoice};
use crate::prepare::PrepareError;

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
    /// settings that the search finds depends on noise. With the pairs, the number is always the
    /// same.
    fn unmeasured_rung_pairs(&self, measurements: &Measurements<'_>) -> Vec<RungSetting> {
        let settings = measurements.measured_settings();
        let is_paired =
            |ladder: &Ladder| *ladder != Ladder::Samples && !ladder.has_equal_accuracy();
        let ladders = self.picture_ladders.iter().copied().filter(is_paired);
        let rungs = ladders.flat_map(|ladder| self.applicable_rungs(ladder));
        let mut rungs: Vec<RungChoice> = rungs
            .filter(|&choice| {
                !self.is_rung_in_use(choice) && !self.infeasible_rungs.contains(&choice)
            })
            .collect();
        rungs.sort_by_key(|&choice| {
            !self.is_recommendable(&self.setting_of_rung(choice), measurements)
        });
        let samples = self
            .applicable_rungs(Ladder::Samples)
            .filter(|choice| !self.is_rung_in_use(*choice));
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
                measurements.differences_under_same_random_numbers(pair)?[1].value
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
}
