//! Cost of each effect of a scene: how much render time it adds, and how much the picture changes
//! without it. Each round renders the picture once with the effect and once without it.

use core::time::Duration;
use std::time::Instant;

use serde::Serialize;

use crate::accuracy::renderer::{FilmRequest, SettingRenderer, TimedFilm, none_if_cancelled};
use crate::accuracy::{ProgressListener, RungSetting, mean_and_variance};
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
    let costs = measure_by_stopwatch(
        (scene, settings),
        budget,
        observer,
        listener,
        time_on_process,
    )?;
    match observer.is_cancelled() {
        true => Err(PrepareError::Cancelled),
        false => Ok(costs),
    }
}

/// Measures like [`measure_effects`], with a stopwatch.
fn measure_by_stopwatch(
    (scene, settings): (&Scene, &Settings),
    budget: Duration,
    observer: &dyn Observer,
    listener: ProgressListener<'_>,
    stopwatch: Stopwatch,
) -> Result<EffectCosts, PrepareError> {
    let start = Instant::now();
    let render = |settings: &Settings, round: u64| {
        let clocks = (stopwatch, &Instant::now as _);
        SettingRenderer::new(scene, settings, observer, clocks).render_film(&FilmRequest {
            setting: &RungSetting::default(),
            round,
            tiles: None,
            denoises: false,
            end: start + budget,
        })
    };
    let simulated = assess_effects(scene, settings).simulated();
    let measured: Vec<Effect> = Effect::ALL
        .iter()
        .copied()
        .filter(|&e| simulated.has(e) && SWITCHABLE_EFFECTS.has(e))
        .collect();
    listener("timing a small trial render", 0.0);
    let renders = 2.0 * ROUNDS as f64 * measured.len().max(1) as f64;
    let settings = choose_size(settings, budget, renders, &render)?;
    let (mut costs, mut late, mut own) = (Vec::new(), Vec::new(), Vec::new());
    for effect in measured {
        let off = Settings {
            without: settings.without.or(EffectSet::from_effects(&[effect])),
            ..settings.clone()
        };
        let mut pairs: Vec<[TimedFilm; 2]> = Vec::new();
        for round in 0..ROUNDS {
            let share = start.elapsed().as_secs_f64() / budget.as_secs_f64().max(1e-9);
            let label = format!("rendering without {}", effect.name());
            listener(&label, share.min(1.0));
            let once = |settings| none_if_cancelled(render(settings, round));
            let (Some(with), Some(without)) = (once(&settings)?, once(&off)?) else {
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
        own.push(render(&settings, 0)?.seconds);
    }
    costs.sort_by(|a, b| b.ratio.median.total_cmp(&a.ratio.median));
    Ok(EffectCosts {
        size: settings.size,
        seconds: SampleQuantiles::from_samples(&own),
        effects: costs,
        late,
    })
}

/// Returns the settings with a picture of which this number of renders takes four fifths of the
/// budget, extrapolated from a small trial render; it is at most as large as the scene's.
fn choose_size(
    settings: &Settings,
    budget: Duration,
    renders: f64,
    render: &dyn Fn(&Settings, u64) -> Result<TimedFilm, PrepareError>,
) -> Result<Settings, PrepareError> {
    let minimum = (LEAST_WIDTH / f64::from(settings.size[0])).min(1.0);
    let scaled = |factor: f64| Settings {
        size: settings
            .size
            .map(|edge| (f64::from(edge) * factor).round().max(1.0) as u32),
        crop: None,
        aovs: Vec::new(),
        ..settings.clone()
    };
    let before = Instant::now();
    render(&scaled(minimum), 0)?;
    let all = before.elapsed().as_secs_f64() * renders;
    let growth = (0.8 * budget.as_secs_f64() / all).sqrt();
    Ok(scaled(minimum * growth.clamp(1.0, 1.0 / minimum)))
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
