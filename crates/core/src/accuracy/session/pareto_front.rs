//! Choice among the measured settings: the Pareto front of time and error, and the recommendations.

use super::MeasurementSession;
use crate::accuracy::frontier::{FrontierPoint, pareto_front_indices};
use crate::accuracy::measurements::Measurements;
use crate::accuracy::recommendation::{
    RecommendationCandidate, is_recommendable, recommend_settings,
};
use crate::accuracy::report::{MeasuredSettingWithFlags, Recommendations};
use crate::accuracy::setting::RungSetting;

impl MeasurementSession<'_> {
    /// Returns time and error of a setting; `None` if the setting was not measured.
    pub(super) fn frontier_point(
        &self,
        setting: &RungSetting,
        measurements: &Measurements<'_>,
    ) -> Option<FrontierPoint> {
        let measured = measurements.summarise_setting(setting, setting)?;
        // A clock may be too coarse for a tiny picture.
        Some(FrontierPoint {
            time: measured.seconds.value.max(1e-9),
            error: measured.errors.relmse.value,
        })
    }

    /// Whether a setting was measured and may be recommended in place of the scene's own.
    pub(super) fn is_recommendable(
        &self,
        setting: &RungSetting,
        measurements: &Measurements<'_>,
    ) -> bool {
        let value_of = |setting: &RungSetting| measurements.summarise_setting(setting, setting);
        value_of(setting)
            .zip(value_of(&RungSetting::default()))
            .is_some_and(|(measured, own_measured)| {
                is_recommendable(setting, &measured, &own_measured)
            })
    }

    /// Returns the settings on the Pareto front with time and error, and the recommended settings.
    pub(super) fn frontier_report(
        &self,
        settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> (Vec<MeasuredSettingWithFlags>, Recommendations) {
        let chosen_settings = self.pareto_settings(settings, measurements);
        let candidates = chosen_settings
            .iter()
            .filter_map(|setting| self.frontier_setting(setting, measurements));
        (
            candidates.collect(),
            self.recommend_settings(settings, measurements),
        )
    }

    /// Returns the recommended ones of the measured settings.
    pub(super) fn recommend_settings(
        &self,
        settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> Recommendations {
        let own_setting = RungSetting::default();
        let contestant = |setting: &RungSetting| {
            let (measured, cost) = (
                measurements.summarise_setting(setting, &own_setting)?,
                measurements.relative_cost(setting, &own_setting)?,
            );
            let is_sound = self.is_recommendable(setting, measurements);
            Some(RecommendationCandidate {
                setting: setting.clone(),
                measured,
                cost,
                is_recommendable: is_sound,
            })
        };
        recommend_settings(
            settings.iter().filter_map(contestant).collect(),
            self.effort.budget.as_secs_f64(),
        )
    }

    /// Returns the measured, recommendable settings on the Pareto front. Of settings with equal
    /// time and error, the one with the fewest changes from the scene's own is returned.
    pub(super) fn pareto_settings(
        &self,
        known_settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> Vec<RungSetting> {
        let mut settings: Vec<RungSetting> = known_settings
            .iter()
            .filter(|setting| {
                **setting == RungSetting::default() || self.is_recommendable(setting, measurements)
            })
            .cloned()
            .collect();
        settings.sort_by_key(|setting| setting.flags().len());
        let known: Vec<(RungSetting, FrontierPoint)> = settings
            .into_iter()
            .filter_map(|setting| {
                self.frontier_point(&setting, measurements)
                    .map(|point| (setting, point))
            })
            .collect();
        let points: Vec<_> = known.iter().map(|(_, point)| *point).collect();
        pareto_front_indices(&points)
            .into_iter()
            .map(|i| known[i].0.clone())
            .collect()
    }
}
