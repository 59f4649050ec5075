//! Files that hold all pictures of a run: a contact sheet and animations.

use std::io;
use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::picture::Picture;
use raywright_io::Error;
use raywright_io::output::{self, AnimationFormat, AnimationWriter, ContactSheet, PictureMetadata};

use crate::commands::render::write;
use crate::failure::Failure;
use crate::origin;
use crate::plan::RenderTask;
use crate::targets::{FreePaths, OutputFiles, printable_path};

/// The contact sheet and the animations of a run, each with the pictures so far.
pub struct CombinedFiles {
    files: Vec<(PathBuf, CombinedFile)>,
    metadata: PictureMetadata,
}

/// A file that holds all pictures of a run.
enum CombinedFile {
    Sheet(ContactSheet),
    Animation(AnimationWriter),
}

impl CombinedFile {
    fn label(&self) -> &'static str {
        match self {
            Self::Sheet(_) => "sheet",
            Self::Animation(_) => "animation",
        }
    }

    fn is_empty(&self) -> bool {
        match self {
            Self::Sheet(sheet) => sheet.is_empty(),
            Self::Animation(animation) => animation.is_empty(),
        }
    }

    fn write(&mut self, path: &Path, metadata: &PictureMetadata) -> Result<(), Error> {
        match self {
            Self::Sheet(sheet) => sheet.write(path, metadata),
            Self::Animation(animation) => animation.write(path),
        }
    }

    fn encode(&mut self, metadata: &PictureMetadata) -> io::Result<Vec<u8>> {
        match self {
            Self::Sheet(sheet) => sheet.to_png(metadata),
            Self::Animation(animation) => animation.to_bytes(),
        }
    }
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
            true => origin::program_metadata(),
        };
        let mut files = Vec::new();
        if let Some(path) = &task.files.sheet {
            let kind = ("png", "--sheet writes a PNG file");
            outputs.add_output_of_type(path, "--sheet", kind)?;
            files.push((path.clone(), CombinedFile::Sheet(ContactSheet::new(count))));
        }
        for path in &task.files.pictures {
            let Some(format) = AnimationFormat::from_path(path) else {
                continue;
            };
            outputs.add_output(path, "-o")?;
            let rate = task.files.frame_rate;
            let animation = AnimationWriter::new(path, format, rate, metadata.clone())?;
            files.push((path.clone(), CombinedFile::Animation(animation)));
        }
        Ok(Self { files, metadata })
    }

    /// Whether any of these files is requested.
    pub fn is_requested(&self) -> bool {
        !self.files.is_empty()
    }

    /// Adds a picture to all files.
    pub fn add_picture(
        &mut self,
        picture: &Picture,
        display: Display,
        caption: &str,
    ) -> Result<(), Failure> {
        for (path, file) in &mut self.files {
            match file {
                CombinedFile::Sheet(sheet) => sheet.add_picture(picture, display, caption),
                CombinedFile::Animation(animation) => animation
                    .add_picture(picture, display)
                    .map_err(|cause| Error::unwritable(path, &cause))?,
            }
        }
        Ok(())
    }

    /// Writes all files that hold a picture, and returns their names. If a file cannot be written,
    /// its content is kept elsewhere, and the failure names this copy.
    pub fn write_all(&mut self, free: FreePaths<'_>) -> Result<Vec<String>, Failure> {
        let (mut names, mut failed) = (Vec::new(), None);
        let metadata = &self.metadata;
        for (path, file) in self.files.iter_mut().filter(|(_, file)| !file.is_empty()) {
            let Err(error) = file.write(path, metadata) else {
                names.push(printable_path(path));
                continue;
            };
            let copy = file.encode(metadata).ok().and_then(|bytes| {
                write::write_to_fallback(path, free, |path, is_free| {
                    output::write_new_file(path, &bytes, is_free)
                })
            });
            let failure = failed.take().unwrap_or_else(|| Failure::from(error));
            failed = Some(write::with_fallback_hint(failure, file.label(), copy));
        }
        failed.map_or(Ok(names), Err)
    }

    /// Writes sheet and animations of an interrupted run under new names, which replace no file.
    /// Returns the new names.
    pub fn write_partial_files(&mut self, free: FreePaths<'_>) -> Result<Vec<String>, Error> {
        let mut names = Vec::new();
        for (path, file) in self.files.iter_mut().filter(|(_, file)| !file.is_empty()) {
            let bytes = file.encode(&self.metadata);
            let bytes = bytes.map_err(|cause| Error::unwritable(path, &cause))?;
            names.push(free.write_partial_file(path, &bytes)?);
        }
        Ok(names)
    }
}
