//! The settings that a measurement may try: the rungs of the ladders that the scene reaches.

use super::renderer::SettingRenderer;
use super::report::LadderInUse;
use super::setting::RungSetting;
use super::trial::{Job, Region};
use crate::denoise::FEWEST_SAMPLES;
use crate::dispatch::find_collapsed_objects;
use crate::effects::{EffectSet, assess_effects};
use crate::ladder::{Ladder, RungChoice, RungValue, applicable_ladders, needed_effects};
use crate::scene::Scene;
use crate::settings::{Sampling, Settings};

/// Samples per pixel of trials on tiles, if the setting in use has more: a change is as visible with
/// few samples, and more tiles can be rendered.
pub(super) const TILE_SAMPLES: u32 = 16;

/// Settings of a scene: sets of rungs that differ from the setting in use.
pub(super) struct SettingSpace<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    /// Ladders that change the picture, the most important first.
    pub ladders: Vec<Ladder>,
    /// Effects that the scene needs.
    effects: EffectSet,
    /// Rungs whose number format cannot represent the scene. They have no picture.
    unstorable: Vec<RungChoice>,
    /// Setting to which rungs are applied on tiles: the one in use, or one of fewer samples.
    pub baseline: RungSetting,
    /// Rungs of the reference.
    pub exact: RungSetting,
}

impl<'a> SettingSpace<'a> {
    /// Returns the settings of the scene of a renderer.
    pub fn new(renderer: &SettingRenderer<'a>) -> Self {
        let SettingRenderer {
            scene, settings, ..
        } = *renderer;
        let effects = assess_effects(scene, settings);
        let ladders = applicable_ladders(scene, settings, &effects);
        let is_unstorable = |&choice: &RungChoice| {
            let (scene, settings) = RungSetting::from_rung(choice).apply(scene, settings);
            !find_collapsed_objects(&scene, settings.precision).is_empty()
        };
        let sampling = settings.sampling;
        let fewer = Ladder::Samples.choices().find(|&choice| {
            !sampling.is_fixed()
                && sampling.samples_per_pixel() > TILE_SAMPLES
                && choice.value() == RungValue::Samples(TILE_SAMPLES)
        });
        Self {
            scene,
            settings,
            ladders: ladders.filter(|of| of.changes_pictures()).collect(),
            effects: needed_effects(&effects),
            unstorable: Ladder::Precision.choices().filter(is_unstorable).collect(),
            baseline: fewer.map(RungSetting::from_rung).unwrap_or_default(),
            exact: RungSetting::default(),
        }
    }

    /// Returns the rungs of a ladder that change this scene's picture and whose number format can
    /// represent the scene, from fast to exact.
    pub fn applicable_rungs(&self, ladder: Ladder) -> Vec<RungChoice> {
        let is_applicable = |choice: &RungChoice| {
            choice.changes_picture(self.effects) && !self.unstorable.contains(choice)
        };
        ladder.choices().filter(is_applicable).collect()
    }

    /// Returns the ladders that change the picture, with their rungs in use.
    pub fn ladders_in_use(&self) -> Vec<LadderInUse> {
        let ladders = self.ladders.iter();
        let in_use = ladders.map(|ladder| LadderInUse {
            ladder: ladder.name(),
            in_use: ladder.current_rung_name(self.scene, self.settings),
        });
        in_use.collect()
    }

    /// Whether a rung is the one in use.
    pub fn is_in_use(&self, choice: RungChoice) -> bool {
        choice.rung() == choice.ladder().current_rung_name(self.scene, self.settings)
    }

    /// Returns the settings that change the number of samples alone, by ascending number, with the
    /// one in use.
    pub fn sample_settings(&self) -> Vec<RungSetting> {
        let choices = self.applicable_rungs(Ladder::Samples).into_iter();
        let others = choices.filter(|&choice| !self.is_in_use(choice));
        let mut all: Vec<RungSetting> = others.map(RungSetting::from_rung).collect();
        all.push(RungSetting::default());
        all.sort_by_key(|setting| self.sample_count(setting));
        all
    }

    /// Returns the baseline with the rungs of a setting.
    pub fn applied_to_baseline(&self, setting: &RungSetting) -> RungSetting {
        self.baseline.with_rungs(setting.choices())
    }

    pub fn exact_baseline(&self) -> RungSetting {
        self.applied_to_baseline(&self.exact)
    }

    /// Returns the setting of which whole pictures at all numbers of samples are rungs: the
    /// baseline, or beside a fixed pattern a setting with samples at random positions.
    pub fn general_baseline(&self) -> Option<RungSetting> {
        let mut samples = self.sample_settings().into_iter();
        let is_general = |setting: &RungSetting| {
            !self.is_fixed(setting) && self.sample_count(setting) >= TILE_SAMPLES
        };
        if self.is_fixed(&self.baseline) {
            samples.find(is_general)
        } else {
            Some(self.baseline.clone())
        }
    }

    /// Returns the settings that change one rung of another ladder than samples and denoising.
    pub fn single_rungs(&self) -> Vec<RungSetting> {
        let ladders = self.ladders.iter();
        let ladders =
            ladders.filter(|ladder| !matches!(ladder, Ladder::Samples | Ladder::Reconstruction));
        let choices = ladders.flat_map(|&ladder| self.applicable_rungs(ladder));
        let others = choices.filter(|&choice| !self.is_in_use(choice));
        others.map(RungSetting::from_rung).collect()
    }

    /// Returns these settings on the baseline, to be tried on tiles, after the setting that tells the time
    /// of the filter's layers.
    pub fn rung_settings(&self) -> Vec<RungSetting> {
        let rungs = self.single_rungs();
        let rungs = rungs.iter().map(|rung| self.applied_to_baseline(rung));
        self.layered_baseline().into_iter().chain(rungs).collect()
    }

    /// Returns the rung that denoises, if a picture of the scene can be denoised.
    fn filter(&self) -> Option<RungChoice> {
        let mut choices = Ladder::Reconstruction.choices();
        let filter = choices.find(|choice| choice.value() == RungValue::Denoised(true));
        filter.filter(|filter| self.ladders.contains(&filter.ladder()))
    }

    /// Returns the setting of which whole pictures at all numbers of samples are rungs, with the layers
    /// that a filter needs; `None` where no picture is denoised.
    pub fn layered_baseline(&self) -> Option<RungSetting> {
        Some(self.general_baseline()?.with_rung(self.filter()?))
    }

    /// Whether the film of a job has the layers that a filter needs. Every whole picture that can be
    /// denoised has, so that it tells both errors.
    pub fn has_layers(
        &self,
        Job {
            setting, region, ..
        }: &Job,
    ) -> bool {
        let filter = self.filter().map(|filter| setting.with_rung(filter));
        match region {
            Region::Whole => filter.is_some_and(|filtered| self.is_denoised(&filtered)),
            Region::Tiles => self.layered_baseline().as_ref() == Some(setting),
        }
    }

    /// Returns the number of samples per pixel of a setting.
    pub fn sample_count(&self, setting: &RungSetting) -> u32 {
        match setting.rung(Ladder::Samples).map(|choice| choice.value()) {
            Some(RungValue::Samples(samples)) => samples,
            _ => self.settings.sampling.samples_per_pixel(),
        }
    }

    /// Whether the samples of a setting are a fixed pattern.
    pub fn is_fixed(&self, setting: &RungSetting) -> bool {
        match setting.rung(Ladder::Samples) {
            Some(_) => {
                let samples = self.sample_count(setting);
                Sampling::from_spp(self.scene, Some(samples)).is_fixed()
            }
            None => self.settings.sampling.is_fixed(),
        }
    }

    /// Whether a setting denoises its picture.
    pub fn is_denoised(&self, setting: &RungSetting) -> bool {
        let choice = setting.rung(Ladder::Reconstruction);
        let is_requested = match choice.map(|choice| choice.value()) {
            Some(RungValue::Denoised(denoised)) => denoised,
            _ => self.settings.denoise,
        };
        is_requested && self.sample_count(setting) >= FEWEST_SAMPLES && !self.is_fixed(setting)
    }

    /// Returns the setting whose trial on tiles tells noise and bias of a setting; `None` if no
    /// trial can.
    pub fn tile_setting(&self, setting: &RungSetting) -> Option<RungSetting> {
        if self.is_fixed(setting) {
            return Some(setting.clone());
        }
        let rest = setting
            .without_ladder(Ladder::Samples)
            .without_ladder(Ladder::Reconstruction);
        Some(self.general_baseline()?.with_rungs(rest.choices()))
    }
}
