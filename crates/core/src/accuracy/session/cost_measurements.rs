//! Time and memory of rungs (quality levels) that do not change the picture, and costs of the
//! scene's effects.

use super::super::ProgressListener;
use super::super::effects::{EffectBench, EffectCosts};
use super::super::measurements::Measurements;
use super::super::report::{LadderCostReport, RungCostReport};
use super::MeasurementSession;
use super::time_budget::{COSTS_END, PRICES_END};
use crate::prepare::PrepareError;

/// Progress listener of one stage of the measurement. It converts the progress of the stage, 0 to
/// 1, to the progress of the whole measurement.
struct ProgressRange<'a> {
    listener: &'a mut dyn ProgressListener,
    from: f64,
    to: f64,
}

impl ProgressListener for ProgressRange<'_> {
    fn report_step(&mut self, label: &str, share: f64) {
        self.listener
            .report_step(label, self.from + share * (self.to - self.from));
    }
}

impl MeasurementSession<'_> {
    /// Measures time and memory of the rungs (quality levels) of each ladder that does not change
    /// the picture. Returns one report per ladder.
    pub fn measure_rung_costs(
        &mut self,
        measurements: &Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<Vec<LadderCostReport>, PrepareError> {
        let mut reports = Vec::new();
        for &ladder in &self.cost_ladders {
            let in_use = ladder.current_rung_name(self.scene, &self.settings);
            let mut rungs = Vec::new();
            for (choice, rung) in ladder.choices().zip(ladder.rungs()) {
                let setting = self.setting_of_rung(choice);
                let in_use = setting == self.baseline;
                listener.report_step(&format!("timing {choice}"), self.spent_budget_share());
                let rung_cost = measurements.measure_rung_cost(
                    &setting,
                    &self.baseline,
                    self.instant_of_budget_share(PRICES_END),
                )?;
                rungs.push(RungCostReport {
                    rung: rung.name.to_owned(),
                    about: rung.about,
                    in_use,
                    rung_cost,
                });
            }
            reports.push(LadderCostReport {
                ladder: ladder.name(),
                in_use,
                rungs,
            });
        }
        Ok(reports)
    }

    /// Measures the cost of each effect of the scene; `None` if the time does not suffice for one
    /// effect.
    pub fn measure_effect_costs(
        &mut self,
        listener: &mut dyn ProgressListener,
    ) -> Result<Option<EffectCosts>, PrepareError> {
        let Self {
            observer,
            stopwatch,
            now,
            ..
        } = *self;
        let (scene, settings) = self.baseline.apply(self.scene, &self.settings);
        let (start, from) = (now(), self.spent_budget_share());
        let budget = self
            .instant_of_budget_share(COSTS_END)
            .saturating_duration_since(start);
        let bench = EffectBench {
            scene: &scene,
            observer,
            stopwatch,
            now,
            start,
            budget,
        };
        match bench.measure_costs(
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
