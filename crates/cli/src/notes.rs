//! What a run has to say besides its result: all of it with `-v`, one line of it otherwise, and nothing with `-q`.

use raywright_io::Loaded;

use crate::console::{self, Verbosity};

/// What matters more is said first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Weight {
    /// What the program did by itself.
    Note,
    /// What would make the picture better.
    Hint,
    /// What is wrong with it.
    Warning,
}

/// Messages that wait for the end of a run.
#[derive(Debug)]
pub struct Notes {
    verbosity: Verbosity,
    /// What they are about, where a run has several scenes.
    about: Option<String>,
    kept: Vec<(Weight, String)>,
}

impl Notes {
    /// None yet.
    pub fn new(verbosity: Verbosity) -> Self {
        Self { verbosity, about: None, kept: Vec::new() }
    }

    /// What follows is about this file.
    pub fn turn_to(&mut self, name: &str) {
        self.about = Some(name.to_owned());
    }

    /// Something that the user should know although the picture is made.
    pub fn warn(&mut self, message: impl Into<String>) {
        self.add(Weight::Warning, message.into());
    }

    /// Something to try.
    pub fn hint(&mut self, message: impl Into<String>) {
        self.add(Weight::Hint, message.into());
    }

    /// Something that was done unasked.
    pub fn note(&mut self, message: impl Into<String>) {
        self.add(Weight::Note, message.into());
    }

    /// What those want to know who ask for more, with a word before it or without.
    pub fn detail(&self, message: impl std::fmt::Display) {
        self.verbosity.detail(message);
    }

    /// The warnings that came with a scene.
    pub fn warn_of(&mut self, loaded: &Loaded) {
        loaded.warnings.iter().for_each(|warning| self.warn(&warning.message));
    }

    fn add(&mut self, weight: Weight, message: String) {
        let message = match &self.about {
            Some(name) if !message.starts_with(name.as_str()) => format!("{name}: {message}"),
            _ => message,
        };
        if self.verbosity == Verbosity::Verbose {
            return console::tell(labelled(weight, &message));
        }
        if !self.kept.iter().any(|(_, kept)| *kept == message) {
            self.kept.push((weight, message));
        }
    }

    /// Says what was kept in one line: the first of what matters most, and how much more there is.
    pub fn finish(&mut self) {
        if let Some(line) = self.line().filter(|_| self.verbosity == Verbosity::Normal) {
            console::tell(line);
        }
        self.kept.clear();
    }

    fn line(&self) -> Option<String> {
        let most = self.kept.iter().map(|(weight, _)| *weight).max()?;
        let (_, first) = self.kept.iter().find(|(weight, _)| *weight == most)?;
        let more = match self.kept.len() - 1 {
            0 => String::new(),
            n => format!(" (and {n} more: -v)"),
        };
        Some(labelled(most, first) + &more)
    }
}

fn labelled(weight: Weight, message: &str) -> String {
    let label = if weight == Weight::Warning { "warning" } else { "note" };
    format!("{label}: {message}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the first of the weightiest messages is the one that is said, with the number of the others; what is said twice counts once.
    #[test]
    fn one_line_has_what_matters_most() {
        let mut notes = Notes::new(Verbosity::Normal);
        assert_eq!(notes.line(), None);
        notes.note("a sky is added");
        assert_eq!(notes.line().as_deref(), Some("note: a sky is added"));
        notes.turn_to("b.glb");
        notes.warn("a is missing");
        notes.hint("try this");
        notes.warn("b.glb: c is missing");
        notes.warn("a is missing");
        assert_eq!(notes.line().as_deref(), Some("warning: b.glb: a is missing (and 3 more: -v)"));
    }
}
