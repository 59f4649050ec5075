//! Runs the program in a fresh folder and compares what it says, with a message that shows both.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use raywright::core::picture::Picture;
use raywright::io::output::{StoredPicture, read_picture};
use raywright::io::{Limits, presets};

/// Whether the program carries a preset: a scene file may be deleted, and what else there is stays
/// whole.
pub fn carried(preset: &str) -> bool {
    let carried = presets::names().any(|known| known == preset);
    if !carried {
        eprintln!("skipped: the program carries no preset {preset}");
    }
    carried
}

/// A file or folder of the shared data beside the checkout; none, and a line that `.ci/run` counts,
/// where it is missing.
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

/// A fresh folder in which the program runs; deleted at the end of the test.
pub struct Desk {
    folder: tempfile::TempDir,
}

/// What a run left behind.
pub struct Run {
    /// Exit code; none after a signal.
    pub code: Option<i32>,
    /// Standard output, raw: it may be a picture.
    pub stdout: Vec<u8>,
    /// Standard error.
    pub stderr: String,
    command: String,
}

impl Desk {
    /// An empty folder.
    pub fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    /// Path of a file in it.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Puts a file into it.
    pub fn write(&self, name: impl AsRef<Path>, contents: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), contents).expect("the folder can be written to");
    }

    /// Names of what is in it, in order.
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

    /// A picture file with its texts.
    pub fn stored(&self, name: &str) -> StoredPicture {
        read_picture(&self.path(name), &Limits::default()).expect("a picture that can be read")
    }

    /// The picture in a file.
    pub fn picture(&self, name: &str) -> Picture {
        self.stored(name).picture
    }

    /// The command with its arguments, not yet started.
    pub fn command<A: AsRef<OsStr>>(&self, args: &[A]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_raywright"));
        command
            .args(args)
            .current_dir(self.folder.path())
            .stdin(Stdio::null());
        command
    }

    /// Runs the program to its end.
    pub fn run<A: AsRef<OsStr>>(&self, args: &[A]) -> Run {
        Run::of(
            args,
            self.command(args).output().expect("the program starts"),
        )
    }
}

impl Desk {
    /// Runs the program to its end with these bytes on its standard input.
    pub fn pipe<A: AsRef<OsStr>>(&self, args: &[A], bytes: &[u8]) -> Run {
        self.write("pipe", bytes);
        let source = std::fs::File::open(self.path("pipe")).expect("just written");
        let output = self
            .command(args)
            .stdin(source)
            .output()
            .expect("the program starts");
        std::fs::remove_file(self.path("pipe")).expect("it is there");
        Run::of(args, output)
    }
}

impl Run {
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

    /// The exit code is this one; otherwise the test shows what the program said.
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

    /// Standard error has this in it.
    #[track_caller]
    pub fn says_like(&self, expected: &str) -> &Self {
        assert!(
            self.stderr.contains(expected),
            "{}\n--- said\n{}\n--- expected in it\n{expected}\n---",
            self.command,
            self.stderr
        );
        self
    }

    /// Standard error is exactly this.
    #[track_caller]
    pub fn says(&self, expected: &str) -> &Self {
        assert!(
            self.stderr.trim_end() == expected.trim_end(),
            "{}\n--- said\n{}\n--- expected\n{expected}\n---",
            self.command,
            self.stderr
        );
        self
    }
}
