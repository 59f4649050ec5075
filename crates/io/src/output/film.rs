//! Film files, which store an unfinished render. A render can be resumed from a film, or divided
//! among machines that write a film each. The format is specific to this program, because no common
//! format keeps the sums of replicates (independent repetitions of the picture) separately.
//!
//! A file consists of these parts, all little-endian:
//! - sixteen magic bytes;
//! - the version of the format (u32);
//! - the length of the header (u64), and the header as JSON;
//! - the film's numbers in the order of [`Film::transfer_data`];
//! - the SHA-256 of all bytes before.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::film::{Film, FilmDataStream, FilmHeader};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::atomic::{ReplaceRule, write_stream};
use super::{PictureMetadata, write_new_stream};
use crate::error::Error;
use crate::limits::{Limits, format_bytes};

const MAGIC: [u8; 16] = *b"\x93raywright film\n";
const VERSION: u32 = 4;

/// Largest accepted length of a header in bytes. The list of tiles for a picture with 2³² pixels
/// takes a tenth of this length.
const MOST_HEADER: u64 = 256 << 20;

/// A film (the sums of an unfinished render) with the metadata of its picture.
#[derive(Clone, Debug)]
pub struct StoredFilm {
    /// Sums of the samples rendered so far.
    pub film: Film,
    /// Metadata about the origin of the picture.
    pub metadata: PictureMetadata,
    /// Display settings that apply when the picture is written as PNG.
    pub display: Display,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilmFileHeader {
    film: FilmHeader,
    metadata: PictureMetadata,
    display: Display,
}

/// Writes a film file atomically. The film is not changed; it is borrowed mutably only because
/// reading and writing share their code.
///
/// # Errors
///
/// Of kind [`File`](crate::ErrorKind::File) if the file cannot be written.
pub fn write_film(path: &Path, kept_film: &mut StoredFilm) -> Result<(), Error> {
    write_stream(path, ReplaceRule::AnyFile, |out| {
        encode_film(out, kept_film)
    })
    .map_err(|cause| Error::unwritable(path, &cause))
}

/// Writes a film file under a name that the user did not choose, otherwise as [`write_film`]. A
/// name that is taken is replaced by the next numbered name, as for
/// [`write_new_file`](super::write_new_file). Returns the path of
/// the written file.
///
/// # Errors
///
/// As [`write_film`].
pub fn write_new_film(
    path: &Path,
    kept_film: &mut StoredFilm,
    is_free: impl Fn(&Path) -> bool,
) -> Result<PathBuf, Error> {
    write_new_stream(path, is_free, |out| encode_film(out, kept_film))
}

fn encode_film(out: &mut dyn Write, kept_film: &mut StoredFilm) -> io::Result<()> {
    let header = FilmFileHeader {
        film: kept_film.film.header(),
        metadata: kept_film.metadata.clone(),
        display: kept_film.display,
    };
    let header = serde_json::to_vec(&header)?;
    let mut out = FilmWriter {
        out: BufWriter::with_capacity(1 << 20, out),
        hash: Sha256::new(),
    };
    out.write_bytes(&MAGIC)?;
    out.write_bytes(&VERSION.to_le_bytes())?;
    out.write_bytes(&(header.len() as u64).to_le_bytes())?;
    out.write_bytes(&header)?;
    kept_film.film.transfer_data(&mut out)?;
    let hash = out.hash.finalize();
    out.out.write_all(&hash)?;
    out.out.flush()
}

/// Whether a file begins as a film file of any version does. False for a file that cannot be read,
/// and for a pipe, from which bytes can be read only once.
pub fn is_film(path: &Path) -> bool {
    if !path.is_file() {
        return false;
    }
    let mut magic = [0; MAGIC.len()];
    let is_read = File::open(path).and_then(|mut file| file.read_exact(&mut magic));
    is_read.is_ok() && magic == MAGIC
}

/// Reads a film file. The memory that the film takes is computed from the header, and checked
/// against the limits before any allocation.
///
/// # Errors
///
/// - Of kind [`File`](crate::ErrorKind::File) for an unreadable file;
/// - [`Input`](crate::ErrorKind::Input) for anything but a complete film of this version;
/// - [`Limit`](crate::ErrorKind::Limit) for a film beyond the memory limit.
pub fn read_film(path: &Path, limits: &Limits) -> Result<StoredFilm, Error> {
    let file = File::open(path).map_err(|cause| Error::unreadable(path, &cause))?;
    if file.metadata().is_ok_and(|metadata| metadata.is_dir()) {
        return Err(Error::unreadable(path, &io::ErrorKind::IsADirectory.into()));
    }
    let mut from = FilmReader {
        from: BufReader::with_capacity(1 << 20, file),
        hash: Sha256::new(),
    };
    decode_film(&mut from, limits).map_err(|fault| match fault {
        FilmFault::Cause(cause) if cause.kind() == io::ErrorKind::UnexpectedEof => {
            Error::invalid_input(path.display(), "the film file is truncated")
                .with_hint("copy the file again, or render again")
        }
        FilmFault::Cause(cause) => Error::unreadable(path, &cause),
        FilmFault::Content(message) => Error::invalid_input(path.display(), message),
        FilmFault::Memory(bytes) => {
            let allowed = format_bytes(limits.memory_bytes);
            Error::over_limit(
                path.display(),
                format_args!(
                    "the film needs {} of memory, more than the limit of {allowed}",
                    format_bytes(bytes)
                ),
            )
            .with_hint("raise the limit with --max-memory")
        }
    })
}

/// Reason why a film cannot be read.
enum FilmFault {
    Cause(io::Error),
    Content(String),
    Memory(u64),
}

impl From<io::Error> for FilmFault {
    fn from(cause: io::Error) -> Self {
        Self::Cause(cause)
    }
}

fn decode_film(from: &mut FilmReader<impl Read>, limits: &Limits) -> Result<StoredFilm, FilmFault> {
    let content = |message: &str| FilmFault::Content(message.to_owned());
    let mut magic = [0; MAGIC.len()];
    let is_film = from.read_bytes(&mut magic).map(|()| magic == MAGIC);
    if !is_film.or_else(|cause| {
        if cause.kind() == io::ErrorKind::UnexpectedEof {
            Ok(false)
        } else {
            Err(cause)
        }
    })? {
        return Err(content(
            "the file is not a film file; films are written by --checkpoint",
        ));
    }
    let version = u32::from_le_bytes(from.read_array()?);
    if version != VERSION {
        return Err(FilmFault::Content(format!(
            "the film file has version {version}, but this program reads only version {VERSION}; use the program that wrote the file, or render again"
        )));
    }
    let length = u64::from_le_bytes(from.read_array()?);
    if length > MOST_HEADER {
        return Err(content(
            "the header of the film file is longer than any valid header: the file is damaged; copy it again, or render again",
        ));
    }
    // The buffer grows with the bytes that exist: a false length allocates no memory.
    let mut header = Vec::new();
    from.from.by_ref().take(length).read_to_end(&mut header)?;
    if (header.len() as u64) < length {
        return Err(FilmFault::Cause(io::ErrorKind::UnexpectedEof.into()));
    }
    from.hash.update(&header);
    let header: FilmFileHeader = serde_json::from_slice(&header).map_err(|cause| {
        FilmFault::Content(format!("the header of the film file is invalid: {cause}"))
    })?;
    let bytes = header
        .film
        .bytes()
        .map_err(|cause| FilmFault::Content(cause.to_string()))?;
    if bytes > limits.memory_bytes {
        return Err(FilmFault::Memory(bytes));
    }
    let mut film =
        Film::from_header(header.film).map_err(|cause| FilmFault::Content(cause.to_string()))?;
    film.transfer_data(from)?;
    let computed_hash = from.hash.clone().finalize();
    let stored_hash: [u8; 32] = from.read_array()?;
    if stored_hash != computed_hash[..] {
        return Err(content(
            "the checksum is wrong: the file was damaged or changed; copy it again, or render again",
        ));
    }
    if from.from.read(&mut [0])? > 0 {
        return Err(content(
            "the file continues after the end of the film; copy it again, or render again",
        ));
    }
    Ok(StoredFilm {
        film,
        metadata: header.metadata,
        display: header.display,
    })
}

/// Writes the numbers of a film, and hashes the bytes written.
struct FilmWriter<W: Write> {
    out: W,
    hash: Sha256,
}

/// Reads the numbers of a film, and hashes the bytes read.
struct FilmReader<R: Read> {
    from: R,
    hash: Sha256,
}

impl<W: Write> FilmWriter<W> {
    fn write_bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hash.update(bytes);
        self.out.write_all(bytes)
    }
}

impl<R: Read> FilmReader<R> {
    fn read_bytes(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.from.read_exact(bytes)?;
        self.hash.update(&*bytes);
        Ok(())
    }

    fn read_array<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.read_bytes(&mut bytes)?;
        Ok(bytes)
    }
}

/// Implements the transfer of lists of numbers for writer and reader, once for each type of number.
macro_rules! numbers {
    ($($method:ident: $number:ty),*) => {
        impl<W: Write> FilmDataStream for FilmWriter<W> {
            type Error = io::Error;
            $(fn $method(&mut self, numbers: &mut [$number]) -> io::Result<()> {
                let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
                self.write_bytes(&bytes)
            })*
        }

        impl<R: Read> FilmDataStream for FilmReader<R> {
            type Error = io::Error;
            $(fn $method(&mut self, numbers: &mut [$number]) -> io::Result<()> {
                let mut bytes = vec![0; size_of_val(numbers)];
                self.read_bytes(&mut bytes)?;
                for (number, bytes) in numbers.iter_mut().zip(bytes.as_chunks().0) {
                    *number = <$number>::from_le_bytes(*bytes);
                }
                Ok(())
            })*
        }
    };
}

numbers!(transfer_f64: f64, transfer_f32: f32, transfer_u16: u16, transfer_u32: u32);
