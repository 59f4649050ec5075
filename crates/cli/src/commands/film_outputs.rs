//! Pictures of film files: `merge` and `denoise` write them in the same way.

use std::path::{Path, PathBuf};

use raywright_core::RenderOutput;
use raywright_io::InputFiles;
use raywright_io::output::StoredFilm;
use raywright_io::report::format_duration;

use super::render::{messages, write};
use crate::args::DisplayArgs;
use crate::failure::Failure;
use crate::session::Session;
use crate::targets::{self, OutputFiles, OutputTarget};
use crate::{origin, plan};

/// Outputs of a command that makes a picture of film files.
pub struct FilmOutputs {
    /// Film files that the command reads.
    pub inputs: InputFiles,
    /// Outputs for the picture.
    pub targets: Vec<OutputTarget>,
}

impl FilmOutputs {
    /// Resolves the picture outputs of `-o` and the film file of `--checkpoint`. None of them may be
    /// one of the films that the command reads.
    pub fn resolve(
        session: &mut Session,
        display: &DisplayArgs,
        (pictures, checkpoint): (&[PathBuf], Option<&Path>),
        films: &[PathBuf],
    ) -> Result<Self, Failure> {
        session.outputs = OutputFiles::with_quality(display.quality);
        let targets = targets::resolve_picture_targets(pictures, &mut session.outputs)?;
        if let Some(path) = checkpoint {
            session.outputs.add_output(path, "--checkpoint")?;
        }
        let mut inputs = InputFiles::default();
        films.iter().for_each(|film| inputs.record_read(film));
        session.outputs.check_against_inputs(&inputs)?;
        Ok(Self { inputs, targets })
    }

    /// Writes the picture of a film, and records its messages. Returns the names of the written files
    /// and the error of the picture for the final message, if known.
    pub fn write_picture(
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
        let is_free = |path: &Path| outputs.is_free_path(path, &self.inputs);
        let places = (&self.inputs, is_free);
        let written = write::write_targets(rendered, &self.targets, display, metadata, places)?;
        messages::note_lost_samples(&rendered.counters, notes);
        let error = messages::report_error(noisy.as_ref(), film, rendered, None, notes);
        Ok((written, error))
    }
}

/// Prints the notes, and the names of the written files with a description of the picture.
pub fn report_files(session: &mut Session, written: &[String], description: &str) {
    session.notes.print_kept_messages();
    if !written.is_empty() {
        session.verbosity.print_result_message(format_args!(
            "wrote {} ({description}, {})",
            written.join(", "),
            format_duration(session.clock.total_seconds())
        ));
    }
}
