//! The program as a library for modules of other languages. Scenes are given as data; all other
//! arguments are flags of the command line, with the same meaning and the same messages. Nothing is
//! printed, no thread is started and no signal is handled: the work runs on the caller's thread
//! pool and checks an observer for cancellation.
//!
//! ```
//! use raywright_cli::embedded::{EmbeddedCommand, load};
//! use raywright_io::Input;
//!
//! let model = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
//! let input = Input::Bytes { name: "sheet.obj".into(), bytes: model.to_vec(), resolver: None };
//! let request = EmbeddedCommand::new("render", ["--size=16x16", "--spp=4"].map(Into::into).to_vec())?;
//! let picture = request.render_picture(load(&input, &request.load_options(), &())?, &())?;
//! assert_eq!(picture.samples, "4 samples");
//! # Ok::<(), raywright_cli::failure::Failure>(())
//! ```

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Parser;
use raywright_core::Observer;
use raywright_io::{LoadOptions, LoadedScene};

use crate::args::{Arguments, Command};
pub use crate::commands::compare::ComparisonPicture;
use crate::commands::render::picture;
pub use crate::commands::render::picture::FinishedPicture;
use crate::commands::{accuracy, compare, explain};
use crate::failure::{Exit, Failure};
use crate::plan::{self, RenderTask};
pub use crate::scene_input::load_with_observer as load;
pub use crate::threads::thread_start_failure;
use crate::{origin, usage_failure};

/// A command of the program with its flags, without the names of its inputs.
pub struct EmbeddedCommand {
    /// The parsed command.
    command: Command,
    /// Flags as the caller gave them.
    words: Vec<OsString>,
}

impl EmbeddedCommand {
    /// Parses the flags of `render`, `explain`, `accuracy` or `compare`.
    ///
    /// A usage failure. Its message contains no usage line.
    pub fn new(command: &str, words: Vec<OsString>) -> Result<Self, Failure> {
        let arguments =
            Arguments::try_parse_from(add_input_names(command, &words)).map_err(|error| {
                let Failure { exit, message } = usage_failure(&error);
                let ends = ["\n\nUsage:", "\n\nFor more information"]
                    .map(|end| message.find(end).unwrap_or(message.len()));
                Failure {
                    exit,
                    message: message[..ends[0].min(ends[1])].to_owned(),
                }
            })?;
        let command = arguments
            .command
            .ok_or_else(|| Failure::new(Exit::Usage, "no command"))?;
        Ok(Self { command, words })
    }

    /// Returns the load options that the flags request.
    pub fn load_options(&self) -> LoadOptions {
        match &self.command {
            Command::Render(args) => {
                plan::build_load_options(&args.changes, args.machine.limits.max_memory)
            }
            Command::Accuracy(args) => plan::build_load_options(&args.changes, args.max_memory),
            Command::Explain(args) => plan::build_load_options(&args.changes, None),
            _ => LoadOptions::default(),
        }
    }

    /// Returns the requested number of threads; `None`: one for each processor.
    pub fn thread_count(&self) -> Option<u32> {
        match &self.command {
            Command::Render(args) => args.machine.limits.threads,
            Command::Accuracy(args) => args.threads,
            _ => None,
        }
    }

    /// Renders the picture of `render` for a scene that was loaded with
    /// [`EmbeddedCommand::load_options`].
    pub fn render_picture(
        &self,
        mut loaded: LoadedScene,
        observer: &dyn Observer,
    ) -> Result<FinishedPicture, Failure> {
        let command = self.equivalent_command_line("render", &loaded);
        picture::render_to_memory(&mut loaded, &self.resolve_render_task()?, command, observer)
    }

    /// Resolves the flags of `render` to the work of a run.
    pub(crate) fn resolve_render_task(&self) -> Result<RenderTask, Failure> {
        let Command::Render(args) = &self.command else {
            return Err(wrong_command_failure("a picture (`render`)"));
        };
        RenderTask::new((**args).clone())
    }

    /// Returns the JSON of `explain --json` or `accuracy --json` for a scene that was loaded with
    /// [`EmbeddedCommand::load_options`].
    pub fn report_json(
        &self,
        loaded: LoadedScene,
        observer: &dyn Observer,
    ) -> Result<String, Failure> {
        match &self.command {
            Command::Explain(args) => explain::run_embedded(args, loaded, observer),
            Command::Accuracy(args) => {
                let command = self.equivalent_command_line("accuracy", &loaded);
                let flags =
                    accuracy::format_measurement_flags(add_input_names("accuracy", &self.words));
                accuracy::run_embedded(args, loaded, (command, &flags), observer)
            }
            _ => Err(wrong_command_failure("a report (`explain` or `accuracy`)")),
        }
    }

    /// Returns the JSON of `compare --json` for two pictures in memory. `names` are the names of
    /// the pictures in the report. A measure of difference beyond its threshold is reported in the
    /// JSON and is no failure.
    pub fn comparison_json(
        &self,
        names: [PathBuf; 2],
        pair: &[ComparisonPicture; 2],
    ) -> Result<String, Failure> {
        let Command::Compare(args) = &self.command else {
            return Err(wrong_command_failure("a comparison (`compare`)"));
        };
        compare::run_embedded(args, names, pair)
    }

    /// Returns the equivalent command line of the program.
    fn equivalent_command_line(&self, command: &str, loaded: &LoadedScene) -> String {
        let first = [OsString::from(command), OsString::from(&loaded.source.name)];
        origin::format_command(&[&first, self.words.as_slice()].concat())
    }
}

/// Returns the command line of a command, with placeholder names of the inputs that it requires.
fn add_input_names(command: &str, words: &[OsString]) -> Vec<OsString> {
    let names: &[&str] = match command {
        "compare" => &["raywright", command, "a", "b"],
        _ => &["raywright", command, "scene"],
    };
    let names = names.iter().map(OsString::from);
    names.chain(words.iter().cloned()).collect()
}

fn wrong_command_failure(label: &str) -> Failure {
    Failure::new(
        Exit::Usage,
        format_args!("this call needs a command that makes {label}"),
    )
}

#[cfg(test)]
mod tests {
    use raywright_io::Input;

    use super::*;

    fn request(command: &str, words: &[&str]) -> Result<EmbeddedCommand, Failure> {
        EmbeddedCommand::new(command, words.iter().map(OsString::from).collect())
    }

    /// Protects: flags mean the same as on the command line, a wrong flag gives the same message,
    /// and flags for files are refused.
    #[test]
    fn words_are_those_of_the_program() {
        let request = |words: &[&str]| request("render", words);
        let failure = request(&["--sizee=4x4"]).err().expect("no such flag");
        assert_eq!(failure.exit, Exit::Usage);
        assert!(
            failure
                .message
                .ends_with("a similar argument exists: '--size'"),
            "{}",
            failure.message
        );
        assert!(
            request(&["--samples=4"])
                .err()
                .is_some_and(|failure| failure.message.contains("--spp"))
        );
        let sheet = Input::Bytes {
            name: "a.obj".into(),
            bytes: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec(),
            resolver: None,
        };
        let picture = |words: &[&str]| {
            let request = request(words)?;
            request.render_picture(load(&sheet, &request.load_options(), &())?, &())
        };
        let made = picture(&["--size=8x4", "--spp=16", "--view=front", "--max-error=1"])
            .expect("a picture");
        assert_eq!(
            (
                made.shown_picture().width,
                made.shown_picture().height,
                made.converged
            ),
            (8, 4, Some(true))
        );
        assert_eq!(
            made.metadata.command,
            "raywright render a.obj --size=8x4 --spp=16 --view=front --max-error=1"
        );
        for words in [
            &["--output=x.png"][..],
            &["--checkpoint=x.film"],
            &["--views=front,left"],
            &["--hash"],
        ] {
            assert!(
                picture(words).is_err_and(|failure| failure.message.contains(&words[0][..6])),
                "{words:?}"
            );
        }
    }

    /// Protects: reports equal those of the program, and a comparison beyond its threshold is
    /// reported without a failure.
    #[test]
    fn reports_are_handed_over() {
        let sheet = Input::Bytes {
            name: "a.obj".into(),
            bytes: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec(),
            resolver: None,
        };
        let loaded = || load(&sheet, &LoadOptions::default(), &()).expect("a scene");
        let explained = request("explain", &[])
            .and_then(|request| request.report_json(loaded(), &()))
            .expect("a report");
        assert!(explained.contains("\"scene\": \"a.obj\""), "{explained}");
        let picture = |seed: &str| {
            let request = request(
                "render",
                &["--size=8x8", "--spp=4", "--integrator=path", seed],
            )
            .expect("a command");
            request.render_picture(loaded(), &()).expect("a picture")
        };
        let pair = [picture("--seed=1"), picture("--seed=2")]
            .map(|of| ComparisonPicture::from_memory(of.shown_picture(), of.display, &of.metadata));
        let compared = request("compare", &["--max-rmse=0"])
            .and_then(|request| request.comparison_json(["a", "b"].map(PathBuf::from), &pair));
        assert!(compared.expect("a comparison").contains("\"RMSE "));
    }
}
