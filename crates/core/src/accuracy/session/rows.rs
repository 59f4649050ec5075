//! Rows of the report: the rungs of a ladder, combinations of rungs, and pictures for comparison.

use super::super::ConfidenceInterval;
use super::super::measurements::Measurements;
use super::super::report::{
    BaselineReport, FrontierCandidate, LadderReport, MeasuredSetting, ReportPicture, RungReport,
};
use super::super::setting::Setting;
use super::{BASE_SAMPLES, MeasurementSession};
use crate::film::Film;
use crate::ladder::{Ladder, RungChoice};
use crate::picture::Picture;

impl MeasurementSession<'_> {
    pub(super) fn ladder(
        &self,
        ladder: Ladder,
        measurements: &Measurements<'_>,
        own_errors: &[(Setting, Ladder)],
    ) -> LadderReport {
        let in_use = ladder.in_use(self.scene, &self.settings);
        let (exact, beside) = (self.most_exact(ladder), self.beside(ladder));
        let rung = |choice: RungChoice| {
            let setting = self.setting(choice);
            let is_in_use = setting == beside;
            // The most exact rung was compared with the rung in use, and every other rung with the
            // most exact rung.
            let pair = if is_in_use { &exact } else { &setting };
            let is_paired = own_errors.contains(&(pair.clone(), ladder));
            let own_error = match setting == exact {
                true => (ladder.shares_random_numbers()).then(|| ConfidenceInterval::exact(0.0)),
                false => is_paired
                    .then(|| measurements.alone(pair))
                    .flatten()
                    .map(|[alone, _]| alone),
            };
            RungReport {
                rung: choice.rung().to_owned(),
                about: choice.about(),
                in_use: is_in_use,
                flag: (!is_in_use)
                    .then(|| Setting::single(choice).flags().pop())
                    .flatten(),
                measured: measurements.measured(&setting, &beside),
                own_error,
            }
        };
        LadderReport {
            ladder: ladder.name(),
            rungs: self.choices_of(ladder).map(rung).collect(),
            in_use,
        }
    }

    /// Returns time and error of the baseline, the scene with fewer samples; `None` if the baseline
    /// is the scene's own setting.
    pub(super) fn base_report(&self, measurements: &Measurements<'_>) -> Option<BaselineReport> {
        self.base.rung(Ladder::Samples)?;
        Some(BaselineReport {
            samples: BASE_SAMPLES,
            measured: measurements.measured(&self.base, &Setting::default())?,
        })
    }

    /// Returns the measured settings with several changed rungs, which are not rows of a ladder.
    pub(super) fn combinations(
        &self,
        settings: &[Setting],
        measurements: &Measurements<'_>,
    ) -> Vec<FrontierCandidate> {
        let rows: Vec<Setting> = self
            .pictured
            .iter()
            .flat_map(|&ladder| self.choices_of(ladder))
            .map(|choice| self.setting(choice))
            .collect();
        let others = settings
            .iter()
            .filter(|setting| !rows.contains(setting) && **setting != self.base);
        let candidate = |setting: &Setting| self.candidate(setting, measurements);
        others
            .filter(|setting| **setting != Setting::default())
            .filter_map(candidate)
            .collect()
    }

    pub(super) fn candidate(
        &self,
        setting: &Setting,
        measurements: &Measurements<'_>,
    ) -> Option<FrontierCandidate> {
        let measured: MeasuredSetting = measurements.measured(setting, &Setting::default())?;
        Some(FrontierCandidate {
            flags: setting.flags(),
            measured,
        })
    }

    /// Returns the pictures for the report: of the first tile, or of the whole picture if all tiles
    /// were measured. They are the reference and the first render of each setting with a single
    /// changed rung.
    pub(super) fn pictures(
        &self,
        measurements: &Measurements<'_>,
        film: &Film,
    ) -> Vec<ReportPicture> {
        let whole = film.picture();
        let is_whole = measurements.sample.is_whole(measurements.known_tiles());
        let Some(reference) = (if is_whole {
            Some(&whole)
        } else {
            measurements.truth()
        }) else {
            return Vec::new();
        };
        let reference = Picture {
            layers: Vec::new(),
            ..reference.clone()
        };
        let choices = self
            .pictured
            .iter()
            .flat_map(|&ladder| self.choices_of(ladder));
        let mut all = vec![Setting::default()];
        for setting in choices.map(|choice| self.setting(choice)) {
            if !all.contains(&setting) {
                all.push(setting);
            }
        }
        let size = (reference.width, reference.height);
        let render = |setting: &Setting| {
            let picture = measurements
                .first(setting)
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
