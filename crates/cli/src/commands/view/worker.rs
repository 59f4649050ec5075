//! The thread that computes: it takes a wish, shows a sketch, continues until the picture is
//! finished, and does jobs between two pieces.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::mem;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use raywright_core::Rendered;
use raywright_core::accuracy::measure_effects;
use raywright_core::settings::Aov;
use raywright_io::output::{Metadata, pixel_hash};

use super::flags::CommandLine;
use super::progress::{LiveRender, Speed, WishWatch};
use super::shared::{Frame, Job, SaveWish, Shared, Wish};
use super::status::{SceneStatus, Status, switches};
use super::subject::{Change, Files, Subject};
use super::{layers, save};
use crate::clock::spoken;
use crate::console::Verbosity;
use crate::failure::Failure;
use crate::origin;
use crate::progress::Steps;
use crate::threads::Threads;

/// Interval of checks for changed files and for open pages.
const LOOK_EVERY: Duration = Duration::from_millis(300);
/// Time limit for measuring effects.
const MEASURING: Duration = Duration::from_secs(20);

/// The thread that computes, with its state.
pub struct Worker {
    pub scene: OsString,
    pub line: CommandLine,
    pub shared: Arc<Shared>,
    pub threads: Threads,
    pub stop: &'static AtomicBool,
    /// Whether the scene is rendered again when its files change.
    pub watches: bool,
    /// Time without a page after which the program ends; `None`: never.
    pub linger: Option<Duration>,
    wish: (u64, Wish),
    subject: Option<Subject>,
    render: Option<LiveRender>,
    speed: Speed,
    files: Files,
    looked: Instant,
    failure: Option<String>,
    said: String,
    costs: BTreeMap<String, f64>,
}

impl Worker {
    /// Creates a worker that has loaded nothing.
    pub fn new(
        scene: OsString,
        line: CommandLine,
        shared: Arc<Shared>,
        threads: Threads,
        stop: &'static AtomicBool,
    ) -> Self {
        Self {
            scene,
            line,
            shared,
            threads,
            stop,
            watches: false,
            linger: None,
            wish: Default::default(),
            subject: None,
            render: None,
            speed: Speed::default(),
            files: Files::new(),
            looked: Instant::now(),
            failure: None,
            said: String::new(),
            costs: BTreeMap::new(),
        }
    }

    /// Loads the scene and shows a first sketch; a failure is returned.
    pub fn begin(&mut self) -> Result<(), Failure> {
        match self.shared.wish_after(self.wish.0) {
            Some(wish) => self.fulfil(wish, false),
            None => Ok(()),
        }
    }

    /// Works until the program is stopped or no page is left.
    pub fn work(mut self) {
        while !self.stop.load(Ordering::Relaxed)
            && !self
                .linger
                .is_some_and(|linger| self.shared.is_abandoned(linger))
        {
            if let Some(wish) = self.shared.wish_after(self.wish.0) {
                self.try_to(|worker| worker.fulfil(wish, false));
            } else if let Some(job) = self.shared.take_job() {
                self.perform(job);
            } else if self.watches && self.have_files_changed() {
                let wish = self.wish.clone();
                self.try_to(|worker| worker.fulfil(wish, true));
            } else if !self.step() {
                self.shared.wait_for_work(self.wish.0, LOOK_EVERY);
            }
        }
    }

    /// Runs an operation; a failure is shown over the last picture.
    fn try_to(&mut self, what: impl FnOnce(&mut Self) -> Result<(), Failure>) {
        if let Err(failure) = what(self) {
            (self.failure, self.said) = (Some(failure.message), String::new());
            self.show(None);
        }
    }

    /// Applies a wish and shows a sketch; changed files are loaded again.
    fn fulfil(&mut self, (number, wish): (u64, Wish), anew: bool) -> Result<(), Failure> {
        let began = Instant::now();
        self.wish = (number, wish);
        let task = self.line.request(&self.wish.1.flags)?.task()?;
        let (scene, stop, threads) = (&self.scene, self.stop, &self.threads);
        let change = match &mut self.subject {
            Some(subject) if !anew => threads.run(|| subject.change(scene, task, stop))?,
            _ => {
                self.subject = Some(threads.run(|| Subject::read(scene, task, stop))?);
                Change::Reading
            }
        };
        self.failure = None;
        if change == Change::Reading {
            self.files = self
                .subject
                .as_ref()
                .map(Subject::files)
                .unwrap_or_default();
        }
        let took = spoken(began.elapsed().as_secs_f64());
        let is_same = change == Change::Display && !self.wish.1.anew && self.render.is_some();
        self.said = match change {
            Change::Display if is_same => "the same picture, shown anew".to_owned(),
            Change::Display => "rendered anew".to_owned(),
            Change::Camera => format!("the camera was turned in {took}"),
            Change::Preparation => format!("prepared anew in {took}"),
            Change::Reading => format!("read and prepared in {took}"),
        };
        let Some(subject) = &self.subject else {
            return Ok(());
        };
        if is_same
            && self.layer().is_none()
            && let Some(rendered) = self
                .render
                .as_mut()
                .and_then(|render| render.rendered.take())
        {
            self.show_rendered(rendered);
            return Ok(());
        }
        let mut render = match self.render.take().filter(|_| is_same) {
            Some(render) => render,
            None => LiveRender::new(&subject.ready),
        };
        let layers: Vec<Aov> = self.layer().into_iter().collect();
        let watch = WishWatch::new(&self.shared, stop, None);
        let (ready, speed) = (&subject.ready, &mut self.speed);
        let (sketch, edge) = threads.run(|| render.first_sketch(ready, &layers, speed, &watch));
        if !is_same {
            render.progress.first_ms = 1000.0 * began.elapsed().as_secs_f64();
        }
        self.render = Some(render);
        let frame = self.frame(&sketch, edge);
        self.show(Some(frame));
        Ok(())
    }

    /// First-hit layer displayed in place of the colours.
    fn layer(&self) -> Option<Aov> {
        layers::of_hits(&self.wish.1.layer)
    }

    /// Continues the picture; returns false where no work is left.
    fn step(&mut self) -> bool {
        let layers: Vec<Aov> = self.layer().into_iter().collect();
        let (Some(subject), Some(mut render)) = (&self.subject, self.render.take()) else {
            return false;
        };
        let (ready, wish, threads) = (&subject.ready, self.wish.0, &self.threads);
        let (shared, stop) = (&self.shared, self.stop);
        let watch = || WishWatch::new(shared, stop, Some(wish));
        // First-hit layers get finer sketches; colours soon have the render's own samples.
        if let Some((sketch, edge)) = threads.run(|| render.next_sketch(ready, &layers, &watch())) {
            self.render = Some(render);
            let frame = self.frame(&sketch, edge);
            self.show(Some(frame));
            return true;
        }
        if !render.has_more() {
            self.render = Some(render);
            return false;
        }
        let is_new = threads.run(|| render.step(ready, watch()));
        let rendered = render.rendered.take();
        self.render = Some(render);
        match rendered {
            Some(rendered) if is_new => self.show_rendered(rendered),
            rendered => {
                self.keep(rendered);
                self.show(None);
            }
        }
        true
    }

    fn keep(&mut self, rendered: Option<Rendered>) {
        if let Some(render) = &mut self.render {
            render.rendered = rendered;
        }
    }

    /// Shows the rendered picture and keeps it.
    fn show_rendered(&mut self, rendered: Rendered) {
        let is_done = self.render.as_ref().is_some_and(|render| render.is_done);
        if let Some(render) = self.render.as_mut().filter(|_| is_done) {
            render.progress.hash = Some(pixel_hash(rendered.shown()));
        }
        if let Some(subject) = self
            .subject
            .as_mut()
            .filter(|subject| subject.plan.is_exposed)
        {
            subject.plan.display = subject.plan.display.suited_to(rendered.shown());
        }
        // First-hit layers are already complete.
        let frame = if self.layer().is_some() {
            None
        } else {
            Some(self.frame(&rendered, 1))
        };
        self.keep(Some(rendered));
        self.show(frame);
    }

    /// Converts a picture for the page.
    fn frame(&self, rendered: &Rendered, edge: u32) -> Frame {
        let (picture, noisy) = (rendered.shown(), &rendered.picture);
        let film = self.render.as_ref().map(|render| &render.film);
        // A sketch has no error estimate.
        let film = film.filter(|film| {
            self.wish.1.layer == "stderr" && edge == 1 && film.size() == [noisy.width, noisy.height]
        });
        let display = self
            .subject
            .as_ref()
            .map(|subject| subject.plan.display)
            .unwrap_or_default();
        let layer = self.layer();
        let codes = self.threads.run(|| match (layer, film) {
            (Some(layer), _) => layers::hits(picture, layer),
            (None, Some(film)) => layers::errors(film, noisy),
            (None, None) => layers::colours(picture, display),
        });
        Frame {
            number: 0,
            size: [picture.width, picture.height],
            edge,
            codes,
        }
    }

    /// Publishes the status, with or without a new picture.
    fn show(&self, frame: Option<Frame>) {
        let (number, wish) = &self.wish;
        let phase = match &self.render {
            _ if self.failure.is_some() => "failed",
            Some(render) if render.is_done => "done",
            _ => "rendering",
        };
        let report = self.subject.as_ref().map(|subject| subject.ready.effects());
        let status = Status {
            told: 0,
            picture: 0,
            wish: *number,
            phase,
            failure: self.failure.clone(),
            said: self.said.clone(),
            command: self.line.text(&wish.flags),
            flags: wish.flags.clone(),
            layer: wish.layer.clone(),
            size: self
                .render
                .as_ref()
                .map(|render| render.film.size())
                .unwrap_or_default(),
            progress: self.render.as_ref().map(|render| render.progress.clone()),
            scene: self.subject.as_ref().map(SceneStatus::of),
            effects: report
                .map(|report| switches(report, &self.costs))
                .unwrap_or_default(),
        };
        self.shared.show(frame, |told, picture| {
            serde_json::to_string(&Status {
                told,
                picture,
                ..status
            })
            .unwrap_or_default()
        });
    }

    fn perform(&mut self, job: Job) {
        match job {
            // The receiver may have gone.
            Job::Save(wish, tell) => drop(tell.try_send(self.save(&wish))),
            Job::Measure => self.measure(),
        }
    }

    /// Saves the current picture.
    fn save(&mut self, wish: &SaveWish) -> (u16, String) {
        let (Some(subject), Some(render)) = (&self.subject, &self.render) else {
            return (503, "there is no picture yet".to_owned());
        };
        let own;
        let rendered = match &render.rendered {
            Some(rendered) => rendered,
            None => {
                own = Rendered::noisy(&render.film);
                &own
            }
        };
        if rendered.counters.samples == 0 {
            return (503, "there is no picture yet".to_owned());
        }
        let error = render
            .progress
            .error
            .as_ref()
            .filter(|_| subject.ready.follows_paths());
        let mut metadata = Metadata {
            command: self.line.text(&self.wish.1.flags),
            error: origin::error(error, rendered, &render.film),
            ..origin::metadata(&subject.loaded, &subject.plan, &subject.task.choices)
        };
        if !render.is_done {
            let [least, most] = render.progress.samples;
            metadata.settings =
                origin::with_samples(&metadata.settings, &format!("{least} to {most} samples"));
        }
        if !subject.task.has_metadata {
            metadata = Metadata::default();
        }
        let (display, inputs) = (subject.plan.display, &subject.loaded.inputs);
        self.threads
            .run(|| save::save(wish, rendered, display, &metadata, inputs))
    }

    /// Measures the costs of effects, unless a newer wish arrives.
    fn measure(&mut self) {
        let Some(subject) = &self.subject else { return };
        self.said = "measuring what effects cost".to_owned();
        self.show(None);
        let watch = WishWatch::new(&self.shared, self.stop, Some(self.wish.0));
        let mut steps = Steps::start(Verbosity::Quiet);
        let (scene, settings) = (&subject.loaded.scene, &subject.plan.settings);
        let measured = self
            .threads
            .run(|| measure_effects(scene, settings, MEASURING, &watch, &mut steps));
        self.said = match measured {
            Ok(costs) => {
                self.costs = costs
                    .effects
                    .iter()
                    .map(|cost| (cost.effect.to_owned(), cost.ratio.median - 1.0))
                    .collect();
                "measured what effects cost".to_owned()
            }
            Err(_) => "measuring was interrupted".to_owned(),
        };
        self.show(None);
    }

    /// Whether any file of the scene has changed.
    fn have_files_changed(&mut self) -> bool {
        if self.looked.elapsed() < LOOK_EVERY {
            return false;
        }
        self.looked = Instant::now();
        let Some(subject) = &self.subject else {
            return false;
        };
        let now = subject.files();
        let before = mem::replace(&mut self.files, now);
        before != self.files
    }
}
