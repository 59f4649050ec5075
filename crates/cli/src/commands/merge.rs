//! `merge`: joins the parts of a picture, rendered separately, to the picture of a single run.

use std::path::{Path, PathBuf};

use raywright_core::RenderOutput;
use raywright_core::film::{Film, PartError};
use raywright_io::output::{KeptFilm, read_film, write_film};
use raywright_io::{Error, InputFiles, Limits};

use super::render::film::refuse_other_program;
use super::render::{messages, write};
use crate::args::MergeArgs;
use crate::clock::{Clock, format_duration};
use crate::console::Verbosity;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::targets::{self, OutputFiles};
use crate::{origin, plan};

/// Runs `merge`: reads the parts, joins them and writes the requested files.
pub fn run(args: &MergeArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let clock = Clock::start();
    let (mut outputs, mut inputs) = (
        OutputFiles::with_quality(args.display.quality),
        InputFiles::default(),
    );
    let targets = targets::pictures(&args.outputs, &mut outputs)?;
    if let Some(path) = &args.checkpoint {
        outputs.add(path, "--checkpoint")?;
    }
    args.parts.iter().for_each(|part| inputs.read(part));
    outputs.keep_clear_of(&inputs)?;
    let mut kept_film = joined(&args.parts, &plan::limits(args.max_memory))?;
    kept_film.metadata.command = origin::command_line();
    let missing = kept_film.film.unfinished();
    if missing > 0 && !targets.is_empty() && !args.unfinished {
        return Err(incomplete(&kept_film.film, missing));
    }
    // The picture is worth writing even if the film file cannot be written.
    let filmed = args
        .checkpoint
        .as_ref()
        .map_or(Ok(()), |path| write_film(path, &mut kept_film));
    let rendered = RenderOutput::from_film(&kept_film.film, &());
    let display = plan::shown_as_suits(&args.display, kept_film.display, rendered.shown_picture());
    let noisy = kept_film.film.uncertainty();
    kept_film.metadata.error = origin::error(noisy.as_ref(), &rendered, &kept_film.film);
    let mut written = write::write(
        &rendered,
        &targets,
        display,
        &kept_film.metadata,
        (&inputs, |path: &Path| outputs.leave_free(path, &inputs)),
    )?;
    written.extend(
        args.checkpoint
            .as_ref()
            .filter(|_| filmed.is_ok())
            .map(|path| write::printable_path(path)),
    );
    let mut notes = Notes::new(verbosity);
    messages::note_losses(&rendered.counters, &mut notes);
    let error = messages::error(noisy.as_ref(), &kept_film.film, &rendered, None, &mut notes)
        .map(|error| format!(", {error}"))
        .unwrap_or_default();
    notes.finish();
    if !written.is_empty() {
        let parts = if args.parts.len() == 1 {
            "1 part".to_owned()
        } else {
            format!("{} parts", args.parts.len())
        };
        verbosity.say(format_args!(
            "wrote {} ({parts}{error}, {})",
            written.join(", "),
            format_duration(clock.total())
        ));
    }
    Ok(filmed?)
}

/// Reads the film files of all parts in turn and joins them. Memory holds the union so far, a
/// single part, and the merged result.
fn joined(paths: &[PathBuf], limits: &Limits) -> Result<KeptFilm, Failure> {
    let mut all: Option<KeptFilm> = None;
    for path in paths {
        let part = read_film(path, limits)?;
        refuse_other_program(path, &part.metadata)?;
        all = Some(match all {
            None => part,
            Some(before) => {
                let film = Film::merge(&[before.film, part.film])
                    .map_err(|error| refused(path, &paths[0], error))?;
                KeptFilm { film, ..before }
            }
        });
    }
    all.ok_or_else(|| Error::usage(PartError::Nothing).into())
}

fn refused(path: &Path, first: &Path, error: PartError) -> Failure {
    let (path, first) = (path.display(), first.display());
    match error {
        PartError::Foreign { label, .. } => Error::input(
            path,
            format_args!("it is not of the picture of {first}: the {label} differs"),
        )
        .into(),
        PartError::Overlap { .. } => {
            let error = Error::input(
                path,
                "it holds samples that a part before it holds too, and none may count twice",
            );
            error.with_hint("name each part once").into()
        }
        other => Error::input(path, other).into(),
    }
}

/// Creates the failure for missing samples. The message states how many tiles and pixels lack
/// samples; which share they belong to is unknown.
fn incomplete(film: &Film, missing: u64) -> Failure {
    let whole = film.whole_part();
    let tiles = film.lacking(&whole);
    let message = format!(
        "parts are missing, or were not finished: {tiles} of {} tiles ({missing} pixels) lack samples",
        whole.tiles.end
    );
    let advice = "add the others or finish them with --resume; --unfinished makes a picture of what is there";
    Failure::new(Exit::Input, message).with_hint(advice)
}
