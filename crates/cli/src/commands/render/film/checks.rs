//! Checks of the flags of film files, and of film files of other programs, scenes or settings.

use std::path::Path;

use raywright_core::film::FilmMergeError;
use raywright_io::output::{StoredFilm, read_film};
use raywright_io::{Error, InputFiles, Limits};

use crate::failure::Failure;
use crate::origin;
use crate::plan::RenderTask;
use crate::targets::{OutputFiles, OutputTarget};

/// Refuses contradicting flags of film files before the scene is loaded, and adds the checkpoint to
/// the output files.
pub fn check_film_flags(
    task: &RenderTask,
    targets: &[OutputTarget],
    outputs: &mut OutputFiles,
) -> Result<(), Failure> {
    refuse_flags_with_part(task, targets)?;
    let Some(path) = &task.film.checkpoint else {
        return Ok(());
    };
    outputs.add_output(path, "--checkpoint")?;
    // The resumed file may be the checkpoint file itself, because the new checkpoint contains all
    // of its samples.
    let mut inputs = InputFiles::default();
    task.film
        .resume
        .iter()
        .filter(|earlier| *earlier != path)
        .for_each(|earlier| inputs.record_read(earlier));
    task.film
        .replay
        .iter()
        .for_each(|map| inputs.record_read(map));
    outputs.check_against_inputs(&inputs)
}

/// Refuses flags that contradict `--part`, whose share of a picture is kept in the film file of
/// `--checkpoint` alone.
fn refuse_flags_with_part(task: &RenderTask, targets: &[OutputTarget]) -> Result<(), Failure> {
    if task.film.part.is_none() {
        return Ok(());
    }
    Failure::refuse_if(
        task.max_error.is_some(),
        "--max-error cannot be used with --part: it needs the errors of the whole picture, and a part has only a share of the samples",
        "use --spp in place of --max-error, or leave out --part",
    )?;
    Failure::refuse_if(
        task.film.checkpoint.is_none(),
        "--part needs --checkpoint, whose file receives the share of the picture",
        "add --checkpoint part.film; raywright merge makes the picture of all parts",
    )?;
    Failure::refuse_if(
        !targets.is_empty(),
        "-o and --part cannot both be given, because a share of a picture is kept in a film file",
        "leave out -o; raywright merge makes the picture of all parts",
    )
}

/// Reads a film file. Refuses the film of another program version, which may use other random
/// numbers.
pub fn read_own_film(path: &Path, limits: &Limits) -> Result<StoredFilm, Failure> {
    let stored = read_film(path, limits)?;
    let software = &stored.metadata.software;
    if software == origin::SOFTWARE {
        return Ok(stored);
    }
    let error = Error::invalid_input(
        path.display(),
        format_args!(
            "the file was made by {software}, and this program is {}",
            origin::SOFTWARE
        ),
    );
    Err(error
        .with_hint("use the program that made the file, or render the picture again")
        .into())
}

/// Creates the failure for a film file that cannot be resumed or replayed with these flags.
pub fn wrong_film_failure(path: &Path, error: FilmMergeError) -> Failure {
    match error {
        FilmMergeError::Foreign { label, .. } => {
            let error = Error::invalid_input(
                path.display(),
                format_args!("the film belongs to another picture: the {label} differs"),
            );
            error
                .with_hint("give the scene and flags that the film was made with; only --spp may be larger")
                .into()
        }
        FilmMergeError::Samples {
            has,
            requested,
            least: minimum,
        } => {
            let message = format!(
                "{}: the film has {has} samples a pixel and cannot be continued to {requested}",
                path.display()
            );
            Failure::usage(
                message,
                format_args!("give --spp {minimum} or a larger number"),
            )
        }
        other => Error::invalid_input(path.display(), other).into(),
    }
}
