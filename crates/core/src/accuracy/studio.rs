//! Where settings are rendered and timed: prepared outside the clock, watched by whoever asked, and given up when time is out.

use std::time::Instant;

use super::estimate::Truth;
use super::report::Reference as Told;
use super::setting::{Setting, reference};
use super::shots::Reference;
use super::{MeasureError, Start};
use crate::bench::clock::process_seconds;
use crate::dispatch::prepare;
use crate::display::Display;
use crate::film::{Film, Part};
use crate::observer::Observer;
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::{Aov, Settings};

/// Most replicates of the reference, which its standard error is estimated from, and samples of each.
const REPLICATES: u32 = 64;
const SAMPLES: u32 = 256;

/// Tells how long some work takes, in seconds of all threads. Tests bring one that goes by the amount of work, in rays.
pub(super) type Stopwatch = fn(work: &mut dyn FnMut() -> u64) -> f64;

/// CPU time of the whole process, which waiting for other programs does not lengthen.
pub(super) fn stopwatch(work: &mut dyn FnMut() -> u64) -> f64 {
    let start = process_seconds();
    work();
    process_seconds() - start
}

/// Why a render is not there.
#[derive(Debug)]
pub(super) enum Unfinished {
    /// Time is out.
    Late,
    /// The user stopped it, or the scene can't be prepared.
    Failed(PrepareError),
}

impl Unfinished {
    /// As the error of a measurement that can't go on without.
    pub fn into_error(self) -> PrepareError {
        match self {
            Self::Late => PrepareError::Cancelled,
            Self::Failed(error) => error,
        }
    }
}

/// Scene, settings and clock.
pub(super) struct Studio<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub observer: &'a dyn Observer,
    pub stopwatch: Stopwatch,
}

/// One finished render.
pub(super) struct Take {
    pub picture: Picture,
    /// Seconds of all threads for rendering alone, and for preparing.
    pub seconds: f64,
    pub preparing: f64,
    pub rays: u64,
    /// Whether other random numbers would have given another picture.
    pub by_chance: bool,
    /// Bytes of geometry and accelerator.
    pub geometry: u64,
}

/// The caller's observer with a time at which all ends.
struct Until<'a> {
    observer: &'a dyn Observer,
    end: Instant,
}

impl Observer for Until<'_> {
    fn cancelled(&self) -> bool {
        self.observer.cancelled() || Instant::now() >= self.end
    }
}

impl Studio<'_> {
    /// Renders a setting with the random numbers of a round.
    pub fn take(&self, setting: &Setting, round: u64, end: Instant) -> Result<Take, Unfinished> {
        let (scene, mut settings) = setting.applied(self.scene, self.settings);
        settings.seed = settings.seed.wrapping_add(round);
        self.render(&scene, &settings, end)
    }

    /// Renders any scene.
    pub fn render(&self, scene: &Scene, settings: &Settings, end: Instant) -> Result<Take, Unfinished> {
        let until = Until { observer: self.observer, end };
        let mut ready = Err(PrepareError::Cancelled);
        let preparing = (self.stopwatch)(&mut || {
            ready = prepare(scene, settings, &until);
            0
        });
        let ready = ready.map_err(|error| self.why(error))?;
        let mut rendered = None;
        let seconds = (self.stopwatch)(&mut || {
            let done = ready.render(&until);
            let rays = done.counters.rays();
            rendered = Some(done);
            rays
        });
        let Some(rendered) = rendered.filter(|rendered| rendered.finished) else {
            return Err(self.why(PrepareError::Cancelled));
        };
        Ok(Take {
            rays: rendered.counters.rays(),
            picture: rendered.picture,
            seconds,
            preparing,
            by_chance: ready.is_by_chance(),
            geometry: ready.memory().geometry,
        })
    }

    /// The reference on these rungs: the one that there is, or replicate by replicate until time is out, two at least.
    pub fn reference(
        &self,
        exact: &Setting,
        display: Display,
        end: Instant,
        start: Start<'_>,
    ) -> Result<(Reference, Told, Film), MeasureError> {
        let (scene, mut settings) = reference(exact, self.scene, self.settings, REPLICATES * SAMPLES);
        settings.replicates = Some(REPLICATES);
        settings.aovs = vec![Aov::StandardError];
        let ready = prepare(&scene, &settings, self.observer)?;
        let mut film = ready.film(start.scene);
        let kept = start.reference.is_some();
        if let Some(earlier) = start.reference {
            film.adopt(earlier.film).map_err(MeasureError::Reference)?;
        }
        let whole = film.whole();
        let is_there = |&replicate: &u32| film.lacking(&Part { replicates: replicate..replicate + 1, ..whole.clone() }) == 0;
        let mut done = (0..REPLICATES).take_while(is_there).count() as u32;
        let before = film.counters().rays();
        let seconds = (self.stopwatch)(&mut || {
            while done < REPLICATES && (done < 2 || !kept && Instant::now() < end) && !self.observer.cancelled() {
                let part = Part { replicates: done..done + 1, ..whole.clone() };
                // The film is this scene's own.
                let rendered = ready.render_part(&mut film, &part, self.observer);
                debug_assert!(rendered.is_ok());
                done += 1;
            }
            film.counters().rays() - before
        });
        if self.observer.cancelled() {
            return Err(PrepareError::Cancelled.into());
        }
        let picture = film.picture();
        let channels = ["stderr.R", "stderr.G", "stderr.B"].map(|name| picture.layer(name).map_or(&[][..], |l| &l.samples));
        let error = (0..picture.pixels()).map(|i| channels.map(|c| c.get(i).copied().unwrap_or(0.0))).collect();
        let truth = Truth { error, picture };
        let standard_error = truth.standard_error();
        let told = Told { samples: done * SAMPLES, rungs: exact.flags(), standard_error, seconds, kept };
        let shown = display.to_values(&truth.picture);
        Ok((Reference { truth, display, shown }, told, film))
    }

    fn why(&self, error: PrepareError) -> Unfinished {
        match error {
            PrepareError::Cancelled if !self.observer.cancelled() => Unfinished::Late,
            error => Unfinished::Failed(error),
        }
    }
}
