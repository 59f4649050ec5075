//! File of the reference picture that `accuracy` compares with. The file is a film file, which
//! holds the samples of a render. Its settings text lists the rungs (quality levels of settings) of
//! that render.

use std::path::Path;

use raywright_core::accuracy::ReusableReference;
use raywright_core::display::Display;
use raywright_core::film::FilmMergeError;
use raywright_core::ladder::RungChoice;
use raywright_io::output::{PictureMetadata, StoredFilm};
use raywright_io::{Error, Limits, LoadedScene};

use crate::commands::render::film::read_own_film;
use crate::commands::render::write::write_film_or_copy;
use crate::failure::Failure;
use crate::origin::program_metadata;
use crate::targets::FreePaths;

/// First word of the settings text in the film file of a reference.
const REFERENCE_MARK: &str = "reference";

/// Reads the reference of `--reference`; `None` if the file does not exist.
pub fn read_reference(path: &Path, limits: &Limits) -> Result<Option<ReusableReference>, Failure> {
    if !path.exists() {
        return Ok(None);
    }
    let StoredFilm { film, metadata, .. } = read_own_film(path, limits)?;
    let mut words = metadata.settings.split(' ');
    let rungs = (words.next() == Some(REFERENCE_MARK))
        .then(|| {
            words
                .map(RungChoice::parse)
                .collect::<Result<Vec<_>, _>>()
                .ok()
        })
        .flatten();
    let rungs = rungs.ok_or_else(|| {
        Error::invalid_input(path.display(), "the file is not a reference picture that `raywright accuracy` wrote")
            .with_hint("give --reference a file that `raywright accuracy` wrote, or a name that does not exist yet")
    })?;
    Ok(Some(ReusableReference { rungs, film }))
}

/// Writes the reference picture, with the rungs (quality levels) of its render, to the file of
/// `--reference`.
pub fn write_reference(
    path: &Path,
    reference: ReusableReference,
    loaded: &LoadedScene,
    free: FreePaths<'_>,
) -> Result<(), Failure> {
    let words = [REFERENCE_MARK.to_owned()]
        .into_iter()
        .chain(reference.rungs.iter().map(RungChoice::to_string));
    let metadata = PictureMetadata {
        scene_hash: loaded.hash.to_string(),
        settings: words.collect::<Vec<_>>().join(" "),
        ..program_metadata()
    };
    let mut film = StoredFilm {
        film: reference.film,
        metadata,
        display: Display::from_render(&loaded.scene.render),
    };
    write_film_or_copy(path, &mut film, free)
}

/// Creates the failure for a reference file of another scene or of other settings.
pub fn wrong_reference_failure(path: &Path, error: &FilmMergeError) -> Failure {
    let label = match error {
        FilmMergeError::Foreign { label, .. } => {
            format!("the reference belongs to another measurement: the {label} differs")
        }
        other => other.to_string(),
    };
    Error::invalid_input(path.display(), label)
        .with_hint("give the scene and flags that the reference was made with, or another file with --reference")
        .into()
}
