//! What accuracy costs in time on one scene: every rung of every ladder that the scene reaches,
//! rendered in turn and compared with a reference better than all of them, and the combinations
//! that are worth their time. It prints nothing.
//!
//! Pictures are measured at the size at which they are rendered, on tiles drawn with known
//! probabilities (`tiles`), since a part of a picture has the bits of the whole. What tiles say of
//! the whole is an estimate with an interval that counts both which tiles were drawn and the noise
//! within them. Renders of one setting differ in their random numbers, round by round; within a
//! round all settings have the same, so that what a choice alone changes is seen free of noise.

mod answer;
mod effects;
mod estimate;
mod frontier;
mod measurements;
mod outputs;
mod pilot;
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
use crate::ladder::Choice;
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

pub use effects::{EffectCost, EffectCosts, measure_effects};
pub use estimate::{Errors, Interval};
pub use outputs::OutputReport;
pub use report::{
    Advice, Answer, Base, Candidate, LadderReport, Measured, Price, PriceReport, Reference, Report,
    RungCost, RungReport, Shown, Tiles,
};
pub use setting::Setting;

/// How much is measured, and of what picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Time that all of it may take: renders end where it does.
    pub budget: Duration,
    /// Width and height of the picture in pixels; none: the scene's.
    pub size: Option<[u32; 2]>,
    /// Times that a tile is rendered where all tiles were, at least two; fewer where time is out.
    pub rounds: u32,
}

/// Hears how far a measurement is.
pub trait Listener {
    /// Something begins: in words, with the share of the budget that is spent.
    fn step(&mut self, what: &str, share: f64);
}

/// Hears nothing.
impl Listener for () {
    fn step(&mut self, _: &str, _: f64) {}
}

/// The reference of a measurement, which the next one of the same scene can do with.
#[derive(Clone, Debug)]
pub struct KeptReference {
    /// The rungs that it was rendered on, besides the scene's own.
    pub rungs: Vec<Choice>,
    /// What was rendered.
    pub film: Film,
}

/// Where a measurement begins.
#[derive(Clone, Debug, Default)]
pub struct Start<'a> {
    /// What tells the scene from others, in a text that is only ever compared.
    pub scene: &'a str,
    /// The reference of an earlier measurement, whose rungs are taken over; none: one is rendered.
    pub reference: Option<KeptReference>,
}

/// Why there is no measurement.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeasureError {
    /// A render can't be prepared, or the observer stopped it.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// There was not even time for the reference and the scene's own picture.
    #[error("the time is over before the reference and one picture are there")]
    NoTime,
    /// The reference is of another scene, or of other settings.
    #[error(transparent)]
    Reference(PartError),
}

/// Measures a validated scene as its settings ask for it, on the current thread pool. Times are
/// those of all threads together. Gives the reference back, to be kept. Where time is out or the
/// observer stops it, the report has what was measured by then.
///
/// # Errors
/// See [`MeasureError`]; [`PrepareError::Cancelled`] where the observer stopped it before there was
/// anything to report.
pub fn measure(
    scene: &Scene,
    settings: &Settings,
    effort: &Effort,
    start: Start<'_>,
    observer: &dyn Observer,
    listener: &mut dyn Listener,
) -> Result<(Report, KeptReference), MeasureError> {
    session::Session::new(
        scene,
        settings,
        Display::of(&scene.render),
        *effort,
        observer,
        (of_process, &Instant::now),
    )
    .run(start, listener)
}
