//! Estimates for the whole picture from measured tiles and from pilots (two noisy whole pictures):
//! time, errors, summed radiance, and ratios of two settings.

use super::super::estimate::{ConfidenceInterval, SettingErrors};
use super::super::report::MeasuredSetting;
use super::super::setting::RungSetting;
use super::super::tiles::{RatioTerm, ratio_interval};
use super::{Measurements, SettingMeasurements, TileMeasurement};
use crate::ladder::Ladder;

/// Largest ratio of squared bias to squared error at which the estimate from the pilots (two noisy
/// pictures) is used. The pilots have the bias of the scene's own rungs too, so their estimate
/// omits this bias.
const MOST_BIAS: f64 = 0.1;

/// Time and error of one setting relative to a second setting, from the tiles on which both
/// settings were measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct RelativeCost {
    /// Render time of the first setting divided by the time of the second.
    pub time: ConfidenceInterval,
    /// Relative mean squared error of the first setting divided by the error of the second.
    pub error: ConfidenceInterval,
}

impl Measurements<'_> {
    /// Estimates the ratio of two sums over the whole picture from the first `count` tiles.
    /// `value_of` returns the terms of numerator and denominator for the tile at a position of the
    /// sample. `doubtful` is whether the numerator contains noise of the reference.
    fn estimate_ratio<'b>(
        &'b self,
        count: usize,
        doubtful: bool,
        value_of: impl Fn(usize) -> (&'b [f64], &'b [f64]),
    ) -> ConfidenceInterval {
        let chances = self.sample.inclusion_probabilities(count);
        let share = |(position, chance): (usize, f64)| {
            let (above, below) = value_of(position);
            RatioTerm {
                inclusion_probability: chance,
                numerator: above,
                denominator: below,
                reference_variance: if doubtful {
                    self.reference_tiles[position].error_variance
                } else {
                    0.0
                },
            }
        };
        ratio_interval(
            &chances
                .into_iter()
                .enumerate()
                .map(share)
                .collect::<Vec<_>>(),
        )
    }

    /// Estimates a mean over all pixels of the picture from the first `count` tiles. `value_of`
    /// returns the sum over a tile, or the sums over its blocks.
    fn estimate_mean(
        &self,
        count: usize,
        value_of: impl Fn(usize) -> Vec<f64>,
    ) -> ConfidenceInterval {
        self.estimate_weighted_mean(count, false, value_of, |_| 1.0)
    }

    /// Estimates the mean error over all pixels of the picture from the first `count` tiles. The
    /// sum of errors is divided by the number of pixels that the tiles represent. Both grow with a
    /// tile's noise, so their ratio varies little between tiles.
    fn estimate_mean_error(
        &self,
        count: usize,
        value_of: impl Fn(usize) -> Vec<f64>,
    ) -> ConfidenceInterval {
        let weight = |position: usize| {
            self.sample.represented_pixel_count(position)
                / self
                    .sample
                    .grid
                    .pixel_count_of_tile(self.sample.passes[position].tile)
        };
        self.estimate_weighted_mean(count, true, value_of, weight)
    }

    /// Estimates a weighted mean over all pixels of the picture from the first `count` tiles.
    ///
    /// - `value_of` returns the sum over a tile, or the sums over its blocks.
    /// - `weight` returns the factor on a tile's number of pixels in the denominator.
    /// - `doubtful` is whether the sums contain noise of the reference.
    fn estimate_weighted_mean(
        &self,
        count: usize,
        doubtful: bool,
        value_of: impl Fn(usize) -> Vec<f64>,
        weight: impl Fn(usize) -> f64,
    ) -> ConfidenceInterval {
        let sums: Vec<Vec<f64>> = (0..count).map(value_of).collect();
        let pixels = |position: usize| match sums[position].len() {
            1 => {
                vec![
                    weight(position)
                        * self
                            .sample
                            .grid
                            .pixel_count_of_tile(self.sample.passes[position].tile),
                ]
            }
            _ => self.reference_tiles[position]
                .block_pixel_counts()
                .iter()
                .map(|pixels| weight(position) * pixels)
                .collect(),
        };
        let pixels: Vec<Vec<f64>> = (0..count).map(pixels).collect();
        self.estimate_ratio(count, doubtful, |position| {
            (&sums[position], &pixels[position])
        })
    }

    /// Returns time and errors of a setting, and its time divided by that of the setting `beside`.
    /// `None` if the setting was not measured. The ratio is NaN if `beside` was not measured.
    pub fn summarise_setting(
        &self,
        setting: &RungSetting,
        beside: &RungSetting,
    ) -> Option<MeasuredSetting> {
        let figures = self.find_setting_measurements(setting)?;
        let count = figures.tiles.len();
        let errors = |position: usize| &figures.tiles[position].errors;
        let has_bias = (0..count).all(|position| !errors(position).bias.is_empty());
        let looked = self
            .sample
            .passes
            .iter()
            .map(|pilot_pass| pilot_pass.seconds)
            .sum::<f64>()
            * self.sample.grid.tile_count() as f64;
        // The time of the pilot pass is divided evenly among the rounds, so that the variance
        // between rounds remains.
        let rounds = figures.tiles.first().map_or(1, |tile| tile.seconds.len());
        let looks: Vec<Vec<f64>> = self
            .sample
            .passes
            .iter()
            .map(|pilot_pass| vec![pilot_pass.seconds / rounds as f64; rounds])
            .collect();
        let looks = |position: usize| -> &[f64] { &looks[position] };
        let seconds = self.estimate_ratio(count, false, |position| {
            (&figures.tiles[position].seconds, looks(position))
        });
        let [relmse, mse] = self.mean_squared_errors(figures);
        let size = self.sample.grid.size.map(f64::from);
        let rays = self
            .estimate_mean(count, |position| vec![figures.tiles[position].rays])
            .value
            * size[0]
            * size[1];
        Some(MeasuredSetting {
            tiles: count,
            renders: figures.rounds as usize,
            seconds: seconds
                .map(|ratio| ratio * looked / self.sample.drawable_tile_count() as f64)
                .multiply(&self.speed_correction_of_time(figures)),
            ratio: self
                .relative_cost(setting, beside)
                .map_or(ConfidenceInterval::from_exact(f64::NAN), |cost| cost.time),
            rays: rays.round() as u64,
            errors: SettingErrors {
                rmse: mse.map(f64::sqrt),
                relmse,
                bias: has_bias.then(|| {
                    self.estimate_mean_error(count, |position| errors(position).bias.clone())
                }),
                light: self.radiance_ratio(setting)?,
            },
            flip: self.estimate_mean(count, |position| vec![errors(position).flip]),
        })
    }

    /// Returns the relative and the absolute mean squared error of a setting. They are estimated
    /// from tiles, or from the pilots (two noisy pictures) if that estimate is more precise and the
    /// bias that it omits is negligible.
    fn mean_squared_errors(&self, figures: &SettingMeasurements) -> [ConfidenceInterval; 2] {
        let count = figures.tiles.len();
        let by_tiles = [
            self.estimate_mean_error(count, |position| {
                figures.tiles[position].errors.relative.clone()
            }),
            self.estimate_mean_error(count, |position| {
                figures.tiles[position].errors.squared.clone()
            }),
        ];
        match self.errors_from_pilots(figures) {
            Some(by_pilots)
                if by_pilots[0].relative_half_width() < by_tiles[0].relative_half_width() =>
            {
                by_pilots
            }
            _ => by_tiles,
        }
    }

    /// Returns the relative and the absolute mean squared error, estimated from the pilots (two
    /// noisy pictures). `None` without pilots. Also `None` if the squared bias of the scene's own
    /// rungs, which the pilots share, is more than a tenth of the squared error.
    fn errors_from_pilots(&self, figures: &SettingMeasurements) -> Option<[ConfidenceInterval; 2]> {
        let whole = figures.whole_errors.as_ref()?;
        let noisy = self
            .find_setting_measurements(&RungSetting::default())
            .filter(|own_figures| !self.is_denoised(&own_figures.setting))?;
        let bias = |position: usize| &noisy.tiles[position].errors.bias;
        let count = noisy.tiles.len();
        let bias = (0..count)
            .all(|position| !bias(position).is_empty())
            .then(|| self.estimate_mean_error(count, |position| bias(position).clone()))?;
        let relmse = whole.relmse();
        let has_bias = !bias.includes_zero() && bias.value > MOST_BIAS * relmse.value;
        (!has_bias).then(|| [relmse, whole.mse()])
    }

    /// Returns the summed radiance of a setting's picture divided by that of the reference. If
    /// denoising is the only biased choice of the setting, its picture before denoising takes the
    /// place of the reference.
    pub fn radiance_ratio(&self, setting: &RungSetting) -> Option<ConfidenceInterval> {
        let figures = self.find_setting_measurements(setting)?;
        let is_alone = self.is_denoised(setting)
            && setting
                .without_ladder(Ladder::Reconstruction)
                .is_free_of_bias();
        if is_alone && !figures.whole_renders.is_empty() {
            let brightened = figures
                .whole_renders
                .iter()
                .map(|render| render.light_ratio);
            return Some(ConfidenceInterval::from_exact(
                brightened.sum::<f64>() / figures.whole_renders.len() as f64,
            ));
        }
        let lights: Vec<[[f64; 1]; 2]> = (figures.tiles.iter().zip(&self.reference_tiles))
            .map(|(tile, truth)| {
                [
                    [tile.errors.light],
                    [if is_alone {
                        tile.noisy_light
                    } else {
                        truth.total_radiance()
                    }],
                ]
            })
            .collect();
        Some(self.estimate_ratio(figures.tiles.len(), false, |position| {
            (&lights[position][0], &lights[position][1])
        }))
    }

    /// Returns the time and the error of a setting relative to the setting `beside`, from the tiles
    /// on which both settings were measured. `None` if either setting was not measured.
    pub fn relative_cost(
        &self,
        setting: &RungSetting,
        beside: &RungSetting,
    ) -> Option<RelativeCost> {
        let (each_figures, other) = (
            self.find_setting_measurements(setting)?,
            self.find_setting_measurements(beside)?,
        );
        if setting == beside {
            return Some(RelativeCost {
                time: ConfidenceInterval::from_exact(1.0),
                error: ConfidenceInterval::from_exact(1.0),
            });
        }
        let count = each_figures.tiles.len().min(other.tiles.len());
        let rounds = each_figures.rounds.min(other.rounds) as usize;
        let times = |figures: &SettingMeasurements| -> Vec<Vec<f64>> {
            let factor = figures.rounds as f64 / rounds as f64;
            let of_tile = |tile: &TileMeasurement| {
                tile.seconds
                    .iter()
                    .take(rounds)
                    .map(|seconds| factor * seconds)
                    .collect()
            };
            figures.tiles.iter().map(of_tile).collect()
        };
        let (own, others) = (times(each_figures), times(other));
        let time = self
            .estimate_ratio(count, false, |position| (&own[position], &others[position]))
            .multiply(&self.speed_correction_of_time_ratio(each_figures, other));
        let by_pilots = |each_figures: &SettingMeasurements| {
            self.errors_from_pilots(each_figures)
                .is_some_and(|by_pilots| by_pilots[0] == self.mean_squared_errors(each_figures)[0])
        };
        let error = match by_pilots(each_figures) || by_pilots(other) {
            true => self.mean_squared_errors(each_figures)[0]
                .divide(&self.mean_squared_errors(other)[0]),
            false => self.estimate_ratio(count, true, |position| {
                (
                    &each_figures.tiles[position].errors.relative,
                    &other.tiles[position].errors.relative,
                )
            }),
        };
        Some(RelativeCost { time, error })
    }

    /// Returns the root mean squared and the relative mean squared difference between a setting and
    /// the setting that was rendered beside it with the same random numbers.
    pub fn differences_under_same_random_numbers(
        &self,
        setting: &RungSetting,
    ) -> Option<[ConfidenceInterval; 2]> {
        let figures = self.find_setting_measurements(setting)?;
        let sum = |i: usize| {
            self.estimate_mean(figures.tiles.len(), |position| {
                vec![figures.tiles[position].errors.paired_difference[i]]
            })
        };
        Some([sum(0).map(f64::sqrt), sum(1)])
    }

    /// Returns the root mean square, over all pixels, of the reference's standard error in linear
    /// radiance.
    pub fn reference_standard_error(&self) -> f64 {
        self.estimate_mean(self.reference_tile_count(), |position| {
            vec![self.reference_tiles[position].summed_variance()]
        })
        .value
        .sqrt()
    }
}
