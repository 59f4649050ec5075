//! Writing of pictures for `render`, `merge` and `denoise`, finished or interrupted.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use raywright_core::RenderOutput;
use raywright_core::display::Display;
use raywright_core::picture::Picture;
use raywright_io::Error;
use raywright_io::output::{self, PictureFormat, PictureMetadata, StoredFilm};

use crate::console;
use crate::failure::{Exit, Failure};
use crate::preparation::NOTHING_KEPT;
use crate::targets::{FreePaths, OutputTarget, printable_path};

/// Returns the name of a picture: that of its scene, with the label of its shot where it has one.
pub fn join_label(stem: &str, label: &str) -> String {
    match label {
        "" => stem.to_owned(),
        label => format!("{stem}-{label}"),
    }
}

/// Writes the picture to all targets and returns the names of the written files. A failed write
/// does not stop the other writes. The picture of the failed target is then kept in the folder of
/// the input or in the temporary folder, and the failure names this copy.
pub fn write_targets(
    rendered: &RenderOutput,
    targets: &[OutputTarget],
    display: Display,
    metadata: &PictureMetadata,
    free: FreePaths<'_>,
) -> Result<Vec<String>, Failure> {
    let (mut written, mut failed) = (Vec::new(), None);
    for target in targets {
        match write_target(target, rendered, display, metadata, free) {
            Ok(name) => written.extend(name),
            Err(failure) => {
                let fallback_path = target.path().and_then(|path| {
                    let picture = select_picture_for_format(
                        rendered,
                        PictureFormat::from_path(path).ok()?,
                        display,
                    );
                    write_to_fallback(path, free, |path, is_free| {
                        output::write_new_picture(path, &picture, display, metadata, is_free)
                    })
                });
                failed = Some(with_fallback_hint(
                    failed.unwrap_or(failure),
                    "picture",
                    fallback_path,
                ));
            }
        }
    }
    failed.map_or(Ok(written), Err)
}

/// Writes a file that could not be written under its own path. The new file is in the folder of the
/// first input or, if that folder is not writable, in the temporary folder. No existing file is
/// replaced. Returns the new path; `None` if neither folder is writable.
pub fn write_to_fallback(
    path: &Path,
    free: FreePaths<'_>,
    mut write: impl FnMut(&Path, &dyn Fn(&Path) -> bool) -> Result<PathBuf, Error>,
) -> Option<PathBuf> {
    let name = path.file_name()?;
    let beside = free.inputs.files().next().and_then(Path::parent);
    let is_new = |other: &Path| other.symlink_metadata().is_err() && free.has(other);
    beside
        .map(Path::to_owned)
        .into_iter()
        .chain([std::env::temp_dir()])
        .find_map(|folder| write(&folder.join(name), &is_new).ok())
}

/// Writes a film as [`write_to_fallback`] does.
pub fn write_film_to_fallback(
    path: &Path,
    film: &mut StoredFilm,
    free: FreePaths<'_>,
) -> Option<PathBuf> {
    write_to_fallback(path, free, |path, is_free| {
        output::write_new_film(path, film, is_free)
    })
}

/// Writes a film file. If the write fails, the film is kept as [`write_to_fallback`] keeps files,
/// and the failure names this copy.
pub fn write_film_or_copy(
    path: &Path,
    film: &mut StoredFilm,
    free: FreePaths<'_>,
) -> Result<(), Failure> {
    output::write_film(path, film).map_err(|error| {
        let copy = write_film_to_fallback(path, film, free);
        with_fallback_hint(error.into(), "film", copy)
    })
}

/// Adds the path of the fallback file, if any, as a hint to the failure of a write. `file`
/// describes the content of the file.
pub fn with_fallback_hint(failure: Failure, file: &str, fallback_path: Option<PathBuf>) -> Failure {
    match fallback_path {
        Some(kept) => failure.with_hint(format_args!(
            "the {file} is kept in {}",
            printable_path(&kept)
        )),
        None => failure,
    }
}

/// Writes the picture to a target. Returns the name of the written file, or `None` for standard
/// output.
fn write_target(
    target: &OutputTarget,
    rendered: &RenderOutput,
    display: Display,
    metadata: &PictureMetadata,
    free: FreePaths<'_>,
) -> Result<Option<String>, Failure> {
    Ok(match target {
        OutputTarget::Stdout => {
            let bytes = output::encode_png(rendered.final_picture(), display, metadata)
                .map_err(|error| Failure::from_stdout_error(&error))?;
            console::write_picture_to_stdout(&bytes)?;
            None
        }
        OutputTarget::File(path, format) => {
            output::write_picture_as(
                path,
                *format,
                &select_picture_for_format(rendered, *format, display),
                display,
                metadata,
            )?;
            Some(printable_path(path))
        }
        // A file of this name may have appeared during the render; the picture then gets a new
        // name.
        OutputTarget::Unnamed(path, format) => {
            let is_free = |other: &Path| other == path || free.has(other);
            let picture = select_picture_for_format(rendered, *format, display);
            Some(printable_path(&output::write_new_picture(
                path, &picture, display, metadata, is_free,
            )?))
        }
    })
}

/// Returns the content of a file in this format. For EXR this is the picture with all layers,
/// composited over the linear background colour, if any. For all other formats these are the
/// displayed colours.
pub fn select_picture_for_format(
    rendered: &RenderOutput,
    format: PictureFormat,
    display: Display,
) -> Cow<'_, Picture> {
    match (format, display.linear_background()) {
        (PictureFormat::Exr, None) => rendered.picture_with_all_layers(),
        (PictureFormat::Exr, Some(colour)) => Cow::Owned(
            rendered
                .composite_over(colour)
                .picture_with_all_layers()
                .into_owned(),
        ),
        _ => Cow::Borrowed(rendered.final_picture()),
    }
}

/// Creates the failure of an interrupted run. The message names the files that keep the unfinished
/// pictures. For several pictures, the message also states the number of finished pictures and of
/// all pictures.
pub fn interrupted_failure(
    kept: Result<Vec<String>, Error>,
    series: Option<[usize; 2]>,
) -> Failure {
    let kept = match kept {
        Ok(kept) => kept.join(", "),
        Err(error) => {
            return Failure {
                exit: Exit::Interrupted,
                message: error.to_string(),
            };
        }
    };
    let count = series.map(|[finished, of]| format!("; {finished} of {of} pictures are finished"));
    let message = match (count, kept.as_str()) {
        (None, "") => NOTHING_KEPT.to_owned(),
        (None, kept) => format!("interrupted; the unfinished picture is in {kept}"),
        (Some(count), "") => format!("interrupted{count}"),
        (Some(count), kept) => {
            format!("interrupted{count}; the unfinished pictures are in {kept}")
        }
    };
    Failure::new(Exit::Interrupted, message)
}

/// Writes an interrupted picture, if it has samples, under new names that replace no file. Returns
/// the new names.
pub fn write_partial_picture(
    rendered: &RenderOutput,
    targets: &[OutputTarget],
    display: Display,
    metadata: &PictureMetadata,
    free: FreePaths<'_>,
) -> Result<Vec<String>, Error> {
    let has_samples = rendered.counters.samples > 0;
    let noisy = RenderOutput {
        denoised: None,
        ..rendered.clone()
    };
    let paths = targets
        .iter()
        .filter_map(OutputTarget::path)
        .filter(|_| has_samples)
        .map(output::partial_picture_path);
    paths
        .map(|partial| {
            let picture =
                select_picture_for_format(&noisy, PictureFormat::from_path(&partial)?, display);
            output::write_new_picture(&partial, &picture, display, metadata, |other: &Path| {
                free.has(other)
            })
            .map(|name| printable_path(&name))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use raywright_core::settings::Settings;
    use raywright_core::{Observer, Scene, prepare};
    use raywright_io::InputFiles;

    use super::*;
    use crate::targets::OutputFiles;

    struct StoppedWriter;

    impl Observer for StoppedWriter {
        fn is_cancelled(&self) -> bool {
            true
        }
    }

    /// Protects: a file name with a line break stays on one line of a message.
    #[test]
    fn names_stay_on_one_line() {
        assert_eq!(printable_path(Path::new("a\nb.png")), "a\u{fffd}b.png");
    }

    /// Protects: a render stopped before its first tile leaves no picture, which would be black; a
    /// later stop keeps the samples in a new file beside any existing file.
    #[test]
    fn only_what_was_made_is_kept() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        let settings = Settings {
            size: [8, 8],
            ..Settings::from_scene(&Scene::default())
        };
        let ready = prepare(&Scene::default(), &settings, &())
            .expect("nothing is wrong with an empty scene");
        let targets = [
            OutputTarget::File(at("a.png"), output::PictureFormat::Png),
            OutputTarget::Stdout,
        ];
        let end = |rendered: &RenderOutput| {
            let kept = write_partial_picture(
                rendered,
                &targets,
                Display::default(),
                &PictureMetadata::default(),
                OutputFiles::default().beside(&InputFiles::default()),
            );
            let failure = interrupted_failure(kept, None);
            assert_eq!(failure.exit, Exit::Interrupted);
            failure.message
        };
        assert_eq!(
            end(&ready.render(&StoppedWriter)),
            "error: interrupted; nothing was written"
        );
        assert_eq!(
            std::fs::read_dir(folder.path()).expect("a folder").count(),
            0
        );
        std::fs::write(at("a.partial.png"), "mine").expect("a file");
        let kept = at("a.partial-2.png");
        assert_eq!(
            end(&ready.render(&())),
            format!(
                "error: interrupted; the unfinished picture is in {}",
                kept.display()
            )
        );
        assert_eq!(std::fs::read(at("a.partial.png")).expect("a file"), b"mine");
        assert!(kept.exists());
    }
}
