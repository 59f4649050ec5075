//! Division of the time budget among the stages of a measurement.

use std::time::Instant;

use super::MeasurementSession;

/// Share of the time budget, 0 to 1, that is spent at the end of each stage.
pub(super) const PILOT_PASS_END: f64 = 0.06;
pub(super) const FEASIBLE_RUNGS_END: f64 = 0.12;
pub(super) const PILOTS_END: f64 = 0.27;
pub(super) const REFERENCE_END: f64 = 0.45;
pub(super) const RUNGS_END: f64 = 0.74;
pub(super) const WALKS_END: f64 = 0.8;
pub(super) const REFINEMENT_END: f64 = 0.87;
pub(super) const TURNS_END: f64 = 0.92;
pub(super) const PRICES_END: f64 = 0.94;
pub(super) const COSTS_END: f64 = 0.96;

impl MeasurementSession<'_> {
    /// Returns the instant at which this share of the time budget, 0 to 1, is spent.
    pub(super) fn instant_of_budget_share(&self, share: f64) -> Instant {
        self.start + self.effort.budget.mul_f64(share)
    }

    /// Returns the wall-clock seconds until this share of the time budget is spent; zero if it is
    /// spent already.
    pub(super) fn seconds_until_budget_share(&self, share: f64) -> f64 {
        self.instant_of_budget_share(share)
            .saturating_duration_since((self.now)())
            .as_secs_f64()
    }

    /// Returns the wall-clock seconds since the start of the measurement.
    pub(super) fn elapsed(&self) -> f64 {
        ((self.now)() - self.start).as_secs_f64()
    }

    /// Returns the spent share of the time budget, 0 to 1.
    pub(super) fn spent_budget_share(&self) -> f64 {
        (self.elapsed() / self.effort.budget.as_secs_f64().max(1e-9)).min(1.0)
    }
}
