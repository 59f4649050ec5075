//! `merge` joins the parts of a picture, rendered separately, to the picture of a single run;
//! `denoise` filters the noise out of the picture of a film file. Both write the picture of films in
//! the same way.

use std::path::{Path, PathBuf};
use std::slice;

use raywright_core::denoise::{DenoiseError, denoise};
use raywright_core::film::{Film, FilmMergeError};
use raywright_core::scene::Scene;
use raywright_core::{Observer, RenderOutput};
use raywright_io::output::StoredFilm;
use raywright_io::report::{format_count, format_duration};
use raywright_io::{Error, InputFiles, Limits};

use crate::args::{DenoiseArgs, DisplayArgs, MergeArgs, ProgressStyle};
use crate::commands::render::film::read_own_film;
use crate::commands::render::{messages, write};
use crate::console::Verbosity;
use crate::failure::{Exit, Failure};
use crate::preparation::NOTHING_KEPT;
use crate::progress::{Progress, RunObserver};
use crate::session::Session;
use crate::targets::{OutputFiles, OutputTarget};
use crate::{origin, plan, targets};

/// Outputs of a command that makes a picture of film files.
struct FilmOutputs {
    /// Film files that the command reads.
    inputs: InputFiles,
    /// Outputs for the picture.
    targets: Vec<OutputTarget>,
}

impl FilmOutputs {
    /// Resolves the picture outputs of `-o` and the film file of `--checkpoint`. None of them may be
    /// one of the films that the command reads.
    fn resolve(
        session: &mut Session,
        display: &DisplayArgs,
        (pictures, checkpoint): (&[PathBuf], Option<&Path>),
        films: &[PathBuf],
    ) -> Result<Self, Failure> {
        session.outputs = OutputFiles::with_quality(display.quality);
        let targets = targets::resolve_picture_targets(pictures, &mut session.outputs)?;
        if let Some(path) = checkpoint {
            session.outputs.add_checkpoint(path)?;
        }
        let mut inputs = InputFiles::default();
        films.iter().for_each(|film| inputs.record_read(film));
        session.outputs.check_against_inputs(&inputs)?;
        Ok(Self { inputs, targets })
    }

    /// Writes the picture of a film, and records its messages. Returns the names of the written files
    /// and the error of the picture for the final message, if known.
    fn write_picture(
        &self,
        session: &mut Session,
        (kept_film, rendered): (&mut StoredFilm, &RenderOutput),
        display: &DisplayArgs,
    ) -> Result<(Vec<String>, Option<String>), Failure> {
        session.end_early_stage();
        let picture = rendered.final_picture();
        let display = plan::apply_display_and_exposure(display, kept_film.display, picture);
        let (film, noisy) = (
            &kept_film.film,
            rendered.error_before_denoising(&kept_film.film),
        );
        let metadata = &mut kept_film.metadata;
        metadata.command = origin::command_line();
        metadata.error = origin::format_error_metadata(noisy.as_ref(), rendered, film);
        let Session { outputs, notes, .. } = session;
        let free = outputs.beside(&self.inputs);
        let written = write::write_targets(rendered, &self.targets, display, metadata, free)?;
        messages::note_faults(rendered.counters.faults(), &Scene::default(), notes);
        let error = messages::report_error(noisy.as_ref(), film, rendered, None, notes);
        Ok((written, error))
    }
}

/// Prints the notes, and the names of the written files with a description of the picture.
fn report_files(session: &mut Session, written: &[String], description: &str) {
    session.notes.print_kept_messages();
    if !written.is_empty() {
        session.verbosity.print_result_message(format_args!(
            "wrote {} ({description}, {})",
            written.join(", "),
            format_duration(session.clock.total_seconds())
        ));
    }
}

/// Runs `merge`: reads the parts, joins them and writes the requested files.
pub fn run_merge(mut session: Session, args: &MergeArgs) -> Result<(), Failure> {
    let named = (args.outputs.as_slice(), args.checkpoint.as_deref());
    let outputs = FilmOutputs::resolve(&mut session, &args.display, named, &args.parts)?;
    let mut kept_film = merge_files(&args.parts, &plan::build_limits(args.max_memory))?;
    let missing = kept_film.film.unfinished_pixels();
    if missing > 0 && !outputs.targets.is_empty() && !args.unfinished {
        return Err(missing_samples_failure(&kept_film.film, missing));
    }
    let rendered = session.run(|| RenderOutput::from_film(&kept_film.film, &()));
    session.end_early_stage();
    kept_film.metadata.command = origin::command_line();
    let free = session.outputs.beside(&outputs.inputs);
    // The picture is worth writing even if the film file cannot be written.
    let film_failure = args
        .checkpoint
        .as_ref()
        .and_then(|path| write::write_film_or_copy(path, &mut kept_film, free).err());
    let developed = (&mut kept_film, &rendered);
    let (mut written, error) = match outputs.write_picture(&mut session, developed, &args.display) {
        Ok(written) => written,
        Err(failure) => return Err(failure.with_failure(film_failure)),
    };
    let checkpoint = args.checkpoint.iter().filter(|_| film_failure.is_none());
    written.extend(checkpoint.map(|path| targets::printable_path(path)));
    let error = error.map(|error| format!(", {error}")).unwrap_or_default();
    let parts = format_count(args.parts.len(), "part");
    report_files(&mut session, &written, &format!("{parts}{error}"));
    film_failure.map_or(Ok(()), Err)
}

/// Reads the film files of all parts in turn and joins them. The memory holds at most the parts
/// joined so far, the next part, and the result of joining these two films.
fn merge_files(paths: &[PathBuf], limits: &Limits) -> Result<StoredFilm, Failure> {
    let mut all: Option<StoredFilm> = None;
    for path in paths {
        let part = read_own_film(path, limits)?;
        all = Some(match all {
            None => part,
            Some(before) => {
                let film = Film::merge(&[before.film, part.film])
                    .map_err(|error| merge_failure(path, &paths[0], error))?;
                StoredFilm { film, ..before }
            }
        });
    }
    all.ok_or_else(|| Error::invalid_usage(FilmMergeError::Nothing).into())
}

fn merge_failure(path: &Path, first: &Path, error: FilmMergeError) -> Failure {
    let (path, first) = (path.display(), first.display());
    match error {
        FilmMergeError::Foreign { label, .. } => Error::invalid_input(
            path,
            format_args!("the part belongs to another picture than {first}: the {label} differs; name only parts of one picture"),
        )
        .into(),
        FilmMergeError::Overlap { .. } => {
            let error = Error::invalid_input(
                path,
                "the part has samples that an earlier part has too, and no sample may count twice",
            );
            error.with_hint("name each part once; each part needs its own K in --part K/N").into()
        }
        other => Error::invalid_input(path, other).into(),
    }
}

/// Creates the failure for missing samples. The message states how many tiles and pixels lack
/// samples; which part of the picture lacks them is unknown.
fn missing_samples_failure(film: &Film, missing: u64) -> Failure {
    let whole = film.full_part();
    let tiles = film.unfinished_tiles(&whole);
    let message = format!(
        "parts are missing or unfinished: {tiles} of {} tiles ({missing} pixels) lack samples",
        whole.tiles.end
    );
    let advice = "add the missing parts, or finish the parts with --resume; --unfinished makes a picture of the samples so far";
    Failure::new(Exit::Input, message).with_hint(advice)
}

/// Runs `denoise`: reads a film file, denoises its picture and writes the requested files.
pub fn run_denoise(mut session: Session, args: &DenoiseArgs) -> Result<(), Failure> {
    let films = slice::from_ref(&args.film);
    let named = (args.outputs.as_slice(), None);
    let outputs = FilmOutputs::resolve(&mut session, &args.display, named, films)?;
    let mut kept_film = read_own_film(&args.film, &plan::build_limits(args.limits.max_memory))?;
    let watch = session.start_work();
    let denoised = session.run(|| denoise(&kept_film.film, &watch));
    if let Err(error) = &denoised {
        return Err(denoise_failure(&args.film.display().to_string(), error));
    }
    let rendered = RenderOutput {
        denoised: Some(denoised),
        ..RenderOutput::from_film_without_denoising(&kept_film.film)
    };
    let developed = (&mut kept_film, &rendered);
    let (written, error) = outputs.write_picture(&mut session, developed, &args.display)?;
    let error = error.unwrap_or_else(|| "denoised (biased)".to_owned());
    report_files(&mut session, &written, &error);
    Ok(())
}

fn denoise_failure(film: &str, error: &DenoiseError) -> Failure {
    match error {
        DenoiseError::Cancelled => Failure::new(Exit::Interrupted, NOTHING_KEPT),
        DenoiseError::NoChance => Error::invalid_input(film, error).into(),
        DenoiseError::Layer(_) | DenoiseError::Replicates => Error::invalid_input(film, error)
            .with_hint("render the scene with --denoise, --checkpoint and at least 8 samples a pixel; the film then has the layers that the denoiser needs")
            .into(),
    }
}

/// Computes the picture of a rendered film, denoised if the film's settings request it, with a
/// progress display. Called by `render` after its last sample.
pub fn denoise_with_progress(
    film: &Film,
    (style, verbosity): (ProgressStyle, Verbosity),
    watch: RunObserver<'_>,
) -> RenderOutput {
    if !film.is_to_be_denoised() {
        return RenderOutput::from_film_without_denoising(film);
    }
    let pixels = film.size().map(u64::from).into_iter().product::<u64>();
    let progress = match pixels < SMALL_PIXELS {
        true => Progress::hidden(),
        false => Progress::start("denoising", style, verbosity),
    };
    let watch = RunObserver {
        progress: Some(&progress),
        ..watch
    };
    let rendered = RenderOutput::from_film(film, &watch as &dyn Observer);
    progress.finish();
    rendered
}

/// Largest number of pixels for which denoising is too short for a progress display.
const SMALL_PIXELS: u64 = 1 << 18;
