//! Combinations of rungs that are worth their time: found by steps from the scene's own setting, and measured again.

use super::super::Listener;
use super::super::frontier::{Point, Steps, pareto, walk};
use super::super::report::Candidate;
use super::super::setting::Setting;
use super::super::shots::Shots;
use super::{Session, WALKS};
use crate::denoise;
use crate::ladder::{Choice, Ladder};
use crate::prepare::PrepareError;

/// Rounds that a step of a walk takes, and that a candidate is measured again.
const STEP_ROUNDS: u64 = 2;
/// Random numbers of candidates that are measured again begin here.
const FRESH: u64 = 1 << 32;

impl Session<'_> {
    pub fn frontier(&mut self, shots: &mut Shots<'_>, listener: &mut dyn Listener) -> Result<Vec<Candidate>, PrepareError> {
        let steps: Vec<Steps> = self.pictured.iter().filter_map(|&ladder| self.steps(ladder, shots)).collect();
        let Some(own) = shots.point(&Setting::default()) else { return Ok(Vec::new()) };
        let mut failed = None;
        let end = self.at(WALKS);
        let is_possible = |setting: &Setting| {
            let (_, settings) = setting.applied(self.scene, &self.settings);
            !settings.denoise || denoise::is_possible(settings.sampling)
        };
        let found = walk(&steps, own, &is_possible, &mut |setting| {
            listener.step(&format!("together: {setting}"), self.spent());
            for round in 0..STEP_ROUNDS {
                match shots.take(setting, round, end) {
                    Ok(true) => {}
                    Ok(false) => return None,
                    Err(error) => {
                        failed = Some(error);
                        return None;
                    }
                }
            }
            shots.point(setting)
        });
        if let Some(error) = failed {
            return Err(error);
        }
        let mut known: Vec<Setting> = [Setting::default()].into_iter().chain(self.choices().map(Setting::one)).collect();
        known.retain(is_possible);
        known.extend(found.into_iter().map(|(setting, _)| setting));
        let mut chosen = unbeaten(known, |setting| shots.point(setting));
        // The best of many is partly the luckiest: only what it does with other random numbers counts.
        let mut again = Shots::new(shots.studio, shots.truth);
        for round in FRESH..FRESH + STEP_ROUNDS {
            for setting in [&Setting::default()].into_iter().chain(chosen.iter().filter(|s| **s != Setting::default())) {
                listener.step(&format!("once more: {setting}"), self.spent());
                self.cut_short |= !again.take(setting, round, self.at(1.0))?;
            }
        }
        chosen = unbeaten(chosen, |setting| again.point(setting));
        let candidate = |setting: &Setting| Some(Candidate { flags: setting.flags(), measured: again.measured(setting)? });
        Ok(chosen.iter().filter_map(candidate).collect())
    }

    /// What is known of a ladder's rungs, as far as they were measured; none where the scene's own has no place among them.
    ///
    /// What a rung gets wrong is its difference to the ladder's most exact one with the same random numbers: beside the error of
    /// few samples it would not be seen, and yet decide what many are worth.
    fn steps(&self, ladder: Ladder, shots: &Shots<'_>) -> Option<Steps> {
        let in_use = ladder.in_use(self.scene, &self.settings);
        let exact = self.most_exact(ladder);
        let point = |setting: &Setting| {
            let point = shots.point(setting)?;
            let error = if ladder.shares_random_numbers() { shots.paired(setting, &exact)?.relative } else { point.error };
            Some(Point { error, ..point })
        };
        let own = point(&Setting::default())?;
        let mut rungs = Vec::new();
        for choice in ladder.choices().filter(|choice| choice.rung() != in_use) {
            rungs.extend(point(&Setting::one(choice)).map(|point| (Some(choice), point)));
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
        Some(Steps { ladder, rungs, own: place })
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
