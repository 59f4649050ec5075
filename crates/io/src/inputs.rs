//! Input files of a run, which no output may replace. Files are compared by identity, through
//! symbolic and hard links, not by the spelling of their names.

use std::collections::{BTreeSet, HashSet};
use std::path::{Component, Path, PathBuf};

use same_file::Handle;

use crate::hash::SceneHash;
use crate::output::{OutputPath, file_fingerprint};

/// Input files of a run, which no output may replace: files that were read or found missing, and
/// paths that the scene names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InputFiles {
    /// Paths of files that were read.
    read: BTreeSet<PathBuf>,
    /// Paths that were opened without success, because no file exists.
    absent: BTreeSet<PathBuf>,
    /// Paths that a scene names, without `.` and `..`. These paths are never opened or tested,
    /// because a scene may name any path, and network folders notice each access.
    named: BTreeSet<PathBuf>,
}

/// Reason why an output must not be written to a path: it would replace an input file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OverwrittenInput {
    /// An input file is at this path. The value is the name under which the file was read.
    Read(PathBuf),
    /// The scene names this path for a file that was missing or not needed.
    Named(PathBuf),
}

impl InputFiles {
    /// Returns SHA-256 over the names and contents of all files that were read or found missing, as
    /// 64 hexadecimal digits. The hash changes when any of these files changes, disappears or
    /// appears; each call reads the files again.
    pub fn content_hash(&self) -> String {
        let mut hash = SceneHash::default();
        for path in self.files() {
            hash.add_bytes(path.to_string_lossy().as_bytes());
            match std::fs::read(path) {
                Ok(bytes) => hash.add_bytes(&bytes),
                Err(cause) => hash.add_bytes(format!("unread: {:?}", cause.kind()).as_bytes()),
            }
        }
        hash.to_string()
    }

    /// Adds a file that was read.
    pub fn record_read(&mut self, path: &Path) {
        self.read.insert(path.to_owned());
    }

    /// Adds a file that was opened without success.
    pub fn record_missing(&mut self, path: &Path) {
        self.absent.insert(path.to_owned());
    }

    /// Adds an absolute path that a scene names, whether or not the file exists.
    pub fn record_named(&mut self, path: &Path) {
        self.named.insert(normalise_path(path));
    }

    /// Returns the files that were read or found missing, ordered by name.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.read.union(&self.absent).map(PathBuf::as_path)
    }

    /// Returns the index of the first output path that would overwrite an input, and the reason.
    /// Each entry of `places` is a path and the fingerprint of the file that exists there, if any.
    /// All paths are checked in one call, so that each input is opened only once.
    pub fn find_conflicting_output<'a>(
        &self,
        places: impl IntoIterator<Item = (&'a OutputPath, Option<u64>)>,
    ) -> Option<(usize, OverwrittenInput)> {
        let prints: HashSet<u64> = self
            .read
            .iter()
            .filter_map(|path| file_fingerprint(path))
            .collect();
        places
            .into_iter()
            .enumerate()
            .find_map(|(i, (place, there))| {
                let is_read = there.is_some_and(|there| prints.contains(&there))
                    || place.matches_any_path(&self.read);
                let clash = if is_read || place.matches_any_path(&self.named) {
                    self.find_overwritten_input(place)
                } else {
                    None
                };
                clash.map(|clash| (i, clash))
            })
    }

    /// Returns the reason why an output path must not be written to, or `None` if writing
    /// overwrites no input.
    pub fn find_overwritten_input(&self, place: &OutputPath) -> Option<OverwrittenInput> {
        let there = place.open_existing_file();
        // If the scene is read from a pipe, opening the pipe again would block. An output never
        // replaces a pipe.
        let handle = |path: &Path| {
            if path.is_file() {
                Handle::from_path(path).ok()
            } else {
                None
            }
        };
        let same =
            |path: &Path| place.matches_path(path) || (there.is_some() && handle(path) == there);
        let read = self
            .read
            .iter()
            .find(|path| same(path))
            .cloned()
            .map(OverwrittenInput::Read);
        read.or_else(|| {
            self.named
                .iter()
                .find(|path| place.matches_path(path))
                .cloned()
                .map(OverwrittenInput::Named)
        })
    }
}

/// Removes `.` and `..` from a path, as text.
fn normalise_path(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                plain.pop();
            }
            other => plain.push(other),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn input_place(path: &Path) -> OutputPath {
        OutputPath::resolve(path).expect("a place that can be written to")
    }

    /// Protects: a file is recognised under every spelling, through symbolic and hard links, and
    /// through a linked folder.
    #[cfg(unix)]
    #[test]
    fn one_file_has_many_names() {
        use std::os::unix::fs::symlink;
        let outer = tempfile::tempdir().unwrap();
        let folder = outer.path().canonicalize().unwrap();
        let wood = folder.join("wood.png");
        fs::write(&wood, "wood").unwrap();
        fs::create_dir(folder.join("sub")).unwrap();
        symlink("wood.png", folder.join("link.png")).unwrap();
        symlink("link.png", folder.join("link to link.png")).unwrap();
        symlink(".", folder.join("here")).unwrap();
        fs::hard_link(&wood, folder.join("hard.png")).unwrap();
        fs::write(folder.join("copy.png"), "wood").unwrap();
        let mut inputs = InputFiles::default();
        inputs.record_read(&wood);
        for name in [
            "wood.png",
            "./wood.png",
            "sub/../wood.png",
            "link.png",
            "link to link.png",
            "here/wood.png",
            "hard.png",
        ] {
            assert_eq!(
                inputs.find_overwritten_input(&input_place(&folder.join(name))),
                Some(OverwrittenInput::Read(wood.clone())),
                "{name}"
            );
        }
        for name in ["copy.png", "new.png", "sub/wood.png"] {
            assert_eq!(
                inputs.find_overwritten_input(&input_place(&folder.join(name))),
                None,
                "{name}"
            );
        }
        // The reverse: read through a link, written under the file's own name.
        let mut linked = InputFiles::default();
        linked.record_read(&folder.join("link to link.png"));
        assert!(linked.find_overwritten_input(&input_place(&wood)).is_some());
    }

    /// Protects: the first of many places that clashes is reported, for each reason that alone
    /// suffices: its spelling, a link to an input, and a name in the scene.
    #[test]
    fn the_first_clash_of_many_is_told() {
        let outer = tempfile::tempdir().unwrap();
        let at = |name: &str| outer.path().canonicalize().unwrap().join(name);
        fs::write(at("wood.png"), "wood").unwrap();
        fs::hard_link(at("wood.png"), at("hard.png")).unwrap();
        let mut inputs = InputFiles::default();
        inputs.record_read(&at("wood.png"));
        inputs.record_read(&at("gone.png"));
        inputs.record_named(&at("named.png"));
        let clash = |name: &str| {
            let places = [input_place(&at("free.png")), input_place(&at(name))];
            inputs.find_conflicting_output(
                places.iter().map(|place| (place, place.file_fingerprint())),
            )
        };
        assert_eq!(clash("other.png"), None);
        assert_eq!(
            clash("wood.png"),
            Some((1, OverwrittenInput::Read(at("wood.png"))))
        );
        assert_eq!(
            clash("hard.png"),
            Some((1, OverwrittenInput::Read(at("wood.png"))))
        );
        assert_eq!(
            clash("gone.png"),
            Some((1, OverwrittenInput::Read(at("gone.png"))))
        );
        assert_eq!(
            clash("named.png"),
            Some((1, OverwrittenInput::Named(at("named.png"))))
        );
    }

    /// Protects: an input keeps its path reserved even after the file is gone.
    #[test]
    fn a_file_that_went_away_was_still_read() {
        let outer = tempfile::tempdir().unwrap();
        let wood = outer.path().canonicalize().unwrap().join("wood.png");
        let mut inputs = InputFiles::default();
        inputs.record_read(&wood);
        assert_eq!(
            inputs.find_overwritten_input(&input_place(&wood)),
            Some(OverwrittenInput::Read(wood.clone()))
        );
        assert_eq!(
            inputs.find_overwritten_input(&input_place(&wood.with_extension("exr"))),
            None
        );
    }

    /// Protects: a path named by a scene is reserved before a file exists there, however it is
    /// spelled.
    #[test]
    fn named_places_are_kept_free() {
        let outer = tempfile::tempdir().unwrap();
        let folder = outer.path().canonicalize().unwrap();
        let mut inputs = InputFiles::default();
        inputs.record_named(&folder.join("scene/./../wood.png"));
        assert_eq!(
            inputs.find_overwritten_input(&input_place(&folder.join("wood.png"))),
            Some(OverwrittenInput::Named(folder.join("wood.png")))
        );
        assert_eq!(
            inputs.find_overwritten_input(&input_place(&folder.join("wood2.png"))),
            None
        );
    }
}
