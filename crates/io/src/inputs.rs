//! The files that something is made from, so that no output replaces one of them: compared as the
//! file system compares files, through links of both kinds, and not by how their names are spelled.

use std::collections::{BTreeSet, HashSet};
use std::path::{Component, Path, PathBuf};

use same_file::Handle;

use crate::hash::SceneHash;
use crate::output::{Place, fingerprint};

/// Files that were read, and places that were named for files.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// As they were opened.
    read: BTreeSet<PathBuf>,
    /// They were looked for and are not there.
    absent: BTreeSet<PathBuf>,
    /// Without `.` and `..`. Such a place is never looked at: a scene may name whatever it likes,
    /// and a network's folders notice when they are asked for.
    named: BTreeSet<PathBuf>,
}

/// Why a place may not be written to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Clash {
    /// A file that was read, by the name it was read under, lies there.
    Read(PathBuf),
    /// The scene names this place for a file of its own, which was not there or not needed.
    Named(PathBuf),
}

impl Inputs {
    /// SHA-256 of the names and the contents of all files that were read or looked for, as 64
    /// hexadecimal digits: another one where any of them has changed, is gone or has come. It is
    /// worked out anew, so that it tells of files as they are now.
    pub fn content_hash(&self) -> String {
        let mut hash = SceneHash::default();
        for path in self.files() {
            hash.note(path.to_string_lossy().as_bytes());
            match std::fs::read(path) {
                Ok(bytes) => hash.note(&bytes),
                Err(cause) => hash.note(format!("unread: {:?}", cause.kind()).as_bytes()),
            }
        }
        hash.to_string()
    }

    /// Adds a file that is read.
    pub fn read(&mut self, path: &Path) {
        self.read.insert(path.to_owned());
    }

    /// Adds a file that was looked for and is not there.
    pub fn miss(&mut self, path: &Path) {
        self.absent.insert(path.to_owned());
    }

    /// Adds an absolute path that something names for a file, whatever is there.
    pub fn name(&mut self, path: &Path) {
        self.named.insert(plain(path));
    }

    /// The files that are read or were looked for, in order of their names.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.read.union(&self.absent).map(PathBuf::as_path)
    }

    /// The first of many places that must not be written to, each with the fingerprint of what is
    /// there: every file is opened once, however many places there are.
    pub fn first_clash<'a>(
        &self,
        places: impl IntoIterator<Item = (&'a Place, Option<u64>)>,
    ) -> Option<(usize, Clash)> {
        let prints: HashSet<u64> = self
            .read
            .iter()
            .filter_map(|path| fingerprint(path))
            .collect();
        places
            .into_iter()
            .enumerate()
            .find_map(|(i, (place, there))| {
                let is_read = there.is_some_and(|there| prints.contains(&there))
                    || place.is_among(&self.read);
                let clash = if is_read || place.is_among(&self.named) {
                    self.clash(place)
                } else {
                    None
                };
                clash.map(|clash| (i, clash))
            })
    }

    /// What would be lost if this place were written to.
    pub fn clash(&self, place: &Place) -> Option<Clash> {
        let there = place.existing();
        // A pipe that a scene came through would be waited for, and no output replaces it.
        let handle = |path: &Path| {
            if path.is_file() {
                Handle::from_path(path).ok()
            } else {
                None
            }
        };
        let same =
            |path: &Path| place.is_spelled(path) || (there.is_some() && handle(path) == there);
        let read = self
            .read
            .iter()
            .find(|path| same(path))
            .cloned()
            .map(Clash::Read);
        read.or_else(|| {
            self.named
                .iter()
                .find(|path| place.is_spelled(path))
                .cloned()
                .map(Clash::Named)
        })
    }
}

/// A path without `.` and `..`, by its text alone.
fn plain(path: &Path) -> PathBuf {
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

    fn place(path: &Path) -> Place {
        Place::check(path).expect("a place that can be written to")
    }

    /// Protects: a file is the same one under every spelling, through symbolic and hard links, and
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
        let mut inputs = Inputs::default();
        inputs.read(&wood);
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
                inputs.clash(&place(&folder.join(name))),
                Some(Clash::Read(wood.clone())),
                "{name}"
            );
        }
        for name in ["copy.png", "new.png", "sub/wood.png"] {
            assert_eq!(inputs.clash(&place(&folder.join(name))), None, "{name}");
        }
        // And the other way round: read through a link, written under the file's own name.
        let mut linked = Inputs::default();
        linked.read(&folder.join("link to link.png"));
        assert!(linked.clash(&place(&wood)).is_some());
    }

    /// Protects: of many places the first one is told that would be lost, for each of the reasons
    /// for which one alone is: its spelling, a link to a file that was read, and a name that a
    /// scene gives.
    #[test]
    fn the_first_clash_of_many_is_told() {
        let outer = tempfile::tempdir().unwrap();
        let at = |name: &str| outer.path().canonicalize().unwrap().join(name);
        fs::write(at("wood.png"), "wood").unwrap();
        fs::hard_link(at("wood.png"), at("hard.png")).unwrap();
        let mut inputs = Inputs::default();
        inputs.read(&at("wood.png"));
        inputs.read(&at("gone.png"));
        inputs.name(&at("named.png"));
        let clash = |name: &str| {
            let places = [place(&at("free.png")), place(&at(name))];
            inputs.first_clash(places.iter().map(|place| (place, place.fingerprint())))
        };
        assert_eq!(clash("other.png"), None);
        assert_eq!(clash("wood.png"), Some((1, Clash::Read(at("wood.png")))));
        assert_eq!(clash("hard.png"), Some((1, Clash::Read(at("wood.png")))));
        assert_eq!(clash("gone.png"), Some((1, Clash::Read(at("gone.png")))));
        assert_eq!(clash("named.png"), Some((1, Clash::Named(at("named.png")))));
    }

    /// Protects: what was read keeps its place also where nothing lies there any more that could be
    /// compared.
    #[test]
    fn a_file_that_went_away_was_still_read() {
        let outer = tempfile::tempdir().unwrap();
        let wood = outer.path().canonicalize().unwrap().join("wood.png");
        let mut inputs = Inputs::default();
        inputs.read(&wood);
        assert_eq!(inputs.clash(&place(&wood)), Some(Clash::Read(wood.clone())));
        assert_eq!(inputs.clash(&place(&wood.with_extension("exr"))), None);
    }

    /// Protects: a place that is named for a file is kept free of outputs also before there is such
    /// a file, by whatever detour it is named.
    #[test]
    fn named_places_are_kept_free() {
        let outer = tempfile::tempdir().unwrap();
        let folder = outer.path().canonicalize().unwrap();
        let mut inputs = Inputs::default();
        inputs.name(&folder.join("scene/./../wood.png"));
        assert_eq!(
            inputs.clash(&place(&folder.join("wood.png"))),
            Some(Clash::Named(folder.join("wood.png")))
        );
        assert_eq!(inputs.clash(&place(&folder.join("wood2.png"))), None);
    }
}
