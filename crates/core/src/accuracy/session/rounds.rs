//! Rounds over all settings: in which order, and how many there is time for.

use std::time::Duration;

use super::super::Listener;
use super::super::setting::Setting;
use super::super::shots::Shots;
use super::reach::samples_of;
use super::{HALVES, RUNGS, Session};
use crate::ladder::{Choice, Ladder};
use crate::prepare::PrepareError;

impl Session<'_> {
    /// Every setting of the rounds, the most telling first: the scene as it is, numbers of samples that may be worth their time, what the
    /// other rungs are put on, these, and more samples than anyone needs who has so many.
    pub fn rounds_of(&self) -> Vec<Setting> {
        let own = f64::from(self.settings.sampling.count());
        let many = |choice: &Choice| samples_of(*choice).is_some_and(|samples| samples > HALVES * own);
        let (last, first): (Vec<Choice>, Vec<Choice>) = self.choices().partition(many);
        let is_samples = |choice: &&Choice| choice.ladder() == Ladder::Samples;
        let samples = first.iter().filter(is_samples).chain(&last).map(|&choice| self.setting(choice));
        let others = first.iter().filter(|choice| !is_samples(choice)).map(|&choice| self.setting(choice));
        let (near, far): (Vec<Setting>, Vec<Setting>) =
            samples.partition(|setting| !setting.rung(Ladder::Samples).is_some_and(|choice| many(&choice)));
        let mut all = vec![Setting::default()];
        for setting in near.into_iter().chain([self.base.clone()]).chain(others).chain(far) {
            if !all.contains(&setting) {
                all.push(setting);
            }
        }
        all
    }

    pub fn rounds(&mut self, shots: &mut Shots<'_>, listener: &mut dyn Listener) -> Result<(), PrepareError> {
        let all = self.rounds_of();
        let end = self.at(RUNGS);
        // How long a sample of the scene's own takes.
        let (mut a_sample, own_samples) = (0.0, f64::from(self.settings.sampling.count()));
        for round in 0..u64::from(self.effort.rounds.max(2)) {
            let before = (self.now)();
            for setting in &all {
                listener.step(&format!("round {}: {setting}", round + 1), self.spent());
                // Without the scene's own picture there is nothing to tell, so that one may take what there is.
                let must = round == 0 && *setting == Setting::default();
                let samples = setting.rung(Ladder::Samples).and_then(samples_of).unwrap_or(own_samples);
                let expected = samples * a_sample;
                let began = (self.now)();
                // What would not be finished would only take the time of the others.
                let taken = (must || began + Duration::from_secs_f64(expected) <= end)
                    && shots.take(setting, round, if must { self.at(1.0) } else { end })?;
                if must {
                    a_sample = ((self.now)() - began).as_secs_f64() / own_samples;
                }
                self.cut_short |= !taken;
            }
            // A further round that would not be finished is not begun.
            if round >= 1 && (self.now)() + ((self.now)() - before) > end {
                break;
            }
        }
        Ok(())
    }
}
