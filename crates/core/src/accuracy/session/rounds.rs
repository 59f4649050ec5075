//! Rounds over all settings: in which order, and how many there is time for.

use std::time::Duration;

use super::super::Listener;
use super::super::measurements::Measurements;
use super::super::setting::Setting;
use super::reach::samples_of;
use super::{HALVES, RUNGS, Session};
use crate::ladder::{Choice, Ladder};
use crate::prepare::PrepareError;

impl Session<'_> {
    /// Every setting of the rounds, the most telling first: the scene as it is, numbers of samples that may be worth their time, what the
    /// other rungs are put on, these, and more samples than anyone needs who has so many.
    pub fn rounds_of(&self) -> Vec<Setting> {
        let (samples, others): (Vec<Choice>, Vec<Choice>) = self.choices().partition(|choice| choice.ladder() == Ladder::Samples);
        let of = |choices: Vec<Choice>| choices.into_iter().map(|choice| self.setting(choice));
        let (far, near): (Vec<Setting>, Vec<Setting>) = of(samples).partition(|setting| self.has_many_samples(setting));
        let mut all = vec![Setting::default()];
        for setting in near.into_iter().chain([self.base.clone()]).chain(of(others)).chain(far) {
            if !all.contains(&setting) {
                all.push(setting);
            }
        }
        all
    }

    /// Whether a setting has more samples than halve the error of the scene's own.
    fn has_many_samples(&self, setting: &Setting) -> bool {
        let own = f64::from(self.settings.sampling.count());
        setting.rung(Ladder::Samples).and_then(samples_of).is_some_and(|samples| samples > HALVES * own)
    }

    /// Two rounds over settings that take about as long as the scene's own, since one says nothing of what a clock is off by; two over those of
    /// many samples; and further ones over all that would be finished.
    pub fn rounds(&mut self, measurements: &mut Measurements<'_>, listener: &mut dyn Listener) -> Result<(), PrepareError> {
        let a_sample = self.first_render(measurements, listener)?;
        let (far, near): (Vec<Setting>, Vec<Setting>) =
            self.rounds_of().into_iter().partition(|setting| self.has_many_samples(setting));
        let mut took = Duration::ZERO;
        for (settings, round) in [(&near, 0), (&near, 1), (&far, 0), (&far, 1)] {
            let before = (self.now)();
            self.round((settings, round), a_sample, measurements, listener)?;
            took += ((self.now)() - before) / 2;
        }
        let all = [near, far].concat();
        for round in 2..u64::from(self.effort.rounds) {
            let before = (self.now)();
            if before + took > self.at(RUNGS) {
                break;
            }
            self.round((&all, round), a_sample, measurements, listener)?;
            took = (self.now)() - before;
        }
        Ok(())
    }

    /// Renders the scene as it is, and again in place of that, since the first picture of a size also takes the time for its memory. Seconds
    /// that a sample takes.
    fn first_render(&self, measurements: &mut Measurements<'_>, listener: &mut dyn Listener) -> Result<f64, PrepareError> {
        let own = Setting::default();
        listener.step(&format!("round 1: {own}"), self.spent());
        let before = (self.now)();
        // Without the scene's own picture there is nothing to tell, so that one may take what there is.
        measurements.take(&own, 0, self.at(1.0))?;
        let took = (self.now)() - before;
        if before + 2 * took <= self.at(RUNGS) {
            measurements.take_again(&own, 0, self.at(RUNGS))?;
        }
        Ok(took.as_secs_f64() / f64::from(self.settings.sampling.count()))
    }

    fn round(
        &mut self,
        (settings, round): (&[Setting], u64),
        a_sample: f64,
        measurements: &mut Measurements<'_>,
        listener: &mut dyn Listener,
    ) -> Result<(), PrepareError> {
        let (end, own_samples) = (self.at(RUNGS), f64::from(self.settings.sampling.count()));
        for setting in settings {
            listener.step(&format!("round {}: {setting}", round + 1), self.spent());
            let samples = setting.rung(Ladder::Samples).and_then(samples_of).unwrap_or(own_samples);
            // What would not be finished would only take the time of the others.
            let is_possible = (self.now)() + Duration::from_secs_f64(samples * a_sample) <= end;
            self.cut_short |= !(measurements.has(setting, round) || is_possible && measurements.take(setting, round, end)?);
        }
        Ok(())
    }
}
