//! Cost of each effect of a scene: how much render time it adds, and how much the picture changes
//! without it. Each round renders the picture once with the effect and once without it.

use core::time::Duration;
use std::time::Instant;

use serde::Serialize;

use super::ProgressListener;
use super::renderer::{FilmRequest, SettingRenderer, TimedFilm, none_if_cancelled};
use super::setting::RungSetting;
use super::trial::mean_and_variance;
use crate::bench::SampleQuantiles;
use crate::bench::clock::{Stopwatch, time_on_process};
use crate::effects::{Effect, EffectSet, SWITCHABLE_EFFECTS, assess_effects};
use crate::observer::Observer;
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

/// Number of rounds for each effect: pairs of a render with the effect and a render without it.
const ROUNDS: u64 = 3;
/// Width in pixels of the trial render, or the width of the picture if that is less. The size of
/// all further renders follows from the time of this render.
const LEAST_WIDTH: f64 = 40.0;

/// Cost of one effect. Time, rays and picture of renders with the effect are compared with those of
/// renders without it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectCost {
    /// Name of the effect in reports, such as `sky light`.
    pub effect: &'static str,
    /// Ratio of the render time with the effect to the time without it, one value per pair of
    /// renders.
    pub ratio: SampleQuantiles,
    /// Ratio of the number of rays with the effect to the number without it.
    pub rays: f64,
    /// Root mean squared difference, in linear radiance, between the pictures with and without the
    /// effect, which use the same random numbers. The variance between rounds is subtracted.
    pub rmse: f64,
}

/// Costs of all effects of a scene that can be switched off, with the size and the time of the
/// renders.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectCosts {
    /// Width and height of the renders in pixels.
    pub size: [u32; 2],
    /// Render time with all effects, in seconds summed over all threads.
    pub seconds: SampleQuantiles,
    /// Costs of the effects that can be switched off, by descending ratio of render times.
    pub effects: Vec<EffectCost>,
    /// Names of the effects that were not measured for lack of time.
    pub late: Vec<&'static str>,
}

/// Measures the cost of every simulated effect that can be switched off, within about the time
/// budget, on the current thread pool.
///
/// # Errors
/// See [`PrepareError`]. [`PrepareError::Cancelled`] means that the observer stopped the
/// measurement, or that the budget was too short for a single render.
pub fn measure_effects(
    scene: &Scene,
    settings: &Settings,
    budget: Duration,
    observer: &dyn Observer,
    listener: ProgressListener<'_>,
) -> Result<EffectCosts, PrepareError> {
    let bench = EffectBench {
        scene,
        observer,
        stopwatch: time_on_process,
        start: Instant::now(),
        budget,
    };
    let costs = bench.measure_costs(settings, listener)?;
    if observer.is_cancelled() {
        Err(PrepareError::Cancelled)
    } else {
        Ok(costs)
    }
}

/// Measurement of effects within a time budget.
struct EffectBench<'a> {
    scene: &'a Scene,
    observer: &'a dyn Observer,
    stopwatch: Stopwatch,
    start: Instant,
    budget: Duration,
}

impl EffectBench<'_> {
    /// Measures the cost of each simulated effect of a scene, by renders with and without the
    /// effect.
    ///
    /// # Errors
    /// A render that cannot be prepared, and [`PrepareError::Cancelled`].
    fn measure_costs(
        &self,
        settings: &Settings,
        listener: ProgressListener<'_>,
    ) -> Result<EffectCosts, PrepareError> {
        let simulated = assess_effects(self.scene, settings).simulated();
        let measured: Vec<Effect> = Effect::ALL
            .iter()
            .copied()
            .filter(|&e| simulated.has(e) && SWITCHABLE_EFFECTS.has(e))
            .collect();
        listener("timing a small trial render", 0.0);
        let settings = Settings {
            size: self.choose_picture_size(settings, measured.len())?,
            crop: None,
            aovs: Vec::new(),
            ..settings.clone()
        };
        let (mut costs, mut late, mut own) = (Vec::new(), Vec::new(), Vec::new());
        for effect in measured {
            let off = Settings {
                without: settings.without.or(EffectSet::from_effects(&[effect])),
                ..settings.clone()
            };
            let mut pairs: Vec<[TimedFilm; 2]> = Vec::new();
            for round in 0..ROUNDS {
                let share =
                    self.start.elapsed().as_secs_f64() / self.budget.as_secs_f64().max(1e-9);
                let label = format!("rendering without {}", effect.name());
                listener(&label, share.min(1.0));
                let render = |settings| none_if_cancelled(self.render_round(settings, round));
                let (Some(with), Some(without)) = (render(&settings)?, render(&off)?) else {
                    break;
                };
                own.push(with.seconds);
                pairs.push([with, without]);
            }
            match pairs.is_empty() {
                true => late.push(effect.name()),
                false => costs.push(EffectCost::from_pairs(effect, &pairs)),
            }
        }
        if own.is_empty() {
            own.push(self.render_round(&settings, 0)?.seconds);
        }
        costs.sort_by(|a, b| b.ratio.median.total_cmp(&a.ratio.median));
        Ok(EffectCosts {
            size: settings.size,
            seconds: SampleQuantiles::from_samples(&own),
            effects: costs,
            late,
        })
    }

    /// Prepares and renders the whole picture. `round` selects the random numbers.
    fn render_round(&self, settings: &Settings, round: u64) -> Result<TimedFilm, PrepareError> {
        let now = &Instant::now;
        let clocks = (self.stopwatch, now as _);
        SettingRenderer::new(self.scene, settings, self.observer, clocks).render_film(
            &FilmRequest {
                setting: &RungSetting::default(),
                round,
                tiles: None,
                denoises: false,
                end: self.start + self.budget,
            },
        )
    }

    /// Returns the picture size in pixels, at most the scene's, for the renders of this number of
    /// effects. All renders together then take four fifths of the time budget. The time is extrapolated
    /// from a small trial render.
    fn choose_picture_size(
        &self,
        settings: &Settings,
        effects: usize,
    ) -> Result<[u32; 2], PrepareError> {
        let minimum = (LEAST_WIDTH / f64::from(settings.size[0])).min(1.0);
        let scaled = |factor: f64| {
            settings
                .size
                .map(|edge| (f64::from(edge) * factor).round().max(1.0) as u32)
        };
        let small = Settings {
            size: scaled(minimum),
            ..settings.clone()
        };
        let before = Instant::now();
        self.render_round(&small, 0)?;
        let renders = 2.0 * ROUNDS as f64 * effects.max(1) as f64;
        let all = before.elapsed().as_secs_f64() * renders;
        let growth = (0.8 * self.budget.as_secs_f64() / all).sqrt();
        Ok(scaled(minimum * growth.clamp(1.0, 1.0 / minimum)))
    }
}

impl EffectCost {
    /// Returns the cost of an effect from pairs of renders with and without it, which share their
    /// random numbers.
    fn from_pairs(effect: Effect, pairs: &[[TimedFilm; 2]]) -> Self {
        let ratio = |[with, without]: &[TimedFilm; 2]| with.seconds / without.seconds.max(1e-9);
        let ratios: Vec<f64> = pairs.iter().map(ratio).collect();
        let pictures: Vec<[Picture; 2]> = pairs
            .iter()
            .map(|pair| pair.each_ref().map(|timed| timed.film.picture()))
            .collect();
        let rays = pairs[0]
            .each_ref()
            .map(|timed| timed.film.counters().ray_count() as f64);
        Self {
            effect: effect.name(),
            ratio: SampleQuantiles::from_samples(&ratios),
            rays: rays[0] / rays[1].max(1.0),
            rmse: rms_difference_of_mean_pictures(&pictures),
        }
    }
}

/// Returns the root mean square, over pixels and channels, of the mean difference between the two
/// pictures of a pair. The variance of that mean, estimated from the spread between pairs, is
/// subtracted.
fn rms_difference_of_mean_pictures(pairs: &[[Picture; 2]]) -> f64 {
    let (count, numbers) = (pairs.len() as f64, 3 * pairs[0][0].pixel_count());
    let mut square = 0.0;
    for i in 0..numbers {
        let difference =
            |[a, b]: &[Picture; 2]| f64::from(a.rgb[i / 3][i % 3]) - f64::from(b.rgb[i / 3][i % 3]);
        let differences: Vec<f64> = pairs.iter().map(difference).collect();
        let (mean, variance) = mean_and_variance(&differences);
        square += mean * mean - variance / count;
    }
    (square / numbers as f64).max(0.0).sqrt()
}

#[cfg(test)]
mod tests;
