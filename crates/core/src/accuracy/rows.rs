//! Report of a measurement, from the figures of its settings.

use super::estimate::ConfidenceInterval;
use super::figures::Figures;
use super::recommendation::{pareto_front, recommend_settings};
use super::report::{
    AccuracyReport, DetailPicture, MeasuredSetting, Recommendations, ReferenceReport,
    ReportPictures, TileReport,
};
use super::setting::RungSetting;
use super::tiles::{tile_count, tile_crop, tile_edge};
use super::trial::Region;
use crate::film::EstimateDoubt;
use crate::ladder::Ladder;
use crate::picture::Picture;
use crate::prepare::PrepareError;

impl Figures<'_> {
    /// Returns the settings of the report: the one in use, numbers of samples, noisy or denoised,
    /// single rungs, and rungs that are certainly efficient combined with numbers of samples.
    fn settings(&self) -> Vec<RungSetting> {
        let space = &self.study.space;
        let own = RungSetting::default();
        let mut samples = space.sample_settings();
        samples.sort_by_key(|setting| *setting != own);
        let mut filters = Ladder::Reconstruction.choices();
        let filter = filters.find(|choice| {
            space.ladders.contains(&Ladder::Reconstruction) && !space.is_in_use(*choice)
        });
        let filtered = samples.iter().filter_map(|setting| {
            let other = setting.with_rung(filter?);
            (space.is_denoised(&other) != space.is_denoised(setting)).then_some(other)
        });
        let mut settings: Vec<RungSetting> = samples.iter().cloned().chain(filtered).collect();
        let rungs = space.single_rungs();
        settings.extend(rungs.iter().cloned());
        for rung in rungs.iter().filter(|rung| self.is_efficient(rung)) {
            let others = samples[1..].iter();
            settings.extend(others.map(|other| other.with_rungs(rung.choices())));
        }
        settings
    }

    /// Renders the pictures that are left, and returns the report; `None` if the setting in use was
    /// not measured.
    ///
    /// # Errors
    /// A render that cannot be prepared.
    pub fn report(&self, is_cut_short: bool) -> Result<Option<AccuracyReport>, PrepareError> {
        let study = self.study;
        let (Some(_), Some(reference)) =
            (self.summarise(&RungSetting::default()), &study.reference)
        else {
            return Ok(None);
        };
        let all = self.settings();
        let mut settings = Vec::new();
        let mut unmeasured = Vec::new();
        for setting in all {
            match self.summarise(&setting) {
                Some(measured) => settings.push(measured),
                None if setting.choices().len() == 1 => unmeasured.push(setting.to_string()),
                None => {}
            }
        }
        let frontier = pareto_front(&settings);
        let recommendations = recommend_settings(&settings, &frontier);
        let size = study.renderer.settings.size;
        let own_error = settings[0].errors.root_relmse;
        let unknown = settings.iter_mut().map(|of| &mut of.errors);
        // Bias and light rest on the same samples as the error.
        for errors in unknown.filter(|of| !of.root_relmse.is_known()) {
            (errors.bias, errors.light) = (None, ConfidenceInterval::UNKNOWN);
        }
        let doubt = self.doubt().unwrap_or(EstimateDoubt::WideInterval);
        Ok(Some(AccuracyReport {
            size,
            tiles: TileReport {
                edge: tile_edge(size),
                measured: study.tiles.len(),
                all: tile_count(size),
            },
            reference: ReferenceReport {
                samples: reference.film.requested_samples().unwrap_or(0),
                rungs: study.space.exact.clone(),
                error: self.reference_error(),
                seconds: reference.seconds,
            },
            sufficient_budget: self.sufficient_budget(&settings),
            pictures: self.pictures(&settings, &recommendations)?,
            doubt: (!own_error.is_known()).then_some(doubt),
            settings,
            frontier,
            recommendations,
            ladders: study.space.ladders_in_use(),
            unmeasured,
            cut_short: is_cut_short || study.renderer.observer.is_cancelled(),
            seconds: study.elapsed(),
        }))
    }

    /// Returns the budget in seconds that would probably make every error known; `None` if all are
    /// known, or none would suffice. The width of an interval falls with the square root of the time.
    fn sufficient_budget(&self, settings: &[MeasuredSetting]) -> Option<f64> {
        let errors = settings.iter().map(|of| of.errors.root_relmse);
        let unknown = errors.filter(|error| !error.is_known());
        let widths = unknown.map(|error| libm::log(error.high / error.low) / libm::log(3.0));
        let finite = widths.filter(|width| width.is_finite());
        let widest = finite.fold(1.0, f64::max);
        (widest > 1.0).then_some(widest * widest * self.study.effort.budget.as_secs_f64())
    }

    /// Returns the reference's own error of noise as root relMSE.
    fn reference_error(&self) -> f64 {
        let tiles = self.study.reference_noise();
        let square: f64 = tiles.iter().map(|of| of.noise).sum();
        let pixels: f64 = tiles.iter().map(|of| of.pixels).sum();
        (square / pixels.max(1.0)).sqrt()
    }

    /// Returns the pictures of the page: the whole picture, and its magnified part in use, with each
    /// recommended setting, and exact. What there is no time for is left out.
    fn pictures(
        &self,
        settings: &[MeasuredSetting],
        recommendations: &Recommendations,
    ) -> Result<ReportPictures, PrepareError> {
        let study = self.study;
        let advised = [&recommendations.half_the_error, &recommendations.same_error];
        let advised = advised.into_iter().flatten().map(|advice| advice.row);
        let mut rows: Vec<usize> = [0].into_iter().chain(advised).collect();
        // Both recommendations may be one setting.
        rows.dedup();
        let mut details: Vec<DetailPicture> = Vec::new();
        for row in rows {
            let picture = self.detail(&settings[row].setting)?;
            details.extend(picture.map(|picture| DetailPicture {
                row: Some(row),
                picture,
            }));
        }
        if let Some(exact) = study.setting_of_exact_detail() {
            // The random numbers are those of no other render.
            let reference = study.render_detail(&exact, u64::MAX)?;
            details.extend(reference.map(|picture| DetailPicture { row: None, picture }));
        }
        let size = study.renderer.settings.size;
        let tiles = study.tiles.iter().map(|&tile| tile_crop(size, tile));
        Ok(ReportPictures {
            whole: study.overview.1.clone(),
            tiles: tiles.collect(),
            detail: Some(study.detail),
            details,
        })
    }

    /// Returns the magnified part of the picture with a setting: of its whole picture, or rendered
    /// anew.
    fn detail(&self, setting: &RungSetting) -> Result<Option<Picture>, PrepareError> {
        if self.study.space.is_denoised(setting) {
            let mut denoised = self.denoised_trials(setting);
            return Ok(denoised.next().map(|of| of.detail.clone()));
        }
        let whole = self.trials(setting, Region::Whole).next();
        match whole.and_then(|trial| trial.detail.clone()) {
            Some(detail) => Ok(Some(detail)),
            None => self.study.render_detail(setting, 0),
        }
    }
}
