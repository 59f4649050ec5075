//! Estimates for the whole picture from tiles and pilots: time, errors, light, and ratios of two
//! settings.

use super::super::estimate::{Errors, Interval};
use super::super::report::Measured;
use super::super::setting::Setting;
use super::super::tiles::{Share, ratio};
use super::{Figures, Measurements, TileFigures};
use crate::ladder::Ladder;

/// Largest share of the bias of the scene's own rungs in a squared error estimated from the pilots.
const MOST_BIAS: f64 = 0.1;

/// Ratios of two settings in their common tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct RelativeCost {
    /// Ratio of the times.
    pub time: Interval,
    /// Ratio of the mean squared errors.
    pub error: Interval,
}

impl Measurements<'_> {
    /// Estimates a ratio of two totals over the whole picture from the first tiles.
    fn total<'b>(
        &'b self,
        count: usize,
        doubtful: bool,
        of: impl Fn(usize) -> (&'b [f64], &'b [f64]),
    ) -> Interval {
        let chances = self.sample.chances(count);
        let share = |(at, chance): (usize, f64)| {
            let (above, below) = of(at);
            Share {
                chance,
                above,
                below,
                doubt: if doubtful { self.truths[at].doubt } else { 0.0 },
            }
        };
        ratio(
            &chances
                .into_iter()
                .enumerate()
                .map(share)
                .collect::<Vec<_>>(),
        )
    }

    /// Estimates a mean over pixels from tile sums, with one number per tile or one per block.
    fn mean(&self, count: usize, of: impl Fn(usize) -> Vec<f64>) -> Interval {
        self.weighted(count, false, of, |_| 1.0)
    }

    /// Estimates the mean of an error over pixels; errors grow with the noise of a tile.
    fn error(&self, count: usize, of: impl Fn(usize) -> Vec<f64>) -> Interval {
        let weight = |at: usize| {
            self.sample.weight(at) / self.sample.grid.pixels(self.sample.order[at].tile)
        };
        self.weighted(count, true, of, weight)
    }

    /// Estimates a weighted mean over pixels.
    fn weighted(
        &self,
        count: usize,
        doubtful: bool,
        of: impl Fn(usize) -> Vec<f64>,
        weight: impl Fn(usize) -> f64,
    ) -> Interval {
        let sums: Vec<Vec<f64>> = (0..count).map(of).collect();
        let pixels = |at: usize| match sums[at].len() {
            1 => vec![weight(at) * self.sample.grid.pixels(self.sample.order[at].tile)],
            _ => self.truths[at]
                .blocks()
                .iter()
                .map(|pixels| weight(at) * pixels)
                .collect(),
        };
        let pixels: Vec<Vec<f64>> = (0..count).map(pixels).collect();
        self.total(count, doubtful, |at| (&sums[at], &pixels[at]))
    }

    /// Returns time, error, and the ratio of its time to that of another setting; `None` without a
    /// measurement.
    pub fn measured(&self, setting: &Setting, beside: &Setting) -> Option<Measured> {
        let of = self.of(setting)?;
        let count = of.tiles.len();
        let errors = |at: usize| &of.tiles[at].errors;
        let has_bias = (0..count).all(|at| !errors(at).bias.is_empty());
        let looked = self
            .sample
            .order
            .iter()
            .map(|look| look.seconds)
            .sum::<f64>()
            * self.sample.grid.count() as f64;
        // The time of the first look is divided evenly over the rounds, so that the spread of the
        // rounds stays visible.
        let rounds = of.tiles.first().map_or(1, |tile| tile.seconds.len());
        let looks: Vec<Vec<f64>> = self
            .sample
            .order
            .iter()
            .map(|look| vec![look.seconds / rounds as f64; rounds])
            .collect();
        let looks = |at: usize| -> &[f64] { &looks[at] };
        let seconds = self.total(count, false, |at| (&of.tiles[at].seconds, looks(at)));
        let [relmse, mse] = self.errors(of);
        let size = self.sample.grid.size.map(f64::from);
        let rays = self.mean(count, |at| vec![of.tiles[at].rays]).value * size[0] * size[1];
        Some(Measured {
            tiles: count,
            renders: of.rounds as usize,
            seconds: seconds
                .map(|ratio| ratio * looked / self.sample.most() as f64)
                .times(&self.own_drift(of)),
            ratio: self
                .relative(setting, beside)
                .map_or(Interval::exact(f64::NAN), |cost| cost.time),
            rays: rays.round() as u64,
            errors: Errors {
                rmse: mse.map(f64::sqrt),
                relmse,
                bias: has_bias.then(|| self.error(count, |at| errors(at).bias.clone())),
                light: self.light(setting)?,
            },
            flip: self.mean(count, |at| vec![errors(at).flip]),
        })
    }

    /// Returns the mean squared errors, relative and absolute: estimated from tiles, or from the
    /// pilots where these are more precise and the bias of the scene's rungs is negligible.
    fn errors(&self, of: &Figures) -> [Interval; 2] {
        let count = of.tiles.len();
        let by_tiles = [
            self.error(count, |at| of.tiles[at].errors.relative.clone()),
            self.error(count, |at| of.tiles[at].errors.squared.clone()),
        ];
        match self.by_pilots(of) {
            Some(by_pilots) if by_pilots[0].relative() < by_tiles[0].relative() => by_pilots,
            _ => by_tiles,
        }
    }

    /// Returns the errors estimated from the pilots, which share the bias of the scene's own rungs;
    /// `None` where that bias is more than a tenth of the error, or without pilots.
    fn by_pilots(&self, of: &Figures) -> Option<[Interval; 2]> {
        let whole = of.whole_errors.as_ref()?;
        let noisy = self
            .of(&Setting::default())
            .filter(|own| !self.is_denoised(&own.setting))?;
        let bias = |at: usize| &noisy.tiles[at].errors.bias;
        let count = noisy.tiles.len();
        let bias = (0..count)
            .all(|at| !bias(at).is_empty())
            .then(|| self.error(count, |at| bias(at).clone()))?;
        let relmse = whole.relmse();
        let has_bias = !bias.is_lost_in_noise() && bias.value > MOST_BIAS * relmse.value;
        (!has_bias).then(|| [relmse, whole.mse()])
    }

    /// Returns the ratio of the light to the reference's. Where only denoising may have changed the
    /// light, the ratio is to the noisy picture's.
    pub fn light(&self, setting: &Setting) -> Option<Interval> {
        let of = self.of(setting)?;
        let is_alone =
            self.is_denoised(setting) && setting.without(Ladder::Reconstruction).is_free_of_bias();
        if is_alone && !of.whole.is_empty() {
            let brightened = of.whole.iter().map(|render| render.brightened);
            return Some(Interval::exact(
                brightened.sum::<f64>() / of.whole.len() as f64,
            ));
        }
        let lights: Vec<[[f64; 1]; 2]> = (of.tiles.iter().zip(&self.truths))
            .map(|(tile, truth)| {
                [
                    [tile.errors.light],
                    [if is_alone {
                        tile.noisy_light
                    } else {
                        truth.light()
                    }],
                ]
            })
            .collect();
        Some(self.total(of.tiles.len(), false, |at| (&lights[at][0], &lights[at][1])))
    }

    /// Returns the ratios of time and error to those of another setting, from their common tiles;
    /// `None` without common tiles.
    pub fn relative(&self, setting: &Setting, beside: &Setting) -> Option<RelativeCost> {
        let (of, other) = (self.of(setting)?, self.of(beside)?);
        if setting == beside {
            return Some(RelativeCost {
                time: Interval::exact(1.0),
                error: Interval::exact(1.0),
            });
        }
        let count = of.tiles.len().min(other.tiles.len());
        let rounds = of.rounds.min(other.rounds) as usize;
        let times = |figures: &Figures| -> Vec<Vec<f64>> {
            let factor = figures.rounds as f64 / rounds as f64;
            let of_tile = |tile: &TileFigures| {
                tile.seconds
                    .iter()
                    .take(rounds)
                    .map(|seconds| factor * seconds)
                    .collect()
            };
            figures.tiles.iter().map(of_tile).collect()
        };
        let (own, others) = (times(of), times(other));
        let time = self
            .total(count, false, |at| (&own[at], &others[at]))
            .times(&self.relative_drift(of, other));
        let by_pilots = |of: &Figures| {
            self.by_pilots(of)
                .is_some_and(|by_pilots| by_pilots[0] == self.errors(of)[0])
        };
        let error = match by_pilots(of) || by_pilots(other) {
            true => self.errors(of)[0].over(&self.errors(other)[0]),
            false => self.total(count, true, |at| {
                (
                    &of.tiles[at].errors.relative,
                    &other.tiles[at].errors.relative,
                )
            }),
        };
        Some(RelativeCost { time, error })
    }

    /// Returns the change by a single choice: root mean squared difference to the pictures of the
    /// other setting, and mean squared relative difference.
    pub fn alone(&self, setting: &Setting) -> Option<[Interval; 2]> {
        let of = self.of(setting)?;
        let sum = |i: usize| self.mean(of.tiles.len(), |at| vec![of.tiles[at].errors.alone[i]]);
        Some([sum(0).map(f64::sqrt), sum(1)])
    }

    /// Returns the standard error of the reference, as a root mean square.
    pub fn standard_error(&self) -> f64 {
        self.mean(self.known(), |at| vec![self.truths[at].variance()])
            .value
            .sqrt()
    }
}
