//! Outcome of a run of pictures: its final message, and the failure with which it ends.

use raywright_io::report::{format_duration, format_significant_digits};

use crate::failure::{Exit, Failure};

/// Outcome of the pictures so far.
#[derive(Default)]
pub struct RunSummary {
    /// Names of the written files of each finished picture.
    pub written_files: Vec<Vec<String>>,
    /// Number of finished pictures.
    pub finished: usize,
    /// Two texts for the final message: the description of the last picture, and its size and
    /// samples, which stand for all pictures of a run.
    pub description: [String; 2],
    /// Largest root relMSE of all pictures of path tracing.
    pub error: Option<f64>,
    /// Exit codes of the failed scenes, in the order of the run.
    pub failed_exits: Vec<Exit>,
    /// Descriptions of the pictures that do not reach the target error.
    pub shortfalls: Vec<String>,
    /// Failure of a film file that could not be written.
    pub checkpoint_failure: Option<Failure>,
}

impl RunSummary {
    /// Formats the final message; `None` for a picture that went to standard output alone.
    /// `together` names the files that hold all pictures.
    pub fn format_message(&self, together: Vec<String>, seconds: f64) -> Option<String> {
        let files = [format_file_ranges(&self.written_files), together]
            .concat()
            .join(", ");
        let error = self
            .error
            .map(|error| format!(", errors up to {}", format_significant_digits(error, 2)))
            .unwrap_or_default();
        let [one, all] = &self.description;
        let described = match self.finished {
            1 => one.clone(),
            finished => format!("{finished} pictures, {all}{error}"),
        };
        match files.as_str() {
            "" if self.finished > 0 => None,
            "" => Some("nothing was written".to_owned()),
            files => Some(format!(
                "wrote {files} ({described}, {})",
                format_duration(seconds)
            )),
        }
    }

    /// Returns the result of a run of `scenes`: a failure if a scene failed, a film file could not be
    /// written, or a target error is not reached.
    pub fn into_result(self, is_single: bool, scenes: usize) -> Result<(), Failure> {
        if let Some(failure) = self.checkpoint_failure {
            return Err(failure);
        }
        if let Some(&exit) = self.failed_exits.first() {
            let message = format!(
                "{} of {scenes} scenes were not rendered (see the errors above)",
                self.failed_exits.len()
            );
            return Err(Failure::new(exit, message));
        }
        match self.shortfalls.as_slice() {
            [] => Ok(()),
            [message] if is_single => Err(Failure::new(Exit::Unreached, message)),
            [first, ..] => {
                let message = format!(
                    "{} of {} pictures do not reach their requested error; the first of them: {first}",
                    self.shortfalls.len(),
                    self.finished
                );
                Err(Failure::new(Exit::Unreached, message))
            }
        }
    }
}

/// Formats the written files for the final message: for each output, the range from the first
/// picture's file to the last picture's file.
pub fn format_file_ranges(names: &[Vec<String>]) -> Vec<String> {
    let (Some(first), Some(last)) = (names.first(), names.last()) else {
        return Vec::new();
    };
    let range = |(first, last): (&String, &String)| {
        if names.len() == 1 {
            first.clone()
        } else {
            format!("{first} to {last}")
        }
    };
    first.iter().zip(last).map(range).collect()
}
