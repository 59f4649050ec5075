//! Messages of a run in addition to its result. With `-v` each message is printed at once, and with
//! `-q` none. Otherwise the messages are printed at the end of the run, a line for each file with a
//! problem.

use std::cmp::Reverse;
use std::collections::HashSet;

use raywright_core::fault::{Fault, FaultKind, Severity};

use crate::console::{self, Verbosity, mask_to_one_line};

/// Importance of a message; greater values are printed first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum MessagePriority {
    /// Information without a defect, such as a choice that the program made automatically.
    Note,
    /// Advice for a better picture.
    Hint,
    /// A defect of the picture. The first kinds come first.
    Warning(Reverse<FaultKind>),
}

impl From<&Fault> for MessagePriority {
    fn from(fault: &Fault) -> Self {
        match fault.severity {
            Severity::Harmless => Self::Note,
            Severity::SlowOrNoisy => Self::Hint,
            Severity::PictureWrong | Severity::NoPicture => Self::Warning(Reverse(fault.kind)),
        }
    }
}

/// A message that is printed at the end of the run.
#[derive(Debug)]
struct QueuedMessage {
    priority: MessagePriority,
    /// Number of the message's file in the order of the run.
    file: usize,
    text: String,
}

/// Messages of a run. They are kept for the end of the run, except in verbose runs, which print
/// them at once.
#[derive(Debug)]
pub struct Notes {
    verbosity: Verbosity,
    /// Name of the current scene, which is put before its messages; `None` in a run of a single
    /// scene.
    current_scene: Option<String>,
    /// Number of scene files so far.
    file: usize,
    messages: Vec<QueuedMessage>,
    /// Whether later messages are dropped.
    is_silent: bool,
    /// Texts of all kept messages, by which a repeated message is recognised and dropped.
    texts: HashSet<String>,
}

/// Largest number of files with a line of their own in the output.
const MOST_FILES: usize = 20;

impl Notes {
    /// Creates a collection without messages.
    pub fn new(verbosity: Verbosity) -> Self {
        Self {
            verbosity,
            current_scene: None,
            file: 0,
            messages: Vec::new(),
            is_silent: false,
            texts: HashSet::new(),
        }
    }

    /// Sets the scene file to which all later messages belong.
    pub fn set_current_file(&mut self, name: &str) {
        self.current_scene = Some(name.to_owned());
        self.file += 1;
    }

    /// Sets whether later messages are dropped.
    pub fn set_silent(&mut self, is_silent: bool) {
        self.is_silent = is_silent;
    }

    /// Adds a warning about a picture that is incomplete or wrong.
    pub fn add_warning(&mut self, message: impl Into<String>) {
        self.queue_message(
            MessagePriority::Warning(Reverse(FaultKind::More)),
            message.into(),
        );
    }

    /// Adds a warning about a whole picture: it is empty, black, white or not converged. It comes
    /// before warnings about parts of a picture.
    pub fn add_picture_warning(&mut self, message: impl Into<String>) {
        self.queue_message(
            MessagePriority::Warning(Reverse(FaultKind::NothingSeen)),
            message.into(),
        );
    }

    /// Adds advice for a better picture.
    pub fn add_hint(&mut self, message: impl Into<String>) {
        self.queue_message(MessagePriority::Hint, message.into());
    }

    /// Adds a note on a choice that the program made automatically, such as an added sky.
    pub fn add_note(&mut self, message: impl Into<String>) {
        self.queue_message(MessagePriority::Note, message.into());
    }

    /// Prints a message at once, in verbose runs only.
    pub fn print_detail(&self, message: impl std::fmt::Display) {
        if !self.is_silent {
            self.verbosity.print_detail(message);
        }
    }

    /// Adds faults by their severity, each as a warning, a hint or a note.
    pub fn add_faults(&mut self, faults: &[Fault]) {
        for fault in faults {
            self.queue_message(fault.into(), mask_to_one_line(&fault.to_string()));
        }
    }

    fn queue_message(&mut self, weight: MessagePriority, message: String) {
        if self.is_silent {
            return;
        }
        let text = match &self.current_scene {
            Some(name) if !message.starts_with(name.as_str()) => format!("{name}: {message}"),
            _ => message,
        };
        if self.verbosity == Verbosity::Verbose {
            return console::print_message(with_label(weight, &text));
        }
        if self.texts.insert(text.clone()) {
            self.messages.push(QueuedMessage {
                priority: weight,
                file: self.file,
                text,
            });
        }
    }

    /// Returns the texts of the kept messages, for a program that uses this crate as a library.
    pub fn into_texts(self) -> Vec<String> {
        self.messages
            .into_iter()
            .map(|message| message.text)
            .collect()
    }

    /// Prints the kept messages, a line for each file with a problem, and removes them from the
    /// collection.
    pub fn print_kept_messages(&mut self) {
        if self.verbosity == Verbosity::Normal {
            self.format_message_lines()
                .iter()
                .for_each(console::print_message);
        }
        (self.messages, self.texts) = (Vec::new(), HashSet::new());
    }

    /// Formats a line for each file with a warning, worst file first: its worst message, and the
    /// number of its other messages. Without any warning, a single line sums up the messages of all
    /// files.
    fn format_message_lines(&self) -> Vec<String> {
        let is_fine = !self
            .messages
            .iter()
            .any(|message| matches!(message.priority, MessagePriority::Warning(_)));
        let same = |a: &QueuedMessage, b: &QueuedMessage| is_fine || a.file == b.file;
        let mut lines: Vec<(MessagePriority, String)> = self
            .messages
            .chunk_by(same)
            .filter_map(summarise_file_messages)
            .collect();
        lines.sort_by_key(|(weight, _)| Reverse(*weight));
        if !is_fine {
            lines.retain(|(weight, _)| matches!(weight, MessagePriority::Warning(_)));
        }
        let hidden = lines.len().saturating_sub(MOST_FILES);
        let mut lines: Vec<String> = lines
            .into_iter()
            .take(MOST_FILES)
            .map(|(_, line)| line)
            .collect();
        if hidden > 0 {
            lines.push(format!(
                "warning: {hidden} more files have warnings; -v lists them"
            ));
        }
        lines
    }
}

/// Formats the first of the most important messages of a file, and the number of its other
/// messages. Returns the importance and the text; `None` without messages.
fn summarise_file_messages(messages: &[QueuedMessage]) -> Option<(MessagePriority, String)> {
    let most = messages.iter().map(|message| message.priority).max()?;
    let first = messages.iter().find(|message| message.priority == most)?;
    let more = match messages.len() - 1 {
        0 => String::new(),
        n => format!(" (further messages: {n}; -v lists them)"),
    };
    Some((most, with_label(most, &first.text) + &more))
}

fn with_label(weight: MessagePriority, message: &str) -> String {
    let label = if matches!(weight, MessagePriority::Warning(_)) {
        "warning"
    } else {
        "note"
    };
    format!("{label}: {message}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the first of the worst messages is printed with the number of the others; repeated
    /// messages count once.
    #[test]
    fn one_line_has_what_matters_most() {
        let mut notes = Notes::new(Verbosity::Normal);
        assert!(notes.format_message_lines().is_empty());
        notes.add_note("a sky is added");
        assert_eq!(notes.format_message_lines(), ["note: a sky is added"]);
        notes.add_warning("a is missing");
        notes.add_hint("try this");
        notes.add_warning("c is missing");
        notes.add_warning("a is missing");
        notes.add_picture_warning("nothing to see");
        assert_eq!(
            notes.format_message_lines(),
            ["warning: nothing to see (further messages: 4; -v lists them)"]
        );
    }

    /// Protects: every file with a problem has a line, whatever other files have, and a file
    /// without problems has none.
    #[test]
    fn each_file_with_a_problem_has_a_line() {
        let mut notes = Notes::new(Verbosity::Normal);
        notes.set_current_file("a.glb");
        notes.add_note("shown at rest");
        notes.set_current_file("b.glb");
        notes.add_warning("b.glb: c is missing");
        notes.add_note("shown at rest");
        notes.set_current_file("c.glb");
        notes.add_faults(&[FaultKind::Picture.in_file("c.glb", "d is missing")]);
        assert_eq!(
            notes.format_message_lines(),
            [
                "warning: c.glb: d is missing",
                "warning: b.glb: c is missing (further messages: 1; -v lists them)"
            ]
        );
        for file in 0..30 {
            notes.set_current_file(&format!("{file}.glb"));
            notes.add_warning("e is missing");
        }
        let lines = notes.format_message_lines();
        assert_eq!(
            (lines.len(), lines.last().map(String::as_str)),
            (
                21,
                Some("warning: 12 more files have warnings; -v lists them")
            )
        );
        let mut fine = Notes::new(Verbosity::Normal);
        for file in ["a.glb", "b.glb"] {
            fine.set_current_file(file);
            fine.add_note("shown at rest");
        }
        assert_eq!(
            fine.format_message_lines(),
            ["note: a.glb: shown at rest (further messages: 1; -v lists them)"]
        );
    }
}
