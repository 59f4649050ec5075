//! Reading of the files that a scene names. Files outside the scene's folder and files over the
//! size limit are refused. Every byte is added to the scene's hash. Every name is recorded, so that
//! no output replaces such a file.

use std::cell::RefCell;
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use crate::error::{Error, describe_io_error};
use crate::hash::SceneHash;
use crate::inputs::InputFiles;
use crate::limits::{Limits, format_bytes};

/// Reason why a [`Folder`] cannot read a file that a scene names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReadError {
    /// The reference is not allowed: it leads outside the folder, or to no regular file. The value
    /// is the message.
    Refused(String),
    /// The file cannot be read.
    Unreadable(String),
    /// The file is larger than the limit.
    TooLarge(String),
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(text) | Self::Unreadable(text) | Self::TooLarge(text) => {
                f.write_str(text)
            }
        }
    }
}

/// Where the files that a scene names are looked up.
#[derive(Clone, Debug)]
enum FolderRoot {
    /// Below a folder, given by its canonical path.
    Disk(PathBuf),
    /// The files come from a resolver of the caller. The text precedes every path; it is empty or
    /// ends in `/`.
    Resolver(Resolver, String),
    /// No file may be read. The text is the reason, for the message of each refusal.
    NoFiles(&'static str),
}

/// Location of a file that a scene names: a path on disk, or a path in a resolver.
enum FileLocation<'f> {
    Disk(PathBuf),
    Resolver(&'f Resolver, String),
}

/// Reader of the files that a scene names, relative to the folder of the scene's file. It refuses
/// paths outside the folder, hashes all bytes that it reads, and lists the files that were read or
/// named.
#[derive(Debug)]
pub struct Folder {
    root: FolderRoot,
    /// Whether files outside the folder may be read, by the user's choice.
    allows_outside: bool,
    file_bytes: u64,
    hash: RefCell<SceneHash>,
    /// Files that were read or that the scene names. The list is shared with the folders of files
    /// that were read from this folder.
    inputs: Rc<RefCell<InputFiles>>,
}

impl Folder {
    /// Returns the folder that contains a file. `file_bytes` is the largest size of each file read
    /// from the folder, in bytes.
    ///
    /// # Errors
    /// If the folder does not exist or cannot be accessed.
    pub fn parent_of(file: &Path, file_bytes: u64) -> std::io::Result<Self> {
        let parent = match file.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        Ok(Self {
            root: FolderRoot::Disk(parent.canonicalize()?),
            ..Self::for_built_in_scene(file_bytes)
        })
    }

    /// Returns the folder of the file that `reference` names. References inside that file start
    /// from this folder.
    ///
    /// # Errors
    ///
    /// [`ReadError::Refused`] for a forbidden reference, [`ReadError::Unreadable`] for a missing
    /// file.
    pub fn folder_of_reference(&self, reference: &str) -> Result<Self, ReadError> {
        let root = match self.locate_reference(reference)? {
            FileLocation::Disk(path) => path.parent().map_or(self.root.clone(), |parent| {
                FolderRoot::Disk(parent.to_owned())
            }),
            FileLocation::Resolver(resolver, name) => {
                let prefix = name
                    .rsplit_once('/')
                    .map(|(folder, _)| format!("{folder}/"));
                FolderRoot::Resolver(resolver.clone(), prefix.unwrap_or_default())
            }
        };
        Ok(Self {
            root,
            inputs: Rc::clone(&self.inputs),
            allows_outside: self.allows_outside,
            ..Self::for_built_in_scene(self.file_bytes)
        })
    }

    /// Sets whether references may lead outside the folder.
    pub fn with_outside_access(self, allowed: bool) -> Self {
        Self {
            allows_outside: allowed,
            ..self
        }
    }

    /// Creates the folder of a built-in scene, which has no files.
    pub fn for_built_in_scene(file_bytes: u64) -> Self {
        let root = FolderRoot::NoFiles(
            "a built-in scene has no folder from which files could be read; save the scene as a file beside these files (raywright presets NAME > FILE)",
        );
        Self {
            root,
            allows_outside: false,
            file_bytes,
            hash: RefCell::default(),
            inputs: Rc::default(),
        }
    }

    /// Creates the folder of a scene given as bytes. Its files come from `resolver`; without a
    /// resolver, every reference is refused.
    pub fn from_resolver(resolver: Option<&Resolver>, file_bytes: u64) -> Self {
        let root = match resolver {
            Some(resolver) => FolderRoot::Resolver(resolver.clone(), String::new()),
            None => FolderRoot::NoFiles(
                "a scene read from a pipe has no folder; give the path of the scene's file instead",
            ),
        };
        Self {
            root,
            ..Self::for_built_in_scene(file_bytes)
        }
    }

    /// Reads a file named inside the scene, by its path relative to the folder with `/` as
    /// separator.
    ///
    /// # Errors
    /// [`ReadError`] for a refused, unreadable or oversized file.
    pub fn read(&self, reference: &str) -> Result<Vec<u8>, ReadError> {
        self.record_reference(reference);
        let unreadable = |cause: std::io::Error| {
            ReadError::Unreadable(format!(
                "cannot read `{reference}`: {}",
                describe_io_error(&cause)
            ))
        };
        let bytes = match self.locate_reference(reference)? {
            FileLocation::Disk(path) => {
                self.inputs.borrow_mut().record_read(&path);
                // A pipe or a device could block the reader for ever, a pipe even when it is
                // opened.
                if !path.is_file() {
                    return Err(ReadError::Refused(format!(
                        "`{reference}` is not a regular file, but a folder, a pipe or a device; name a file"
                    )));
                }
                let file = File::open(&path).map_err(unreadable)?;
                read_file(&file, self.file_bytes).map_err(unreadable)?
            }
            FileLocation::Resolver(resolver, name) => {
                let bytes = resolver.read(&name).and_then(refuse_placeholder);
                Some(bytes.map_err(unreadable)?)
                    .filter(|bytes| bytes.len() as u64 <= self.file_bytes)
            }
        };
        let bytes = bytes.ok_or_else(|| {
            ReadError::TooLarge(format!(
                "`{reference}` is larger than the limit of {}; use a smaller file",
                format_bytes(self.file_bytes)
            ))
        })?;
        self.add_to_hash(reference.as_bytes());
        self.add_to_hash(&bytes);
        Ok(bytes)
    }

    /// Adds the scene's own file to the list of inputs. This file is opened by the caller, not by
    /// [`Self::read`].
    pub(crate) fn record_scene_file(&self, path: &Path) {
        self.inputs.borrow_mut().record_read(path);
    }

    /// Records a file that the scene names, even if the file is missing, refused or never read.
    pub fn record_reference(&self, reference: &str) {
        // An output picture with the name of a missing texture would become that texture in the
        // next render.
        let path = Path::new(reference.strip_prefix("file://").unwrap_or(reference));
        if let FolderRoot::Disk(root) = &self.root
            && !reference.is_empty()
        {
            self.inputs.borrow_mut().record_named(&root.join(path));
        }
    }

    /// Returns the files that were read or named so far, by this folder and by the folders of its
    /// files.
    pub fn inputs(&self) -> InputFiles {
        self.inputs.borrow().clone()
    }

    /// Adds bytes to the hash that were not read by [`Self::read`].
    pub fn add_to_hash(&self, bytes: &[u8]) {
        self.hash.borrow_mut().add_bytes(bytes);
    }

    /// Returns the hash of all bytes added since the last call, in order, and starts a new hash.
    /// The hash is moved, not copied, because its buffer holds up to a megabyte.
    pub fn take_hash(&self) -> SceneHash {
        self.hash.take()
    }

    /// Finds the location of a file that the scene names, and refuses a reference that leads
    /// outside the folder.
    fn locate_reference(&self, reference: &str) -> Result<FileLocation<'_>, ReadError> {
        let refuse = |why: &str| Err(ReadError::Refused(format!("`{reference}` {why}")));
        if reference.is_empty() || reference.contains('\0') {
            return refuse("is not a valid file name");
        }
        let local = if self.allows_outside {
            reference.strip_prefix("file://").unwrap_or(reference)
        } else {
            reference
        };
        if has_scheme(local) {
            return refuse(
                "is a URL, but only files in the scene's folder are read; save the file there and name it by its path",
            );
        }
        let root = match &self.root {
            FolderRoot::Disk(root) => root,
            FolderRoot::Resolver(resolver, prefix) => {
                let Some(name) = normalise_reference(local) else {
                    return refuse(
                        "lies outside the scene's folder, and only files in that folder are read",
                    );
                };
                let parts: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
                return Ok(FileLocation::Resolver(
                    resolver,
                    prefix.clone() + &parts.join("/"),
                ));
            }
            FolderRoot::NoFiles(why) => return refuse(&format!("cannot be read: {why}")),
        };
        const OUT: &str = "lies outside the scene's folder, and only files in that folder are read (--allow-outside permits other files)";
        let path = match normalise_reference(local) {
            Some(relative) => root.join(relative),
            None if self.allows_outside => root.join(local),
            None => return refuse(OUT),
        };
        let unreadable = |cause| {
            ReadError::Unreadable(format!(
                "cannot read `{reference}`: {}",
                describe_io_error(&cause)
            ))
        };
        let there = path
            .canonicalize()
            .or_else(|cause| find_ignoring_case(root, local).ok_or(cause));
        let path = there
            .inspect_err(|_| self.inputs.borrow_mut().record_missing(&path))
            .map_err(unreadable)?;
        match self.allows_outside || path.starts_with(root) {
            true => Ok(FileLocation::Disk(path)),
            false => refuse(
                "is a link to a file outside the scene's folder (--allow-outside follows such links)",
            ),
        }
    }
}

/// Resolves `.` and `..` in a reference without file access. Returns `None` for an absolute path,
/// and for a path that leaves the folder at any step, such as `../here/a.png`.
fn normalise_reference(reference: &str) -> Option<PathBuf> {
    // Windows paths are refused on every system, so that a scene is accepted by all machines or by
    // none.
    let on_drive =
        matches!(reference.as_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic());
    if on_drive
        || reference.starts_with(['/', '\\'])
        || reference.split('\\').any(|part| part == "..")
    {
        return None;
    }
    let mut plain = PathBuf::new();
    for part in Path::new(reference).components() {
        match part {
            Component::Normal(name) => plain.push(name),
            Component::CurDir => {}
            Component::ParentDir if plain.pop() => {}
            Component::ParentDir | Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(plain)
}

/// Finds the only file below `root` whose path equals a reference except for letter case; `None` if
/// no file or several files match. Many models were written on systems that ignore case.
fn find_ignoring_case(root: &Path, reference: &str) -> Option<PathBuf> {
    let mut path = root.to_owned();
    for part in &normalise_reference(reference)? {
        let requested = part.to_str()?.to_lowercase();
        let names = path
            .read_dir()
            .ok()?
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let mut fitting = names.filter(|name| name.to_lowercase() == requested);
        // An ambiguous match is no match.
        let (name, other) = (fitting.next()?, fitting.next());
        if other.is_some() {
            return None;
        }
        path.push(name);
    }
    path.canonicalize().ok()
}

/// Whether a reference starts with a URL scheme (`http:`, `file:`). A single letter is a drive
/// (`C:`).
fn has_scheme(reference: &str) -> bool {
    let (scheme, rest) = reference.split_once(':').unwrap_or_default();
    let word = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'));
    word && scheme.len() > 1
        && (rest.starts_with('/') || matches!(scheme, "data" | "file" | "http" | "https"))
}

/// Reads all bytes of a file; returns `None` for a file longer than `limit` bytes.
pub(crate) fn read_file(file: &File, limit: u64) -> std::io::Result<Option<Vec<u8>>> {
    read_up_to_limit(
        file,
        file.metadata().map_or(0, |metadata| metadata.len()),
        limit,
    )
}

/// Reads a picture file whole.
///
/// # Errors
/// Of kind file for an unreadable file, of kind limit for a file that is too large.
pub(crate) fn read_picture_file(path: &Path, limits: &Limits) -> Result<Vec<u8>, Error> {
    let unreadable = |cause: std::io::Error| Error::unreadable(path, &cause);
    let file = File::open(path).map_err(unreadable)?;
    let bytes = read_file(&file, limits.file_bytes).map_err(unreadable)?;
    bytes.ok_or_else(|| {
        let limit = format_bytes(limits.file_bytes);
        Error::over_limit(
            path.display(),
            format!("the file is larger than the limit of {limit}; use a smaller picture"),
        )
    })
}

/// Reads all bytes of a source; returns `None` for more than `limit` bytes. `reported` is the
/// number of bytes that the source states, or 0 if unknown.
pub(crate) fn read_up_to_limit(
    source: impl Read,
    reported: u64,
    limit: u64,
) -> std::io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    // The reservation avoids copies while the list grows. It may fail where the claimed length is
    // false; the list then grows as bytes arrive.
    let _ = bytes.try_reserve_exact(usize::try_from(reported.min(limit)).unwrap_or_default());
    source
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)?;
    let bytes = refuse_placeholder(bytes)?;
    Ok((bytes.len() as u64 <= limit).then_some(bytes))
}

/// Returns the bytes of a file, unless they stand in for the file: a pointer of Git LFS, or a
/// server's page.
///
/// # Errors
/// An error that names the placeholder and the remedy.
pub(crate) fn refuse_placeholder(bytes: Vec<u8>) -> std::io::Result<Vec<u8>> {
    const LFS: &str = "the file is only a Git LFS pointer, and its content was not fetched; `git lfs pull` fetches it";
    const HTML: &str =
        "the file is an HTML page, probably saved in place of the file; download the file itself";
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(2048)]).to_ascii_lowercase();
    let start = start.trim_start_matches('\u{feff}').trim_start();
    // Comments and an XML declaration may precede the first element of a page.
    let is_page = ["<!doctype html", "<html"].iter().any(|tag| {
        start.starts_with(tag)
            || (start.starts_with("<!--") || start.starts_with("<?xml")) && start.contains(tag)
    });
    match start.starts_with("version https://git-lfs.github.com/spec/") {
        true => Err(std::io::Error::other(LFS)),
        false if is_page => Err(std::io::Error::other(HTML)),
        _ => Ok(bytes),
    }
}

// Source of the files that a scene names, for a scene loaded from bytes: an archive, memory or a
// network. The caller provides this source.

type ReadFunction = dyn Fn(&str) -> io::Result<Vec<u8>> + Send + Sync;

/// Function that provides the files that a scene names, for a scene that is not on disk
/// ([`Input::Bytes`](crate::Input::Bytes)). It gets the path of each file relative to the scene,
/// with `/` as separator.
///
/// Paths outside the scene's own folder are refused before the call. Content larger than
/// [`Limits::file_bytes`](crate::Limits) is refused after the call. Clones of a resolver compare as
/// equal; two resolvers that were created separately do not.
#[derive(Clone)]
pub struct Resolver(Arc<ReadFunction>);

impl Resolver {
    /// Creates a resolver from a function.
    pub fn new(read: impl Fn(&str) -> io::Result<Vec<u8>> + Send + Sync + 'static) -> Self {
        Self(Arc::new(read))
    }

    /// Reads a file by its path relative to the scene.
    ///
    /// # Errors
    /// Errors of the function; [`io::ErrorKind::NotFound`] for a missing file.
    pub fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        (self.0)(path)
    }
}

impl fmt::Debug for Resolver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Resolver").finish_non_exhaustive()
    }
}

impl PartialEq for Resolver {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Eq for Resolver {}

#[cfg(test)]
mod tests;
