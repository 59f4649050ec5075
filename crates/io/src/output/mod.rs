//! Picture files, written atomically and read back: PNG, JPEG and WebP for display, OpenEXR for
//! linear values, and film files, which hold the sums of an unfinished render.

mod animation;
mod atomic;
mod exr;
mod film;
mod metadata;
mod output_path;
mod png;
mod read;
mod sheet;

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::picture::Picture;
use sha2::{Digest, Sha256};

use crate::error::Error;
pub use animation::{AnimationFormat, AnimationWriter};
use atomic::ReplaceRule;
pub use atomic::{is_own_picture, write_atomically};
pub(crate) use exr::encode_exr;
pub use film::{StoredFilm, is_film, read_film, write_film, write_new_film};
pub use metadata::PictureMetadata;
pub use output_path::OutputPath;
pub(crate) use output_path::file_fingerprint;
pub use png::encode_png;
pub(crate) use png::{encode_jpeg, encode_webp};
pub(crate) use read::check_dwa_blocks;
#[cfg(test)]
pub(crate) use read::decode_picture;
pub use read::{StoredPicture, read_picture};
pub use sheet::{ContactSheet, PictureMark, mark_radius, write_marked_picture};

/// Format of a picture file, chosen by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// Display values of 8 or 16 bits.
    Png,
    /// Display values of 8 bits, lossy and without coverage.
    Jpeg {
        /// Quality from 1 to 100.
        quality: u8,
    },
    /// Display values of 8 bits, lossless.
    WebP,
    /// Linear floating-point values of 32 bits, with all layers.
    Exr,
}

/// Default quality of a JPEG, on a scale from 1 to 100.
pub const DEFAULT_JPEG_QUALITY: u8 = 90;

impl PictureFormat {
    /// Selects the format of a path.
    ///
    /// # Errors
    /// Of kind [`Usage`](crate::ErrorKind::Usage) for an unsupported extension.
    pub fn from_path(path: &Path) -> Result<Self, Error> {
        let extension = path
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("jpg" | "jpeg") => Ok(Self::Jpeg {
                quality: DEFAULT_JPEG_QUALITY,
            }),
            Some("webp") => Ok(Self::WebP),
            Some("exr") => Ok(Self::Exr),
            Some(other) => Err(Error::invalid_usage(format!(
                "cannot write {}: unknown picture format `.{other}`",
                path.display()
            ))),
            None => Err(Error::invalid_usage(format!(
                "cannot write {}: the name has no extension of a picture format",
                path.display()
            ))),
        }
        .map_err(|error| {
            error.with_hint(
                "names end in `.png`, `.jpg`, `.webp` (display values) or `.exr` (linear numbers)",
            )
        })
    }
}

/// Writes a picture atomically, in the format of the path's extension: the path never refers to an
/// unfinished picture.
///
/// # Errors
/// Of kind [`Usage`](crate::ErrorKind::Usage) for an unsupported extension,
/// [`File`](crate::ErrorKind::File) if the file cannot be written.
pub fn write_picture(
    path: &Path,
    picture: &Picture,
    display: Display,
    metadata: &PictureMetadata,
) -> Result<(), Error> {
    write_picture_as(
        path,
        PictureFormat::from_path(path)?,
        picture,
        display,
        metadata,
    )
}

/// Writes a picture in a given format, otherwise as [`write_picture`].
///
/// # Errors
/// Of kind [`File`](crate::ErrorKind::File) if the file cannot be written.
pub fn write_picture_as(
    path: &Path,
    format: PictureFormat,
    picture: &Picture,
    display: Display,
    metadata: &PictureMetadata,
) -> Result<(), Error> {
    write_atomically(
        path,
        &encode_picture(path, format, picture, display, metadata)?,
    )
}

/// Writes a picture under a name that the user did not choose. Only a picture that this program
/// wrote is replaced. If another file has the name, or `is_free_path` returns false for the name,
/// the next numbered name (`NAME-2.EXT`) is tried. Returns the path of the written file.
///
/// # Errors
///
/// As [`write_picture`].
pub fn write_new_picture(
    path: &Path,
    picture: &Picture,
    display: Display,
    metadata: &PictureMetadata,
    is_free: impl Fn(&Path) -> bool,
) -> Result<PathBuf, Error> {
    write_new_file(
        path,
        &encode_picture(
            path,
            PictureFormat::from_path(path)?,
            picture,
            display,
            metadata,
        )?,
        is_free,
    )
}

/// Writes the bytes of a file of any kind, otherwise as [`write_new_picture`].
///
/// # Errors
/// Of kind [`File`](crate::ErrorKind::File) if the file cannot be written.
pub fn write_new_file(
    path: &Path,
    bytes: &[u8],
    is_free: impl Fn(&Path) -> bool,
) -> Result<PathBuf, Error> {
    write_new_stream(path, is_free, |out| out.write_all(bytes))
}

fn write_new_stream(
    path: &Path,
    is_free: impl Fn(&Path) -> bool,
    mut write: impl FnMut(&mut dyn Write) -> std::io::Result<()>,
) -> Result<PathBuf, Error> {
    for number in 1..=MOST_NAMES {
        let name = numbered_path(path, number);
        if !is_free(&name) {
            continue;
        }
        match atomic::write_stream(&name, ReplaceRule::ProgramPictures, &mut write) {
            Ok(()) => return Ok(name),
            Err(cause) if cause.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(cause) => return Err(Error::unwritable(&name, &cause)),
        }
    }
    Err(Error::unwritable(
        path,
        &std::io::ErrorKind::AlreadyExists.into(),
    ))
}

/// Largest number of names that are tried before the write fails.
const MOST_NAMES: u32 = 1000;

/// Returns the path with `-NUMBER` before the extension; for number 1, the path itself.
fn numbered_path(path: &Path, number: u32) -> PathBuf {
    if number == 1 {
        path.to_owned()
    } else {
        insert_suffix(path, &format!("-{number}"))
    }
}

fn encode_picture(
    path: &Path,
    format: PictureFormat,
    picture: &Picture,
    display: Display,
    metadata: &PictureMetadata,
) -> Result<Vec<u8>, Error> {
    match format {
        PictureFormat::Png => encode_png(picture, display, metadata),
        PictureFormat::Jpeg { quality } => encode_jpeg(picture, quality, display, metadata),
        PictureFormat::WebP => encode_webp(picture, display, metadata),
        PictureFormat::Exr => encode_exr(picture, metadata),
    }
    .map_err(|cause| Error::unwritable(path, &cause))
}

/// Returns the name for the unfinished picture of an interrupted render: `NAME.partial.EXT`.
pub fn partial_picture_path(path: &Path) -> PathBuf {
    insert_suffix(path, ".partial")
}

/// Longest file name in bytes on common file systems.
const LONGEST_NAME: usize = 255;

/// Inserts a suffix between stem and extension of a file name. If the new name is too long for a
/// file system, the stem is truncated.
fn insert_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut end = OsString::from(suffix);
    if let Some(extension) = path.extension() {
        end.push(".");
        end.push(extension);
    }
    let stem = path.file_stem().unwrap_or_default();
    let room = LONGEST_NAME.saturating_sub(end.len());
    let mut name = if stem.len() <= room {
        stem.to_owned()
    } else {
        let stem = stem.to_string_lossy();
        stem[..stem.floor_char_boundary(room)].into()
    };
    name.push(end);
    path.with_file_name(name)
}

/// Returns SHA-256 of the pixels as 64 hexadecimal digits, independent of the file format. The
/// hashed numbers are the width, the height, the linear red, green and blue of each pixel row by
/// row, and the coverage of each pixel if present. Each is a little-endian 32-bit number.
pub fn pixel_hash(picture: &Picture) -> String {
    let mut hash = Sha256::new();
    [picture.width, picture.height]
        .iter()
        .for_each(|edge| hash.update(edge.to_le_bytes()));
    let numbers = picture
        .rgb
        .iter()
        .flatten()
        .chain(picture.alpha.iter().flatten());
    numbers.for_each(|number| hash.update(number.to_le_bytes()));
    hash.finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

/// Refuses a picture whose buffers do not match its width and height.
fn check_buffer_sizes(picture: &Picture) -> std::io::Result<()> {
    if picture.pixel_count() == 0 {
        return Err(std::io::Error::other("the picture has no pixels"));
    }
    if !picture.is_consistent() {
        return Err(std::io::Error::other(
            "a buffer of the picture does not match the picture's width and height",
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
