//! Settings by which the rungs (quality levels) of each ladder are measured.

use std::vec;

use super::MeasurementSession;
use crate::accuracy::setting::RungSetting;
use crate::denoise;
use crate::ladder::{Ladder, RungChoice, RungValue};

impl MeasurementSession<'_> {
    /// Returns the rungs (quality levels) of a ladder that change this scene's picture and whose
    /// number format can represent the scene.
    pub(super) fn applicable_rungs(&self, ladder: Ladder) -> vec::IntoIter<RungChoice> {
        let choices = ladder.choices().filter(|choice| {
            choice.changes_picture(self.effects) && !self.unstorable_rungs.contains(choice)
        });
        choices.collect::<Vec<_>>().into_iter()
    }

    /// Whether a rung (quality level) is the one of the scene's own setting.
    pub(super) fn is_rung_in_use(&self, choice: RungChoice) -> bool {
        choice.rung()
            == choice
                .ladder()
                .current_rung_name(self.scene, &self.settings)
    }

    /// Returns the setting to which the rungs (quality levels) of a ladder are applied and
    /// compared: the scene's own setting for sample counts; for other ladders the baseline, the
    /// scene with fewer samples.
    pub(super) fn baseline_for_ladder(&self, ladder: Ladder) -> RungSetting {
        if ladder == Ladder::Samples {
            RungSetting::default()
        } else {
            self.baseline.clone()
        }
    }

    /// Returns the setting by which a rung (quality level) is measured. For a rung that is in use,
    /// it is the unchanged baseline.
    pub(super) fn setting_of_rung(&self, choice: RungChoice) -> RungSetting {
        let beside = self.baseline_for_ladder(choice.ladder());
        if self.is_rung_in_use(choice) {
            beside
        } else {
            beside.with_rung(choice)
        }
    }

    /// Returns the baseline (the scene, possibly with fewer samples) on the ladder's most exact
    /// rung that does not take too long.
    pub(super) fn most_exact_setting(&self, ladder: Ladder) -> RungSetting {
        let reached = |choice: &RungChoice| {
            choice.can_be_reference() && !self.infeasible_rungs.contains(choice)
        };
        let choice = self.applicable_rungs(ladder).rev().find(reached);
        choice.map_or_else(
            || self.baseline_for_ladder(ladder),
            |choice| self.setting_of_rung(choice),
        )
    }

    /// Returns the number of samples per pixel of a setting.
    pub(super) fn sample_count(&self, setting: &RungSetting) -> u32 {
        setting
            .rung(Ladder::Samples)
            .and_then(rung_sample_count)
            .unwrap_or(self.settings.sampling.samples_per_pixel())
    }

    /// Whether a setting can be rendered. A denoised setting needs enough samples.
    pub(super) fn is_valid_setting(&self, setting: &RungSetting) -> bool {
        let (_, settings) = setting.apply(self.scene, &self.settings);
        !settings.denoise || denoise::is_denoisable_sampling(settings.sampling)
    }
}

/// Returns the number of samples per pixel that a rung (quality level) of the samples ladder sets,
/// or `None` for another ladder.
pub(super) fn rung_sample_count(choice: RungChoice) -> Option<u32> {
    let RungValue::Samples(samples) = choice.value() else {
        return None;
    };
    Some(samples)
}
