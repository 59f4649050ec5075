//! One picture of a run: rendered, written to its files, and counted in the messages of the run.

use raywright_core::denoise::DenoiseError;
use raywright_core::film::Uncertainty;
use raywright_core::{ReadyScene, RenderOutput};
use raywright_io::LoadedScene;
use raywright_io::output::{PictureMetadata, write_atomically};

use super::super::film::FilmRender;
use super::super::{self as render, RenderedPicture, messages, write};
use super::{PictureSeries, SceneAtTime};
use crate::commands::films;
use crate::failure::{Exit, Failure};
use crate::plan::{PictureJob, PicturePlan, RenderTask, choose_exposure};
use crate::session::StageSeconds;
use crate::stats::render_stats;
use crate::{console, scene_input};

/// A rendered picture of a series, before it is written.
struct RenderedFrame<'a> {
    /// Index of the picture in the run.
    number: usize,
    /// Label of the picture in a contact sheet.
    caption: String,
    plan: PicturePlan,
    film_render: FilmRender<'a>,
    rendered: RenderOutput,
    /// Estimated error of the picture before denoising.
    noisy: Option<Uncertainty>,
    /// Wall-clock seconds of the stages of the run so far.
    seconds: StageSeconds,
}

impl RenderedFrame<'_> {
    /// Whether the render or the denoising was interrupted.
    fn is_interrupted(&self) -> bool {
        !self.film_render.is_done()
            || matches!(self.rendered.denoised, Some(Err(DenoiseError::Cancelled)))
    }

    /// Returns the picture with its scene, for messages and files.
    fn picture<'b>(
        &'b self,
        task: &'b RenderTask,
        (loaded, ready): (&'b LoadedScene, &'b ReadyScene),
    ) -> RenderedPicture<'b> {
        RenderedPicture {
            task,
            loaded,
            ready,
            plan: &self.plan,
            film: self.film_render.film(),
            rendered: &self.rendered,
            noisy: self.noisy,
        }
    }
}

impl<'a> PictureSeries<'a> {
    /// Renders a picture and writes it. `number` is the index of the picture in the run.
    pub(super) fn render_job(
        &mut self,
        number: usize,
        moment: &mut SceneAtTime,
    ) -> Result<(), Failure> {
        let task = self.task;
        let job = &task.jobs[number];
        let mut plan = task.resolve_job(&mut moment.loaded, job, &moment.silhouette)?;
        let load = self.session.clock.lap();
        self.prepare_picture(&plan, moment)?;
        let prepare = self.session.clock.lap();
        let SceneAtTime {
            loaded,
            ready: Some(ready),
            ..
        } = moment
        else {
            return Ok(());
        };
        self.backdrop = self.backdrop.or(ready.studio_backdrop_radiance());
        self.refuse_empty_view(loaded, ready, &plan)?;
        self.expose_picture((loaded, ready), &mut plan);
        let notes = &mut self.session.notes;
        render::note_preparation(loaded, ready, notes);
        render::refuse_impossible_denoising(task, ready, notes)?;
        let options = self.job_load_options(job);
        let film_render = FilmRender::start(task, &options, (loaded, ready), (&plan, &job.label))?;
        let film_render = self.render_film(film_render, ready)?;
        let (rendered, noisy) = self.develop_film(&film_render);
        let [render, render_cpu] = self.session.clock.lap_with_cpu();
        let frame = RenderedFrame {
            number,
            caption: self.format_caption(job, &loaded.source.stem),
            plan,
            film_render,
            rendered,
            noisy,
            seconds: StageSeconds {
                load,
                prepare,
                render,
                render_cpu,
                ..StageSeconds::default()
            },
        };
        self.finish_frame(frame, (loaded, ready))
    }

    /// Prepares the scene for a picture. An interruption keeps the unfinished sheet and animations
    /// in files.
    fn prepare_picture(
        &mut self,
        plan: &PicturePlan,
        moment: &mut SceneAtTime,
    ) -> Result<(), Failure> {
        match moment.prepare_picture(plan, &self.session) {
            Err(failure) if failure.exit == Exit::Interrupted && !self.task.is_single => {
                let free = self.session.outputs.beside(&moment.loaded.inputs);
                let kept = self.combined_files.write_partial_files(free);
                Err(write::interrupted_failure(kept, self.counts()))
            }
            prepared => prepared,
        }
    }

    /// Renders the samples of a picture's film, and ends the run's early stage before.
    fn render_film(
        &mut self,
        mut film_render: FilmRender<'a>,
        ready: &ReadyScene,
    ) -> Result<FilmRender<'a>, Failure> {
        if self.session.end_early_stage() {
            self.progress.restart_clock();
        }
        let (session, progress) = (&self.session, &self.progress);
        session.run(|| film_render.render(ready, progress, session))?;
        if self.task.is_single {
            self.progress.finish();
        }
        film_render.note_exceeded_budget(&mut self.session);
        Ok(film_render)
    }

    /// Returns the picture of a film, denoised where requested, and its estimated error before
    /// denoising.
    fn develop_film(&self, film_render: &FilmRender<'_>) -> (RenderOutput, Option<Uncertainty>) {
        // A run of several pictures has a single progress display, without a display for each
        // picture.
        let verbosity = if self.task.is_single {
            self.session.verbosity
        } else {
            console::Verbosity::Quiet
        };
        let film = film_render.film();
        self.session.run(|| {
            let (display, watch) = (
                (self.task.report.progress, verbosity),
                self.session.observer(),
            );
            let rendered = films::denoise_with_progress(film, display, watch);
            let noisy = rendered.error_before_denoising(film);
            (rendered, noisy)
        })
    }

    /// Formats the label of a picture in a contact sheet: the caption of its shot, and in a run of
    /// several scenes the name of its scene before.
    fn format_caption(&self, job: &PictureJob, scene: &str) -> String {
        match (self.inputs.len(), job.caption.as_str()) {
            (_, "") => scene.to_owned(),
            (1, caption) => caption.to_owned(),
            (_, caption) => format!("{scene} {caption}"),
        }
    }

    /// Returns the number of finished pictures and of all pictures, if the run has several.
    fn counts(&self) -> Option<[usize; 2]> {
        (!self.task.is_single).then_some([self.summary.finished, self.task.jobs.len()])
    }

    /// Writes a picture, finished or interrupted, and records its messages.
    fn finish_frame(
        &mut self,
        mut frame: RenderedFrame<'_>,
        (loaded, ready): (&mut LoadedScene, &ReadyScene),
    ) -> Result<(), Failure> {
        if frame.film_render.is_done() {
            self.refuse_empty_picture(loaded, &frame.rendered, &frame.plan)?;
        }
        let origin = frame.film_render.metadata().clone();
        let picture = frame.picture(self.task, (loaded, ready));
        let metadata = picture.metadata(origin);
        let free = self.session.outputs.beside(&loaded.inputs);
        frame.film_render.keep_unwritten_film(free);
        if frame.is_interrupted() {
            return Err(self.keep_interrupted_frame(&frame, &metadata, loaded));
        }
        if let Err(failure) = self.write_frame(&frame, &metadata, loaded) {
            return Err(failure.with_failure(frame.film_render.into_checkpoint_failure()));
        }
        let clock = &mut self.session.clock;
        (frame.seconds.write, frame.seconds.total) = (clock.lap(), clock.total_seconds());
        let lost = frame.rendered.counters.faults();
        let lost = messages::note_faults(lost, &loaded.scene, &mut self.session.notes);
        loaded.warnings.extend(lost);
        if let Some(path) = &self.task.report.stats {
            let measured = (&frame.rendered, frame.noisy);
            let stats = render_stats((loaded, ready), measured, frame.seconds);
            write_atomically(path, console::format_json(&stats).as_bytes())?;
        }
        self.report_frame(&frame, (loaded, ready));
        self.summary.finished += 1;
        self.progress.finish_work_piece();
        self.summary.checkpoint_failure = frame.film_render.into_checkpoint_failure();
        Ok(())
    }

    /// Writes what is rendered of an interrupted picture, and the unfinished sheet and animations,
    /// to partial files. Returns the failure that names these files.
    fn keep_interrupted_frame(
        &mut self,
        frame: &RenderedFrame<'_>,
        metadata: &PictureMetadata,
        loaded: &LoadedScene,
    ) -> Failure {
        let (targets, display) = (&self.targets[frame.number], frame.plan.display);
        let free = self.session.outputs.beside(&loaded.inputs);
        let own = write::write_partial_picture(&frame.rendered, targets, display, metadata, free);
        let film_render = &frame.film_render;
        let kept = own.and_then(|own| {
            let files = [own, self.combined_files.write_partial_files(free)?].concat();
            Ok(film_render.with_checkpoint_path(files))
        });
        film_render.with_resume_hint(write::interrupted_failure(kept, self.counts()))
    }

    /// Writes a finished picture to its files, prints the hash of its pixels where requested, and
    /// adds the picture to the sheet and the animations.
    fn write_frame(
        &mut self,
        frame: &RenderedFrame<'_>,
        metadata: &PictureMetadata,
        loaded: &LoadedScene,
    ) -> Result<(), Failure> {
        let (rendered, display) = (&frame.rendered, frame.plan.display);
        let targets = &self.targets[frame.number];
        let free = self.session.outputs.beside(&loaded.inputs);
        let names = write::write_targets(rendered, targets, display, metadata, free)?;
        render::print_pixel_hash(self.task, (rendered, display), &names, &frame.caption)?;
        self.summary
            .written_files
            .push(frame.film_render.with_checkpoint_path(names));
        self.combined_files
            .add_picture(rendered.final_picture(), display, &frame.caption)
    }

    /// Records the notes about a written picture, and its part in the final message of the run.
    fn report_frame(
        &mut self,
        frame: &RenderedFrame<'_>,
        (loaded, ready): (&LoadedScene, &ReadyScene),
    ) {
        let picture = frame.picture(self.task, (loaded, ready));
        let (settings, notes) = (&frame.plan.settings, &mut self.session.notes);
        let error = picture.add_notes(&self.targets[frame.number], notes);
        let error = error.map(|error| format!(", {error}")).unwrap_or_default();
        if let Some(noisy) = picture
            .reported_error()
            .filter(|_| !self.task.keeps_noise())
        {
            messages::note_denoising(noisy, settings, notes);
        }
        let [width, height] = settings
            .crop
            .map_or(settings.size, |crop| [crop.width, crop.height]);
        let samples = frame.film_render.format_samples();
        let described = format!("{width}x{height}, {samples}");
        self.summary.description = [format!("{described}{error}"), described];
        self.summary.shortfalls.extend(picture.describe_shortfall());
        if self.task.is_single {
            let details = messages::format_details(ready, &frame.rendered, &frame.seconds);
            notes.print_detail(details.trim_end());
        }
        let error = picture.shown_error().filter(|_| ready.is_path_traced());
        let error = error.map(|error| error.root_relmse.value);
        self.summary.error = self.summary.error.into_iter().chain(error).reduce(f64::max);
    }

    /// Refuses a picture that shows no object before it is written, if its scene has no other
    /// picture.
    fn refuse_empty_picture(
        &mut self,
        loaded: &LoadedScene,
        rendered: &RenderOutput,
        plan: &PicturePlan,
    ) -> Result<(), Failure> {
        let reason = scene_input::describe_empty_picture(loaded, rendered, &plan.settings);
        self.shows_object |= reason.is_none();
        render::refuse_empty_picture(
            self.task,
            loaded,
            reason.filter(|_| self.task.pictures_per_scene() == 1),
        )
    }

    /// Refuses a view that shows no object before its render, judged by a coarse picture and, if
    /// that is empty, by a few samples a pixel.
    fn refuse_empty_view(
        &mut self,
        loaded: &LoadedScene,
        ready: &ReadyScene,
        plan: &PicturePlan,
    ) -> Result<(), Failure> {
        if self.task.pictures_per_scene() > 1
            || !self.task.refuses_empty_pictures()
            || self.task.film.resume.is_some()
        {
            return Ok(());
        }
        let watch = self.session.observer();
        match self.session.run(|| ready.look_for_objects(&watch)) {
            (rendered, true) => self.refuse_empty_picture(loaded, &rendered, plan),
            _ => Ok(()),
        }
    }

    /// Chooses the exposure of a scene's first picture, and applies it to each of its pictures.
    fn expose_picture(
        &mut self,
        (loaded, ready): (&LoadedScene, &mut ReadyScene),
        plan: &mut PicturePlan,
    ) {
        let requested = (plan.display, plan.requested_exposure);
        let watch = self.session.observer();
        let choose = || choose_exposure(loaded, ready, requested, &watch);
        let chosen = self.exposure.unwrap_or_else(|| self.session.run(choose));
        self.exposure = Some(chosen);
        plan.apply_exposure(chosen, ready);
        let notes = &mut self.session.notes;
        messages::note_chosen_exposure(chosen, notes);
        messages::note_stray_parts(plan, notes);
    }
}
