//! Costs in time and memory: rungs that do not change pictures, and the effects of the scene.

use super::super::Listener;
use super::super::effects::{Bench, EffectCosts};
use super::super::measurements::Measurements;
use super::super::report::{Price, PriceReport};
use super::{COSTS, PRICES, Session};
use crate::prepare::PrepareError;

/// Maps the progress of a part to its range of the whole.
struct ProgressRange<'a> {
    listener: &'a mut dyn Listener,
    from: f64,
    to: f64,
}

impl Listener for ProgressRange<'_> {
    fn step(&mut self, what: &str, share: f64) {
        self.listener
            .step(what, self.from + share * (self.to - self.from));
    }
}

impl Session<'_> {
    pub fn prices(
        &mut self,
        measurements: &Measurements<'_>,
        listener: &mut dyn Listener,
    ) -> Result<Vec<PriceReport>, PrepareError> {
        let mut reports = Vec::new();
        for &ladder in &self.priced {
            let in_use = ladder.in_use(self.scene, &self.settings);
            let mut rungs = Vec::new();
            for (choice, rung) in ladder.choices().zip(ladder.rungs()) {
                let setting = self.setting(choice);
                let in_use = setting == self.base;
                listener.step(&format!("time of {choice}"), self.spent());
                let paid = measurements.paid(&setting, &self.base, self.at(PRICES))?;
                rungs.push(Price {
                    rung: rung.name.to_owned(),
                    about: rung.about,
                    in_use,
                    paid,
                });
            }
            reports.push(PriceReport {
                ladder: ladder.name(),
                in_use,
                rungs,
            });
        }
        Ok(reports)
    }

    /// Measures the cost of each effect; `None` without time for any.
    pub fn costs(
        &mut self,
        listener: &mut dyn Listener,
    ) -> Result<Option<EffectCosts>, PrepareError> {
        let Self {
            observer,
            stopwatch,
            now,
            ..
        } = *self;
        let (scene, settings) = self.base.applied(self.scene, &self.settings);
        let (start, from) = (now(), self.spent());
        let budget = self.at(COSTS).saturating_duration_since(start);
        let bench = Bench {
            scene: &scene,
            observer,
            stopwatch,
            now,
            start,
            budget,
        };
        match bench.run(
            &settings,
            &mut ProgressRange {
                listener,
                from,
                to: 1.0,
            },
        ) {
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
