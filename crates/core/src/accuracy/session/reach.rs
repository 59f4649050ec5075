//! What a measurement can reach in its time: how exact the reference may be, and how large the pictures.

use std::time::Duration;

use super::super::renderer::Unfinished;
use super::super::setting::Setting;
use super::{BASE_SAMPLES, HALVES, REACH, REFERENCE, RUNGS, Session};
use crate::ladder::{Choice, Ladder, RungValue};
use crate::prepare::PrepareError;
use crate::settings::{Sampling, Settings};

/// Columns of the smallest picture that is measured, where the scene's is not smaller.
const LEAST_WIDTH: f64 = 40.0;
/// A rung may take this many times as long as the scene's own, or so long at least, in the smallest picture.
const PATIENCE: f64 = 20.0;
const LEAST_PATIENCE: Duration = Duration::from_millis(500);
/// Samples of the pictures by which the size is chosen: those of a fixed pattern may be shared by pixels.
const PROBE: u32 = 16;
/// Rounds that the size allows for.
const ROUNDS: f64 = 3.0;
/// Seconds that a render has to take to say how fast the scene renders.
const LEAST_PROBE: f64 = 0.03;
impl Session<'_> {
    /// The most exact rung of each ladder that does not take too long, samples apart, as a tiny picture shows. Paths that divide at
    /// glass and mirrors have twice as many ends with each segment. What is not known when the time for this is over stays as it is.
    pub fn within_reach(&mut self) -> Result<Setting, PrepareError> {
        let settings = Settings { size: self.scaled(self.least()), ..self.settings.clone() };
        let (before, end) = ((self.now)(), self.at(REACH));
        let own = self.studio(&settings).take(&self.base, 0, self.at(1.0));
        let patience = ((self.now)() - before).mul_f64(PATIENCE).max(LEAST_PATIENCE);
        own.map_err(Unfinished::into_error)?;
        let mut exact = Setting::default();
        for ladder in self.pictured.iter().copied().filter(|&ladder| ladder != Ladder::Samples && !ladder.is_a_matter_of_taste())
        {
            for choice in self.choices_of(ladder).rev().filter(Choice::can_be_reference) {
                let setting = self.setting(choice);
                if (self.now)() >= end {
                    return Ok(exact);
                }
                match self.studio(&settings).take(&setting, 0, end.min((self.now)() + patience)) {
                    Ok(_) => {
                        exact = exact.with(choice);
                        break;
                    }
                    Err(Unfinished::Late) => self.beyond.push(choice),
                    Err(Unfinished::Failed(error)) => return Err(error),
                }
            }
        }
        Ok(exact)
    }

    /// Share of the scene's width that the smallest picture has.
    fn least(&self) -> f64 {
        (LEAST_WIDTH / f64::from(self.full_size[0])).min(1.0)
    }

    fn scaled(&self, factor: f64) -> [u32; 2] {
        self.full_size.map(|edge| (f64::from(edge) * factor).round().max(1.0) as u32)
    }

    /// Size at which three rounds take their share of the budget, by what samples take in small pictures; at most the scene's.
    pub fn affordable(&self) -> Result<[u32; 2], PrepareError> {
        let own = f64::from(self.settings.sampling.count());
        let mut factor = self.least();
        let a_sample = loop {
            let size = self.scaled(factor);
            let settings = Settings { size, sampling: Sampling::General(PROBE), ..self.settings.clone() };
            let before = (self.now)();
            // Late is right for a picture so slow: the smallest is then all there is time for.
            match self.studio(&settings).take(&Setting::default(), 0, self.at(REFERENCE)) {
                Err(Unfinished::Failed(error)) => return Err(error),
                Err(Unfinished::Late) => return Ok(self.scaled(self.least())),
                Ok(_) => {}
            }
            let seconds = ((self.now)() - before).as_secs_f64();
            if seconds >= LEAST_PROBE || factor >= 1.0 {
                break seconds / (f64::from(size[0]) * f64::from(size[1]) * f64::from(PROBE));
            }
            factor = (2.0 * factor).min(1.0);
        };
        let base = own.min(f64::from(BASE_SAMPLES));
        let samples: f64 = self.choices().map(|choice| samples_of(choice).filter(|&n| n <= HALVES * own).unwrap_or(base)).sum();
        let wanted = self.effort.budget.as_secs_f64() * (RUNGS - REFERENCE) / (ROUNDS * (samples + own) * a_sample);
        let [width, height] = self.full_size.map(f64::from);
        Ok(self.scaled((wanted / (width * height)).sqrt().clamp(self.least(), 1.0)))
    }
}

/// Samples of a rung of that ladder.
pub(super) fn samples_of(choice: Choice) -> Option<f64> {
    let RungValue::Samples(samples) = choice.value() else { return None };
    Some(f64::from(samples))
}
