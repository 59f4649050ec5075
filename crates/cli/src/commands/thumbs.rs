//! `thumbs`: a small picture of every scene and model below a folder, rendered only if a file of
//! the model has changed.

use std::collections::{BTreeMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use raywright_core::Settings;
use raywright_core::framing::Silhouette;
use raywright_io::output::{is_own_picture, write_atomically};
use raywright_io::{Error, Input, InputFiles, LoadOptions, LoadedScene, is_scene_or_model, load};
use serde::{Deserialize, Serialize};

use crate::args::ThumbsArgs;
use crate::commands::render::picture::render_to_memory;
use crate::failure::{Exit, Failure};
use crate::plan::RenderTask;
use crate::session::Session;
use crate::{console, origin, scene_input};

/// Version of the layout of [`ThumbnailIndex`].
const FORMAT: u32 = 1;
/// Name of the index file in the folder of the pictures.
const INDEX: &str = "thumbs.json";
/// Interval between writes of the index file. A run that is ended at once, by a second Ctrl-C or
/// while it reads a model, forgets the pictures of at most this interval.
const INDEX_INTERVAL: Duration = Duration::from_secs(1);
/// Message of an interrupted run.
const INTERRUPTED: &str =
    "interrupted; finished pictures are kept, and the next run renders the others";

/// Index file: the inputs of all pictures, kept between runs to find pictures that are out of date.
#[derive(Debug, Default, Deserialize, Serialize)]
struct ThumbnailIndex {
    format: u32,
    /// Inputs of each picture, by the model's path below the searched folder.
    thumbnails: BTreeMap<String, ThumbnailInputs>,
}

/// Inputs of a picture: program version, size and files.
#[derive(Debug, Deserialize, PartialEq, Serialize)]
struct ThumbnailInputs {
    version: String,
    size: u32,
    /// Paths of all files that the render read.
    files: Vec<PathBuf>,
    /// Hash of the contents of `files`.
    hash: String,
}

impl ThumbnailInputs {
    fn from_inputs(inputs: &InputFiles, size: u32) -> Self {
        let files = inputs.files().map(Path::to_owned).collect();
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            size,
            files,
            hash: inputs.content_hash(),
        }
    }

    /// Whether the program's version, the picture's size and the contents of the input files are
    /// unchanged, so that the existing picture is kept.
    fn is_current(&self, size: u32) -> bool {
        let mut inputs = InputFiles::default();
        self.files.iter().for_each(|file| inputs.record_read(file));
        *self == Self::from_inputs(&inputs, size)
    }
}

/// Runs `thumbs`: renders the pictures that are missing or out of date, and prints a line for each
/// model.
pub fn run(mut session: Session, args: &ThumbsArgs) -> Result<(), Failure> {
    session.start_early_stage(INTERRUPTED);
    let mut models = list_models(args)?;
    // The newest models are rendered first, because a user may be waiting for them.
    models.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    let index_file = args.output.join(INDEX);
    let mut index = read_index(&index_file)?;
    let (mut worst, mut failed, mut index_written) = (Exit::Done, 0, Instant::now());
    for (_, model) in &models {
        session.end_early_stage();
        if session.is_stopped() {
            break;
        }
        if index_written.elapsed() >= INDEX_INTERVAL {
            write_index(&index_file, &index)?;
            index_written = Instant::now();
        }
        match update_thumbnail(args, model, &mut index, &mut session) {
            Ok((picture, is_new)) => console::print(format!(
                "{} {}\n",
                if is_new { "new " } else { "same" },
                picture.display()
            ))?,
            Err(failure) if failure.exit == Exit::Interrupted => break,
            Err(failure) => {
                console::print_message(&failure.message);
                failed += 1;
                worst = if failure.exit as u8 > worst as u8 {
                    failure.exit
                } else {
                    worst
                };
            }
        }
    }
    session.end_early_stage();
    write_index(&index_file, &index)?;
    if session.is_stopped() {
        return Err(Failure::new(Exit::Interrupted, INTERRUPTED));
    }
    if models.is_empty() {
        session.verbosity.print_warning(format_args!(
            "{}: the folder contains no scene and no model; name another folder",
            args.folder.display()
        ));
    }
    match failed {
        0 => Ok(()),
        n => Err(Failure::new(
            worst,
            format_args!(
                "the pictures of {n} of {} models could not be made; see the errors above",
                models.len()
            ),
        )),
    }
}

/// Lists every scene and model below the folder with its modification time, except files in the
/// folder of the pictures. Each folder is searched once, under its first path without links where
/// it has one, however many links lead to it.
fn list_models(args: &ThumbsArgs) -> Result<Vec<(SystemTime, PathBuf)>, Failure> {
    let (mut found, mut folders) = (Vec::new(), vec![args.folder.clone()]);
    // Links are followed after all folders that have a path without links.
    let (mut links, mut searched) = (Vec::new(), HashSet::new());
    searched.extend(folder_identity(&args.output));
    while let Some(folder) = folders.pop().or_else(|| links.pop()) {
        let is_new = folder_identity(&folder).is_some_and(|identity| searched.insert(identity));
        if !is_new && folder != args.folder {
            continue;
        }
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(cause) if folder == args.folder => {
                return Err(Error::unreadable(&folder, &cause).into());
            }
            // An unreadable folder below the searched folder is skipped.
            Err(_) => continue,
        };
        for path in entries.flatten().map(|entry| entry.path()) {
            let is_hidden = path
                .file_name()
                .is_some_and(|name| name.to_string_lossy().starts_with('.'));
            let Ok(metadata) = fs::metadata(&path) else {
                continue;
            };
            if metadata.is_dir() {
                match path.is_symlink() {
                    _ if is_hidden => {}
                    true => links.push(path),
                    false => folders.push(path),
                }
            } else if metadata.is_file() && !is_hidden && is_scene_or_model(&path) {
                found.push((metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH), path));
            }
        }
    }
    Ok(found)
}

/// Returns the identity of a folder, the same for all paths that lead to it; `None` without access
/// to the folder.
#[cfg(unix)]
fn folder_identity(folder: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    let metadata = fs::metadata(folder).ok()?;
    Some((metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn folder_identity(folder: &Path) -> Option<PathBuf> {
    fs::canonicalize(folder).ok()
}

/// Renders a model's picture if it is missing or out of date. Returns its path, and whether it was
/// rendered.
fn update_thumbnail(
    args: &ThumbsArgs,
    model: &Path,
    index: &mut ThumbnailIndex,
    session: &mut Session,
) -> Result<(PathBuf, bool), Failure> {
    session.start_early_stage(INTERRUPTED);
    let below = model.strip_prefix(&args.folder).unwrap_or(model);
    let (name, picture) = (
        below.to_string_lossy().into_owned(),
        thumbnail_path(&args.output, below),
    );
    let is_ours = is_own_picture(&picture);
    if is_ours
        && index
            .thumbnails
            .get(&name)
            .is_some_and(|known| known.is_current(args.size))
    {
        return Ok((picture, false));
    }
    if picture.exists() && !is_ours {
        let message = format!(
            "cannot write {}: a file of this name exists and is no picture made by this program; remove it, or name another folder with -o",
            picture.display()
        );
        return Err(Failure::new(Exit::File, message));
    }
    index.thumbnails.remove(&name);
    let mut loaded =
        load(&Input::Path(model.to_owned()), &LoadOptions::default()).map_err(Failure::from)?;
    if let Some(failure) = scene_input::empty_scene_failure(&loaded) {
        return Err(failure);
    }
    render_thumbnail(&mut loaded, args.size, &picture, session)?;
    index.thumbnails.insert(
        name,
        ThumbnailInputs::from_inputs(&loaded.inputs, args.size),
    );
    Ok((picture, true))
}

/// Returns the path of a model's picture: `a/b.glb` becomes `OUT/a/b.glb.png`, so that `b.obj` in
/// the same folder has another picture.
fn thumbnail_path(output: &Path, below: &Path) -> PathBuf {
    let mut name = below.file_name().unwrap_or_default().to_owned();
    name.push(".png");
    output.join(below.with_file_name(name))
}

/// Renders the thumbnail of a scene as a quick preview and writes it. A model is shown from its
/// default view, whatever cameras it has. The exposure is automatic, because no user chooses it for
/// each model.
fn render_thumbnail(
    loaded: &mut LoadedScene,
    size: u32,
    picture: &Path,
    session: &mut Session,
) -> Result<(), Failure> {
    let is_model = loaded.source.format.is_model();
    let view = is_model.then(|| Silhouette::from_scene(&loaded.scene).default_view());
    let task = RenderTask::thumbnail(loaded.source.name.clone().into(), size, view)?;
    let watch = session.start_work();
    let render = || render_to_memory(loaded, &task, origin::command_line(), &watch);
    let finished = session.run(render)?;
    let settings = Settings::from_scene(&loaded.scene);
    let reason = scene_input::describe_empty_picture(loaded, &finished.rendered, &settings);
    if let Some(reason) = reason {
        let name = &loaded.source.name;
        return Err(scene_input::empty_picture_failure(name, reason));
    }
    create_parent_folder(picture)?;
    finished.save(picture)
}

/// Creates the folder that contains a file, with all its parent folders.
fn create_parent_folder(file: &Path) -> Result<(), Failure> {
    let folder = file.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder).map_err(|cause| Error::unwritable(folder, &cause).into())
}

/// Reads the index file of earlier runs; empty if the file does not exist or has another version.
fn read_index(file: &Path) -> Result<ThumbnailIndex, Failure> {
    let fresh = ThumbnailIndex {
        format: FORMAT,
        ..ThumbnailIndex::default()
    };
    let text = match fs::read_to_string(file) {
        Ok(text) => text,
        Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => return Ok(fresh),
        Err(cause) => return Err(Error::unreadable(file, &cause).into()),
    };
    match serde_json::from_str::<ThumbnailIndex>(&text) {
        Ok(index) if index.format == FORMAT => Ok(index),
        Ok(_) => Ok(fresh),
        Err(cause) => {
            let failure = Failure::new(
                Exit::Input,
                format_args!(
                    "{}: the file is no index of `raywright thumbs`: {cause}",
                    file.display()
                ),
            );
            Err(failure.with_hint("name another folder with -o, or remove the file"))
        }
    }
}

fn write_index(file: &Path, index: &ThumbnailIndex) -> Result<(), Failure> {
    create_parent_folder(file)?;
    Ok(write_atomically(
        file,
        console::format_json(index).as_bytes(),
    )?)
}
