//! Runs the program in a fresh folder and checks its output, with messages that show both.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use raywright::core::picture::Picture;
use raywright::io::output::{StoredPicture, read_picture};
use raywright::io::{Limits, presets};

/// Whether a preset is built in: its scene file may have been deleted, and other tests still run.
pub fn carried(preset: &str) -> bool {
    let carried = presets::names().any(|known| known == preset);
    if !carried {
        eprintln!("skipped: the program carries no preset {preset}");
    }
    carried
}

/// Path of the shared data beside the checkout; `None`, with a line that `.ci/run` counts, if it is
/// missing.
pub fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared")
        .join(name);
    if !path.exists() {
        eprintln!("skipped: shared data not found ({})", path.display());
        return None;
    }
    Some(path)
}

/// A fresh folder in which the program runs; deleted after the test.
pub struct Sandbox {
    folder: tempfile::TempDir,
}

/// Result of a run.
pub struct ProgramRun {
    /// Exit code; `None` after a signal.
    pub code: Option<i32>,
    /// Standard output as bytes, because it may be a picture.
    pub stdout: Vec<u8>,
    /// Standard error.
    pub stderr: String,
    command: String,
}

impl Sandbox {
    /// Creates an empty folder.
    pub fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    /// Path of a file in the folder.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file to the folder.
    pub fn write(&self, name: impl AsRef<Path>, contents: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), contents).expect("the folder can be written to");
    }

    /// Names of the folder's files, in order.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).expect("a folder");
        let mut names: Vec<String> = entries
            .map(|entry| {
                entry
                    .expect("readable")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    }

    /// Reads a picture file with its metadata.
    pub fn stored(&self, name: &str) -> StoredPicture {
        read_picture(&self.path(name), &Limits::default()).expect("a picture that can be read")
    }

    /// Reads the picture in a file.
    pub fn picture(&self, name: &str) -> Picture {
        self.stored(name).picture
    }

    /// Returns the command with its arguments, not yet started.
    pub fn command<A: AsRef<OsStr>>(&self, args: &[A]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_raywright"));
        command
            .args(args)
            .current_dir(self.folder.path())
            .stdin(Stdio::null());
        command
    }

    /// Runs the program to its end.
    pub fn run<A: AsRef<OsStr>>(&self, args: &[A]) -> ProgramRun {
        ProgramRun::of(
            args,
            self.command(args).output().expect("the program starts"),
        )
    }
}

impl Sandbox {
    /// Runs the program to its end with these bytes on standard input.
    pub fn pipe<A: AsRef<OsStr>>(&self, args: &[A], bytes: &[u8]) -> ProgramRun {
        self.write("pipe", bytes);
        let source = std::fs::File::open(self.path("pipe")).expect("just written");
        let output = self
            .command(args)
            .stdin(source)
            .output()
            .expect("the program starts");
        std::fs::remove_file(self.path("pipe")).expect("it is there");
        ProgramRun::of(args, output)
    }
}

impl ProgramRun {
    fn of<A: AsRef<OsStr>>(args: &[A], output: Output) -> Self {
        let words: Vec<_> = args
            .iter()
            .map(|word| word.as_ref().to_string_lossy())
            .collect();
        Self {
            code: output.status.code(),
            stdout: output.stdout,
            stderr: String::from_utf8(output.stderr).expect("messages are UTF-8"),
            command: format!("raywright {}", words.join(" ")),
        }
    }

    /// Standard output as text.
    pub fn text(&self) -> &str {
        std::str::from_utf8(&self.stdout).expect("text on standard output")
    }

    /// Asserts the exit code; a failure shows the program's messages.
    #[track_caller]
    pub fn exits_with(&self, code: i32) -> &Self {
        assert_eq!(
            self.code,
            Some(code),
            "{}\nstderr:\n{}",
            self.command,
            self.stderr
        );
        self
    }

    /// Asserts that standard error contains this text.
    #[track_caller]
    pub fn prints_like(&self, expected: &str) -> &Self {
        assert!(
            self.stderr.contains(expected),
            "{}\n--- said\n{}\n--- expected in it\n{expected}\n---",
            self.command,
            self.stderr
        );
        self
    }

    /// Asserts that standard error is exactly this text.
    #[track_caller]
    pub fn prints(&self, expected: &str) -> &Self {
        assert!(
            self.stderr.trim_end() == expected.trim_end(),
            "{}\n--- said\n{}\n--- expected\n{expected}\n---",
            self.command,
            self.stderr
        );
        self
    }
}
