//! Accuracy against time on one scene. Every rung of every ladder that matters to the scene is
//! rendered and compared with a reference better than all of them, and combinations that are worth
//! their time are found. The module prints nothing.
//!
//! Pictures are measured at their full size, on tiles drawn with known probabilities (`tiles`); a
//! tile has the bits of the whole picture. The estimate for the whole has an interval that includes
//! both the choice of tiles and the noise within them. Renders of one setting use different random
//! numbers in each round. Within a round all settings use the same random numbers, so that the
//! change by a single choice is measured free of noise.

mod effects;
mod estimate;
mod frontier;
mod measurements;
mod outputs;
mod pilot;
mod recommendation;
mod renderer;
mod report;
mod session;
mod setting;
mod tiles;

use core::time::Duration;
use std::time::Instant;

use crate::bench::clock::of_process;
use crate::display::Display;
use crate::film::{Film, PartError};
use crate::ladder::RungChoice;
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

pub use effects::{EffectCost, EffectCosts, measure_effects};
pub use estimate::{ConfidenceInterval, SettingErrors};
pub use outputs::OutputReport;
pub use report::{
    AccuracyReport, Advice, BaselineReport, FrontierCandidate, LadderReport, MeasuredSetting,
    PriceReport, Recommendations, Reference, ReportPicture, RungCost, RungPrice, RungReport, Tiles,
};
pub use setting::Setting;

/// Extent of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccuracyEffort {
    /// Time budget of the measurement; renders end with it.
    pub budget: Duration,
    /// Width and height of the picture in pixels; `None`: the scene's.
    pub size: Option<[u32; 2]>,
    /// Renders of each tile where all tiles were rendered, at least two; fewer where time is out.
    pub rounds: u32,
}

/// Receives the progress of a measurement.
pub trait ProgressListener {
    /// Reports the next step in words, with the spent share of the budget.
    fn step(&mut self, label: &str, share: f64);
}

/// A listener that ignores progress.
impl ProgressListener for () {
    fn step(&mut self, _: &str, _: f64) {}
}

/// Reference of a measurement, for reuse by the next measurement of the same scene.
#[derive(Clone, Debug)]
pub struct KeptReference {
    /// Rungs of the reference, besides the scene's own.
    pub rungs: Vec<RungChoice>,
    /// Rendered film of the reference.
    pub film: Film,
}

/// Starting point of a measurement.
#[derive(Clone, Debug, Default)]
pub struct MeasurementStart<'a> {
    /// Text that identifies the scene; only compared.
    pub scene: &'a str,
    /// Reference of an earlier measurement, whose rungs are reused; `None`: a new one is rendered.
    pub reference: Option<KeptReference>,
}

/// Error of a measurement.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeasureError {
    /// A render cannot be prepared, or the observer stopped it.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The time was too short for the reference and the scene's own picture.
    #[error("the time is over before the reference and one picture are there")]
    NoTime,
    /// The reference belongs to another scene, or to other settings.
    #[error(transparent)]
    Reference(PartError),
}

/// Measures a validated scene with its settings, on the current thread pool. Times are those of all
/// threads together. Returns the report, and the reference for reuse. Where time is out or the
/// observer stops the measurement, the report holds the results so far.
///
/// # Errors
/// See [`MeasureError`]; [`PrepareError::Cancelled`] where the observer stopped the measurement
/// before its first result.
pub fn measure(
    scene: &Scene,
    settings: &Settings,
    effort: &AccuracyEffort,
    start: MeasurementStart<'_>,
    observer: &dyn Observer,
    listener: &mut dyn ProgressListener,
) -> Result<(AccuracyReport, KeptReference), MeasureError> {
    session::MeasurementSession::new(
        scene,
        settings,
        Display::from_render(&scene.render),
        *effort,
        observer,
        (of_process, &Instant::now),
    )
    .run(start, listener)
}
