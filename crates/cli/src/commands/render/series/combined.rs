//! Files that hold all pictures of a run: a contact sheet and animations.

use std::io;
use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::picture::Picture;
use raywright_io::output::{self, AnimationFormat, AnimationWriter, ContactSheet, PictureMetadata};
use raywright_io::{Error, InputFiles};

use crate::commands::render::write::{self, printable_path};
use crate::failure::Failure;
use crate::origin;
use crate::plan::RenderTask;
use crate::targets::OutputFiles;

/// The contact sheet and the animations of a run, each with the pictures so far.
pub struct CombinedFiles {
    sheet: Option<(PathBuf, ContactSheet)>,
    animations: Vec<(PathBuf, AnimationWriter)>,
    metadata: PictureMetadata,
}

impl CombinedFiles {
    /// Checks the requested files, and starts a sheet for `count` pictures and animations without
    /// pictures.
    pub fn start(
        task: &RenderTask,
        count: usize,
        outputs: &mut OutputFiles,
    ) -> Result<Self, Failure> {
        let metadata = match task.files.has_metadata {
            false => PictureMetadata::default(),
            true => PictureMetadata {
                software: origin::SOFTWARE.to_owned(),
                command: origin::command_line(),
                ..PictureMetadata::default()
            },
        };
        let mut sheet = None;
        if let Some(path) = &task.files.sheet {
            let kind = ("png", "--sheet writes a PNG file");
            outputs.add_output_of_type(path, "--sheet", kind)?;
            sheet = Some((path.clone(), ContactSheet::new(count)));
        }
        let mut animations = Vec::new();
        for (path, format) in task
            .files
            .pictures
            .iter()
            .filter_map(|path| Some((path, AnimationFormat::from_path(path)?)))
        {
            outputs.add_output(path, "-o")?;
            animations.push((
                path.clone(),
                AnimationWriter::new(path, format, task.files.frame_rate, metadata.clone())?,
            ));
        }
        Ok(Self {
            sheet,
            animations,
            metadata,
        })
    }

    /// Whether a sheet or an animation was requested.
    pub fn is_requested(&self) -> bool {
        self.sheet.is_some() || !self.animations.is_empty()
    }

    /// Adds the next picture to the sheet and to each animation.
    pub fn add_picture(
        &mut self,
        picture: &Picture,
        display: Display,
        caption: &str,
    ) -> Result<(), Failure> {
        if let Some((_, sheet)) = &mut self.sheet {
            sheet.add_picture(picture, display, caption);
        }
        for (path, animation) in &mut self.animations {
            animation
                .add_picture(picture, display)
                .map_err(|cause| Error::unwritable(path, &cause))?;
        }
        Ok(())
    }

    /// Writes the sheet and all animations, and returns their names. A failed write does not stop
    /// the other writes. The content of the failed file is then kept in the folder of the input or
    /// in the temporary folder, and the failure names this copy.
    pub fn write_all(
        &mut self,
        (inputs, is_free): (&InputFiles, impl Fn(&Path) -> bool),
    ) -> Result<Vec<String>, Failure> {
        let (mut names, mut failed) = (Vec::new(), None);
        let mut record_result =
            |path: &Path, label, written, bytes: &mut dyn FnMut() -> io::Result<_>| {
                let Err(error) = written else {
                    names.push(printable_path(path));
                    return;
                };
                let fallback_path = bytes().ok().and_then(|bytes: Vec<u8>| {
                    write::write_to_fallback(path, (inputs, &is_free), |path, is_free| {
                        output::write_file_without_overwriting(path, &bytes, is_free)
                    })
                });
                let failure = failed.take().unwrap_or_else(|| Failure::from(error));
                failed = Some(write::with_fallback_hint(failure, label, fallback_path));
            };
        if let Some((path, sheet)) = self.sheet.as_ref().filter(|(_, sheet)| !sheet.is_empty()) {
            let metadata = &self.metadata;
            let written = sheet.write(path, metadata);
            record_result(path, "sheet", written, &mut || sheet.to_png(metadata));
        }
        for (path, animation) in self
            .animations
            .iter_mut()
            .filter(|(_, animation)| !animation.is_empty())
        {
            let written = animation.write(path);
            record_result(path, "animation", written, &mut || animation.to_bytes());
        }
        failed.map_or(Ok(names), Err)
    }

    /// Writes sheet and animations of an interrupted run under new names, which replace no file.
    /// Returns the new names.
    pub fn write_partial_files(
        &mut self,
        is_free: impl Fn(&Path) -> bool,
    ) -> Result<Vec<String>, Error> {
        let sheet = self.sheet.as_ref().filter(|(_, sheet)| !sheet.is_empty());
        let sheet = sheet.map(|(path, sheet)| (path.clone(), sheet.to_png(&self.metadata)));
        let animations = self
            .animations
            .iter_mut()
            .filter(|(_, animation)| !animation.is_empty());
        let animations = animations.map(|(path, animation)| (path.clone(), animation.to_bytes()));
        let files: Vec<_> = sheet.into_iter().chain(animations).collect();
        files
            .into_iter()
            .map(|(path, bytes)| {
                let bytes = bytes.map_err(|cause| Error::unwritable(&path, &cause))?;
                output::write_file_without_overwriting(
                    &output::partial_picture_path(&path),
                    &bytes,
                    &is_free,
                )
                .map(|name| printable_path(&name))
            })
            .collect()
    }
}
