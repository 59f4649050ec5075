//! Where settings are rendered and timed: prepared outside the clock, watched by whoever asked, and given up when time is out.

use core::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use super::estimate::Truth;
use super::measurements::Reference;
use super::report::Reference as Told;
use super::setting::{Setting, reference};
use super::{MeasureError, Start};
use crate::bench::clock::Stopwatch;
use crate::dispatch::{Ready, prepare};
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

/// Tells the time. Tests bring one that goes by how often it is asked.
pub(super) type Now<'a> = &'a (dyn Fn() -> Instant + Sync);

/// Why a render is not there.
#[derive(Debug)]
pub(super) enum Unfinished {
    /// Time is out, or the user stopped it.
    Late,
    /// The scene can't be prepared.
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
pub(super) struct Renderer<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub observer: &'a dyn Observer,
    /// In seconds of all threads.
    pub stopwatch: Stopwatch,
    pub now: Now<'a>,
}

/// One finished render.
pub(super) struct TimedRender {
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
struct Deadline<'a> {
    observer: &'a dyn Observer,
    now: Now<'a>,
    end: Instant,
}

impl Observer for Deadline<'_> {
    fn cancelled(&self) -> bool {
        self.observer.cancelled() || (self.now)() >= self.end
    }
}

/// When the reference ends: as soon as time is out, if there are two replicates by then; in any case with all the time.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReferenceTime {
    pub end: Instant,
    pub latest: Instant,
}

impl Renderer<'_> {
    /// Renders a setting with the random numbers of a round.
    pub fn take(&self, setting: &Setting, round: u64, end: Instant) -> Result<TimedRender, Unfinished> {
        let (scene, mut settings) = setting.applied(self.scene, self.settings);
        settings.seed = settings.seed.wrapping_add(round);
        self.render(&scene, &settings, end)
    }

    /// Renders any scene.
    pub fn render(&self, scene: &Scene, settings: &Settings, end: Instant) -> Result<TimedRender, Unfinished> {
        let until = self.until(end);
        let mut ready = Err(PrepareError::Cancelled);
        let preparing = (self.stopwatch)(&mut || {
            ready = prepare(scene, settings, &until);
            0
        });
        let ready = ready.map_err(why)?;
        let mut rendered = None;
        let seconds = (self.stopwatch)(&mut || {
            let done = ready.render(&until);
            let rays = done.counters.rays();
            rendered = Some(done);
            rays
        });
        let Some(rendered) = rendered.filter(|rendered| rendered.finished) else {
            return Err(Unfinished::Late);
        };
        Ok(TimedRender {
            rays: rendered.counters.rays(),
            picture: rendered.shown().clone(),
            seconds,
            preparing,
            by_chance: ready.is_by_chance(),
            geometry: ready.memory().geometry,
        })
    }

    fn until(&self, end: Instant) -> Deadline<'_> {
        Deadline { observer: self.observer, now: self.now, end }
    }

    /// The reference on these rungs: the one that there is, or replicate by replicate until time is out, of two at least a part.
    pub fn reference(
        &self,
        exact: &Setting,
        display: Display,
        time: ReferenceTime,
        start: Start<'_>,
    ) -> Result<(Reference, Told, Film), MeasureError> {
        let (scene, mut settings) = reference(exact, self.scene, self.settings, REPLICATES * SAMPLES);
        settings.replicates = Some(REPLICATES);
        settings.aovs = vec![Aov::StandardError];
        let ready = prepare(&scene, &settings, &self.until(time.latest)).map_err(|error| self.explained(error))?;
        let mut film = ready.film(start.scene);
        let kept = start.reference.is_some();
        if let Some(earlier) = start.reference {
            film.adopt(earlier.film).map_err(MeasureError::Reference)?;
        }
        let before = film.counters().rays();
        let seconds = (self.stopwatch)(&mut || {
            self.expose(&ready, &mut film, time, kept);
            film.counters().rays() - before
        });
        let whole = film.whole();
        let lacks_any =
            |replicate: u32| *film.samples(&Part { replicates: replicate..replicate + 1, ..whole.clone() }).start() == 0;
        if self.observer.cancelled() || (0..2).any(lacks_any) {
            return Err(self.explained(PrepareError::Cancelled));
        }
        let picture = film.picture();
        let channels = ["stderr.R", "stderr.G", "stderr.B"].map(|name| picture.layer(name).map_or(&[][..], |l| &l.samples));
        let error = (0..picture.pixels()).map(|i| channels.map(|c| c.get(i).copied().unwrap_or(0.0))).collect();
        let truth = Truth { error, picture };
        let standard_error = truth.standard_error();
        let told = Told { samples: *film.samples(&whole).start(), rungs: exact.flags(), standard_error, seconds, kept };
        let shown = display.to_values(&truth.picture);
        Ok((Reference { truth, display, shown }, told, film))
    }

    /// Adds replicates to a film while there is time. The first two go on side by side, so that they tell an error wherever they end; a
    /// further one that would not be finished is not begun. One that was kept is only finished as far as it has to be.
    fn expose(&self, ready: &Ready, film: &mut Film, ReferenceTime { end, latest }: ReferenceTime, kept: bool) {
        let whole = film.whole();
        let part = |replicates: Range<u32>| Part { replicates, ..whole.clone() };
        let has_both = |film: &Film| (0..2).all(|replicate| *film.samples(&part(replicate..replicate + 1)).start() > 0);
        let began = (self.now)();
        // The film is this scene's own, so that nothing of it is refused.
        let _ = ready.render_part(film, &part(0..2), &self.until(end));
        while !has_both(film) && (self.now)() < latest && !self.observer.cancelled() {
            let _ = ready.render_part(
                film,
                &part(0..2),
                &WorkLimit { until: self.until(latest), left: AtomicUsize::new(WORK_LIMIT) },
            );
        }
        let done = (0..REPLICATES).take_while(|&replicate| film.lacking(&part(replicate..replicate + 1)) == 0).count() as u32;
        if kept || done < 2 {
            return;
        }
        let each = ((self.now)() - began) / 2;
        for replicate in done..REPLICATES {
            if (self.now)() + each > end || self.observer.cancelled() {
                return;
            }
            let _ = ready.render_part(film, &part(replicate..replicate + 1), &self.until(latest));
        }
    }

    /// Why there is no measurement: the user stopped it, or there was no time for the least of it.
    pub fn explained(&self, error: PrepareError) -> MeasureError {
        match error {
            PrepareError::Cancelled if !self.observer.cancelled() => MeasureError::NoTime,
            error => error.into(),
        }
    }
}

/// Pieces of work that are done between two looks at what is there.
const WORK_LIMIT: usize = 16;

/// Ends after a few pieces of work.
struct WorkLimit<'a> {
    until: Deadline<'a>,
    left: AtomicUsize,
}

impl Observer for WorkLimit<'_> {
    fn cancelled(&self) -> bool {
        self.until.cancelled()
    }

    fn has_enough(&self, _: bool) -> bool {
        self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_err()
    }
}

fn why(error: PrepareError) -> Unfinished {
    match error {
        PrepareError::Cancelled => Unfinished::Late,
        error => Unfinished::Failed(error),
    }
}
