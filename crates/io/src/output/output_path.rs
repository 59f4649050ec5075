//! Resolution of output paths. All spellings and links of a path lead to the same resolved path.
//! The resolution also tests whether a file can be created there.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use same_file::Handle;

use crate::error::Error;

/// Largest number of links in a chain; a longer chain counts as a cycle, as in Linux.
const MOST_LINKS: usize = 40;

/// Prefix of the names of temporary files.
pub(super) const TEMPORARY: &str = ".raywright-";

/// Path of an output file, with symbolic links resolved and write access tested before the render
/// starts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputPath {
    /// Path with all links resolved; the file need not exist.
    path: PathBuf,
    /// Whether the file system ignores letter case.
    ignores_case: bool,
}

impl OutputPath {
    /// Resolves a path, and tests as far as possible whether a file can be created there. The
    /// folder must exist, be writable and have room, which is tested with a temporary file. The
    /// file system must accept the name, and no folder or irreplaceable file may have the name.
    ///
    /// # Errors
    /// An error of kind [`File`](crate::ErrorKind::File).
    pub fn resolve(path: &Path) -> Result<Self, Error> {
        let fail = |cause: io::Error| Error::unwritable(path, &cause);
        if path.is_dir() || path.to_string_lossy().ends_with(std::path::is_separator) {
            return Err(fail(io::ErrorKind::IsADirectory.into()));
        }
        let end = resolve_links(path).map_err(fail)?;
        let folder = folder_of(&end);
        require_folder(&folder).map_err(|cause| match cause.kind() {
            io::ErrorKind::NotFound => fail(cause).with_hint(format!(
                "create the folder first: mkdir -p {}",
                folder.display()
            )),
            _ => fail(cause),
        })?;
        let metadata = match fs::metadata(&end) {
            Ok(metadata) => Some(metadata),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => None,
            // This happens, for example, for a name that is too long for any file.
            Err(cause) => return Err(fail(cause)),
        };
        if metadata
            .as_ref()
            .is_some_and(|metadata| metadata.is_file() && metadata.permissions().readonly())
        {
            let hint =
                "the file is write-protected; choose another name, or make the file writable first";
            return Err(fail(io::ErrorKind::PermissionDenied.into()).with_hint(hint));
        }
        // A device or a pipe is written to directly.
        let ignores_case = match &metadata {
            Some(metadata) if !metadata.is_file() => false,
            _ => {
                let test_file = create_test_file(&folder).map_err(fail)?;
                check_replaceable(&folder, metadata.as_ref(), &test_file).map_err(fail)?;
                let other = test_file
                    .path()
                    .file_name()
                    .map(|name| name.to_string_lossy().to_uppercase());
                other.is_some_and(|other| test_file.path().with_file_name(other).exists())
            }
        };
        let folder = folder.canonicalize().map_err(fail)?;
        let path = end
            .file_name()
            .map_or_else(|| folder.clone(), |name| folder.join(name));
        Ok(Self { path, ignores_case })
    }

    /// Returns the file name after all links are resolved.
    pub fn file_name(&self) -> Option<&OsStr> {
        self.path.file_name()
    }

    /// Whether two paths lead to the same file.
    pub fn is_same_file(&self, other: &Self) -> bool {
        self.matches_path(&other.path)
            || self.open_existing_file().is_some_and(|file| {
                other
                    .open_existing_file()
                    .is_some_and(|there| file == there)
            })
    }

    /// Returns the path as a key for comparison: in lower case if the file system ignores letter
    /// case.
    pub fn lookup_key(&self) -> PathBuf {
        if self.ignores_case {
            self.path.to_string_lossy().to_lowercase().into()
        } else {
            self.path.clone()
        }
    }

    /// Whether an absolute path without links denotes the same file name as this path.
    pub(crate) fn matches_path(&self, path: &Path) -> bool {
        self.path == path
            || (self.ignores_case
                && self.lookup_key() == Path::new(&path.to_string_lossy().to_lowercase()))
    }

    /// Returns the fingerprint of the file that exists at the path; `None` without a file.
    pub fn file_fingerprint(&self) -> Option<u64> {
        file_fingerprint(&self.path)
    }

    /// Whether the path of any entry of `paths` denotes the same file name as this path. The
    /// entries are absolute paths without links.
    pub(crate) fn matches_any_path(&self, paths: &BTreeSet<PathBuf>) -> bool {
        if self.ignores_case {
            paths.iter().any(|path| self.matches_path(path))
        } else {
            paths.contains(&self.path)
        }
    }

    /// Opens the regular file that exists at the path. Returns `None` for a missing file, and for a
    /// pipe or a device, because opening a pipe blocks.
    pub(crate) fn open_existing_file(&self) -> Option<Handle> {
        if self.path.is_file() {
            Handle::from_path(&self.path).ok()
        } else {
            None
        }
    }
}

fn require_folder(folder: &Path) -> io::Result<()> {
    if fs::metadata(folder)?.is_dir() {
        Ok(())
    } else {
        Err(io::ErrorKind::NotADirectory.into())
    }
}

/// Creates a temporary file of a single byte in a folder. The creation fails on a full disk.
fn create_test_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut test_file = tempfile::Builder::new()
        .prefix(TEMPORARY)
        .tempfile_in(folder)
        .map_err(|cause| strip_file_name(&cause))?;
    test_file
        .write_all(&[0])
        .map_err(|cause| strip_file_name(&cause))?;
    Ok(test_file)
}

/// Returns an error of the same kind without the name of the temporary file, which means nothing to
/// the user.
fn strip_file_name(cause: &io::Error) -> io::Error {
    cause.kind().into()
}

/// Checks that the existing file can be replaced. In a shared folder such as `/tmp` (sticky bit),
/// only the owner of the file or the owner of the folder may replace the file.
#[cfg(unix)]
fn check_replaceable(
    folder: &Path,
    metadata: Option<&fs::Metadata>,
    test_file: &tempfile::NamedTempFile,
) -> io::Result<()> {
    use std::os::unix::fs::MetadataExt;
    const STICKY: u32 = 0o1000;
    let (Some(metadata), folder, user) = (
        metadata,
        fs::metadata(folder)?,
        test_file.as_file().metadata()?.uid(),
    ) else {
        return Ok(());
    };
    let is_owner = user == 0 || [metadata.uid(), folder.uid()].contains(&user);
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

/// Returns a fingerprint of the identity of the regular file at a path; `None` without a file. No
/// handle stays open. Equal fingerprints almost certainly mean the same file.
pub(crate) fn file_fingerprint(path: &Path) -> Option<u64> {
    let handle = if path.is_file() {
        Handle::from_path(path).ok()?
    } else {
        return None;
    };
    let mut hasher = DefaultHasher::new();
    handle.hash(&mut hasher);
    Some(hasher.finish())
}

/// Resolves all links of a path, whether or not its target exists.
pub(super) fn resolve_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(next) => path = folder_of(&path).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other(
        "the symbolic links of the path form a cycle",
    ))
}

/// Returns the folder of a file path; `.` for a name without a folder.
pub(super) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a dangling link resolves to the file it would create, a cycle of links ends with
    /// an error, and the check leaves no file behind.
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
        let place = |name: &str| OutputPath::resolve(&at(name)).unwrap();
        assert!(place("link.png").is_same_file(&place("sub/../sub/new.png")));
        assert!(!place("link.png").is_same_file(&place("new.png")));
        let error = |name: &str| OutputPath::resolve(&at(name)).unwrap_err().to_string();
        assert!(
            error("round.png").contains("the symbolic links of the path form a cycle"),
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

    /// Protects: two names of a file are one location, and a copy is another.
    #[test]
    fn hard_links_are_one_place() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("a"), "a").unwrap();
        fs::copy(at("a"), at("copy")).unwrap();
        fs::hard_link(at("a"), at("b")).unwrap();
        let place = |name: &str| OutputPath::resolve(&at(name)).unwrap();
        assert!(place("a").is_same_file(&place("b")));
        assert!(!place("a").is_same_file(&place("copy")));
    }

    /// Protects: where the file system ignores case, outputs named `A.png` and `a.png` are the
    /// same; elsewhere they differ.
    #[test]
    fn case_counts_where_the_file_system_says_so() {
        let place = |ignores_case| OutputPath {
            path: PathBuf::from("/Pictures/a.png"),
            ignores_case,
        };
        for (path, same) in [("/pictures/A.PNG", true), ("/Pictures/b.png", false)] {
            assert_eq!(place(true).matches_path(Path::new(path)), same, "{path}");
            assert!(!place(false).matches_path(Path::new(path)), "{path}");
        }
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("probe"), "").unwrap();
        let ignored = folder.path().join("PROBE").exists();
        assert_eq!(
            OutputPath::resolve(&folder.path().join("a.png"))
                .unwrap()
                .ignores_case,
            ignored
        );
    }

    /// Protects: an impossible name is refused, whether a component or the whole is too long; the
    /// longest possible name is accepted.
    #[cfg(unix)]
    #[test]
    fn names_that_no_file_can_have_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| OutputPath::resolve(&folder.path().join(name));
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
                error.to_string().contains("the file name is too long"),
                "{error}"
            );
        }
        place(&"n".repeat(255)).unwrap();
        std::os::unix::fs::symlink(&long, folder.path().join("link.png")).unwrap();
        assert!(place("link.png").is_err());
    }

    /// Protects: a write-protected file is refused as an output.
    #[test]
    fn write_protected_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        fs::write(&path, "mine").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        let error = OutputPath::resolve(&path).unwrap_err();
        assert_eq!(error.kind(), crate::ErrorKind::File);
        assert!(
            error
                .to_string()
                .contains("permission denied\nhelp: the file is write-protected"),
            "{error}"
        );
    }
}
