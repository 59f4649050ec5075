//! The viewer's computing thread. It takes a request of the page, shows a coarse preview, renders
//! until the picture is finished, and does jobs between two slices of the render: saving the picture
//! under a name from the page, by the rules of every other output, and measuring the costs of effects.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::mem;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use raywright_core::RenderOutput;
use raywright_core::denoise::sketch;
use raywright_core::display::Display;
use raywright_core::effect_costs::measure_effects;
use raywright_core::film::Film;
use raywright_core::settings::Aov;
use raywright_io::InputFiles;
use raywright_io::output::{
    PictureFormat, PictureMetadata, pixel_hash, write_new_picture, write_picture_as,
};
use raywright_io::report::format_duration;
use serde_json::json;

use crate::commands::render::write;
use crate::commands::view::flags::ViewCommand;
use crate::commands::view::layers;
use crate::commands::view::progress::{LiveRender, LoadObserver, PreviewSpeed, RequestObserver};
use crate::commands::view::shared::{SaveRequest, SharedView, ViewFrame, ViewJob, ViewRequest};
use crate::commands::view::status::{list_effect_switches, scene_status};
use crate::commands::view::viewed_scene::{FileStamps, SceneChange, ViewedScene};
use crate::failure::Failure;
use crate::origin;
use crate::session::Session;
use crate::targets::OutputFiles;

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

    /// Loads the scene, and sends a message once it is loaded. Then serves requests and jobs and
    /// renders, until the program is stopped or no page has been open for the time `linger`.
    ///
    /// The failure of a scene that cannot be loaded at the start.
    pub fn run(mut self, loaded: &SyncSender<()>) -> Result<(), Failure> {
        if let Some(request) = self.shared.request_newer_than(0) {
            self.view_request = request.clone();
            self.publish_status(None);
            if let Err(failure) = self.apply_request(request, false) {
                self.failure = Some(failure.message.clone());
                self.publish_status(None);
                return Err(failure);
            }
        }
        // The other thread has ended if it could not print the address.
        let _ = loaded.try_send(());
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
        Ok(())
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
        let watch = LoadObserver::new(&self.shared, session.observer(), number);
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
        let watch = RequestObserver::new(&self.shared, session.observer(), None);
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
        let (Some(subject), Some(mut render)) = (&mut self.viewed_scene, self.render.take()) else {
            return false;
        };
        let session = &self.session;
        let request = Some(self.view_request.0);
        let observer = || RequestObserver::new(&self.shared, session.observer(), request);
        // Finer previews come before the first samples of the render.
        if let Some((sketch, edge)) =
            session.run(|| render.render_next_preview(&subject.ready, &layers, &observer()))
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
        // Only a newer request ends the search for openings.
        if !session.run(|| subject.complete_preparation(&observer())) {
            self.render = Some(render);
            return true;
        }
        let is_new = session.run(|| render.render_slice(&subject.ready, observer()));
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

/// Time limit for measuring the costs of effects.
const MEASURE_TIMEOUT: Duration = Duration::from_secs(20);

impl ViewWorker {
    /// Does a job, and sends its result to the thread that waits for it.
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
        if !subject.task.files.has_metadata {
            metadata = PictureMetadata::default();
        }
        let (display, inputs) = (subject.plan.display, &subject.loaded.inputs);
        self.session
            .run(|| save_picture(view_request, rendered, display, &metadata, inputs))
    }

    /// Measures the costs of effects. A newer request or job ends the measurement.
    fn measure_effect_costs(&mut self) {
        let Some(subject) = &self.viewed_scene else {
            return;
        };
        self.message = "measuring the costs of effects".to_owned();
        self.publish_status(None);
        let watch = self.request_observer();
        let (scene, settings) = (&subject.loaded.scene, &subject.plan.settings);
        let measured = self
            .session
            .run(|| measure_effects(scene, settings, MEASURE_TIMEOUT, &watch, &mut |_, _| ()));
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
}

impl ViewWorker {
    /// Publishes the rendered picture and keeps it for later requests.
    fn publish_output(&mut self, rendered: RenderOutput) {
        let is_done = self.render.as_ref().is_some_and(|render| render.is_done);
        if let Some(render) = self.render.as_mut().filter(|_| is_done) {
            render.progress.hash = Some(pixel_hash(rendered.final_picture()));
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

    /// Keeps a rendered picture for later requests; `None` leaves no picture.
    fn store_output(&mut self, rendered: Option<RenderOutput>) {
        if let Some(render) = &mut self.render {
            render.rendered = rendered;
        }
    }

    /// Converts a picture or preview to 8-bit codes for the page. `edge` is the edge of its pixels.
    fn encode_frame(&self, rendered: &RenderOutput, edge: u32) -> ViewFrame {
        let film = self.render.as_ref().map(|render| &render.film);
        // A stage with too few samples to be denoised, and so without a claim, is filtered too.
        let own;
        let is_noisy = |film: &&Film| {
            edge == 1
                && film.is_to_be_denoised()
                && rendered.denoised.as_ref().is_some_and(Result::is_err)
        };
        let noisy = &rendered.picture;
        let picture = match film
            .filter(is_noisy)
            .and_then(|film| self.session.run(|| sketch(film)))
        {
            Some(picture) => {
                own = picture;
                &own
            }
            None => rendered.final_picture(),
        };
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
        let codes = self.session.run(|| match (layer, film) {
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

    /// Publishes the status, and a picture where one is given. The page's script reads the status by
    /// these names: `number` rises with each status, `request` is the number of the page's request
    /// that the status belongs to, `failure` the message that the page shows over the last picture,
    /// `message` the work done for the request, `picture` the number of the displayed picture.
    fn publish_status(&self, frame: Option<ViewFrame>) {
        let (request, view_request) = &self.view_request;
        let phase = match &self.render {
            _ if self.failure.is_some() => "failed",
            None => "loading",
            Some(render) if render.is_done => "done",
            Some(_) => "rendering",
        };
        let subject = self.viewed_scene.as_ref();
        let effects =
            subject.map(|subject| list_effect_switches(subject.ready.effects(), &self.costs));
        let render = self.render.as_ref();
        let status = json!({
            "request": request,
            "phase": phase,
            "failure": self.failure,
            "message": self.message,
            "command": self.command.to_shell_text(&view_request.flags),
            "flags": view_request.flags,
            "layer": view_request.layer,
            "size": render.map_or([0; 2], |render| render.film.size()),
            "progress": render.map(|render| &render.progress),
            "scene": subject.map(scene_status),
            "effects": effects.unwrap_or_default(),
        });
        self.shared.publish_frame_and_status(frame, status);
    }
}

/// Writes the picture under the requested name. Returns an HTTP status and a message for the page.
pub fn save_picture(
    view_request: &SaveRequest,
    rendered: &RenderOutput,
    display: Display,
    metadata: &PictureMetadata,
    inputs: &InputFiles,
) -> (u16, String) {
    let Some(path) = parse_plain_name(&view_request.name) else {
        return (
            400,
            "give a file name without a folder, such as picture.png".to_owned(),
        );
    };
    let refused = |failure: Failure| (400, failure.message);
    let format = match PictureFormat::from_path(&path) {
        Ok(format) => format,
        Err(error) => return refused(error.into()),
    };
    let mut outputs = OutputFiles::default();
    if let Err(failure) = outputs
        .add_output(&path, "another name")
        .and_then(|()| outputs.check_against_inputs(inputs))
    {
        return refused(failure);
    }
    let name = view_request.name.as_str();
    match path.symlink_metadata() {
        Ok(other_metadata) if !other_metadata.is_file() => {
            return (
                400,
                format!(
                    "{name} is a folder, a link or a device, which is not replaced; choose another name"
                ),
            );
        }
        Ok(_) if !view_request.replace => return (409, format!("{name} exists already")),
        _ => {}
    }
    let picture = write::select_picture_for_format(rendered, format, display);
    let written = match view_request.replace {
        true => write_picture_as(&path, format, &picture, display, metadata),
        // A file created after the check is not replaced.
        false => {
            let is_free = |other: &Path| other == path && other.symlink_metadata().is_err();
            write_new_picture(&path, &picture, display, metadata, is_free).map(|_| ())
        }
    };
    match written {
        Ok(()) => (200, format!("wrote {name}")),
        Err(error) => (400, error.to_string()),
    }
}

/// Returns the path of a file name in the working folder. `None` for a name with a folder, and for
/// a name that is invalid on some system.
fn parse_plain_name(name: &str) -> Option<PathBuf> {
    let is_odd = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    if name.len() > 200 || name.starts_with(['.', '-', '~']) || name.contains(is_odd) {
        return None;
    }
    let path = PathBuf::from(name);
    let mut parts = path.components();
    let is_plain = matches!(
        (parts.next(), parts.next()),
        (Some(Component::Normal(_)), None)
    );
    is_plain.then_some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: no name leads outside the working folder, to a hidden file or to a device.
    #[test]
    fn names_have_no_folder() {
        for name in [
            "", ".", "..", "../a.png", "/a.png", "a/b.png", r"a\b.png", "c:a.png", ".a.png",
            "-a.png", "a\n.png", "~a.png",
        ] {
            assert_eq!(parse_plain_name(name), None, "{name}");
        }
        assert_eq!(
            parse_plain_name("a b-1.png"),
            Some(PathBuf::from("a b-1.png"))
        );
        assert_eq!(parse_plain_name(&"a".repeat(201)), None);
    }
}
