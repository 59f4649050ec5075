//! Costs of rungs that do not change pictures, in time and memory, and costs of the scene's
//! effects.

use super::super::ProgressListener;
use super::super::effects::{EffectBench, EffectCosts};
use super::super::measurements::Measurements;
use super::super::report::{PriceReport, RungPrice};
use super::{COSTS, MeasurementSession, PRICES};
use crate::prepare::PrepareError;

/// Progress listener that maps the progress of a stage, 0 to 1, to its range of the whole
/// measurement.
struct ProgressRange<'a> {
    listener: &'a mut dyn ProgressListener,
    from: f64,
    to: f64,
}

impl ProgressListener for ProgressRange<'_> {
    fn step(&mut self, label: &str, share: f64) {
        self.listener
            .step(label, self.from + share * (self.to - self.from));
    }
}

impl MeasurementSession<'_> {
    pub fn prices(
        &mut self,
        measurements: &Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<Vec<PriceReport>, PrepareError> {
        let mut reports = Vec::new();
        for &ladder in &self.priced {
            let in_use = ladder.in_use(self.scene, &self.settings);
            let mut rungs = Vec::new();
            for (choice, rung) in ladder.choices().zip(ladder.rungs()) {
                let setting = self.setting(choice);
                let in_use = setting == self.base;
                listener.step(&format!("time of {choice}"), self.spent());
                let rung_cost =
                    measurements.rung_cost(&setting, &self.base, self.instant_at(PRICES))?;
                rungs.push(RungPrice {
                    rung: rung.name.to_owned(),
                    about: rung.about,
                    in_use,
                    rung_cost,
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

    /// Measures the cost of each effect of the scene; `None` if the time does not suffice for one
    /// effect.
    pub fn costs(
        &mut self,
        listener: &mut dyn ProgressListener,
    ) -> Result<Option<EffectCosts>, PrepareError> {
        let Self {
            observer,
            stopwatch,
            now,
            ..
        } = *self;
        let (scene, settings) = self.base.applied(self.scene, &self.settings);
        let (start, from) = (now(), self.spent());
        let budget = self.instant_at(COSTS).saturating_duration_since(start);
        let bench = EffectBench {
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
