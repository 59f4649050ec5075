//! The viewer's current view as a `render` command: the flags with which the program was started,
//! and the flags changed on the viewer's web page.

use std::ffi::OsString;

use crate::args::{self, Flag};
use crate::embedded::EmbeddedCommand;
use crate::failure::{Exit, Failure};
use crate::origin;

/// Flags that the viewer's web page may set. No such flag names a file, raises a limit or grants
/// access.
const PAGE_FLAGS: [&str; 34] = [
    "animation",
    "at",
    "camera",
    "clamp",
    "crop",
    "denoise",
    "edges",
    "exposure",
    "eye",
    "fit",
    "fov",
    "gamma",
    "ground",
    "integrator",
    "max-depth",
    "max-error",
    "no-denoise",
    "ortho",
    "precision",
    "quick",
    "rung",
    "scene",
    "seed",
    "set",
    "size",
    "spp",
    "studio",
    "target",
    "tonemap",
    "up",
    "variant",
    "view",
    "without",
    "zoom",
];

/// Largest number of flags that the web page may set.
const MOST_FLAGS: usize = 200;
/// Largest length in bytes of a flag's value that the web page may set.
const MOST_FLAG_BYTES: usize = 1000;

/// The `render` command of the current view: a scene, and the flags that the web page cannot
/// change.
#[derive(Clone, Debug)]
pub struct ViewCommand {
    /// Name of the scene on the command line.
    scene: OsString,
    /// Flags of the program's command line that the web page cannot change.
    fixed_flags: Vec<Flag>,
}

impl ViewCommand {
    /// Splits the `render` flags of the program's command line. Returns the command with the flags
    /// that the web page cannot change, and a list of the flags that the page may change.
    pub fn from_command_line(scene: OsString, words: Vec<OsString>) -> (Self, Vec<Flag>) {
        let (own, fixed) = args::list_render_flags(words)
            .into_iter()
            .partition(|(name, _)| PAGE_FLAGS.contains(&name.as_str()));
        (
            Self {
                scene,
                fixed_flags: fixed,
            },
            own,
        )
    }

    /// Refuses flags and values that the web page may not set.
    pub fn check_page_flags(flags: &[Flag]) -> Result<(), Failure> {
        let refuse = |reason: String| Err(Failure::new(Exit::Usage, reason));
        if flags.len() > MOST_FLAGS {
            return refuse(format!(
                "the page sets more flags than the limit of {MOST_FLAGS}; reload the page"
            ));
        }
        for (name, value) in flags {
            let value = value.as_deref().unwrap_or_default();
            if !PAGE_FLAGS.contains(&name.as_str()) {
                return refuse(format!(
                    "the page may not set --{name}; give this flag on the command line"
                ));
            }
            if value.len() > MOST_FLAG_BYTES || value.contains(char::is_control) {
                return refuse(format!(
                    "--{name}: the value is too long or contains control characters"
                ));
            }
        }
        Ok(())
    }

    /// Parses the `render` command that consists of the fixed flags and the flags set on the web
    /// page, `flags`.
    pub fn parse_render_command(&self, flags: &[Flag]) -> Result<EmbeddedCommand, Failure> {
        let word = |(name, value): &Flag| match value {
            Some(value) => OsString::from(format!("--{name}={value}")),
            None => OsString::from(format!("--{name}")),
        };
        EmbeddedCommand::new(
            "render",
            self.fixed_flags.iter().chain(flags).map(word).collect(),
        )
    }

    /// Formats the `render` command for a shell, quoted: the scene, the fixed flags and the flags
    /// set on the web page, `flags`.
    pub fn to_shell_text(&self, flags: &[Flag]) -> String {
        let mut words = vec![OsString::from("render"), self.scene.clone()];
        for (name, value) in self.fixed_flags.iter().chain(flags) {
            match value.as_deref() {
                Some(value) if value.starts_with('-') || value.is_empty() => {
                    words.push(format!("--{name}={value}").into())
                }
                Some(value) => words.extend([format!("--{name}").into(), value.into()]),
                None => words.push(format!("--{name}").into()),
            }
        }
        origin::format_command(&words)
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::args::Arguments;

    fn command(words: &str) -> (ViewCommand, Vec<Flag>) {
        let words = ["raywright", "view", "a b.glb"]
            .into_iter()
            .chain(words.split_whitespace())
            .map(OsString::from)
            .collect();
        ViewCommand::from_command_line("a b.glb".into(), words)
    }

    /// Protects: the web page and its command start with the `render` flags that the user typed,
    /// lists and switches included. The page cannot change flags that name files or raise limits.
    #[test]
    fn a_command_is_what_was_typed() {
        let (line, flags) = command(
            "--set a=1 --set b=-2 --denoise --without shadows,highlights --at=-1 --allow-outside --env sky.hdr --linger 5s -q",
        );
        let names: Vec<&str> = flags.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names.len(), 5, "{names:?}");
        let text = line.to_shell_text(&flags);
        assert!(text.starts_with("raywright render 'a b.glb' "), "{text}");
        for part in [
            "--set a=1",
            "--set b=-2",
            "--denoise",
            "--without shadows,highlights",
            "--at=-1",
            "--allow-outside",
            "--env sky.hdr",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(!text.contains("linger"), "{text}");
        assert!(line.parse_render_command(&flags).is_ok());
    }

    /// Protects: the web page cannot set a flag that reads or writes a file, raises a limit or lets
    /// a scene read elsewhere.
    #[test]
    fn a_page_has_no_files() {
        for name in [
            "output",
            "env",
            "allow-outside",
            "max-memory",
            "threads",
            "checkpoint",
            "resume",
            "stats",
            "sheet",
            "aov",
            "no-such",
        ] {
            assert!(
                ViewCommand::check_page_flags(&[(name.to_owned(), Some("x".to_owned()))]).is_err(),
                "{name}"
            );
        }
        let known = Arguments::command();
        let render = known.find_subcommand("render").expect("a command");
        for name in PAGE_FLAGS {
            assert!(
                render
                    .get_arguments()
                    .any(|arg| arg.get_long() == Some(name)),
                "{name}"
            );
            assert!(
                ViewCommand::check_page_flags(&[(name.to_owned(), Some("x".to_owned()))]).is_ok(),
                "{name}"
            );
        }
        let long = "x".repeat(MOST_FLAG_BYTES + 1);
        assert!(ViewCommand::check_page_flags(&[("set".to_owned(), Some(long))]).is_err());
        assert!(
            ViewCommand::check_page_flags(&[("set".to_owned(), Some("a\n".to_owned()))]).is_err()
        );
        assert!(
            ViewCommand::check_page_flags(&vec![("denoise".to_owned(), None); MOST_FLAGS + 1])
                .is_err()
        );
    }
}
