//! Measurement of accuracy against time on one scene. A *ladder* is a choice that trades accuracy
//! for time, such as the number of samples; a *rung* is a value of the choice. The module prints
//! nothing.
//!
//! A measurement is a table of *trials* (`trial`): renders of a setting on a region of the picture.
//! One function chooses the next trial (`policy`), and every figure is a function of the trials
//! (`figures`). A budget that ends leaves a table that is valid at any row.
//!
//! Errors of noise come from whole pictures, which state their own error (`curve`). Tiles tell what
//! such a claim cannot see: bias, and the noise of a rung beside that of the setting in use. All
//! settings share the random numbers of a round, so that the effect of a rung is measured with
//! little noise.

mod curve;
mod estimate;
mod figures;
mod opening;
mod policy;
mod recommendation;
pub(crate) mod renderer;
mod report;
mod rows;
mod setting;
mod space;
mod study;
mod tiles;
mod trial;

use core::time::Duration;
use std::time::Instant;

use crate::bench::clock::{Stopwatch, time_on_process};
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

use figures::Figures;
use renderer::{ClockFunction, SettingRenderer};
use study::Study;

pub(crate) use trial::mean_and_variance;

pub use estimate::{ConfidenceInterval, SettingErrors};
pub use report::{
    AccuracyReport, DetailPicture, LadderInUse, MeasuredSetting, Recommendation, Recommendations,
    ReferenceReport, ReportPictures, TileReport,
};
pub use setting::RungSetting;

/// Effort of a measurement: time budget, and number of renders per tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccuracyEffort {
    /// Time budget of the measurement. Renders stop when the budget is spent.
    pub budget: Duration,
    /// Largest number of rounds, at least two. A round renders with other random numbers.
    pub rounds: u32,
}

/// Function that is told the next step of a measurement: its description, and the spent share of the
/// time budget, 0 to 1. It cannot stop the measurement; an [`Observer`] can.
pub type ProgressListener<'a> = &'a mut dyn FnMut(&str, f64);

/// Reason why a measurement of accuracy has no report.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeasureError {
    /// A render cannot be prepared, or the observer stopped it.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The time budget ended before the reference and the scene's own picture were rendered.
    #[error(
        "the time budget ended before the reference and one picture of the scene were rendered; use a longer --budget or a smaller --size"
    )]
    InsufficientTime,
}

/// Measures the accuracy and the time of every rung (quality level) for a validated scene, on the
/// current thread pool. Times are summed over all threads. If the time runs out or the observer stops
/// the measurement, the report holds the results obtained by then.
///
/// # Errors
/// See [`MeasureError`]. [`PrepareError::Cancelled`] means that the observer stopped the
/// measurement before its first result.
pub fn measure_accuracy(
    scene: &Scene,
    settings: &Settings,
    effort: &AccuracyEffort,
    observer: &dyn Observer,
    listener: ProgressListener<'_>,
) -> Result<AccuracyReport, MeasureError> {
    let clocks: (Stopwatch, ClockFunction<'_>) = (time_on_process, &Instant::now);
    measure_by_clocks((scene, settings), effort, observer, listener, clocks)
}

/// Measures like [`measure_accuracy`], with a stopwatch and a clock.
fn measure_by_clocks(
    (scene, settings): (&Scene, &Settings),
    effort: &AccuracyEffort,
    observer: &dyn Observer,
    listener: ProgressListener<'_>,
    clocks: (Stopwatch, ClockFunction<'_>),
) -> Result<AccuracyReport, MeasureError> {
    let begun = clocks.1();
    let settings = Settings {
        crop: None,
        aovs: Vec::new(),
        max_error: None,
        ..settings.clone()
    };
    let renderer = SettingRenderer::new(scene, &settings, observer, clocks);
    let mut study = Study::new(&renderer, *effort, begun);
    let measured = study.run(listener).and_then(|is_cut_short| {
        let report = Figures { study: &study }.report(is_cut_short)?;
        report.ok_or(PrepareError::Cancelled)
    });
    // What is cancelled lacks time, unless the observer stopped it.
    measured.map_err(|error| match error {
        PrepareError::Cancelled if !observer.is_cancelled() => MeasureError::InsufficientTime,
        error => error.into(),
    })
}
