//! The viewer's computing thread. It takes a request of the page, shows a coarse preview, renders
//! until the picture is finished, and does jobs between two slices of the render.

mod jobs;
mod publish;

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::mem;
use std::sync::Arc;
use std::time::{Duration, Instant};

use raywright_core::settings::Aov;
use raywright_io::report::format_duration;

use super::flags::ViewCommand;
use super::layers;
use super::progress::{LiveRender, PreviewSpeed, RequestObserver};
use super::shared::{SharedView, ViewRequest};
use super::viewed_scene::{FileStamps, SceneChange, ViewedScene};
use crate::failure::Failure;
use crate::session::Session;

/// Interval between checks for changed files and for open pages.
const CHECK_INTERVAL: Duration = Duration::from_millis(300);

/// State of the viewer's computing thread.
pub struct ViewWorker {
    pub scene: OsString,
    pub command: ViewCommand,
    pub shared: Arc<SharedView>,
    pub session: Session,
    /// Whether the scene is rendered again when its files change.
    pub watches_files: bool,
    /// Time without an open page after which the program ends; `None`: never.
    pub linger: Option<Duration>,
    /// Number of the request that is served, and the request.
    view_request: (u64, ViewRequest),
    /// The scene; `None` before the first load.
    viewed_scene: Option<ViewedScene>,
    /// The current render, if any.
    render: Option<LiveRender>,
    speed: PreviewSpeed,
    /// Modification times and lengths of the scene's files at the last check.
    files: FileStamps,
    last_file_check: Instant,
    /// Message of the last failure, which the page shows; `None` after a success.
    failure: Option<String>,
    /// Description of the work done for the request, and its duration.
    message: String,
    /// Additional time of each measured effect, by the effect's name, as a share of the time
    /// without the effect.
    costs: BTreeMap<String, f64>,
}

impl ViewWorker {
    /// Creates the state before the scene is loaded.
    pub fn new(
        scene: OsString,
        line: ViewCommand,
        shared: Arc<SharedView>,
        session: Session,
    ) -> Self {
        Self {
            scene,
            command: line,
            shared,
            session,
            watches_files: false,
            linger: None,
            view_request: Default::default(),
            viewed_scene: None,
            render: None,
            speed: PreviewSpeed::default(),
            files: FileStamps::new(),
            last_file_check: Instant::now(),
            failure: None,
            message: String::new(),
            costs: BTreeMap::new(),
        }
    }

    /// Loads the scene and shows a first preview. Called before the page is served, so that the
    /// program ends with the failure of a scene that cannot be loaded.
    pub fn load_and_preview_scene(&mut self) -> Result<(), Failure> {
        match self.shared.request_newer_than(self.view_request.0) {
            Some(view_request) => self.apply_request(view_request, false),
            None => Ok(()),
        }
    }

    /// Serves requests and jobs and renders, until the program is stopped or no page has been open
    /// for the time `linger`.
    pub fn run(mut self) {
        while !self.session.is_stopped()
            && !self
                .linger
                .is_some_and(|linger| self.shared.is_abandoned(linger))
        {
            if let Some(view_request) = self.shared.request_newer_than(self.view_request.0) {
                self.run_or_show_failure(|worker| worker.apply_request(view_request, false));
            } else if let Some(job) = self.shared.take_job() {
                self.run_job(job);
            } else if self.watches_files && self.have_files_changed() {
                let view_request = self.view_request.clone();
                self.run_or_show_failure(|worker| worker.apply_request(view_request, true));
            } else if !self.continue_render() {
                self.shared
                    .wait_for_work(self.view_request.0, CHECK_INTERVAL);
            }
        }
    }

    /// Runs an operation. The page shows the message of a failure over the last picture.
    fn run_or_show_failure(&mut self, describe: impl FnOnce(&mut Self) -> Result<(), Failure>) {
        if let Err(failure) = describe(self) {
            (self.failure, self.message) = (Some(failure.message), String::new());
            self.publish_status(None);
        }
    }

    /// Applies a request of the page and shows a first preview. If `anew` is true, the scene's
    /// files are loaded again, although no load option changed.
    fn apply_request(
        &mut self,
        (number, view_request): (u64, ViewRequest),
        anew: bool,
    ) -> Result<(), Failure> {
        let began = Instant::now();
        self.view_request = (number, view_request);
        let task = self
            .command
            .parse_render_command(&self.view_request.1.flags)?
            .resolve_render_task()?;
        let (scene, session) = (&self.scene, &self.session);
        let watch = session.observer();
        let change = match &mut self.viewed_scene {
            Some(subject) if !anew => session.run(|| subject.apply_task(scene, task, &watch))?,
            _ => {
                self.viewed_scene = Some(session.run(|| ViewedScene::load(scene, task, &watch))?);
                SceneChange::Reading
            }
        };
        self.failure = None;
        if change == SceneChange::Reading {
            self.files = self
                .viewed_scene
                .as_ref()
                .map(ViewedScene::file_stamps)
                .unwrap_or_default();
        }
        let took = format_duration(began.elapsed().as_secs_f64());
        let is_same =
            change == SceneChange::Display && !self.view_request.1.anew && self.render.is_some();
        self.message = match change {
            SceneChange::Display if is_same => {
                "the change was shown without a new render".to_owned()
            }
            SceneChange::Display => "rendered again".to_owned(),
            SceneChange::Camera => format!("the new camera was set in {took}"),
            SceneChange::Preparation => format!("prepared again in {took}"),
            SceneChange::Reading => format!("the scene was loaded and prepared in {took}"),
        };
        let Some(subject) = &self.viewed_scene else {
            return Ok(());
        };
        if is_same
            && self.shown_layer().is_none()
            && let Some(rendered) = self
                .render
                .as_mut()
                .and_then(|render| render.rendered.take())
        {
            self.publish_output(rendered);
            return Ok(());
        }
        let mut render = match self.render.take().filter(|_| is_same) {
            Some(render) => render,
            None => LiveRender::new(&subject.ready),
        };
        let layers: Vec<Aov> = self.shown_layer().into_iter().collect();
        let watch = RequestObserver::new(&self.shared, watch, None);
        let (ready, speed) = (&subject.ready, &mut self.speed);
        let (sketch, edge) =
            session.run(|| render.render_first_preview(ready, &layers, speed, &watch));
        if !is_same {
            render.progress.first_ms = 1000.0 * began.elapsed().as_secs_f64();
        }
        self.render = Some(render);
        let frame = self.encode_frame(&sketch, edge);
        self.publish_status(Some(frame));
        Ok(())
    }

    /// Returns an observer that stops its work for a newer request or a job too.
    fn request_observer(&self) -> RequestObserver<'_> {
        let request = Some(self.view_request.0);
        RequestObserver::new(&self.shared, self.session.observer(), request)
    }

    /// Returns the first-hit layer that the page shows in place of colours, if any.
    fn shown_layer(&self) -> Option<Aov> {
        layers::first_hit_layer(&self.view_request.1.layer)
    }

    /// Renders the next preview, or the picture for a short time (a slice). Returns false if the
    /// picture is finished.
    fn continue_render(&mut self) -> bool {
        let layers: Vec<Aov> = self.shown_layer().into_iter().collect();
        let (Some(subject), Some(mut render)) = (&self.viewed_scene, self.render.take()) else {
            return false;
        };
        let (ready, session) = (&subject.ready, &self.session);
        let watch = self.request_observer();
        // Finer previews come before the first samples of the render.
        if let Some((sketch, edge)) =
            session.run(|| render.render_next_preview(ready, &layers, &watch))
        {
            self.render = Some(render);
            let frame = self.encode_frame(&sketch, edge);
            self.publish_status(Some(frame));
            return true;
        }
        if !render.is_unfinished() {
            self.render = Some(render);
            return false;
        }
        let watch = self.request_observer();
        let is_new = session.run(|| render.render_slice(ready, watch));
        let rendered = render.rendered.take();
        self.render = Some(render);
        match rendered {
            Some(rendered) if is_new => self.publish_output(rendered),
            rendered => {
                self.store_output(rendered);
                self.publish_status(None);
            }
        }
        true
    }

    /// Whether a file of the scene has changed since the last check; at most one check per
    /// interval.
    fn have_files_changed(&mut self) -> bool {
        if self.last_file_check.elapsed() < CHECK_INTERVAL {
            return false;
        }
        self.last_file_check = Instant::now();
        let Some(subject) = &self.viewed_scene else {
            return false;
        };
        let now = subject.file_stamps();
        let before = mem::replace(&mut self.files, now);
        before != self.files
    }
}
