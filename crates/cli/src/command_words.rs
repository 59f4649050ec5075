//! Preprocessing of the command line before clap parses it: files without a command are rendered.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use clap::{CommandFactory, ValueEnum};

use crate::args::Arguments;
use crate::console::ColorChoice;

/// Inserts `render` if the command is missing: before files, and before flags that only some
/// commands have. Flags that every command has, such as `-q`, are moved behind the command. Of
/// repeated flags, the last then applies.
pub fn insert_command(mut words: Vec<OsString>) -> Vec<OsString> {
    let Some(index) = find_command_index(&words) else {
        return words;
    };
    let has_command = Arguments::command()
        .get_subcommands()
        .any(|command| words[index] == command.get_name());
    if has_command {
        words[1..=index].rotate_right(1);
    } else if is_flag(&words[index]) || is_scene_name(&words[index]) {
        words.insert(1, "render".into());
    }
    words
}

/// Returns the index of the command, or of the word before which a command is missing; `None` if
/// the line needs no command, as for `--help`.
fn find_command_index(words: &[OsString]) -> Option<usize> {
    let mut index = 1;
    while let Some(word) = words.get(index).and_then(|word| word.to_str()) {
        match word {
            "-q" | "-v" | "--quiet" | "--verbose" => index += 1,
            "--color" => index += 2,
            _ if word.starts_with("--color=") => index += 1,
            "-h" | "--help" | "-V" | "--version" | "help" => return None,
            _ => break,
        }
    }
    (index < words.len()).then_some(index)
}

fn is_flag(word: &OsStr) -> bool {
    word.to_str()
        .is_some_and(|word| word.len() > 1 && word.starts_with('-'))
}

/// Whether a word in place of a command is probably the name of a scene. Any other word is a
/// misspelled command.
fn is_scene_name(word: &OsStr) -> bool {
    let looks =
        |word: &str| word == "-" || word.starts_with("preset:") || word.contains(['.', '/']);
    word.to_str().is_none_or(looks) || Path::new(word).exists()
}

/// Returns the last value of `--color` on the line, before clap parses it.
pub fn find_colour_choice(words: &[OsString]) -> ColorChoice {
    let named = |name: &str| ColorChoice::from_str(name, false).ok();
    let after = |(i, word): (usize, &str)| match word.strip_prefix("--color") {
        Some("") => words
            .get(i + 1)
            .and_then(|word| word.to_str())
            .and_then(named),
        Some(rest) => rest.strip_prefix('=').and_then(named),
        None => None,
    };
    words
        .iter()
        .enumerate()
        .rev()
        .find_map(|(i, word)| after((i, word.to_str()?)))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<OsString> {
        line.split(' ').map(OsString::from).collect()
    }

    /// Protects: files and flags alone mean a render; commands, requests for help and other words
    /// are left unchanged.
    #[test]
    fn files_alone_are_rendered() {
        let full = |line| {
            insert_command(words(line))
                .join(OsStr::new(" "))
                .into_string()
                .expect("text")
        };
        for (line, expected) in [
            ("raywright a.glb b.glb", "raywright render a.glb b.glb"),
            (
                "raywright -q --color never preset:x",
                "raywright render -q --color never preset:x",
            ),
            (
                "raywright --color=auto - -o -",
                "raywright render --color=auto - -o -",
            ),
            (
                "raywright -q -v info a.glb -q",
                "raywright info -q -v a.glb -q",
            ),
            ("raywright -s 4x3 a.glb", "raywright render -s 4x3 a.glb"),
        ] {
            assert_eq!(full(line), expected);
        }
        for line in [
            "raywright",
            "raywright -q",
            "raywright info a.glb",
            "raywright rendr",
            "raywright --help",
        ] {
            assert_eq!(full(line), line);
        }
    }

    /// Protects: the last `--color` is in force, however it is spelled.
    #[test]
    fn colours_are_found_early() {
        assert_eq!(
            find_colour_choice(&words("raywright rendr --color never --color=always")),
            ColorChoice::Always
        );
        assert_eq!(
            find_colour_choice(&words("raywright --color")),
            ColorChoice::Auto
        );
    }
}
