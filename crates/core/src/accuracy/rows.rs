//! Report of a measurement, from the figures of its settings.

use super::estimate::ConfidenceInterval;
use super::figures::Figures;
use super::recommendation::{
    RecommendationCandidate, is_recommendable, pareto_front, recommend_settings,
};
use super::report::{
    AccuracyReport, LadderCostReport, LadderReport, MeasuredSetting, MeasuredSettingWithFlags,
    ReferenceReport, ReportPicture, RungCost, RungCostReport, RungReport, TileReport,
};
use super::setting::RungSetting;
use super::study::Study;
use super::tiles::{tile_count, tile_edge};
use super::trial::{ABSOLUTE, Region, Trial};
use super::{EffectCosts, OutputFormatReport};
use crate::bench::SampleQuantiles;
use crate::ladder::{Ladder, RungChoice};

/// Factor on the samples of the setting in use up to which settings are recommended: it halves the
/// error of noise.
const HALVING_SAMPLES: u32 = 4;
/// Longest budget that a report names, as a multiple of the given one.
const LONGEST_BUDGET: f64 = 60.0;

/// Rows of the report of a study.
pub(super) struct Rows<'s> {
    study: &'s Study<'s>,
    figures: Figures<'s>,
}

impl<'s> Rows<'s> {
    /// Returns the rows of a finished study.
    pub fn new(study: &'s Study<'s>) -> Self {
        Self {
            study,
            figures: Figures::new(study),
        }
    }

    /// Returns the settings of the report, each with its figures and its cost relative to the
    /// setting in use: numbers of samples, denoised ones, single rungs, and rungs that are certainly
    /// efficient combined with numbers of samples.
    fn candidates(&self) -> Vec<RecommendationCandidate> {
        let own = RungSetting::default();
        let Some(own_measured) = self.figures.summarise(&own) else {
            return Vec::new();
        };
        let most = HALVING_SAMPLES.saturating_mul(self.study.space.sample_count(&own));
        let mut samples = self.study.space.sample_settings();
        samples.retain(|setting| self.study.space.sample_count(setting) <= most);
        let denoised = Ladder::Reconstruction.choices().find(|choice| {
            self.study.space.ladders.contains(&Ladder::Reconstruction)
                && !self.study.space.is_in_use(*choice)
        });
        let denoised = samples
            .iter()
            .flat_map(|s| denoised.map(|choice| s.with_rung(choice)));
        let mut settings: Vec<RungSetting> = samples.iter().cloned().chain(denoised).collect();
        for rung in self.study.space.single_rungs() {
            settings.push(rung.clone());
            if self.figures.is_efficient(&rung) {
                let others = samples.iter().filter(|other| **other != own);
                settings.extend(others.map(|other| {
                    rung.choices()
                        .iter()
                        .fold(other.clone(), |all, &choice| all.with_rung(choice))
                }));
            }
        }
        let candidate = |setting: RungSetting| {
            let measured = self.figures.summarise(&setting)?;
            Some(RecommendationCandidate {
                error: self.figures.error_ratio(&setting, &measured),
                is_recommendable: is_recommendable(&setting, &measured, &own_measured),
                setting,
                measured,
            })
        };
        settings.into_iter().filter_map(candidate).collect()
    }

    /// Returns the report; `None` if the setting in use was not measured.
    pub fn report(
        &self,
        outputs: Vec<OutputFormatReport>,
        costs: Option<EffectCosts>,
        is_cut_short: bool,
    ) -> Option<AccuracyReport> {
        let own = self.figures.summarise(&RungSetting::default())?;
        let reference = self.study.reference.as_ref()?;
        let candidates = self.candidates();
        let front = pareto_front(&candidates);
        let with_flags = |candidate: &RecommendationCandidate| MeasuredSettingWithFlags {
            flags: candidate.setting.flags(),
            measured: candidate.measured.clone(),
        };
        let is_combined = |c: &&RecommendationCandidate| c.setting.choices().len() > 1;
        Some(AccuracyReport {
            size: self.study.renderer.settings.size,
            tiles: TileReport {
                edge: tile_edge(self.study.renderer.settings.size),
                measured: self.study.tiles.len(),
                all: tile_count(self.study.renderer.settings.size),
                shown: [self.study.shown.x, self.study.shown.y],
            },
            reference: ReferenceReport {
                samples: reference.film.requested_samples().unwrap_or(0),
                rungs: self.study.space.exact.flags(),
                tiles: self.study.tiles.len(),
                standard_error: self.reference_error(),
                seconds: reference.seconds,
                kept: reference.is_reused(),
            },
            needs: self.needed_budget(&candidates),
            recommendations: recommend_settings(&candidates, &front),
            combinations: candidates
                .iter()
                .filter(is_combined)
                .map(with_flags)
                .collect(),
            frontier: front
                .iter()
                .map(|&at| with_flags(&candidates[at]))
                .collect(),
            ladders: self
                .study
                .space
                .ladders
                .iter()
                .map(|&ladder| self.ladder_report(ladder))
                .collect(),
            prices: self
                .study
                .space
                .cost_ladders
                .iter()
                .map(|&l| self.cost_report(l, &own))
                .collect(),
            outputs,
            own,
            not_called_for: self.study.space.unneeded_ladders(),
            costs,
            pictures: self.report_pictures(),
            seconds: self.study.elapsed(),
            cut_short: is_cut_short,
        })
    }

    /// Returns the budget in seconds that would probably make every error of the candidates known;
    /// `None` if all are known, or none would suffice. The width of an interval falls with the
    /// square root of the time.
    fn needed_budget(&self, candidates: &[RecommendationCandidate]) -> Option<f64> {
        let unknown = candidates
            .iter()
            .map(|candidate| candidate.measured.errors.relmse);
        let unknown = unknown
            .map(|square| square.map(f64::sqrt))
            .filter(|error| !error.is_known());
        let factor = |error: ConfidenceInterval| {
            let width = libm::log(error.high / error.low) / libm::log(3.0);
            width * width
        };
        let most = unknown
            .map(factor)
            .filter(|&f| f <= LONGEST_BUDGET)
            .fold(1.0, f64::max);
        (most > 1.0).then_some(most * self.study.effort.budget.as_secs_f64())
    }

    /// Returns the root mean square, over all pixels, of the reference's standard error in radiance.
    fn reference_error(&self) -> f64 {
        let squares = self.study.reference_noise().into_iter();
        let [square, pixels] = squares.fold([0.0; 2], |all, of| {
            [all[0] + of.noise[ABSOLUTE], all[1] + of.pixels]
        });
        (square / pixels.max(1.0)).sqrt()
    }

    fn ladder_report(&self, ladder: Ladder) -> LadderReport {
        let rung = |choice: RungChoice| {
            let in_use = self.study.space.is_in_use(choice);
            let setting = match in_use {
                true => RungSetting::default(),
                false => RungSetting::from_rung(choice),
            };
            RungReport {
                rung: choice.rung().to_owned(),
                about: choice.rung_description(),
                in_use,
                flag: (!in_use).then(|| setting.flags().pop()).flatten(),
                measured: self.figures.summarise(&setting),
            }
        };
        LadderReport {
            ladder: ladder.name(),
            in_use: self.study.space.rung_in_use(ladder),
            rungs: self
                .study
                .space
                .applicable_rungs(ladder)
                .into_iter()
                .map(rung)
                .collect(),
        }
    }

    fn cost_report(&self, ladder: Ladder, own: &MeasuredSetting) -> LadderCostReport {
        let rung = |choice: RungChoice| {
            let setting = self.study.space.with_rung(choice);
            let trials: Vec<&Trial> = self
                .figures
                .trials(&setting, Region::Tiles)
                .filter(|trial| trial.is_prepared_anew)
                .collect();
            let ratios = self
                .figures
                .time_ratios(&setting, &self.study.space.baseline, true);
            let preparing: Vec<f64> = trials.iter().map(|trial| trial.preparing).collect();
            let ratio = SampleQuantiles::from_samples(&ratios);
            RungCostReport {
                rung: choice.rung().to_owned(),
                about: choice.rung_description(),
                in_use: self.study.space.is_in_use(choice),
                rung_cost: trials.first().map(|trial| RungCost {
                    preparing: SampleQuantiles::from_samples(&preparing),
                    seconds: ratio.scale(own.seconds.value),
                    ratio,
                    geometry: trial.geometry,
                    same_bits: trials.iter().all(|trial| trial.has_same_bits),
                }),
            }
        };
        LadderCostReport {
            ladder: ladder.name(),
            in_use: self.study.space.rung_in_use(ladder),
            rungs: ladder.choices().map(rung).collect(),
        }
    }

    /// Returns the pictures for comparison: the reference, the setting in use, and each setting that
    /// differs from it in one choice.
    fn report_pictures(&self) -> Vec<ReportPicture> {
        let mut pictures = vec![ReportPicture {
            name: "reference".to_owned(),
            picture: self.study.reference_picture(),
        }];
        let named = |name: String, setting: &RungSetting| {
            let trials = [Region::Whole, Region::Tiles]
                .into_iter()
                .flat_map(|region| self.figures.trials(setting, region));
            let picture = trials.filter_map(|trial| trial.picture.clone()).next()?;
            Some(ReportPicture { name, picture })
        };
        let own = RungSetting::default();
        let shown = [&own, &self.study.space.baseline]
            .into_iter()
            .find_map(|s| named(own.to_string(), s));
        pictures.extend(shown);
        let samples = self.study.space.sample_settings();
        let others = samples.iter().filter(|setting| **setting != own);
        pictures.extend(others.filter_map(|setting| named(setting.to_string(), setting)));
        let denoised = self
            .figures
            .denoised_trial(&own)
            .or_else(|| self.figures.denoised_trial(&self.study.space.baseline));
        let denoised = denoised.and_then(|trial| trial.denoised.as_ref()?.picture.clone());
        pictures.extend(denoised.map(|picture| ReportPicture {
            name: "reconstruction=denoised".to_owned(),
            picture,
        }));
        let rungs = self.study.space.single_rungs();
        let tiles = self.study.space.rung_settings();
        let rungs = rungs.iter().zip(&tiles);
        pictures.extend(rungs.filter_map(|(rung, tile)| named(rung.to_string(), tile)));
        pictures
    }
}
