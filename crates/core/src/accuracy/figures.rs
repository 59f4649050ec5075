//! Figures of settings as functions of the trials: time, error, bias and light.
//!
//! The squared error of a setting is r·V(n) + b. V(n) is the squared error of noise of the setting
//! in use with n samples, from the claims of whole pictures, noisy or denoised. r is the noise of the
//! setting's other rungs over that of the baseline, on the same tiles and with as many samples. b is
//! the squared bias, from differences to the exact picture with the same random numbers.

use super::curve::{Claim, NoiseCurve};
use super::estimate::{
    ConfidenceInterval, NORMAL, RESOLUTION, SettingErrors, ratio_of_sums, variance_of_sum,
};
use super::renderer::REPLICATES;
use super::report::MeasuredSetting;
use super::setting::RungSetting;
use super::study::Study;
use super::trial::{DenoisedTrial, Region, TileSums, Trial, mean_bias};
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

    /// Returns the sums of errors of a setting's tiles in all rounds.
    fn tile_sums(&self, setting: &RungSetting) -> Vec<&TileSums> {
        let pairs = self.paired_sums(setting, setting).into_iter();
        pairs.map(|[own, _]| own).collect()
    }

    /// Returns the curve of noise of the setting in use; `None` without a claim.
    fn noise_curve(&self) -> Option<NoiseCurve> {
        let settings = self.study.space.sample_settings();
        let claims = settings.iter().filter_map(|setting| {
            let samples = self.study.space.sample_count(setting);
            let claims = self
                .trials(setting, Region::Whole)
                .filter_map(|trial| Some(Claim::from_uncertainty(samples, &trial.claim?)));
            Claim::pool(&claims.collect::<Vec<_>>())
        });
        NoiseCurve::new(claims.collect())
    }

    /// Returns the reason why a render of the setting in use does not know its error.
    pub fn doubt(&self) -> Option<EstimateDoubt> {
        let own = RungSetting::default();
        let is_denoised = self.study.space.is_denoised(&own);
        // With a smaller picture nearly black, the picture in use is so, too.
        let trials = self
            .trials(&own, Region::Whole)
            .chain(self.study.table.first());
        let doubts = trials.filter_map(|trial| {
            let denoised = trial.denoised.as_ref().filter(|_| is_denoised);
            denoised.map_or(trial.claim, |of| Some(of.claim))?.doubt
        });
        doubts.min_by_key(|doubt| *doubt == EstimateDoubt::FewSamples)
    }

    /// Returns the squared error of noise of the setting in use with the samples of another setting,
    /// denoised if that is; `None` if no denoised picture tells it.
    fn noise(&self, setting: &RungSetting) -> Option<ConfidenceInterval> {
        let space = &self.study.space;
        let samples = space.sample_count(setting);
        if space.is_denoised(setting) {
            let claims = self.denoised_trials(setting).map(|denoised| {
                let mut claim = Claim::from_uncertainty(samples, &denoised.claim);
                // Noise that a filter spread over blocks hardly depends on the seed.
                claim.error.carriers = f64::INFINITY;
                claim
            });
            return Some(Claim::pool(&claims.collect::<Vec<_>>())?.square());
        }
        let is_noiseless = self.study.table.iter().any(|Trial { job, is_random, .. }| {
            job.region == Region::Whole && !is_random && !space.is_fixed(&job.setting)
        });
        Some(match self.noise_curve() {
            Some(curve) => curve.square(samples),
            None if is_noiseless => ConfidenceInterval::from_exact(0.0),
            None => ConfidenceInterval::UNKNOWN,
        })
    }

    /// Returns the ratio of the squared noise of a setting on tiles to that of the baseline.
    fn noise_ratio(&self, setting: &RungSetting, samples: u32) -> ConfidenceInterval {
        let baseline = self.study.space.general_baseline();
        let Some(baseline) = baseline.filter(|baseline| baseline != setting) else {
            return ConfidenceInterval::from_exact(1.0);
        };
        let pairs = self.paired_sums(setting, &baseline);
        if pairs.is_empty() {
            return ConfidenceInterval::UNKNOWN;
        }
        let terms = pairs.iter().map(|pair| pair.map(|sums| sums.noise));
        let ratio = ratio_of_sums(&terms.collect::<Vec<_>>());
        // Of what the tiles lack of the whole picture's noise, a rung may leave nothing or all.
        let lack = 1.0 - self.tiled_share_of_noise(&baseline);
        let low = (1.0 - lack) * ratio.low;
        let high = ratio.high + lack * (1.0 - ratio.high).max(0.0);
        let value = (low * high).sqrt();
        let ratio = ConfidenceInterval { value, low, high };
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

    /// Returns the share, 0 to 1, of the whole picture's noise that the tiles certainly do not exceed: rare
    /// light may lie between them.
    fn tiled_share_of_noise(&self, baseline: &RungSetting) -> f64 {
        let sums = self.tile_sums(baseline);
        let pixels: f64 = sums.iter().map(|of| of.pixels).sum();
        let mean = sums.iter().map(|of| of.noise).sum::<f64>() / pixels;
        let residuals = sums.iter().map(|of| of.noise - mean * of.pixels);
        let variance = variance_of_sum(&residuals.collect::<Vec<_>>());
        let most = mean + NORMAL * variance.sqrt() / pixels;
        let whole = self.noise_curve().filter(|_| self.study.tile_share() < 1.0);
        let samples = self.study.space.sample_count(baseline);
        let least = whole.map_or(0.0, |curve| curve.square(samples).low);
        match most < least {
            true => most / least,
            false => 1.0,
        }
    }

    /// Returns the squared bias of a setting on tiles; `None` without a trial.
    fn bias(&self, setting: &RungSetting) -> Option<ConfidenceInterval> {
        let sums = self.tile_sums(setting);
        (!sums.is_empty()).then(|| mean_bias(&sums, self.study.tile_share()))
    }

    /// Returns time and errors of a setting; `None` if no trial tells them.
    pub fn summarise(&self, setting: &RungSetting) -> Option<MeasuredSetting> {
        let errors = self.errors(setting)?;
        let (seconds, ratio) = self.cost(setting)?;
        Some(MeasuredSetting {
            flags: setting.flags(),
            setting: setting.clone(),
            seconds,
            ratio,
            errors,
            error_ratio: self.error_ratio(setting, &errors),
        })
    }

    /// Returns the errors of a setting.
    fn errors(&self, setting: &RungSetting) -> Option<SettingErrors> {
        let tile = self.study.space.tile_setting(setting)?;
        let light: Vec<_> = self.tile_sums(&tile).iter().map(|of| of.light).collect();
        let light = match light.is_empty() {
            true => ConfidenceInterval::UNKNOWN,
            false => ratio_of_sums(&light),
        };
        let is_denoised = self.study.space.is_denoised(setting);
        let mut denoised = self.denoised_trials(setting).filter(|_| is_denoised);
        let change = denoised.next().map(|denoised| 1.0 + denoised.light_change);
        let is_baseline = self.study.space.general_baseline().as_ref() == Some(&tile);
        // Rare bright samples that make the error in use unknown are in differences to it, too.
        let own = RungSetting::default();
        let is_told = is_baseline || self.study.space.is_fixed(&own) || {
            let own = self.noise(&own)?;
            own.map(f64::sqrt).is_known()
        };
        let root_relmse = match is_told {
            true => self.square(setting, self.noise(setting)?, 1.0)?,
            false => ConfidenceInterval::UNKNOWN,
        };
        Some(SettingErrors {
            root_relmse: root_relmse.map(f64::sqrt),
            bias: self.bias(&tile).map(|bias| bias.map(f64::sqrt)),
            light: match change {
                Some(change) if is_baseline => ConfidenceInterval::from_exact(change),
                Some(change) => light.map(|light| light * change),
                None => light,
            },
        })
    }

    /// Returns the squared error of a setting in multiples of `unit`. `noise` is the squared noise of
    /// the setting in use with as many samples, in that unit.
    fn square(
        &self,
        setting: &RungSetting,
        noise: ConfidenceInterval,
        unit: f64,
    ) -> Option<ConfidenceInterval> {
        let space = &self.study.space;
        let tile = space.tile_setting(setting)?;
        let bias = self.bias(&tile).map(|bias| bias.map(|bias| bias / unit));
        if space.is_fixed(setting) {
            return bias;
        }
        let mut changed = tile.choices().iter().map(|choice| choice.ladder());
        if bias.is_none() && changed.any(|ladder| ladder != Ladder::Samples) {
            return None;
        }
        let ratio = self.noise_ratio(&tile, space.sample_count(setting));
        let noise = noise.multiply(&match space.is_denoised(setting) {
            false => ratio,
            // A filter leaves all of a rung's noise, or none.
            true => ConfidenceInterval {
                value: ratio.value.sqrt(),
                low: ratio.low.min(1.0),
                high: ratio.high.max(1.0),
            },
        });
        let rest = setting.without_ladder(Ladder::Reconstruction);
        let is_free = rest.is_free_of_bias() && self.has_no_bias();
        Some(match bias.filter(|_| !is_free) {
            Some(bias) => noise.add(&bias),
            None => noise,
        })
    }

    /// Whether the setting in use has no bias that the trials tell from none.
    fn has_no_bias(&self) -> bool {
        let baseline = self.study.space.general_baseline();
        let bias = baseline.and_then(|baseline| self.bias(&baseline));
        bias.is_none_or(|bias| bias.includes_zero())
    }

    /// Returns the denoised whole pictures with the samples of a setting.
    pub fn denoised_trials(
        &self,
        setting: &RungSetting,
    ) -> impl Iterator<Item = &'s DenoisedTrial> {
        let samples = setting.rung(Ladder::Samples);
        let samples = samples.map(RungSetting::from_rung).unwrap_or_default();
        let trials: Vec<_> = self.trials(&samples, Region::Whole).collect();
        trials
            .into_iter()
            .filter_map(|trial| trial.denoised.as_ref())
    }

    /// Returns the seconds of a setting, and their ratio to those of the setting in use. What both rest on
    /// does not make the ratio uncertain.
    fn cost(&self, setting: &RungSetting) -> Option<(ConfidenceInterval, ConfidenceInterval)> {
        let own = RungSetting::default();
        let (space, look) = (&self.study.space, self.study.first_look);
        let kinds = [setting, &own].map(|of| space.is_fixed(of));
        let own_base = self.sample_cost(kinds[1])? * f64::from(space.sample_count(&own));
        let is_scaled = setting.rung(Ladder::Samples).is_some() && !kinds[0];
        let base = match is_scaled {
            true => self.sample_cost(false)? * f64::from(space.sample_count(setting)),
            false => own_base,
        };
        let factor = self.time_ratio(&space.tile_setting(setting)?)?;
        let layers = self.layer_cost();
        let drift = libm::hypot(self.time_drift(), layers.logarithmic_error());
        // Seconds, and the share of the filter in them.
        let total = |setting: &RungSetting, base: f64, factor: f64| {
            let filter = match space.is_denoised(setting) {
                true => (layers.value - 1.0) * base + self.denoised_trials(setting).next()?.seconds,
                false => 0.0,
            };
            // A clock may be too coarse for a tiny picture.
            let seconds = ((base + look) * factor + filter).max(1e-9);
            Some((seconds, filter / seconds))
        };
        let (seconds, filter) = total(setting, base, factor.value)?;
        let (own_seconds, own_filter) = total(&own, own_base, 1.0)?;
        let scale = match is_scaled {
            true if kinds[0] != kinds[1] => drift,
            true => RESOLUTION,
            false => 0.0,
        };
        let apart = libm::hypot(scale, drift * (filter - own_filter));
        let error = factor.logarithmic_error();
        let ratio = match *setting == own {
            true => ConfidenceInterval::from_exact(1.0),
            false => {
                ConfidenceInterval::from_logarithm(seconds / own_seconds, libm::hypot(error, apart))
            }
        };
        let seconds = ConfidenceInterval::from_logarithm(seconds, libm::hypot(error, drift));
        Some((seconds, ratio))
    }

    /// Returns the time with the layers that a filter needs over the time without, as tiles tell it.
    fn layer_cost(&self) -> ConfidenceInterval {
        let layered = self.study.space.layered_baseline();
        let cost = layered.and_then(|layered| self.time_ratio(&layered));
        cost.unwrap_or(ConfidenceInterval::from_exact(1.0))
    }

    /// Returns the seconds of one sample in every pixel without the layers of a filter, from all whole
    /// pictures with or without a fixed pattern: a picture takes as long as its samples.
    fn sample_cost(&self, is_fixed: bool) -> Option<f64> {
        let (space, layers) = (&self.study.space, self.layer_cost().value);
        let of_whole = self.study.table.iter().filter_map(|trial| {
            let is_of = trial.job.region == Region::Whole && trial.seconds.is_finite();
            let layers = if space.has_layers(&trial.job) {
                layers
            } else {
                1.0
            };
            let samples = f64::from(space.sample_count(&trial.job.setting));
            (is_of && space.is_fixed(&trial.job.setting) == is_fixed)
                .then_some([trial.seconds / layers, samples])
        });
        let sum = of_whole.reduce(|sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        sum.map(|[seconds, samples]| seconds / samples)
    }

    /// Returns the mean ratio of a setting's times on tiles to the mean of the baseline's before and
    /// after each; `None` without a trial.
    fn time_ratio(&self, setting: &RungSetting) -> Option<ConfidenceInterval> {
        let baseline = match self.study.space.is_fixed(setting) {
            true => self.study.space.baseline.clone(),
            false => self.study.space.general_baseline()?,
        };
        if *setting == baseline {
            return Some(ConfidenceInterval::from_exact(1.0));
        }
        let table = &self.study.table;
        let is_of = |trial: &&Trial, setting: &RungSetting| {
            let job = &trial.job;
            job.region == Region::Tiles && job.setting == *setting && trial.seconds.is_finite()
        };
        let logarithm = |(at, trial): (usize, &Trial)| {
            let mut before = table[..at].iter().rev();
            let before = before.find(|of| is_of(of, &baseline));
            let after = table[at..].iter().find(|of| is_of(of, &baseline));
            let beside: Vec<f64> = before.into_iter().chain(after).map(|t| t.seconds).collect();
            let mean = beside.iter().sum::<f64>() / beside.len() as f64;
            (mean > 0.0 && trial.seconds > 0.0).then(|| libm::log(trial.seconds / mean))
        };
        let own = table.iter().enumerate();
        let own = own.filter(|(_, of)| is_of(of, setting));
        let logarithms: Vec<f64> = own.filter_map(logarithm).collect();
        let count = logarithms.len() as f64;
        let mean = libm::exp(logarithms.iter().sum::<f64>() / count);
        let error = self.time_drift() / count.sqrt();
        (count > 0.0).then(|| ConfidenceInterval::from_logarithm(mean, error))
    }

    /// Returns the standard deviation of the logarithm of a time from one trial of a setting on tiles
    /// to the next, of all settings.
    fn time_drift(&self) -> f64 {
        let (mut squares, mut count) = (0.0, 0.0);
        let table = &self.study.table;
        for (at, trial) in table.iter().enumerate() {
            let kind = |of: &'s Trial| (&of.job.setting, of.job.region);
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

    /// Returns the error of a setting over that of the setting in use. Noise that both have in common
    /// does not make it uncertain.
    fn error_ratio(&self, setting: &RungSetting, errors: &SettingErrors) -> ConfidenceInterval {
        let own = RungSetting::default();
        if *setting == own {
            return ConfidenceInterval::from_exact(1.0);
        }
        let space = &self.study.space;
        let [count, own_count] = [setting, &own].map(|of| space.sample_count(of));
        let is_denoised = space.is_denoised(setting);
        let is_paired = is_denoised == space.is_denoised(&own)
            && !space.is_fixed(setting)
            && !space.is_fixed(&own);
        let paired = || {
            let own_noise = self.noise(&own).filter(|of| of.map(f64::sqrt).is_known())?;
            let one = ConfidenceInterval::from_exact(1.0);
            let noise = match count == own_count {
                true => one,
                false if is_denoised => self.noise(setting)?.divide(&own_noise),
                false => self.noise_curve()?.ratio(count, own_count),
            };
            let unit = Some(own_noise.value).filter(|unit| *unit > 0.0)?;
            let own_square = self.square(&own, one, unit)?;
            let ratio = self.square(setting, noise, unit)?.divide(&own_square);
            Some(ratio.map(f64::sqrt))
        };
        let paired = is_paired.then(paired).flatten();
        let independent = || Some(errors.root_relmse.divide(&self.errors(&own)?.root_relmse));
        paired
            .or_else(independent)
            .unwrap_or(ConfidenceInterval::UNKNOWN)
    }

    /// Whether a rung without bias certainly has less noise in the same time.
    pub fn is_efficient(&self, rung: &RungSetting) -> bool {
        self.gain(rung)
            .is_some_and(|gain| rung.is_free_of_bias() && gain.high < 1.0)
    }

    /// Returns noise times time of a rung over that of the baseline.
    fn gain(&self, rung: &RungSetting) -> Option<ConfidenceInterval> {
        let tile = self.study.space.tile_setting(rung)?;
        let noise = self.noise_ratio(&tile, self.study.space.sample_count(rung));
        Some(self.time_ratio(&tile)?.multiply(&noise))
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
