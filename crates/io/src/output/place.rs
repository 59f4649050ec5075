//! Where a file name leads: the one place behind all its spellings and links, and whether a file can be made there.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};

use same_file::Handle;

use crate::error::Error;

/// Links in a row before they are taken for a circle; Linux follows as many.
const MOST_LINKS: usize = 40;

/// A place to write a file to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Where the name leads: through links, also where nothing is at their end.
    path: PathBuf,
    /// The file system takes names that differ in case for one.
    ignores_case: bool,
}

impl Place {
    /// The place behind a name, if a file of it can be made, as far as this can be known beforehand: there is such a folder, it
    /// can be written to (shown by making another file in it for a moment), and no folder and no write-protected file is there.
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
        if folder.exists() && !folder.is_dir() {
            return Err(fail(io::ErrorKind::NotADirectory.into()));
        }
        if !folder.exists() {
            let hint = format!("create the folder first: mkdir -p {}", folder.display());
            return Err(fail(io::ErrorKind::NotFound.into()).with_hint(hint));
        }
        if fs::metadata(&end).is_ok_and(|there| there.is_file() && there.permissions().readonly()) {
            let hint = "the file is write-protected; name another one, or allow writing to it first";
            return Err(fail(io::ErrorKind::PermissionDenied.into()).with_hint(hint));
        }
        // What is no regular file, a device or a pipe, is written to where it is.
        let probe = match fs::metadata(&end) {
            Ok(there) if !there.is_file() => None,
            _ => Some(tempfile::Builder::new().prefix(".raywright-").tempfile_in(&folder).map_err(|e| fail(e.kind().into()))?),
        };
        let ignores_case = probe.is_some_and(|probe| {
            let other = probe.path().file_name().map(|name| name.to_string_lossy().to_uppercase());
            other.is_some_and(|other| probe.path().with_file_name(other).exists())
        });
        let folder = folder.canonicalize().map_err(fail)?;
        let path = end.file_name().map_or_else(|| folder.clone(), |name| folder.join(name));
        Ok(Self { path, ignores_case })
    }

    /// The name of the file at the end of all links.
    pub fn file_name(&self) -> Option<&OsStr> {
        self.path.file_name()
    }

    /// Whether both are one place, or two names of one file.
    pub fn is(&self, other: &Self) -> bool {
        self.is_spelled(&other.path) || self.existing().is_some_and(|file| other.existing().is_some_and(|there| file == there))
    }

    /// Its path, in one spelling of all that the file system takes for one: to look it up among many.
    pub fn spelling(&self) -> PathBuf {
        if self.ignores_case { self.path.to_string_lossy().to_lowercase().into() } else { self.path.clone() }
    }

    /// Whether an absolute path without links is this place's.
    pub(crate) fn is_spelled(&self, path: &Path) -> bool {
        self.path == path || (self.ignores_case && self.spelling() == Path::new(&path.to_string_lossy().to_lowercase()))
    }

    /// What tells the file that is there now from other ones; none where there is none.
    pub fn fingerprint(&self) -> Option<u64> {
        fingerprint(&self.path)
    }

    /// Whether one of these absolute paths without links is this place's.
    pub(crate) fn is_among(&self, paths: &BTreeSet<PathBuf>) -> bool {
        if self.ignores_case { paths.iter().any(|path| self.is_spelled(path)) } else { paths.contains(&self.path) }
    }

    /// The regular file that is there. Only such a one is opened, because opening a pipe waits for its other end.
    pub(crate) fn existing(&self) -> Option<Handle> {
        if self.path.is_file() { Handle::from_path(&self.path).ok() } else { None }
    }
}

/// What tells the regular file at a path from other ones, without keeping it open; none where there is none. Files of one fingerprint are
/// nearly surely one file.
pub(crate) fn fingerprint(path: &Path) -> Option<u64> {
    let handle = if path.is_file() { Handle::from_path(path).ok()? } else { return None };
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

    /// Protects: a link to nothing leads where a file behind it would be made, a circle of links ends, and looking leaves no
    /// trace.
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
        assert!(error("round.png").contains("circle"), "{}", error("round.png"));
        assert!(error("lost.png").contains("no such file or folder"), "{}", error("lost.png"));
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

    /// Protects: where the file system takes `A.png` for `a.png`, two outputs of these names are one; elsewhere they are two.
    #[test]
    fn case_counts_where_the_file_system_says_so() {
        let place = |ignores_case| Place { path: PathBuf::from("/Pictures/a.png"), ignores_case };
        for (path, same) in [("/pictures/A.PNG", true), ("/Pictures/b.png", false)] {
            assert_eq!(place(true).is_spelled(Path::new(path)), same, "{path}");
            assert!(!place(false).is_spelled(Path::new(path)), "{path}");
        }
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("probe"), "").unwrap();
        let ignored = folder.path().join("PROBE").exists();
        assert_eq!(Place::check(&folder.path().join("a.png")).unwrap().ignores_case, ignored);
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
        assert!(error.to_string().contains("permission denied\nhelp: the file is write-protected"), "{error}");
    }
}
