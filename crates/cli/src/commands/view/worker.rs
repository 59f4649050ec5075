//! The viewer's computing thread. It takes a request of the page, shows a coarse preview, renders
//! until the picture is finished, and does jobs between two slices of the render.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::mem;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use raywright_core::RenderOutput;
use raywright_core::accuracy::measure_effects;
use raywright_core::settings::Aov;
use raywright_io::output::{PictureMetadata, pixel_hash};

use super::flags::ViewCommand;
use super::progress::{LiveRender, PreviewSpeed, RequestObserver};
use super::shared::{SaveRequest, SharedView, ViewFrame, ViewJob, ViewRequest};
use super::status::{SceneStatus, ViewStatus, list_effect_switches};
use super::viewed_scene::{FileStamps, SceneChange, ViewedScene};
use super::{layers, save};
use crate::clock::format_duration;
use crate::console::Verbosity;
use crate::failure::Failure;
use crate::origin;
use crate::progress::StepProgress;
use crate::threads::Threads;

/// Interval between checks for changed files and for open pages.
const CHECK_INTERVAL: Duration = Duration::from_millis(300);
/// Time limit for measuring the costs of effects.
const MEASURE_TIMEOUT: Duration = Duration::from_secs(20);

/// State of the viewer's computing thread.
pub struct ViewWorker {
    pub scene: OsString,
    pub command: ViewCommand,
    pub shared: Arc<SharedView>,
    pub threads: Threads,
    pub stop: &'static AtomicBool,
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
        threads: Threads,
        stop: &'static AtomicBool,
    ) -> Self {
        Self {
            scene,
            command: line,
            shared,
            threads,
            stop,
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
        while !self.stop.load(Ordering::Relaxed)
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
        let (scene, stop, threads) = (&self.scene, self.stop, &self.threads);
        let change = match &mut self.viewed_scene {
            Some(subject) if !anew => threads.run(|| subject.apply_task(scene, task, stop))?,
            _ => {
                self.viewed_scene = Some(threads.run(|| ViewedScene::load(scene, task, stop))?);
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
            SceneChange::Display if is_same => "shown without a new render".to_owned(),
            SceneChange::Display => "rendered again".to_owned(),
            SceneChange::Camera => format!("the camera was turned in {took}"),
            SceneChange::Preparation => format!("prepared again in {took}"),
            SceneChange::Reading => format!("loaded and prepared in {took}"),
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
        let watch = RequestObserver::new(&self.shared, stop, None);
        let (ready, speed) = (&subject.ready, &mut self.speed);
        let (sketch, edge) =
            threads.run(|| render.render_first_preview(ready, &layers, speed, &watch));
        if !is_same {
            render.progress.first_ms = 1000.0 * began.elapsed().as_secs_f64();
        }
        self.render = Some(render);
        let frame = self.encode_frame(&sketch, edge);
        self.publish_status(Some(frame));
        Ok(())
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
        let (ready, wish, threads) = (&subject.ready, self.view_request.0, &self.threads);
        let (shared, stop) = (&self.shared, self.stop);
        let watch = || RequestObserver::new(shared, stop, Some(wish));
        // Finer previews come before the first samples of the render.
        if let Some((sketch, edge)) =
            threads.run(|| render.render_next_preview(ready, &layers, &watch()))
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
        let is_new = threads.run(|| render.render_slice(ready, watch()));
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

    fn store_output(&mut self, rendered: Option<RenderOutput>) {
        if let Some(render) = &mut self.render {
            render.rendered = rendered;
        }
    }

    /// Publishes the rendered picture and keeps it for later requests.
    fn publish_output(&mut self, rendered: RenderOutput) {
        let is_done = self.render.as_ref().is_some_and(|render| render.is_done);
        if let Some(render) = self.render.as_mut().filter(|_| is_done) {
            render.progress.hash = Some(pixel_hash(rendered.final_picture()));
        }
        if let Some(subject) = self
            .viewed_scene
            .as_mut()
            .filter(|subject| subject.plan.has_auto_exposure)
        {
            subject.plan.display = subject
                .plan
                .display
                .with_suitable_exposure(rendered.final_picture());
        }
        // The preview has already shown a first-hit layer at full resolution.
        let frame = if self.shown_layer().is_some() {
            None
        } else {
            Some(self.encode_frame(&rendered, 1))
        };
        self.store_output(Some(rendered));
        self.publish_status(frame);
    }

    /// Converts a picture or preview to 8-bit codes for the page. `edge` is the edge of its pixels.
    fn encode_frame(&self, rendered: &RenderOutput, edge: u32) -> ViewFrame {
        let (picture, noisy) = (rendered.final_picture(), &rendered.picture);
        let film = self.render.as_ref().map(|render| &render.film);
        // A preview has no samples in the film, and so no standard errors.
        let film = film.filter(|film| {
            self.view_request.1.layer == "stderr"
                && edge == 1
                && film.size() == [noisy.width, noisy.height]
        });
        let display = self
            .viewed_scene
            .as_ref()
            .map(|subject| subject.plan.display)
            .unwrap_or_default();
        let layer = self.shown_layer();
        let codes = self.threads.run(|| match (layer, film) {
            (Some(layer), _) => layers::encode_layer(picture, layer),
            (None, Some(film)) => layers::encode_errors(film, noisy),
            (None, None) => layers::encode_colours(picture, display),
        });
        ViewFrame {
            number: 0,
            size: [picture.width, picture.height],
            edge,
            codes,
        }
    }

    /// Publishes the status, and a new picture if given.
    fn publish_status(&self, frame: Option<ViewFrame>) {
        let (number, view_request) = &self.view_request;
        let phase = match &self.render {
            _ if self.failure.is_some() => "failed",
            Some(render) if render.is_done => "done",
            _ => "rendering",
        };
        let report = self
            .viewed_scene
            .as_ref()
            .map(|subject| subject.ready.effects());
        let status = ViewStatus {
            told: 0,
            picture: 0,
            wish: *number,
            phase,
            failure: self.failure.clone(),
            said: self.message.clone(),
            command: self.command.to_shell_text(&view_request.flags),
            flags: view_request.flags.clone(),
            layer: view_request.layer.clone(),
            size: self
                .render
                .as_ref()
                .map(|render| render.film.size())
                .unwrap_or_default(),
            progress: self.render.as_ref().map(|render| render.progress.clone()),
            scene: self.viewed_scene.as_ref().map(SceneStatus::from_scene),
            effects: report
                .map(|report| list_effect_switches(report, &self.costs))
                .unwrap_or_default(),
        };
        self.shared
            .publish_frame_and_status(frame, |reported, picture| {
                serde_json::to_string(&ViewStatus {
                    told: reported,
                    picture,
                    ..status
                })
                .unwrap_or_default()
            });
    }

    fn run_job(&mut self, job: ViewJob) {
        match job {
            // The thread that waits for the result may have ended.
            ViewJob::Save(view_request, tell) => {
                drop(tell.try_send(self.save_picture(&view_request)))
            }
            ViewJob::Measure => self.measure_effect_costs(),
        }
    }

    /// Saves the current picture under the name that the page gave. Returns an HTTP status and a
    /// message.
    fn save_picture(&mut self, view_request: &SaveRequest) -> (u16, String) {
        let (Some(subject), Some(render)) = (&self.viewed_scene, &self.render) else {
            return (503, "there is no picture yet".to_owned());
        };
        let own;
        let rendered = match &render.rendered {
            Some(rendered) => rendered,
            None => {
                own = RenderOutput::from_film_without_denoising(&render.film);
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
            .filter(|_| subject.ready.is_path_traced());
        let mut metadata = PictureMetadata {
            command: self.command.to_shell_text(&self.view_request.1.flags),
            error: origin::format_error_metadata(error, rendered, &render.film),
            ..origin::picture_metadata(&subject.loaded, &subject.plan, &subject.task.choices)
        };
        if !render.is_done {
            let [minimum, maximum] = render.progress.samples;
            metadata.settings = origin::replace_sample_count(
                &metadata.settings,
                &format!("{minimum} to {maximum} samples"),
            );
        }
        if !subject.task.has_metadata {
            metadata = PictureMetadata::default();
        }
        let (display, inputs) = (subject.plan.display, &subject.loaded.inputs);
        self.threads
            .run(|| save::save_picture(view_request, rendered, display, &metadata, inputs))
    }

    /// Measures the costs of effects. A newer request or job ends the measurement.
    fn measure_effect_costs(&mut self) {
        let Some(subject) = &self.viewed_scene else {
            return;
        };
        self.message = "measuring the costs of effects".to_owned();
        self.publish_status(None);
        let watch = RequestObserver::new(&self.shared, self.stop, Some(self.view_request.0));
        let mut steps = StepProgress::start(Verbosity::Quiet);
        let (scene, settings) = (&subject.loaded.scene, &subject.plan.settings);
        let measured = self
            .threads
            .run(|| measure_effects(scene, settings, MEASURE_TIMEOUT, &watch, &mut steps));
        self.message = match measured {
            Ok(costs) => {
                self.costs = costs
                    .effects
                    .iter()
                    .map(|cost| (cost.effect.to_owned(), cost.ratio.median - 1.0))
                    .collect();
                "measured the costs of effects".to_owned()
            }
            Err(_) => "measuring was interrupted".to_owned(),
        };
        self.publish_status(None);
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
