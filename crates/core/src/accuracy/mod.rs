//! Measurement of accuracy against time on one scene. A *ladder* is a choice that trades accuracy
//! for time, such as the number of samples; a *rung* is a value of the choice. Every rung that
//! changes the scene's picture is rendered and compared with a reference, which is more accurate
//! than all rungs. A greedy search then measures combinations of rungs. The module prints nothing.
//!
//! Errors are measured on tiles of the full-size picture, drawn with known probabilities (`tiles`).
//! A tile has the same bits as in a render of the whole picture. The interval of an estimate covers
//! the choice of tiles and the noise within the tiles. A setting is rendered in several rounds,
//! each with other random numbers. All settings share the random numbers of a round, so that the
//! effect of a single rung is measured without noise.

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

use crate::bench::clock::time_on_process;
use crate::display::Display;
use crate::film::{Film, FilmMergeError};
use crate::ladder::RungChoice;
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

pub use effects::{EffectCost, EffectCosts, measure_effects};
pub use estimate::{ConfidenceInterval, SettingErrors};
pub use outputs::OutputFormatReport;
pub use report::{
    AccuracyReport, LadderCostReport, LadderReport, MeasuredBaseline, MeasuredSetting,
    MeasuredSettingWithFlags, Recommendation, Recommendations, ReferenceReport, ReportPicture,
    RungCost, RungCostReport, RungReport, TileReport,
};
pub use setting::RungSetting;

/// Effort of a measurement: time budget, picture size, and number of renders per tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccuracyEffort {
    /// Time budget of the measurement. Renders stop when the budget is spent.
    pub budget: Duration,
    /// Width and height of the picture in pixels; `None` for the size in the scene.
    pub size: Option<[u32; 2]>,
    /// Number of renders of each tile, at least two, for a picture of which all tiles are measured.
    /// The number is smaller if the time runs out.
    pub rounds: u32,
}

/// Listener to the progress of a measurement. It cannot stop the measurement; an [`Observer`] can.
pub trait ProgressListener {
    /// Reports the next step: its description, and the spent share of the time budget, 0 to 1.
    fn report_step(&mut self, label: &str, share: f64);
}

/// Ignores the progress of a measurement.
impl ProgressListener for () {
    fn report_step(&mut self, _: &str, _: f64) {}
}

/// Reference picture of a measurement, as a film. The next measurement of the same scene adds tiles
/// to it.
#[derive(Clone, Debug)]
pub struct ReusableReference {
    /// Rungs (quality levels) in which the reference differs from the scene's own settings.
    pub rungs: Vec<RungChoice>,
    /// Rendered film of the reference.
    pub film: Film,
}

/// Start of a measurement: a text that identifies the scene, and possibly the reference picture of
/// an earlier measurement of this scene.
#[derive(Clone, Debug, Default)]
pub struct MeasurementStart<'a> {
    /// Text that identifies the scene. A reused reference must carry the same text.
    pub scene: &'a str,
    /// Reference of an earlier measurement, to which tiles are added; `None` renders a new
    /// reference.
    pub reference: Option<ReusableReference>,
}

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
    /// The reusable reference belongs to another scene, or to other settings.
    #[error(transparent)]
    Reference(FilmMergeError),
}

/// Measures the accuracy and the time of every rung (quality level) for a validated scene, on the
/// current thread pool. Times are summed over all threads. Returns the report, and the reference
/// for reuse. If the time runs out or the observer stops the measurement, the report holds the
/// results obtained by then.
///
/// # Errors
/// See [`MeasureError`]. [`PrepareError::Cancelled`] means that the observer stopped the
/// measurement before its first result.
pub fn measure_accuracy(
    scene: &Scene,
    settings: &Settings,
    effort: &AccuracyEffort,
    start: MeasurementStart<'_>,
    observer: &dyn Observer,
    listener: &mut dyn ProgressListener,
) -> Result<(AccuracyReport, ReusableReference), MeasureError> {
    session::MeasurementSession::new(
        scene,
        settings,
        Display::from_render(&scene.render),
        *effort,
        observer,
        (time_on_process, &Instant::now),
    )
    .run_measurement(start, listener)
}
