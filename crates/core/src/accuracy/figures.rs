//! Figures of settings as functions of the trials: time, error, bias and light.
//!
//! The squared error of a setting is r·V(n) + b. V(n) is the squared error of noise of the setting
//! in use with n samples, from the claims of whole pictures. r is the noise of the setting's other
//! rungs over that of the baseline, on the same tiles and with as many samples. b is the squared
//! bias, from differences to the exact picture with the same random numbers.

use super::curve::{Claim, NoiseCurve};
use super::estimate::{ConfidenceInterval, RESOLUTION, SettingErrors, ratio_of_sums};
use super::renderer::REPLICATES;
use super::report::MeasuredSetting;
use super::setting::RungSetting;
use super::study::Study;
use super::trial::{ABSOLUTE, Job, RELATIVE, Region, TileSums, Trial, mean_bias};
use crate::film::EstimateDoubt;
use crate::ladder::Ladder;
use crate::settings::default_replicates;

/// Table of trials of a study, of which the figures are functions.
pub(super) struct Figures<'s> {
    pub study: &'s Study<'s>,
}

impl<'s> Figures<'s> {
    /// Returns the finished trials of a setting on a region.
    pub fn trials(&self, setting: &RungSetting, region: Region) -> impl Iterator<Item = &'s Trial> {
        self.study.table.iter().filter(move |trial| {
            trial.job.setting == *setting && trial.job.region == region && trial.seconds.is_finite()
        })
    }

    /// Returns the sums of errors of a setting's tiles in all rounds, beside those of another
    /// setting in the same rounds.
    fn paired_sums(&self, setting: &RungSetting, other: &RungSetting) -> Vec<[&TileSums; 2]> {
        let sums = |setting, round| {
            let mut trials = self.trials(setting, Region::Tiles);
            trials
                .find(|trial| trial.job.round == round)
                .map(|trial| &trial.sums)
        };
        let pair = |round| Some(sums(setting, round)?.iter().zip(sums(other, round)?));
        let rounds = (0..u64::from(self.study.effort.rounds)).filter_map(pair);
        rounds.flatten().map(|(own, other)| [own, other]).collect()
    }

    /// Returns two sums of each tile of a setting, in all rounds.
    fn tile_sums(&self, setting: &RungSetting, sums: fn(&TileSums) -> [f64; 2]) -> Vec<[f64; 2]> {
        let pairs = self.paired_sums(setting, setting).into_iter();
        pairs.map(|[own, _]| sums(own)).collect()
    }

    /// Returns the curve of noise of the setting in use; `None` without a claim.
    fn noise_curve(&self, of: usize) -> Option<NoiseCurve> {
        let settings = self.study.space.sample_settings();
        let claims = settings.iter().flat_map(|setting| {
            let samples = self.study.space.sample_count(setting);
            let claims = self
                .trials(setting, Region::Whole)
                .filter_map(|trial| trial.claim);
            claims.map(move |claim| Claim::from_uncertainty(samples, &claim)[of])
        });
        NoiseCurve::new(claims.collect())
    }

    /// Returns the reason why a render of the setting in use does not know its error.
    pub fn doubt(&self) -> Option<EstimateDoubt> {
        let own = RungSetting::default();
        let trial = match self.study.space.is_denoised(&own) {
            true => self.denoised_trial(&own),
            false => self.trials(&own, Region::Whole).next(),
        };
        // With a smaller picture nearly black, the picture in use is so, too.
        let trial = trial.or(self.study.table.first())?;
        let denoised = trial
            .denoised
            .as_ref()
            .filter(|_| self.study.space.is_denoised(&own));
        denoised.map_or(trial.claim, |of| Some(of.claim))?.doubt
    }

    /// Returns the squared error of noise of the setting in use with another number of samples.
    fn noise(&self, samples: u32, of: usize) -> ConfidenceInterval {
        let space = &self.study.space;
        let is_noiseless = self.study.table.iter().any(|Trial { job, is_random, .. }| {
            job.region == Region::Whole && !is_random && !space.is_fixed(&job.setting)
        });
        match self.noise_curve(of) {
            Some(curve) => curve.square(samples),
            None if is_noiseless => ConfidenceInterval::from_exact(0.0),
            None => ConfidenceInterval::UNKNOWN,
        }
    }

    /// Returns the ratio of the squared noise of a setting on tiles to that of the baseline.
    fn noise_ratio(&self, setting: &RungSetting, samples: u32, of: usize) -> ConfidenceInterval {
        let baseline = self.study.space.general_baseline();
        let Some(baseline) = baseline.filter(|baseline| baseline != setting) else {
            return ConfidenceInterval::from_exact(1.0);
        };
        let pairs = self.paired_sums(setting, &baseline);
        if pairs.is_empty() {
            return ConfidenceInterval::UNKNOWN;
        }
        let terms = pairs.iter().map(|pair| pair.map(|sums| sums.noise[of]));
        let ratio = ratio_of_sums(&terms.collect::<Vec<_>>());
        if setting.rung(Ladder::Sampler).is_none() {
            return ratio;
        }
        // Samplers differ by the exponents of their noise, and not at all with one sample in a
        // replicate.
        let replicate = |samples: u32| f64::from(samples) / f64::from(default_replicates(samples));
        let own = f64::from(self.study.space.sample_count(&baseline)) / f64::from(REPLICATES);
        let power = libm::log(replicate(samples)) / libm::log(own.max(2.0));
        ratio.map(|ratio| libm::pow(ratio, power))
    }

    /// Returns the squared bias of a setting on tiles; `None` without a trial.
    fn bias(&self, setting: &RungSetting, of: usize) -> Option<ConfidenceInterval> {
        let pairs = self.paired_sums(setting, setting);
        let sums: Vec<&TileSums> = pairs.into_iter().map(|[own, _]| own).collect();
        (!sums.is_empty()).then(|| mean_bias(&sums, of, self.study.tile_share()))
    }

    /// Returns the summed radiance of a setting's picture over that of the exact picture.
    fn light(&self, setting: &RungSetting) -> ConfidenceInterval {
        match self.tile_sums(setting, |sums| sums.light).as_slice() {
            [] => ConfidenceInterval::UNKNOWN,
            terms => ratio_of_sums(terms),
        }
    }

    /// Returns time and errors of a setting; `None` if no trial tells them.
    pub fn summarise(&self, setting: &RungSetting) -> Option<MeasuredSetting> {
        let tile = self.study.space.tile_setting(setting)?;
        let errors = match self.study.space.is_denoised(setting) {
            true => self.denoised_errors(setting)?,
            false => self.noisy_errors(setting, &tile)?,
        };
        let (seconds, ratio, rays) = self.cost(setting)?;
        let trials = self.study.table.iter();
        Some(MeasuredSetting {
            renders: trials
                .filter(|trial| trial.job.setting == tile)
                .count()
                .max(1),
            seconds,
            ratio,
            rays,
            errors,
        })
    }

    /// Returns the errors of a setting that denoises, from the claim of its whole picture.
    fn denoised_errors(&self, setting: &RungSetting) -> Option<SettingErrors> {
        let output = self.denoised_trial(setting)?.denoised.as_ref()?;
        let claims = Claim::from_uncertainty(self.study.space.sample_count(setting), &output.claim);
        // Noise that a filter spread over blocks hardly depends on the seed.
        let [relmse, mse] = claims.map(|mut claim| {
            claim.error.carriers = f64::INFINITY;
            claim.square()
        });
        Some(SettingErrors {
            rmse: mse.map(f64::sqrt),
            relmse,
            bias: None,
            light: ConfidenceInterval::from_exact(1.0 + output.light_change),
        })
    }

    /// Returns the errors of a setting that does not denoise. `tile` is its setting on tiles.
    fn noisy_errors(&self, setting: &RungSetting, tile: &RungSetting) -> Option<SettingErrors> {
        let square = |of: usize| self.square(setting, tile, of, &|n| self.noise(n, of), 1.0);
        Some(SettingErrors {
            rmse: square(ABSOLUTE)?.map(f64::sqrt),
            relmse: square(RELATIVE)?,
            bias: self.bias(tile, RELATIVE),
            light: self.light(tile),
        })
    }

    /// Returns the squared error of a setting that does not denoise, in multiples of `unit`. `tile` is
    /// its setting on tiles, and `noise` the squared noise of the setting in use for each number of
    /// samples, in that unit.
    fn square(
        &self,
        setting: &RungSetting,
        tile: &RungSetting,
        of: usize,
        noise: &dyn Fn(u32) -> ConfidenceInterval,
        unit: f64,
    ) -> Option<ConfidenceInterval> {
        let bias = self.bias(tile, of).map(|bias| bias.map(|bias| bias / unit));
        if self.study.space.is_fixed(setting) {
            let terms = match of {
                RELATIVE => self.tile_sums(tile, |sums| [sums.noise[RELATIVE], sums.pixels]),
                _ => self.tile_sums(tile, |sums| [sums.noise[ABSOLUTE], sums.pixels]),
            };
            return Some(ratio_of_sums(&terms).add(&bias?));
        }
        let mut changed = tile.choices().iter().map(|choice| choice.ladder());
        if bias.is_none() && changed.any(|ladder| ladder != Ladder::Samples) {
            return None;
        }
        let samples = self.study.space.sample_count(setting);
        let noise = noise(samples).multiply(&self.noise_ratio(tile, samples, of));
        let is_free = setting.is_free_of_bias() && self.has_no_bias();
        Some(match bias.filter(|_| !is_free) {
            Some(bias) => noise.add(&bias),
            None => noise,
        })
    }

    /// Whether the setting in use has no bias that the trials tell from none.
    fn has_no_bias(&self) -> bool {
        let baseline = self.study.space.general_baseline();
        let bias = baseline.and_then(|baseline| self.bias(&baseline, RELATIVE));
        bias.is_none_or(|bias| bias.includes_zero())
    }

    /// Returns the whole picture whose denoised version is that of a setting, if it has no further
    /// rung.
    pub fn denoised_trial(&self, setting: &RungSetting) -> Option<&Trial> {
        let setting = setting.without_ladder(Ladder::Reconstruction);
        self.trials(&setting, Region::Whole)
            .find(|trial| trial.denoised.is_some())
    }

    /// Returns the seconds of a setting, their ratio to those of the setting in use, and the rays.
    fn cost(&self, setting: &RungSetting) -> Option<(ConfidenceInterval, ConfidenceInterval, u64)> {
        let own = RungSetting::default();
        let space = &self.study.space;
        let (own_seconds, own_error, own_rays) = self.whole_cost(&own)?;
        let samples = setting.rung(Ladder::Samples).map(RungSetting::from_rung);
        let (base, error, rays) = match samples.filter(|_| !space.is_fixed(setting)) {
            Some(samples) => self.whole_cost(&samples)?,
            None => (own_seconds, own_error, own_rays),
        };
        let (factor, more_rays) = self.tile_cost(&space.tile_setting(setting)?)?;
        let mut seconds = base * factor.value;
        if space.is_denoised(setting) {
            seconds += self.denoised_trial(setting)?.denoised.as_ref()?.seconds;
        }
        // A clock may be too coarse for a tiny picture.
        let seconds = seconds.max(1e-9);
        let error = libm::hypot(error, factor.logarithmic_error());
        let ratio = seconds / own_seconds.max(1e-9);
        let ratio = match *setting == own {
            true => ConfidenceInterval::from_exact(1.0),
            false => ConfidenceInterval::from_logarithm(ratio, libm::hypot(error, own_error)),
        };
        let seconds = ConfidenceInterval::from_logarithm(seconds, error);
        Some((seconds, ratio, (rays * more_rays).round() as u64))
    }

    /// Returns seconds, standard error of their logarithm, and rays of the setting in use with
    /// another number of samples: of its own whole picture, or scaled from the largest. A scaled time
    /// has twice the error of others.
    fn whole_cost(&self, setting: &RungSetting) -> Option<(f64, f64, f64)> {
        if let Some(trial) = self.trials(setting, Region::Whole).next() {
            return Some((trial.seconds, self.time_drift(), trial.rays as f64));
        }
        let space = &self.study.space;
        let settings = space.sample_settings();
        let others = settings
            .iter()
            .filter(|other| space.is_fixed(other) == space.is_fixed(setting));
        let trials = others.flat_map(|other| self.trials(other, Region::Whole));
        let count = |setting: &RungSetting| space.sample_count(setting);
        let largest = trials.max_by_key(|trial| count(&trial.job.setting))?;
        let factor = f64::from(count(setting)) / f64::from(count(&largest.job.setting));
        let (seconds, rays) = (factor * largest.seconds, factor * largest.rays as f64);
        Some((seconds, 2.0 * self.time_drift(), rays))
    }

    /// Returns the ratios of a setting's time and rays on tiles to those of the baseline. Each time
    /// is divided by that of the baseline's trials before and after it.
    fn tile_cost(&self, setting: &RungSetting) -> Option<(ConfidenceInterval, f64)> {
        let baseline = match self.study.space.is_fixed(setting) {
            true => self.study.space.baseline.clone(),
            false => self.study.space.general_baseline()?,
        };
        if *setting == baseline {
            return Some((ConfidenceInterval::from_exact(1.0), 1.0));
        }
        let rays = |setting| Some(self.trials(setting, Region::Tiles).next()?.rays as f64);
        let more_rays = rays(setting)? / rays(&baseline)?.max(1.0);
        Some((self.time_ratio(setting, &baseline, false)?, more_rays))
    }

    /// Returns the mean ratio of a setting's times on tiles to those of a baseline; `None` without a
    /// trial.
    pub fn time_ratio(
        &self,
        setting: &RungSetting,
        baseline: &RungSetting,
        prepares: bool,
    ) -> Option<ConfidenceInterval> {
        let ratios = self.time_ratios(setting, baseline, prepares);
        let count = ratios.len() as f64;
        let mean = ratios.iter().map(|&ratio| libm::log(ratio)).sum::<f64>() / count;
        let error = self.time_drift() / count.sqrt();
        let ratio = || ConfidenceInterval::from_logarithm(libm::exp(mean), error);
        (!ratios.is_empty()).then(ratio)
    }

    /// Returns the ratio of each of a setting's times on tiles to the mean of the baseline's before
    /// and after it, in the order of the trials.
    fn time_ratios(
        &self,
        setting: &RungSetting,
        baseline: &RungSetting,
        prepares: bool,
    ) -> Vec<f64> {
        let table = &self.study.table;
        let is_of = |trial: &Trial, setting: &RungSetting, prepares: bool| {
            let Job {
                region,
                prepares: is_prepared,
                ..
            } = trial.job;
            region == Region::Tiles
                && is_prepared == prepares
                && trial.job.setting == *setting
                && trial.seconds.is_finite()
        };
        let ratio = |(at, trial): (usize, &Trial)| {
            let before = table[..at]
                .iter()
                .rev()
                .find(|of| is_of(of, baseline, false));
            let after = table[at..].iter().find(|of| is_of(of, baseline, false));
            let beside: Vec<f64> = before.into_iter().chain(after).map(|t| t.seconds).collect();
            let mean = beside.iter().sum::<f64>() / beside.len() as f64;
            (mean > 0.0 && trial.seconds > 0.0).then_some(trial.seconds / mean)
        };
        let own = table
            .iter()
            .enumerate()
            .filter(|(_, of)| is_of(of, setting, prepares));
        own.filter_map(ratio).collect()
    }

    /// Returns the standard deviation of the logarithm of a time from one trial of a setting on tiles
    /// to the next, of all settings.
    fn time_drift(&self) -> f64 {
        let (mut squares, mut count) = (0.0, 0.0);
        let table = &self.study.table;
        for (at, trial) in table.iter().enumerate() {
            let kind = |of: &'s Trial| (&of.job.setting, of.job.region, of.job.prepares);
            let next = table[at + 1..]
                .iter()
                .find(|next| kind(next) == kind(trial));
            let step = next.map(|next| libm::log(next.seconds / trial.seconds));
            if let Some(step) = step.filter(|step| step.is_finite()) {
                squares += step * step;
                count += 2.0;
            }
        }
        (squares / f64::max(count, 1.0)).sqrt().max(RESOLUTION)
    }

    /// Returns the squared error of a setting over that of the setting in use. Noise that both have
    /// in common does not make it uncertain.
    pub fn error_ratio(
        &self,
        setting: &RungSetting,
        measured: &MeasuredSetting,
    ) -> ConfidenceInterval {
        let own = RungSetting::default();
        if *setting == own {
            return ConfidenceInterval::from_exact(1.0);
        }
        let independent = || match self.summarise(&own) {
            Some(own) => measured.errors.relmse.divide(&own.errors.relmse),
            None => ConfidenceInterval::UNKNOWN,
        };
        let space = &self.study.space;
        let is_separate = |of: &RungSetting| space.is_denoised(of) || space.is_fixed(of);
        let curve = self.noise_curve(RELATIVE);
        let curve = curve.filter(|_| !is_separate(setting) && !is_separate(&own));
        let Some(curve) = curve else {
            return independent();
        };
        let samples = space.sample_count(&own);
        let unit = curve.square(samples).value;
        let square = |of: &RungSetting| {
            let tile = space.tile_setting(of)?;
            self.square(of, &tile, RELATIVE, &|n| curve.ratio(n, samples), unit)
        };
        match (square(setting), square(&own)) {
            (Some(square), Some(own)) if unit > 0.0 => square.divide(&own),
            _ => independent(),
        }
    }

    /// Whether a rung without bias certainly has less noise in the same time.
    pub fn is_efficient(&self, rung: &RungSetting) -> bool {
        self.gain(rung)
            .is_some_and(|gain| rung.is_free_of_bias() && gain.high < 1.0)
    }

    /// Returns noise times time of a rung over that of the baseline.
    fn gain(&self, rung: &RungSetting) -> Option<ConfidenceInterval> {
        let tile = self.study.space.tile_setting(rung)?;
        let noise = self.noise_ratio(&tile, self.study.space.sample_count(rung), RELATIVE);
        Some(self.tile_cost(&tile)?.0.multiply(&noise))
    }

    /// Returns the settings on tiles whose error or time may still decide the recommendation: rungs
    /// that save time or noise, the most promising first.
    pub fn contenders(&self) -> Vec<RungSetting> {
        let space = &self.study.space;
        let gain = |rung: &RungSetting| Some((self.gain(rung)?.value, space.tile_setting(rung)?));
        let mut gains: Vec<_> = space.single_rungs().iter().filter_map(gain).collect();
        gains.retain(|(gain, _)| *gain < 1.0);
        gains.sort_by(|a, b| a.0.total_cmp(&b.0));
        gains.into_iter().map(|(_, tile)| tile).collect()
    }
}
