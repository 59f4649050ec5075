//! List of the settings that a measurement plans, in order of importance.

use super::{HALVING_SAMPLES, MeasurementSession, rung_sample_count};
use crate::accuracy::setting::RungSetting;
use crate::ladder::{Ladder, RungChoice};

/// Ladders that most users change: number of samples, and denoising.
const NUMBERS: [Ladder; 2] = [Ladder::Samples, Ladder::Reconstruction];

/// Setting to be measured, and the ladder (quality setting) that it changes.
#[derive(Clone)]
pub(super) struct PlannedSetting {
    pub setting: RungSetting,
    pub ladder: Ladder,
    /// Setting with which this one is compared under the same random numbers.
    pub compared_setting: Option<RungSetting>,
    /// Whether the pictures are kept for comparison with later settings.
    pub keeps_pictures: bool,
}

impl PlannedSetting {
    /// Creates a setting that is measured without comparison.
    fn new(setting: RungSetting, ladder: Ladder) -> Self {
        Self {
            setting,
            ladder,
            compared_setting: None,
            keeps_pictures: false,
        }
    }

    /// Returns the setting, with pictures that are kept.
    fn keeping_pictures(self) -> Self {
        Self {
            keeps_pictures: true,
            ..self
        }
    }

    /// Whether the setting belongs to one of the most important ladders, which are measured on more
    /// tiles.
    pub fn has_important_ladder(&self) -> bool {
        matches!(
            self.ladder,
            Ladder::Samples | Ladder::Reconstruction | Ladder::Integrator
        )
    }
}

impl MeasurementSession<'_> {
    /// Returns every setting of the plan in order of importance. First come the scene's own setting
    /// and the baseline, the scene with fewer samples. Sample counts up to those that halve the
    /// error follow, with and without denoising. Then come the rungs (quality levels) of all other
    /// ladders, and last larger sample counts.
    pub(super) fn planned_settings(&self) -> Vec<PlannedSetting> {
        let (near, far): (Vec<RungChoice>, Vec<RungChoice>) = self
            .applicable_rungs(Ladder::Samples)
            .filter(|_| self.picture_ladders.contains(&Ladder::Samples))
            .partition(|&choice| {
                rung_sample_count(choice)
                    .is_some_and(|samples| samples <= self.sample_count_halving_error())
            });
        let own = PlannedSetting::new(RungSetting::default(), Ladder::Samples);
        let baseline = PlannedSetting::new(self.baseline.clone(), Ladder::Samples);
        let mut all = vec![own.keeping_pictures(), baseline.keeping_pictures()];
        all.extend(self.planned_sample_settings(near));
        for &ladder in &self.picture_ladders {
            if ladder != Ladder::Samples {
                all.extend(self.planned_ladder_settings(ladder));
            }
        }
        all.extend(
            far.into_iter()
                .map(|choice| PlannedSetting::new(self.setting_of_rung(choice), Ladder::Samples)),
        );
        let mut known: Vec<RungSetting> = Vec::new();
        all.retain(|item| {
            let is_new = !known.contains(&item.setting) && self.is_valid_setting(&item.setting);
            known.push(item.setting.clone());
            is_new
        });
        all
    }

    /// Returns the number of samples per pixel that halves the error of the scene's own number.
    fn sample_count_halving_error(&self) -> u32 {
        HALVING_SAMPLES.saturating_mul(self.settings.sampling.samples_per_pixel())
    }

    /// Returns the settings of these sample counts and of the scene's own, each with and without
    /// denoising.
    fn planned_sample_settings(&self, sample_counts: Vec<RungChoice>) -> Vec<PlannedSetting> {
        let denoised = Ladder::Reconstruction.choices().find(|choice| {
            self.picture_ladders.contains(&Ladder::Reconstruction) && !self.is_rung_in_use(*choice)
        });
        sample_counts
            .into_iter()
            .map(|choice| self.setting_of_rung(choice))
            .chain([RungSetting::default()])
            .flat_map(|setting| {
                let other = denoised
                    .map(|choice| setting.with_rung(choice))
                    .filter(|other| self.is_valid_setting(other))
                    .map(|other| PlannedSetting::new(other, Ladder::Reconstruction));
                [PlannedSetting::new(setting, Ladder::Samples)]
                    .into_iter()
                    .chain(other)
            })
            .collect()
    }

    /// Returns the settings of a ladder's rungs (quality levels), the most exact first. The
    /// most exact rung is compared with the baseline, and every other rung with the most exact one.
    fn planned_ladder_settings(&self, ladder: Ladder) -> Vec<PlannedSetting> {
        let exact = self.most_exact_setting(ladder);
        let pair = |setting: RungSetting| ladder.shares_random_numbers().then_some(setting);
        let most_exact = PlannedSetting {
            compared_setting: pair(self.baseline_for_ladder(ladder)),
            ..PlannedSetting::new(exact.clone(), ladder)
        };
        let others = self
            .applicable_rungs(ladder)
            .filter(|choice| !self.infeasible_rungs.contains(choice))
            .map(|choice| PlannedSetting {
                compared_setting: pair(exact.clone()),
                ..PlannedSetting::new(self.setting_of_rung(choice), ladder)
            });
        [most_exact.keeping_pictures()]
            .into_iter()
            .chain(others)
            .collect()
    }

    /// Returns the settings that change samples or denoising alone, with sample counts up to those
    /// that halve the error. Denoised settings are included if they are rendered as whole pictures.
    pub(super) fn common_sample_settings(&self) -> Vec<RungSetting> {
        let is_near =
            |setting: &RungSetting| self.sample_count(setting) <= self.sample_count_halving_error();
        let is_one = |setting: &RungSetting| {
            setting
                .choices()
                .iter()
                .all(|choice| NUMBERS.contains(&choice.ladder()))
        };
        let is_cheap = |setting: &RungSetting| {
            setting.rung(Ladder::Reconstruction).is_none()
                || self.renders_denoised_whole_picture(setting)
        };
        let all = self.planned_settings().into_iter().map(|item| item.setting);
        all.filter(|setting| is_one(setting) && is_near(setting) && is_cheap(setting))
            .collect()
    }
}
