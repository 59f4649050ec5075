//! Where results go, checked before any work is done: a long render must not end with "no such folder".

use std::io;
use std::path::{Path, PathBuf};

use raywright_io::Error;
use raywright_io::output::Format;

use crate::failure::Failure;

/// One place to write the picture to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// PNG on standard output.
    Stdout,
    /// A file, by its final name.
    File(PathBuf, Format),
}

impl Target {
    /// Whether it can hold more than colour and coverage.
    pub fn has_layers(&self) -> bool {
        matches!(self, Self::File(_, Format::Exr))
    }
}

/// Checks every place that was asked for: a known format, a folder that can be written to, nothing twice.
pub fn check(outputs: &[PathBuf]) -> Result<Vec<Target>, Failure> {
    let mut targets = Vec::with_capacity(outputs.len());
    let mut places = Vec::with_capacity(outputs.len());
    for output in outputs {
        let (target, place) = if output == Path::new("-") {
            (Target::Stdout, output.clone())
        } else {
            (Target::File(output.clone(), Format::of(output)?), writable(output)?)
        };
        if places.contains(&place) {
            return Err(Error::usage(format_args!("{} is named twice as output", output.display())).into());
        }
        targets.push(target);
        places.push(place);
    }
    Ok(targets)
}

/// Checks that a file of this name can be made, by making another one beside it for a moment, and returns the one name
/// that all spellings of its path share.
pub fn writable(path: &Path) -> Result<PathBuf, Failure> {
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    let fail = |cause: io::Error| Failure::from(Error::write(path, &cause));
    if path.is_dir() {
        return Err(fail(io::ErrorKind::IsADirectory.into()));
    }
    if folder.exists() && !folder.is_dir() {
        return Err(fail(io::ErrorKind::NotADirectory.into()));
    }
    if !folder.exists() {
        let error = Error::write(path, &io::ErrorKind::NotFound.into());
        return Err(error.with_hint(format!("create the folder first: mkdir -p {}", folder.display())).into());
    }
    tempfile::Builder::new().prefix(".raywright-").tempfile_in(folder).map_err(|cause| fail(cause.kind().into()))?;
    let folder = folder.canonicalize().map_err(fail)?;
    Ok(path.file_name().map_or_else(|| folder.clone(), |name| folder.join(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two spellings of one file are one file.
    #[test]
    fn the_same_file_twice_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (plain, detour) = (folder.path().join("a.png"), folder.path().join("./a.png"));
        assert!(check(&[plain.clone(), folder.path().join("b.png")]).is_ok());
        assert!(check(&[plain, detour]).is_err());
        assert!(check(&["-".into(), "-".into()]).is_err());
    }

    /// Looking whether a folder can be written to leaves nothing behind in it.
    #[test]
    fn checking_leaves_no_trace() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        writable(&folder.path().join("a.png")).expect("a fresh folder can be written to");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
    }
}
