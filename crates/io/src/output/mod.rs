//! Pictures on disk: PNG for the screen, OpenEXR for the numbers, both written whole or not at all, and read back.

mod atomic;
mod exr;
mod metadata;
mod png;
mod read;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::picture::Picture;

use crate::error::Error;
pub use atomic::write_atomically;
pub use exr::exr_bytes;
pub use metadata::Metadata;
pub use png::png_bytes;
pub(crate) use read::can_abort;
pub use read::{StoredPicture, decode_picture, read_picture};

/// A picture format, as the end of a file's name says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8-bit display values.
    Png,
    /// Linear scene-referred 32-bit floating point with all layers.
    Exr,
}

impl Format {
    /// The format that a path asks for; an error of kind [`Usage`](crate::ErrorKind::Usage) where it asks for none of ours.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            Some(other) => Err(Error::usage(format!("cannot write {}: unknown picture format `.{other}`", path.display()))),
            None => Err(Error::usage(format!("cannot write {}: the name does not end in a picture format", path.display()))),
        }
        .map_err(|error| error.with_hint("names end in `.png` (what a screen shows) or `.exr` (linear numbers)"))
    }
}

/// Whether a picture could be written under that name, as far as this can be known before it is rendered: a known
/// format, an existing folder, and no folder of the name itself.
pub fn check_target(path: &Path) -> Result<Format, Error> {
    let format = Format::of(path)?;
    if path.is_dir() {
        return Err(Error::write(path, &std::io::ErrorKind::IsADirectory.into()));
    }
    match atomic::folder_of(path).metadata() {
        Ok(folder) if folder.is_dir() => Ok(format),
        Ok(_) => Err(Error::write(path, &std::io::ErrorKind::NotADirectory.into())),
        Err(cause) => Err(Error::write(path, &cause)),
    }
}

/// Writes a picture in the format that its name asks for. The final name only ever holds a finished picture.
pub fn write_picture(path: &Path, picture: &Picture, display: Display, metadata: &Metadata) -> Result<(), Error> {
    match Format::of(path)? {
        Format::Png => write_png(path, picture, display, metadata),
        Format::Exr => write_exr(path, picture, metadata),
    }
}

/// Writes the display picture as PNG; see [`png_bytes`].
pub fn write_png(path: &Path, picture: &Picture, display: Display, metadata: &Metadata) -> Result<(), Error> {
    let bytes = png_bytes(picture, display, metadata).map_err(|cause| Error::write(path, &cause))?;
    write_atomically(path, &bytes)
}

/// Writes colour, coverage and layers as OpenEXR; see [`exr_bytes`].
pub fn write_exr(path: &Path, picture: &Picture, metadata: &Metadata) -> Result<(), Error> {
    let bytes = exr_bytes(picture, metadata).map_err(|cause| Error::write(path, &cause))?;
    write_atomically(path, &bytes)
}

/// The name for what an interrupted render has so far: `NAME.partial.EXT`.
pub fn partial_name(path: &Path) -> PathBuf {
    let mut name = path.file_stem().map(OsString::from).unwrap_or_default();
    name.push(".partial");
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// A picture whose buffers do not fit its size cannot become a file.
fn check_consistent(picture: &Picture) -> std::io::Result<()> {
    if picture.pixels() == 0 {
        return Err(std::io::Error::other("the picture has no pixels"));
    }
    if !picture.is_consistent() {
        return Err(std::io::Error::other("the picture's buffers do not fit its size"));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
