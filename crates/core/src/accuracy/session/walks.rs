//! Combinations of rungs that are worth their time: found by steps from what rungs are put on, and measured again.

use super::super::Listener;
use super::super::answer::answer;
use super::super::frontier::{Point, Steps, pareto, walk};
use super::super::measurements::Measurements;
use super::super::report::{Answer, Candidate};
use super::super::setting::Setting;
use super::{AGAIN, Session, WALKS};
use crate::denoise;
use crate::ladder::{Choice, Ladder};
use crate::prepare::PrepareError;

/// Rounds that a step of a walk takes, and that a candidate is measured again.
const STEP_ROUNDS: u64 = 2;
/// Random numbers of candidates that are measured again begin here.
const FRESH: u64 = 1 << 32;

impl Session<'_> {
    /// The settings that none measured beats, each with what it does with other random numbers where there is time for that, and what they
    /// say first of all.
    pub fn frontier(
        &mut self,
        measurements: &mut Measurements<'_>,
        listener: &mut dyn Listener,
    ) -> Result<(Vec<Candidate>, Answer), PrepareError> {
        let is_possible = |setting: &Setting| {
            let (_, settings) = setting.applied(self.scene, &self.settings);
            !settings.denoise || denoise::is_possible(settings.sampling)
        };
        let mut known = self.walked(measurements, &is_possible, listener)?;
        known.extend(self.rounds_of().into_iter().filter(|setting| is_possible(setting)));
        let own = Setting::default();
        let mut chosen = unbeaten(known.clone(), |setting| measurements.point(setting));
        // The best of many is partly the luckiest: what it does with other random numbers counts.
        let mut again = Measurements::new(measurements.studio, measurements.truth);
        for round in FRESH..FRESH + STEP_ROUNDS {
            for setting in [&own].into_iter().chain(chosen.iter().filter(|setting| **setting != own)) {
                listener.step(&format!("once more: {setting}"), self.spent());
                self.cut_short |= !again.take(setting, round, self.at(AGAIN))?;
            }
        }
        let has_all = again.point(&own).is_some() && chosen.iter().all(|setting| again.point(setting).is_some());
        let last = if has_all { &again } else { &*measurements };
        chosen = unbeaten(chosen, |setting| last.point(setting));
        let candidate = |setting: &Setting| Some(Candidate { flags: setting.flags(), measured: last.measured(setting, &own)? });
        let best = |setting: Setting| {
            let cost = again.relative_cost(&setting, &own).or_else(|| measurements.relative_cost(&setting, &own))?;
            Some((setting, cost))
        };
        let answer = answer(known.into_iter().filter_map(best));
        Ok((chosen.iter().filter_map(candidate).collect(), answer))
    }

    /// Combinations that steps lead to.
    fn walked(
        &self,
        measurements: &mut Measurements<'_>,
        is_possible: &dyn Fn(&Setting) -> bool,
        listener: &mut dyn Listener,
    ) -> Result<Vec<Setting>, PrepareError> {
        let steps: Vec<Steps> = self.pictured.iter().filter_map(|&ladder| self.steps(ladder, measurements)).collect();
        let Some(start) = measurements.point(&self.base) else { return Ok(Vec::new()) };
        let (mut failed, end) = (None, self.at(WALKS));
        let found = walk(&steps, (&self.base, start), is_possible, &mut |setting| {
            listener.step(&format!("together: {setting}"), self.spent());
            for round in 0..STEP_ROUNDS {
                match measurements.take(setting, round, end) {
                    Ok(true) => {}
                    Ok(false) => return None,
                    Err(error) => {
                        failed = Some(error);
                        return None;
                    }
                }
            }
            measurements.point(setting)
        });
        failed.map_or(Ok(found.into_iter().map(|(setting, _)| setting).collect()), Err)
    }

    /// What is known of a ladder's rungs, as far as they were measured; none where the scene's own has no place among them.
    ///
    /// What a rung gets wrong is its difference to the ladder's most exact one with the same random numbers: beside the error of
    /// few samples it would not be seen, and yet decide what many are worth.
    fn steps(&self, ladder: Ladder, measurements: &Measurements<'_>) -> Option<Steps> {
        let in_use = ladder.in_use(self.scene, &self.settings);
        let exact = self.most_exact(ladder);
        let point = |setting: &Setting| {
            let point = measurements.point(setting)?;
            let error = if ladder.shares_random_numbers() { measurements.paired(setting, &exact)?.relative } else { point.error };
            Some(Point { error, ..point })
        };
        let own = point(&self.beside(ladder))?;
        let mut rungs = Vec::new();
        for choice in ladder.choices().filter(|choice| choice.rung() != in_use) {
            rungs.extend(point(&self.setting(choice)).map(|point| (Some(choice), point)));
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
        let start = match self.base.rung(ladder) {
            Some(choice) => rungs.iter().position(|(rung, _)| *rung == Some(choice))?,
            None => place,
        };
        Some(Steps { ladder, rungs, start })
    }
}

/// Those that were measured and that no other one beats, simple settings before others where both are worth the same.
fn unbeaten(mut settings: Vec<Setting>, point: impl Fn(&Setting) -> Option<Point>) -> Vec<Setting> {
    settings.sort_by_key(|setting| setting.flags().len());
    let known: Vec<(Setting, Point)> =
        settings.into_iter().filter_map(|setting| point(&setting).map(|point| (setting, point))).collect();
    let points: Vec<_> = known.iter().map(|(_, point)| *point).collect();
    pareto(&points).into_iter().map(|i| known[i].0.clone()).collect()
}
