//! `merge`: joins the parts of a picture, rendered separately, to the picture of a single run.

use std::path::{Path, PathBuf};

use raywright_core::RenderOutput;
use raywright_core::film::{Film, FilmMergeError};
use raywright_io::output::{StoredFilm, read_film};
use raywright_io::{Error, InputFiles, Limits};

use super::render::film::refuse_other_version;
use super::render::{messages, write};
use crate::args::MergeArgs;
use crate::clock::{StageClock, format_duration};
use crate::console::Verbosity;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::targets::{self, OutputFiles};
use crate::{origin, plan};

/// Runs `merge`: reads the parts, joins them and writes the requested files.
pub fn run(args: &MergeArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let clock = StageClock::start();
    let (mut outputs, mut inputs) = (
        OutputFiles::with_quality(args.display.quality),
        InputFiles::default(),
    );
    let targets = targets::resolve_picture_targets(&args.outputs, &mut outputs)?;
    if let Some(path) = &args.checkpoint {
        outputs.add_output(path, "--checkpoint")?;
    }
    args.parts.iter().for_each(|part| inputs.record_read(part));
    outputs.check_against_inputs(&inputs)?;
    let mut kept_film = merge_files(&args.parts, &plan::build_limits(args.max_memory))?;
    kept_film.metadata.command = origin::command_line();
    let missing = kept_film.film.unfinished_pixels();
    if missing > 0 && !targets.is_empty() && !args.unfinished {
        return Err(missing_samples_failure(&kept_film.film, missing));
    }
    let is_free = |path: &Path| outputs.is_free_path(path, &inputs);
    // The picture is worth writing even if the film file cannot be written.
    let film_failure = args
        .checkpoint
        .as_ref()
        .and_then(|path| write::write_film_or_copy(path, &mut kept_film, (&inputs, is_free)).err());
    let rendered = RenderOutput::from_film(&kept_film.film, &());
    let display = plan::apply_display_and_exposure(
        &args.display,
        kept_film.display,
        rendered.final_picture(),
    );
    let noisy = kept_film.film.estimate_uncertainty();
    kept_film.metadata.error =
        origin::format_error_metadata(noisy.as_ref(), &rendered, &kept_film.film);
    let mut written = match write::write_targets(
        &rendered,
        &targets,
        display,
        &kept_film.metadata,
        (&inputs, is_free),
    ) {
        Ok(written) => written,
        Err(failure) => return Err(failure.with_failure(film_failure)),
    };
    written.extend(
        args.checkpoint
            .as_ref()
            .filter(|_| film_failure.is_none())
            .map(|path| write::printable_path(path)),
    );
    let mut notes = Notes::new(verbosity);
    messages::note_lost_samples(&rendered.counters, &mut notes);
    let error =
        messages::report_error(noisy.as_ref(), &kept_film.film, &rendered, None, &mut notes)
            .map(|error| format!(", {error}"))
            .unwrap_or_default();
    notes.print_kept_messages();
    if !written.is_empty() {
        let parts = if args.parts.len() == 1 {
            "1 part".to_owned()
        } else {
            format!("{} parts", args.parts.len())
        };
        verbosity.print_result_message(format_args!(
            "wrote {} ({parts}{error}, {})",
            written.join(", "),
            format_duration(clock.total_seconds())
        ));
    }
    film_failure.map_or(Ok(()), Err)
}

/// Reads the film files of all parts in turn and joins them. The memory holds at most the parts
/// joined so far, the next part, and the result of joining these two films.
fn merge_files(paths: &[PathBuf], limits: &Limits) -> Result<StoredFilm, Failure> {
    let mut all: Option<StoredFilm> = None;
    for path in paths {
        let part = read_film(path, limits)?;
        refuse_other_version(path, &part.metadata)?;
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
