//! Report of a measurement, from the figures of its settings.

use super::ProgressListener;
use super::estimate::ConfidenceInterval;
use super::figures::Figures;
use super::recommendation::{
    HALF, RecommendationCandidate, is_recommendable, pareto_front, recommend_settings,
};
use super::report::{
    AccuracyReport, DetailPicture, LadderReport, MeasuredSetting, MeasuredSettingWithFlags,
    Recommendations, ReferenceReport, ReportPictures, RungCost, RungReport, TileReport,
};
use super::setting::RungSetting;
use super::tiles::{tile_count, tile_crop, tile_edge};
use super::trial::{ABSOLUTE, Region, Trial};
use crate::ladder::{Ladder, RungChoice};
use crate::picture::Picture;
use crate::prepare::PrepareError;

impl Figures<'_> {
    /// Returns the settings of the report, each with its figures and its cost relative to the
    /// setting in use: numbers of samples, denoised ones, single rungs, and rungs that are certainly
    /// efficient combined with numbers of samples.
    fn candidates(&self, own_measured: &MeasuredSetting) -> Vec<RecommendationCandidate> {
        let space = &self.study.space;
        let own = RungSetting::default();
        let count = |setting: &RungSetting| space.sample_count(setting);
        let mut samples = space.sample_settings();
        // The least number of samples that halves the error is the largest of the report.
        let halves = |setting: &&RungSetting| {
            let measured = self.summarise(setting);
            let ratio = measured.map(|measured| self.error_ratio(setting, &measured).value);
            ratio.is_some_and(|square| square <= HALF * HALF)
        };
        let most = samples.iter().find(halves).map(count);
        samples.retain(|setting| most.is_none_or(|most| count(setting) <= most));
        let denoised = Ladder::Reconstruction.choices().find(|choice| {
            space.ladders.contains(&Ladder::Reconstruction) && !space.is_in_use(*choice)
        });
        let denoised = samples
            .iter()
            .flat_map(|s| denoised.map(|choice| s.with_rung(choice)));
        let mut settings: Vec<RungSetting> = samples.iter().cloned().chain(denoised).collect();
        for rung in space.single_rungs() {
            if self.is_efficient(&rung) {
                let others = samples.iter().filter(|other| **other != own);
                settings.extend(others.map(|other| other.with_rungs(rung.choices())));
            }
            settings.push(rung);
        }
        let candidate = |setting: RungSetting| {
            let measured = self.summarise(&setting)?;
            Some(RecommendationCandidate {
                error: self.error_ratio(&setting, &measured),
                is_recommendable: is_recommendable(&setting, &measured, own_measured),
                setting,
                measured,
            })
        };
        settings.into_iter().filter_map(candidate).collect()
    }

    /// Measures what is left besides the trials, and returns the report; `None` if the setting in use
    /// was not measured.
    ///
    /// # Errors
    /// A render that cannot be prepared.
    pub fn report(
        &self,
        is_cut_short: bool,
        listener: &mut dyn ProgressListener,
    ) -> Result<Option<AccuracyReport>, PrepareError> {
        let study = self.study;
        let (Some(own), Some(reference)) =
            (self.summarise(&RungSetting::default()), &study.reference)
        else {
            return Ok(None);
        };
        let candidates = self.candidates(&own);
        let front = pareto_front(&candidates);
        let recommendations = recommend_settings(&candidates, &front);
        let pictures = self.pictures(&candidates, &recommendations)?;
        let outputs = study.measure_outputs();
        let costs = study.measure_effect_costs(listener)?;
        let with_flags = |candidate: &RecommendationCandidate| MeasuredSettingWithFlags {
            flags: candidate.setting.flags(),
            measured: candidate.measured.clone(),
        };
        let is_combined = |of: &&RecommendationCandidate| of.setting.choices().len() > 1;
        let ladders = study.space.ladders.iter().chain(&study.space.cost_ladders);
        Ok(Some(AccuracyReport {
            size: study.renderer.settings.size,
            tiles: TileReport {
                edge: tile_edge(study.renderer.settings.size),
                measured: study.tiles.len(),
                all: tile_count(study.renderer.settings.size),
            },
            reference: ReferenceReport {
                samples: reference.film.requested_samples().unwrap_or(0),
                rungs: study.space.exact.flags(),
                standard_error: self.reference_error(),
                seconds: reference.seconds,
                reused: reference.is_reused(),
            },
            sufficient_budget: self.sufficient_budget(&candidates),
            recommendations,
            combinations: candidates
                .iter()
                .filter(is_combined)
                .map(with_flags)
                .collect(),
            frontier: front
                .iter()
                .map(|&at| with_flags(&candidates[at]))
                .collect(),
            ladders: ladders
                .map(|&ladder| self.ladder_report(ladder, &own))
                .collect(),
            outputs,
            doubt: self
                .doubt()
                .filter(|_| !own.errors.relmse.map(f64::sqrt).is_known()),
            own,
            inapplicable: study.space.unneeded_ladders(),
            cut_short: is_cut_short
                || study.renderer.observer.is_cancelled()
                || costs.as_ref().is_none_or(|costs| !costs.late.is_empty()),
            costs,
            pictures,
            seconds: study.elapsed(),
        }))
    }

    /// Returns the budget in seconds that would probably make every error of the candidates known;
    /// `None` if all are known, or none would suffice. The width of an interval falls with the
    /// square root of the time.
    fn sufficient_budget(&self, candidates: &[RecommendationCandidate]) -> Option<f64> {
        let errors = candidates
            .iter()
            .map(|of| of.measured.errors.relmse.map(f64::sqrt));
        let width = |error: ConfidenceInterval| libm::log(error.high / error.low) / libm::log(3.0);
        let unknown = errors.filter(|error| !error.is_known()).map(width);
        let widest = unknown
            .filter(|width| width.is_finite())
            .fold(1.0, f64::max);
        (widest > 1.0).then_some(widest * widest * self.study.effort.budget.as_secs_f64())
    }

    /// Returns the root mean square, over all pixels, of the reference's standard error in radiance.
    fn reference_error(&self) -> f64 {
        let tiles = self.study.reference_noise();
        let square: f64 = tiles.iter().map(|of| of.noise[ABSOLUTE]).sum();
        let pixels: f64 = tiles.iter().map(|of| of.pixels).sum();
        (square / pixels.max(1.0)).sqrt()
    }

    fn ladder_report(&self, ladder: Ladder, own: &MeasuredSetting) -> LadderReport {
        let space = &self.study.space;
        let rung = |choice: RungChoice| {
            let in_use = space.is_in_use(choice);
            let setting = match in_use {
                true => RungSetting::default(),
                false => RungSetting::from_rung(choice),
            };
            let (measured, cost) = match ladder.changes_pictures() {
                true => (self.summarise(&setting), None),
                false => self.cost_of(choice, own).unzip(),
            };
            RungReport {
                rung: choice.rung().to_owned(),
                about: choice.rung_description(),
                in_use,
                flag: setting.flags().pop(),
                measured,
                cost,
            }
        };
        let rungs = space.applicable_rungs(ladder).into_iter();
        LadderReport {
            ladder: ladder.name(),
            in_use: space.rung_in_use(ladder),
            rungs: rungs.map(rung).collect(),
        }
    }

    /// Returns time and memory of a rung that changes no picture; `None` if no trial tells them.
    fn cost_of(
        &self,
        choice: RungChoice,
        own: &MeasuredSetting,
    ) -> Option<(MeasuredSetting, RungCost)> {
        let space = &self.study.space;
        let setting = space.with_rung(choice);
        let trials = self.trials(&setting, Region::Tiles);
        let trials: Vec<&Trial> = trials.filter(|trial| trial.job.prepares).collect();
        let cost = RungCost {
            preparing: trials.first()?.preparing,
            geometry: trials[0].geometry,
            same_bits: trials.iter().all(|trial| trial.has_same_bits),
        };
        let ratio = self.time_ratio(&setting, &space.baseline, true)?;
        let measured = MeasuredSetting {
            renders: trials.len(),
            seconds: own.seconds.multiply(&ratio),
            ratio,
            ..own.clone()
        };
        Some((measured, cost))
    }

    /// Returns the pictures of the page: the whole picture, and its magnified part in use, with each
    /// recommended setting, and exact. What there is no time for is left out.
    fn pictures(
        &self,
        candidates: &[RecommendationCandidate],
        recommendations: &Recommendations,
    ) -> Result<ReportPictures, PrepareError> {
        let study = self.study;
        let advised = [&recommendations.half_the_error, &recommendations.same_error];
        let mut details: Vec<DetailPicture> = Vec::new();
        for candidate in candidates {
            let flags = candidate.setting.flags();
            let is_advised = advised
                .iter()
                .copied()
                .flatten()
                .any(|of| of.flags == flags);
            if !flags.is_empty() && !is_advised {
                continue;
            }
            details.extend(
                self.detail(&candidate.setting)?
                    .map(|picture| DetailPicture {
                        flags,
                        measured: Some(candidate.measured.clone()),
                        picture,
                    }),
            );
        }
        details.sort_by_key(|detail| !detail.flags.is_empty());
        if let Some(exact) = study.setting_of_exact_detail() {
            // The random numbers are those of no other render.
            let reference = study.render_detail(&exact, u64::MAX)?;
            details.extend(reference.map(|picture| DetailPicture {
                flags: exact.flags(),
                measured: None,
                picture,
            }));
        }
        let size = study.renderer.settings.size;
        Ok(ReportPictures {
            whole: study.overview.1.clone(),
            tiles: study
                .tiles
                .iter()
                .map(|&tile| tile_crop(size, tile))
                .collect(),
            detail: Some(study.detail),
            details,
        })
    }

    /// Returns the magnified part of the picture with a setting: of its whole picture, or rendered
    /// anew.
    fn detail(&self, setting: &RungSetting) -> Result<Option<Picture>, PrepareError> {
        if self.study.space.is_denoised(setting) {
            let trial = self.denoised_trial(setting);
            return Ok(trial.and_then(|of| Some(of.denoised.as_ref()?.detail.clone())));
        }
        let whole = self.trials(setting, Region::Whole).next();
        match whole.and_then(|trial| trial.detail.clone()) {
            Some(detail) => Ok(Some(detail)),
            None => self.study.render_detail(setting, 0),
        }
    }
}
