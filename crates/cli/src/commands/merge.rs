//! `merge`: joins the parts of a picture, rendered separately, to the picture of a single run.

use std::path::{Path, PathBuf};

use raywright_core::RenderOutput;
use raywright_core::film::{Film, FilmMergeError};
use raywright_io::output::StoredFilm;
use raywright_io::report::format_count;
use raywright_io::{Error, Limits};

use super::film_outputs::{FilmOutputs, report_files};
use super::render::film::read_own_film;
use super::render::write;
use crate::args::MergeArgs;
use crate::failure::{Exit, Failure};
use crate::session::Session;
use crate::{origin, plan};

/// Runs `merge`: reads the parts, joins them and writes the requested files.
pub fn run(mut session: Session, args: &MergeArgs) -> Result<(), Failure> {
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
    let is_free = |path: &Path| session.outputs.is_free_path(path, &outputs.inputs);
    // The picture is worth writing even if the film file cannot be written.
    let film_failure = args.checkpoint.as_ref().and_then(|path| {
        write::write_film_or_copy(path, &mut kept_film, (&outputs.inputs, is_free)).err()
    });
    let developed = (&mut kept_film, &rendered);
    let (mut written, error) = match outputs.write_picture(&mut session, developed, &args.display) {
        Ok(written) => written,
        Err(failure) => return Err(failure.with_failure(film_failure)),
    };
    let checkpoint = args.checkpoint.iter().filter(|_| film_failure.is_none());
    written.extend(checkpoint.map(|path| write::printable_path(path)));
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
