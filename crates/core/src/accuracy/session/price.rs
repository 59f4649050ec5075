//! What costs time and memory apart from errors: rungs that no picture depends on, and the effects of the scene.

use super::super::Listener;
use super::super::effects::{Bench, EffectCosts};
use super::super::report::{Price, PriceReport};
use super::super::setting::Setting;
use super::super::shots::Shots;
use super::{EFFECTS, PRICES, Session};
use crate::prepare::PrepareError;

/// Tells of a part of the measurement as the stretch of the whole that it is.
struct Stretch<'a> {
    listener: &'a mut dyn Listener,
    from: f64,
    to: f64,
}

impl Listener for Stretch<'_> {
    fn step(&mut self, what: &str, share: f64) {
        self.listener.step(what, self.from + share * (self.to - self.from));
    }
}

impl Session<'_> {
    pub fn prices(&mut self, shots: &Shots<'_>, listener: &mut dyn Listener) -> Result<Vec<PriceReport>, PrepareError> {
        let mut reports = Vec::new();
        for &ladder in &self.priced {
            let in_use = ladder.in_use(self.scene, &self.settings);
            let mut rungs = Vec::new();
            for (choice, rung) in ladder.choices().zip(ladder.rungs()) {
                let setting = self.setting(choice);
                let own = setting == Setting::default();
                listener.step(&format!("time of {choice}"), self.spent());
                let paid = shots.paid(&setting, self.at(PRICES))?;
                rungs.push(Price { rung: rung.name.to_owned(), about: rung.about, in_use: own, paid });
            }
            reports.push(PriceReport { ladder: ladder.name(), in_use, rungs });
        }
        Ok(reports)
    }

    /// What each effect costs; none where there is no time for any.
    pub fn costs(&mut self, listener: &mut dyn Listener) -> Result<Option<EffectCosts>, PrepareError> {
        let Self { scene, observer, stopwatch, now, .. } = *self;
        let (start, from) = (now(), self.spent());
        let bench = Bench { scene, observer, stopwatch, now, start, budget: self.at(EFFECTS).saturating_duration_since(start) };
        match bench.run(&self.settings, &mut Stretch { listener, from, to: EFFECTS.max(from) }) {
            Ok(costs) => {
                self.cut_short |= !costs.late.is_empty();
                Ok(Some(costs))
            }
            Err(PrepareError::Cancelled) => {
                self.cut_short = true;
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}
