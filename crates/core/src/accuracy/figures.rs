//! Figures of settings as functions of the trials: time, error, bias and light.
//!
//! The squared error of a setting is r·V(n) + b. V(n) is the squared error of noise of the setting
//! in use with n samples, from the claims of whole pictures. r is the noise of the setting's other
//! rungs over that of the baseline, on the same tiles and with as many samples. b is the squared
//! bias, from differences to the exact picture with the same random numbers.

use super::curve::{Claim, NoiseCurve};
use super::estimate::{ConfidenceInterval, SettingErrors, ratio_of_sums};
use super::renderer::REPLICATES;
use super::report::MeasuredSetting;
use super::setting::RungSetting;
use super::space::SettingSpace;
use super::study::Study;
use super::trial::{ABSOLUTE, RELATIVE, Region, TileSums, Trial, mean_bias};
use crate::ladder::Ladder;
use crate::settings::default_replicates;

/// Least standard error of the logarithm of a time: that of two renders shortly after one another on
/// a quiet machine. A time that was not measured but scaled has twice the error of others.
const TIME_ERROR: f64 = 0.03;
/// Largest number of settings that are tried in further rounds.
const MOST_CONTENDERS: usize = 6;
/// Largest ratio of noise times time with which a rung without bias is combined with numbers of
/// samples.
const EFFICIENT: f64 = 0.95;

/// Table of trials, of which the figures are functions.
pub(super) struct Figures<'s> {
    space: &'s SettingSpace<'s>,
    table: &'s [Trial],
    /// Largest number of rounds.
    rounds: u32,
    /// Share of the picture's tiles, 0 to 1, on which rungs were tried.
    tile_share: f64,
    tiles: usize,
}

impl<'s> Figures<'s> {
    /// Returns the figures of a study so far.
    pub fn new(study: &'s Study<'_>) -> Self {
        Self {
            space: &study.space,
            table: &study.table,
            rounds: study.effort.rounds,
            tile_share: study.tile_share(),
            tiles: study.tiles.len(),
        }
    }

    /// Returns the finished trials of a setting on a region.
    pub fn trials(&self, setting: &RungSetting, region: Region) -> impl Iterator<Item = &'s Trial> {
        self.table.iter().filter(move |trial| {
            trial.setting == *setting && trial.region == region && trial.seconds.is_finite()
        })
    }

    /// Returns the sums of errors of a setting's tiles in all rounds, beside those of another
    /// setting in the same rounds.
    fn paired_sums(&self, setting: &RungSetting, other: &RungSetting) -> Vec<[&TileSums; 2]> {
        let first = |setting, round| {
            self.trials(setting, Region::Tiles)
                .find(|trial| trial.round == round)
        };
        let pair = |round| {
            Some(
                first(setting, round)?
                    .sums
                    .iter()
                    .zip(&first(other, round)?.sums),
            )
        };
        let rounds = (0..u64::from(self.rounds)).filter_map(pair);
        rounds.flatten().map(|(own, other)| [own, other]).collect()
    }

    /// Returns the curve of noise of the setting in use; `None` without a claim.
    fn noise_curve(&self, of: usize) -> Option<NoiseCurve> {
        let settings = self.space.sample_settings();
        let claims = settings.iter().flat_map(|setting| {
            let samples = self.space.sample_count(setting);
            let claims = self
                .trials(setting, Region::Whole)
                .filter_map(|trial| trial.claim);
            claims.map(move |claim| Claim::from_uncertainty(samples, &claim)[of])
        });
        NoiseCurve::new(claims.collect())
    }

    /// Returns the squared error of noise of the setting in use with another number of samples.
    fn noise(&self, samples: u32, of: usize) -> ConfidenceInterval {
        let is_noiseless = self.table.iter().any(|trial| {
            trial.region == Region::Whole
                && !trial.is_random
                && !self.space.is_fixed(&trial.setting)
        });
        match self.noise_curve(of) {
            Some(curve) => curve.square(samples),
            None if is_noiseless => ConfidenceInterval::from_exact(0.0),
            None => ConfidenceInterval::UNKNOWN,
        }
    }

    /// Returns the ratio of the squared noise of a setting on tiles to that of the baseline.
    fn noise_ratio(&self, setting: &RungSetting, samples: u32, of: usize) -> ConfidenceInterval {
        let Some(baseline) = self
            .space
            .general_baseline()
            .filter(|baseline| baseline != setting)
        else {
            return ConfidenceInterval::from_exact(1.0);
        };
        let pairs = self.paired_sums(setting, &baseline);
        if pairs.is_empty() {
            return ConfidenceInterval::UNKNOWN;
        }
        let terms: Vec<[f64; 2]> = pairs
            .iter()
            .map(|pair| pair.map(|sums| sums.noise[of]))
            .collect();
        let ratio = ratio_of_sums(&terms);
        if setting.rung(Ladder::Sampler).is_none() {
            return ratio;
        }
        // Samplers differ by the exponents of their noise, and not at all with one sample in a
        // replicate.
        let replicate = |samples: u32| f64::from(samples) / f64::from(default_replicates(samples));
        let own = f64::from(self.space.sample_count(&baseline)) / f64::from(REPLICATES);
        let power = libm::log(replicate(samples)) / libm::log(own.max(2.0));
        ratio.map(|ratio| libm::pow(ratio, power))
    }

    /// Returns the squared bias of a setting on tiles; `None` without a trial.
    fn bias(&self, setting: &RungSetting, of: usize) -> Option<ConfidenceInterval> {
        let sums: Vec<TileSums> = self
            .paired_sums(setting, setting)
            .iter()
            .map(|[own, _]| (*own).clone())
            .collect();
        (!sums.is_empty()).then(|| mean_bias(&sums, of, self.tile_share))
    }

    /// Returns the summed radiance of a setting's picture over that of the exact picture.
    fn light(&self, setting: &RungSetting) -> ConfidenceInterval {
        let terms: Vec<[f64; 2]> = self
            .paired_sums(setting, setting)
            .iter()
            .map(|[own, _]| own.light)
            .collect();
        if terms.is_empty() {
            return ConfidenceInterval::UNKNOWN;
        }
        ratio_of_sums(&terms)
    }

    /// Returns time and errors of a setting; `None` if no trial tells them.
    pub fn summarise(&self, setting: &RungSetting) -> Option<MeasuredSetting> {
        let tile = self.space.tile_setting(setting)?;
        let errors = match self.space.is_denoised(setting) {
            true => self.denoised_errors(setting)?,
            false => self.noisy_errors(setting, &tile)?,
        };
        let (seconds, ratio, rays) = self.cost(setting)?;
        Some(MeasuredSetting {
            tiles: self.tiles,
            renders: self
                .table
                .iter()
                .filter(|trial| trial.setting == tile)
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
        let claims = Claim::from_uncertainty(self.space.sample_count(setting), &output.claim);
        let [relmse, mse] = claims.map(|claim| claim.square());
        Some(SettingErrors {
            rmse: mse.map(f64::sqrt),
            relmse,
            bias: None,
            light: ConfidenceInterval::from_exact(1.0 + output.light_change),
        })
    }

    /// Returns the errors of a setting that does not denoise. `tile` is its setting on tiles.
    fn noisy_errors(&self, setting: &RungSetting, tile: &RungSetting) -> Option<SettingErrors> {
        let samples = self.space.sample_count(setting);
        let is_changed = tile
            .choices()
            .iter()
            .any(|choice| choice.ladder() != Ladder::Samples);
        let is_free = setting.is_free_of_bias() && self.has_no_bias();
        let square = |of: usize| {
            let bias = self.bias(tile, of);
            if self.space.is_fixed(setting) {
                return Some(self.direct_noise(tile, of).add(&bias?));
            }
            if is_changed && bias.is_none() {
                return None;
            }
            let noise = self
                .noise(samples, of)
                .multiply(&self.noise_ratio(tile, samples, of));
            Some(
                bias.filter(|_| !is_free)
                    .map_or(noise, |bias| noise.add(&bias)),
            )
        };
        Some(SettingErrors {
            rmse: square(ABSOLUTE)?.map(f64::sqrt),
            relmse: square(RELATIVE)?,
            bias: self.bias(tile, RELATIVE),
            light: self.light(tile),
        })
    }

    /// Whether the setting in use has no bias that the trials tell from none.
    fn has_no_bias(&self) -> bool {
        self.space
            .general_baseline()
            .and_then(|baseline| self.bias(&baseline, RELATIVE))
            .is_none_or(|bias| bias.includes_zero())
    }

    /// Returns the squared noise of a picture of a fixed pattern of samples.
    fn direct_noise(&self, setting: &RungSetting, of: usize) -> ConfidenceInterval {
        let terms: Vec<[f64; 2]> = self
            .paired_sums(setting, setting)
            .iter()
            .map(|[own, _]| [own.noise[of], own.pixels])
            .collect();
        ratio_of_sums(&terms)
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
        let (own_seconds, own_error, _) = self.whole_cost(&own)?;
        let tile = self.space.tile_setting(setting)?;
        let (base, error, rays) = if self.space.is_fixed(setting) {
            self.whole_cost(&own)?
        } else {
            let samples = setting.rung(Ladder::Samples).map(RungSetting::from_rung);
            self.whole_cost(&samples.unwrap_or_default())?
        };
        let (factor, more_rays) = self.tile_cost(&tile)?;
        let mut seconds = base * factor.value;
        if self.space.is_denoised(setting) {
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
        let rays = (rays * more_rays).round() as u64;
        Some((
            ConfidenceInterval::from_logarithm(seconds, error),
            ratio,
            rays,
        ))
    }

    /// Returns seconds, standard error of their logarithm, and rays of the setting in use with
    /// another number of samples: of its own whole picture, or scaled from the largest.
    fn whole_cost(&self, setting: &RungSetting) -> Option<(f64, f64, f64)> {
        if let Some(trial) = self.trials(setting, Region::Whole).next() {
            return Some((trial.seconds, self.time_drift(), trial.rays as f64));
        }
        let settings = self.space.sample_settings();
        let others = settings
            .iter()
            .filter(|other| self.space.is_fixed(other) == self.space.is_fixed(setting));
        let trials = others.flat_map(|other| self.trials(other, Region::Whole));
        let largest = trials.max_by_key(|trial| self.space.sample_count(&trial.setting))?;
        let factor = f64::from(self.space.sample_count(setting))
            / f64::from(self.space.sample_count(&largest.setting));
        Some((
            factor * largest.seconds,
            2.0 * self.time_drift(),
            factor * largest.rays as f64,
        ))
    }

    /// Returns the ratios of a setting's time and rays on tiles to those of the baseline. Each time
    /// is divided by that of the baseline's trials before and after it.
    fn tile_cost(&self, setting: &RungSetting) -> Option<(ConfidenceInterval, f64)> {
        let baseline = match self.space.is_fixed(setting) {
            true => self.space.baseline.clone(),
            false => self.space.general_baseline()?,
        };
        if *setting == baseline {
            return Some((ConfidenceInterval::from_exact(1.0), 1.0));
        }
        let ratios = self.time_ratios(setting, &baseline, false);
        let rays = |setting| Some(self.trials(setting, Region::Tiles).next()?.rays as f64);
        if ratios.is_empty() {
            return None;
        }
        let logarithms: Vec<f64> = ratios.iter().map(|&ratio| libm::log(ratio)).collect();
        let mean = logarithms.iter().sum::<f64>() / logarithms.len() as f64;
        let error = self.time_drift() / (logarithms.len() as f64).sqrt();
        Some((
            ConfidenceInterval::from_logarithm(libm::exp(mean), error),
            rays(setting)? / rays(&baseline)?.max(1.0),
        ))
    }

    /// Returns the ratio of each of a setting's times on tiles to the mean of the baseline's before
    /// and after it, in the order of the trials.
    pub fn time_ratios(
        &self,
        setting: &RungSetting,
        baseline: &RungSetting,
        anew: bool,
    ) -> Vec<f64> {
        let is_trial = |trial: &&Trial| trial.region == Region::Tiles && trial.seconds.is_finite();
        let is_baseline = |trial: &&Trial| {
            is_trial(trial) && trial.setting == *baseline && !trial.is_prepared_anew
        };
        let own = self.table.iter().enumerate().filter(|(_, trial)| {
            is_trial(trial) && trial.setting == *setting && trial.is_prepared_anew == anew
        });
        let ratio = |(at, trial): (usize, &Trial)| {
            let before = self.table[..at].iter().rev().find(is_baseline);
            let after = self.table[at..].iter().find(is_baseline);
            let beside: Vec<f64> = before.into_iter().chain(after).map(|t| t.seconds).collect();
            let mean = beside.iter().sum::<f64>() / beside.len() as f64;
            (!beside.is_empty() && mean > 0.0 && trial.seconds > 0.0)
                .then_some(trial.seconds / mean)
        };
        own.filter_map(ratio).collect()
    }

    /// Returns the standard deviation of the logarithm of a time from one trial of a setting on tiles
    /// to the next, of all settings.
    fn time_drift(&self) -> f64 {
        let (mut squares, mut count) = (0.0, 0.0);
        for (at, trial) in self.table.iter().enumerate() {
            let is_next = |next: &&Trial| {
                next.setting == trial.setting
                    && next.is_prepared_anew == trial.is_prepared_anew
                    && next.region == trial.region
            };
            let next = self.table[at + 1..].iter().find(is_next);
            let step = next.map(|next| libm::log(next.seconds / trial.seconds));
            if let Some(step) = step.filter(|step| step.is_finite()) {
                squares += step * step;
                count += 2.0;
            }
        }
        (squares / f64::max(count, 1.0)).sqrt().max(TIME_ERROR)
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
        let curve = self.noise_curve(RELATIVE).filter(|_| {
            ![setting, &own]
                .iter()
                .any(|s| self.space.is_denoised(s) || self.space.is_fixed(s))
        });
        let (Some(curve), Some(tile)) = (curve, self.space.tile_setting(setting)) else {
            return independent();
        };
        let samples = [setting, &own].map(|s| self.space.sample_count(s));
        let square = curve.square(samples[1]).value;
        if square.is_nan() || square <= 0.0 {
            return independent();
        }
        let noise = curve
            .ratio(samples[0], samples[1])
            .multiply(&self.noise_ratio(&tile, samples[0], RELATIVE));
        if self.has_no_bias() && setting.is_free_of_bias() {
            return noise;
        }
        let bias = |tile: &RungSetting| {
            let bias = self.bias(tile, RELATIVE);
            bias.map(|bias| bias.map(|bias| bias / square))
        };
        let one = ConfidenceInterval::from_exact(1.0);
        let own_bias = self.space.tile_setting(&own).and_then(|own| bias(&own));
        let own = own_bias.map_or(one, |bias| one.add(&bias));
        bias(&tile)
            .map_or(noise, |bias| noise.add(&bias))
            .divide(&own)
    }

    /// Whether a rung without bias certainly has less noise in the same time.
    pub fn is_efficient(&self, rung: &RungSetting) -> bool {
        self.efficiency(rung).is_some_and(|of| of.high < EFFICIENT)
    }

    /// Returns noise times time of a rung over that of the baseline; `None` with bias.
    fn efficiency(&self, rung: &RungSetting) -> Option<ConfidenceInterval> {
        let tile = self.space.tile_setting(rung)?;
        let time = self.tile_cost(&tile)?.0;
        let samples = self.space.sample_count(rung);
        rung.is_free_of_bias()
            .then(|| time.multiply(&self.noise_ratio(&tile, samples, RELATIVE)))
    }

    /// Returns the settings on tiles whose error or time may still decide the recommendation: rungs
    /// that save time or noise, the most promising first.
    pub fn contenders(&self) -> Vec<RungSetting> {
        let gain = |rung: &RungSetting| {
            let tile = self.space.tile_setting(rung)?;
            let time = self.tile_cost(&tile)?.0.value;
            let noise = self
                .noise_ratio(&tile, self.space.sample_count(rung), RELATIVE)
                .value;
            Some((time * noise, tile)).filter(|(gain, _)| *gain < 1.0)
        };
        let mut gains: Vec<_> = self.space.single_rungs().iter().filter_map(gain).collect();
        gains.sort_by(|a, b| a.0.total_cmp(&b.0));
        gains.truncate(MOST_CONTENDERS);
        gains.into_iter().map(|(_, tile)| tile).collect()
    }
}
