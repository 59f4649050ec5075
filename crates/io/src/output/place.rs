//! Where a file name leads: the one place behind all its spellings and links, and whether a file
//! can be made there.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use same_file::Handle;

use crate::error::Error;

/// Links in a row before they are taken for a circle; Linux follows as many.
const MOST_LINKS: usize = 40;

/// What the names of unfinished files begin with.
pub(super) const TEMPORARY: &str = ".raywright-";

/// A place to write a file to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Where the name leads: through links, also where nothing is at their end.
    path: PathBuf,
    /// The file system takes names that differ in case for one.
    ignores_case: bool,
}

impl Place {
    /// The place behind a name, if a file of it can be made, as far as this can be known
    /// beforehand: there is such a folder, it can be written to and has room (shown by making
    /// another file in it for a moment), the name is none that the file system refuses, and neither
    /// a folder nor a file that may not be replaced is there.
    ///
    /// # Errors
    /// An error of kind [`File`](crate::ErrorKind::File).
    pub fn check(path: &Path) -> Result<Self, Error> {
        let fail = |cause: io::Error| Error::write(path, &cause);
        if path.is_dir() || path.to_string_lossy().ends_with(std::path::is_separator) {
            return Err(fail(io::ErrorKind::IsADirectory.into()));
        }
        let end = follow(path).map_err(fail)?;
        let folder = folder_of(&end);
        check_folder(&folder).map_err(|cause| match cause.kind() {
            io::ErrorKind::NotFound => fail(cause).with_hint(format!(
                "create the folder first: mkdir -p {}",
                folder.display()
            )),
            _ => fail(cause),
        })?;
        let there = match fs::metadata(&end) {
            Ok(there) => Some(there),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => None,
            // Such as a name that is longer than any file's can be.
            Err(cause) => return Err(fail(cause)),
        };
        if there
            .as_ref()
            .is_some_and(|there| there.is_file() && there.permissions().readonly())
        {
            let hint =
                "the file is write-protected; name another one, or allow writing to it first";
            return Err(fail(io::ErrorKind::PermissionDenied.into()).with_hint(hint));
        }
        // What is no regular file, a device or a pipe, is written to where it is.
        let ignores_case = match &there {
            Some(there) if !there.is_file() => false,
            _ => {
                let probe = probe(&folder).map_err(fail)?;
                check_replaceable(&folder, there.as_ref(), &probe).map_err(fail)?;
                let other = probe
                    .path()
                    .file_name()
                    .map(|name| name.to_string_lossy().to_uppercase());
                other.is_some_and(|other| probe.path().with_file_name(other).exists())
            }
        };
        let folder = folder.canonicalize().map_err(fail)?;
        let path = end
            .file_name()
            .map_or_else(|| folder.clone(), |name| folder.join(name));
        Ok(Self { path, ignores_case })
    }

    /// The name of the file at the end of all links.
    pub fn file_name(&self) -> Option<&OsStr> {
        self.path.file_name()
    }

    /// Whether both are one place, or two names of one file.
    pub fn is(&self, other: &Self) -> bool {
        self.is_spelled(&other.path)
            || self
                .existing()
                .is_some_and(|file| other.existing().is_some_and(|there| file == there))
    }

    /// Its path, in one spelling of all that the file system takes for one: to look it up among
    /// many.
    pub fn spelling(&self) -> PathBuf {
        if self.ignores_case {
            self.path.to_string_lossy().to_lowercase().into()
        } else {
            self.path.clone()
        }
    }

    /// Whether an absolute path without links is this place's.
    pub(crate) fn is_spelled(&self, path: &Path) -> bool {
        self.path == path
            || (self.ignores_case
                && self.spelling() == Path::new(&path.to_string_lossy().to_lowercase()))
    }

    /// What tells the file that is there now from other ones; none where there is none.
    pub fn fingerprint(&self) -> Option<u64> {
        fingerprint(&self.path)
    }

    /// Whether one of these absolute paths without links is this place's.
    pub(crate) fn is_among(&self, paths: &BTreeSet<PathBuf>) -> bool {
        if self.ignores_case {
            paths.iter().any(|path| self.is_spelled(path))
        } else {
            paths.contains(&self.path)
        }
    }

    /// The regular file that is there. Only such a one is opened, because opening a pipe waits for
    /// its other end.
    pub(crate) fn existing(&self) -> Option<Handle> {
        if self.path.is_file() {
            Handle::from_path(&self.path).ok()
        } else {
            None
        }
    }
}

fn check_folder(folder: &Path) -> io::Result<()> {
    if fs::metadata(folder)?.is_dir() {
        Ok(())
    } else {
        Err(io::ErrorKind::NotADirectory.into())
    }
}

/// A file in a folder that is gone in a moment, of one byte, for which a full disk has no room.
fn probe(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut probe = tempfile::Builder::new()
        .prefix(TEMPORARY)
        .tempfile_in(folder)
        .map_err(|cause| named_by_kind(&cause))?;
    probe
        .write_all(&[0])
        .map_err(|cause| named_by_kind(&cause))?;
    Ok(probe)
}

/// The same failure without the name of the temporary file, which says nothing to a user.
fn named_by_kind(cause: &io::Error) -> io::Error {
    cause.kind().into()
}

/// In a folder of all, such as `/tmp`, a file can be replaced by its owner and the folder's alone.
#[cfg(unix)]
fn check_replaceable(
    folder: &Path,
    there: Option<&fs::Metadata>,
    probe: &tempfile::NamedTempFile,
) -> io::Result<()> {
    use std::os::unix::fs::MetadataExt;
    const STICKY: u32 = 0o1000;
    let (Some(there), folder, user) = (
        there,
        fs::metadata(folder)?,
        probe.as_file().metadata()?.uid(),
    ) else {
        return Ok(());
    };
    let is_owner = user == 0 || [there.uid(), folder.uid()].contains(&user);
    if folder.mode() & STICKY != 0 && !is_owner {
        Err(io::ErrorKind::PermissionDenied.into())
    } else {
        Ok(())
    }
}

#[cfg(not(unix))]
fn check_replaceable(
    _: &Path,
    _: Option<&fs::Metadata>,
    _: &tempfile::NamedTempFile,
) -> io::Result<()> {
    Ok(())
}

/// What tells the regular file at a path from other ones, without keeping it open; none where there
/// is none. Files of one fingerprint are nearly surely one file.
pub(crate) fn fingerprint(path: &Path) -> Option<u64> {
    let handle = if path.is_file() {
        Handle::from_path(path).ok()?
    } else {
        return None;
    };
    let mut hasher = DefaultHasher::new();
    handle.hash(&mut hasher);
    Some(hasher.finish())
}

/// The name at the end of all links, whether something is there or not.
pub(super) fn follow(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(next) => path = folder_of(&path).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("its symbolic links run in a circle"))
}

/// The folder that holds a file of this name.
pub(super) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a link to nothing leads where a file behind it would be made, a circle of links
    /// ends, and looking leaves no trace.
    #[cfg(unix)]
    #[test]
    fn links_lead_to_one_place() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        symlink("sub/new.png", at("link.png")).unwrap();
        symlink("round.png", at("round.png")).unwrap();
        symlink("no/such.png", at("lost.png")).unwrap();
        let place = |name: &str| Place::check(&at(name)).unwrap();
        assert!(place("link.png").is(&place("sub/../sub/new.png")));
        assert!(!place("link.png").is(&place("new.png")));
        let error = |name: &str| Place::check(&at(name)).unwrap_err().to_string();
        assert!(
            error("round.png").contains("circle"),
            "{}",
            error("round.png")
        );
        assert!(
            error("lost.png").contains("no such file or folder"),
            "{}",
            error("lost.png")
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
    }

    /// Protects: two names of one file are one place, and a copy is another.
    #[test]
    fn hard_links_are_one_place() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("a"), "a").unwrap();
        fs::copy(at("a"), at("copy")).unwrap();
        fs::hard_link(at("a"), at("b")).unwrap();
        let place = |name: &str| Place::check(&at(name)).unwrap();
        assert!(place("a").is(&place("b")));
        assert!(!place("a").is(&place("copy")));
    }

    /// Protects: where the file system takes `A.png` for `a.png`, two outputs of these names are
    /// one; elsewhere they are two.
    #[test]
    fn case_counts_where_the_file_system_says_so() {
        let place = |ignores_case| Place {
            path: PathBuf::from("/Pictures/a.png"),
            ignores_case,
        };
        for (path, same) in [("/pictures/A.PNG", true), ("/Pictures/b.png", false)] {
            assert_eq!(place(true).is_spelled(Path::new(path)), same, "{path}");
            assert!(!place(false).is_spelled(Path::new(path)), "{path}");
        }
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("probe"), "").unwrap();
        let ignored = folder.path().join("PROBE").exists();
        assert_eq!(
            Place::check(&folder.path().join("a.png"))
                .unwrap()
                .ignores_case,
            ignored
        );
    }

    /// Protects: a name that no file can have is refused, as one part of it and as a whole, and the
    /// longest that one can have is not.
    #[cfg(unix)]
    #[test]
    fn names_that_no_file_can_have_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| Place::check(&folder.path().join(name));
        let long = "n".repeat(256);
        for name in [
            long.clone(),
            format!("{long}/a.png"),
            "n/".repeat(3000) + "a.png",
            "é".repeat(128),
        ] {
            let error = place(&name).unwrap_err();
            assert_eq!(error.kind(), crate::ErrorKind::File);
            assert!(
                error.to_string().contains("the name is too long"),
                "{error}"
            );
        }
        place(&"n".repeat(255)).unwrap();
        std::os::unix::fs::symlink(&long, folder.path().join("link.png")).unwrap();
        assert!(place("link.png").is_err());
    }

    /// Protects: a write-protected file is the user's word that it stays as it is.
    #[test]
    fn write_protected_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        fs::write(&path, "mine").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        let error = Place::check(&path).unwrap_err();
        assert_eq!(error.kind(), crate::ErrorKind::File);
        assert!(
            error
                .to_string()
                .contains("permission denied\nhelp: the file is write-protected"),
            "{error}"
        );
    }
}
