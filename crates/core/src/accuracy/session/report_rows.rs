//! Parts of the report: the rungs (quality levels) of a ladder, combinations of rungs, and pictures
//! for comparison.

use super::super::ConfidenceInterval;
use super::super::measurements::Measurements;
use super::super::report::{
    LadderReport, MeasuredBaseline, MeasuredSetting, MeasuredSettingWithFlags, ReportPicture,
    RungReport,
};
use super::super::setting::RungSetting;
use super::{BASE_SAMPLES, MeasurementSession};
use crate::film::Film;
use crate::ladder::{Ladder, RungChoice};
use crate::picture::Picture;

impl MeasurementSession<'_> {
    /// Returns the report of a ladder: time and error of each rung (quality level). `own_errors`
    /// lists the settings that were compared with the ladder's most exact rung under the same
    /// random numbers.
    pub(super) fn ladder_report(
        &self,
        ladder: Ladder,
        measurements: &Measurements<'_>,
        own_errors: &[(RungSetting, Ladder)],
    ) -> LadderReport {
        let in_use = ladder.current_rung_name(self.scene, &self.settings);
        let (exact, beside) = (
            self.most_exact_setting(ladder),
            self.baseline_for_ladder(ladder),
        );
        let rung = |choice: RungChoice| {
            let setting = self.setting_of_rung(choice);
            let is_in_use = setting == beside;
            // The most exact rung was compared with the rung in use, and every other rung with the
            // most exact rung.
            let pair = if is_in_use { &exact } else { &setting };
            let is_paired = own_errors.contains(&(pair.clone(), ladder));
            let own_error = match setting == exact {
                true => {
                    (ladder.shares_random_numbers()).then(|| ConfidenceInterval::from_exact(0.0))
                }
                false => is_paired
                    .then(|| measurements.differences_under_same_random_numbers(pair))
                    .flatten()
                    .map(|[alone, _]| alone),
            };
            RungReport {
                rung: choice.rung().to_owned(),
                about: choice.rung_description(),
                in_use: is_in_use,
                flag: (!is_in_use)
                    .then(|| RungSetting::from_rung(choice).flags().pop())
                    .flatten(),
                measured: measurements.summarise_setting(&setting, &beside),
                own_error,
            }
        };
        LadderReport {
            ladder: ladder.name(),
            rungs: self.applicable_rungs(ladder).map(rung).collect(),
            in_use,
        }
    }

    /// Returns time and error of the baseline (the scene with fewer samples). `None` if the
    /// baseline is the scene's own setting.
    pub(super) fn baseline_report(
        &self,
        measurements: &Measurements<'_>,
    ) -> Option<MeasuredBaseline> {
        self.baseline.rung(Ladder::Samples)?;
        Some(MeasuredBaseline {
            samples: BASE_SAMPLES,
            measured: measurements.summarise_setting(&self.baseline, &RungSetting::default())?,
        })
    }

    /// Returns the measured settings in which several rungs (quality levels) are changed.
    pub(super) fn combination_reports(
        &self,
        settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> Vec<MeasuredSettingWithFlags> {
        let rows: Vec<RungSetting> = self
            .picture_ladders
            .iter()
            .flat_map(|&ladder| self.applicable_rungs(ladder))
            .map(|choice| self.setting_of_rung(choice))
            .collect();
        let others = settings
            .iter()
            .filter(|setting| !rows.contains(setting) && **setting != self.baseline);
        let candidate = |setting: &RungSetting| self.frontier_setting(setting, measurements);
        others
            .filter(|setting| **setting != RungSetting::default())
            .filter_map(candidate)
            .collect()
    }

    pub(super) fn frontier_setting(
        &self,
        setting: &RungSetting,
        measurements: &Measurements<'_>,
    ) -> Option<MeasuredSettingWithFlags> {
        let measured: MeasuredSetting =
            measurements.summarise_setting(setting, &RungSetting::default())?;
        Some(MeasuredSettingWithFlags {
            flags: setting.flags(),
            measured,
        })
    }

    /// Returns the pictures for comparison: the reference, and the first render of each setting
    /// that differs from the scene's own in one choice. They show the first tile, or the whole
    /// picture if all tiles were measured.
    pub(super) fn report_pictures(
        &self,
        measurements: &Measurements<'_>,
        film: &Film,
    ) -> Vec<ReportPicture> {
        let whole = film.picture();
        let is_whole = measurements
            .sample
            .covers_picture(measurements.reference_tile_count());
        let Some(reference) = (if is_whole {
            Some(&whole)
        } else {
            measurements.reference_picture()
        }) else {
            return Vec::new();
        };
        let reference = Picture {
            layers: Vec::new(),
            ..reference.clone()
        };
        let choices = self
            .picture_ladders
            .iter()
            .flat_map(|&ladder| self.applicable_rungs(ladder));
        let mut all = vec![RungSetting::default()];
        for setting in choices.map(|choice| self.setting_of_rung(choice)) {
            if !all.contains(&setting) {
                all.push(setting);
            }
        }
        let size = (reference.width, reference.height);
        let render = |setting: &RungSetting| {
            let picture = measurements
                .first_picture(setting)
                .filter(|first| (first.width, first.height) == size)?;
            Some(ReportPicture {
                name: setting.to_string(),
                picture: picture.clone(),
            })
        };
        let renders = all.iter().filter_map(render).collect::<Vec<_>>();
        [ReportPicture {
            name: "reference".to_owned(),
            picture: reference,
        }]
        .into_iter()
        .chain(renders)
        .collect()
    }
}
