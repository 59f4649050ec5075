//! Animations in a single file: GIF with 256 colours per picture, APNG with full colour.
//!
//! The number of pictures is known only at the end, because a run may be interrupted. Until then
//! each picture is kept, compressed, in an unnamed file beside the output file.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

use gif::{DisposalMethod, Frame, Repeat};
use png::{ColorType, Decoder};
use raywright_core::display::{Display, OutputFormat};
use raywright_core::picture::Picture;

use super::atomic::{ReplaceRule, write_stream};
use super::metadata::PictureMetadata;
use super::output_path::folder_of;
use super::png::{create_encoder, encode_png};
use crate::error::Error;

/// File format of an animation, by the extension of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnimationFormat {
    /// 256 colours per picture, and times in hundredths of a second.
    Gif,
    /// PNG with several pictures.
    Apng,
}

impl AnimationFormat {
    /// Returns the format for the extension of a file name; `None` for a format that stores a
    /// single picture.
    pub fn from_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
        [("gif", Self::Gif), ("apng", Self::Apng)]
            .into_iter()
            .find(|(name, _)| *name == ending)
            .map(|(_, format)| format)
    }
}

/// Writer of an animation. Pictures are added one by one, before their number is known.
#[derive(Debug)]
pub struct AnimationWriter {
    format: AnimationFormat,
    /// Number of pictures shown per second.
    rate: f64,
    metadata: PictureMetadata,
    /// Temporary file with the added pictures in sequence, each compressed as PNG.
    spool: File,
    lengths: Vec<usize>,
    size: [u32; 2],
    display: Display,
    has_alpha: bool,
}

/// Shortest duration of a picture in a GIF, in hundredths of a second. Most viewers show a picture
/// of a shorter duration for a tenth of a second.
const MIN_GIF_DELAY: f64 = 2.0;

impl AnimationWriter {
    /// Creates an empty animation for the file `path`, with `rate` pictures per second.
    ///
    /// # Errors
    /// Of kind [`File`](crate::ErrorKind::File) if no temporary file can be created in the folder
    /// of `path`.
    pub fn new(
        path: &Path,
        format: AnimationFormat,
        rate: f64,
        metadata: PictureMetadata,
    ) -> Result<Self, Error> {
        let spool = tempfile::tempfile_in(folder_of(path))
            .map_err(|cause| Error::unwritable(path, &cause))?;
        let (lengths, size, display) = (Vec::new(), [0; 2], Display::PLAIN);
        Ok(Self {
            format,
            rate,
            metadata,
            spool,
            lengths,
            size,
            display,
            has_alpha: false,
        })
    }

    /// Adds the next picture, converted for display.
    ///
    /// # Errors
    /// A picture of another size or transparency than the first picture, or a failed write.
    pub fn add_picture(&mut self, picture: &Picture, display: Display) -> io::Result<()> {
        let display = Display {
            output: OutputFormat::Eight,
            ..display
        };
        let (size, has_alpha) = ([picture.width, picture.height], display.has_alpha(picture));
        if self.lengths.is_empty() {
            (self.size, self.display, self.has_alpha) = (size, display, has_alpha);
        } else if self.size != size {
            let ([w, h], [width, height]) = (self.size, size);
            return Err(io::Error::other(format!(
                "the pictures of the animation have different sizes, {w} × {h} and {width} × {height} pixels; --size sets one size"
            )));
        } else if self.has_alpha != has_alpha {
            return Err(io::Error::other(
                "some pictures of the animation are transparent and others opaque; choose the same --background for all",
            ));
        }
        // A GIF makes partly covered pixels opaque. A shadow without background would become a
        // black spot.
        let is_alone = self.format == AnimationFormat::Gif && has_alpha && picture.shadow.is_some();
        let picture = if is_alone {
            Cow::Owned(picture.without_shadow())
        } else {
            Cow::Borrowed(picture)
        };
        let png = encode_png(&picture, display, &PictureMetadata::default())?;
        if self.spool.write_all(&png).is_err() {
            self.move_to_temp_folder()?;
            self.spool.write_all(&png)?;
        }
        self.lengths.push(png.len());
        Ok(())
    }

    /// Moves the added pictures from the folder of the output file, which is full, to the system's
    /// temporary folder.
    fn move_to_temp_folder(&mut self) -> io::Result<()> {
        let mut spool = tempfile::tempfile()?;
        self.spool.seek(SeekFrom::Start(0))?;
        let whole = self.lengths.iter().map(|&length| length as u64).sum();
        io::copy(&mut (&self.spool).take(whole), &mut spool)?;
        self.spool = spool;
        Ok(())
    }

    /// Number of pictures added so far.
    pub fn len(&self) -> usize {
        self.lengths.len()
    }

    /// Whether no picture was added yet.
    pub fn is_empty(&self) -> bool {
        self.lengths.is_empty()
    }

    /// Writes the animation atomically. The animation repeats for ever.
    ///
    /// # Errors
    /// Of kind [`File`](crate::ErrorKind::File) if the file cannot be written.
    pub fn write(&mut self, path: &Path) -> Result<(), Error> {
        write_stream(path, ReplaceRule::AnyFile, |out| self.encode(out))
            .map_err(|cause| Error::unwritable(path, &cause))
    }

    /// Returns the animation as the bytes of a file.
    ///
    /// # Errors
    /// A failure to read the kept pictures.
    pub fn to_bytes(&mut self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.encode(&mut bytes)?;
        Ok(bytes)
    }

    fn encode(&mut self, out: &mut dyn Write) -> io::Result<()> {
        let mut out = BufWriter::new(out);
        match self.format {
            AnimationFormat::Gif => self.encode_gif(&mut out)?,
            AnimationFormat::Apng => self.encode_apng(&mut out)?,
        }
        out.flush()
    }

    fn encode_apng(&mut self, out: &mut dyn Write) -> io::Result<()> {
        let [width, height] = self.size;
        let mut encoder = create_encoder(
            out,
            [width, height],
            self.has_alpha,
            self.display,
            &self.metadata,
        )?;
        encoder.set_animated(u32::try_from(self.len()).map_err(io::Error::other)?, 0)?;
        let delay = (1000.0 / self.rate).round().clamp(1.0, f64::from(u16::MAX)) as u16;
        encoder.set_frame_delay(delay, 1000)?;
        let mut writer = encoder.write_header()?;
        self.for_each_picture(|codes, _| Ok(writer.write_image_data(&codes)?))?;
        Ok(writer.finish()?)
    }

    fn encode_gif(&mut self, out: &mut dyn Write) -> io::Result<()> {
        let edge = |pixels: u32| {
            u16::try_from(pixels)
                .map_err(|_| io::Error::other("a GIF has at most 65535 pixels per row and column; choose a smaller --size, or write a .apng"))
        };
        let (width, height) = (edge(self.size[0])?, edge(self.size[1])?);
        let mut encoder = gif::Encoder::new(out, width, height, &[]).map_err(io::Error::other)?;
        encoder
            .set_repeat(Repeat::Infinite)
            .map_err(io::Error::other)?;
        let (rate, has_alpha) = (self.rate, self.has_alpha);
        // Rounding the end of each picture, not its duration, makes the total exact.
        let end = |picture: usize| (100.0 * (picture + 1) as f64 / rate).round();
        let time =
            |picture: usize| end(picture) - if picture == 0 { 0.0 } else { end(picture - 1) };
        self.for_each_picture(|mut codes, picture| {
            let frame = if has_alpha {
                Frame::from_rgba_speed(width, height, &mut codes, 10)
            } else {
                Frame::from_rgb_speed(width, height, &codes, 10)
            };
            let delay = time(picture).clamp(MIN_GIF_DELAY, f64::from(u16::MAX)) as u16;
            let dispose = if has_alpha {
                DisposalMethod::Background
            } else {
                DisposalMethod::Keep
            };
            encoder
                .write_frame(&Frame {
                    delay,
                    dispose,
                    ..frame
                })
                .map_err(io::Error::other)
        })
    }

    /// Decodes the added pictures in order. Calls `take` with the 8-bit codes and the index of each
    /// picture.
    fn for_each_picture(
        &mut self,
        mut take: impl FnMut(Vec<u8>, usize) -> io::Result<()>,
    ) -> io::Result<()> {
        self.spool.seek(SeekFrom::Start(0))?;
        let mut spool = BufReader::new(&self.spool);
        for (i, &length) in self.lengths.iter().enumerate() {
            let mut png = vec![0; length];
            spool.read_exact(&mut png)?;
            let mut reader = Decoder::new(io::Cursor::new(png)).read_info()?;
            let channels = if reader.info().color_type == ColorType::Rgba {
                4
            } else {
                3
            };
            let mut codes = vec![0; channels * self.size[0] as usize * self.size[1] as usize];
            reader.next_frame(&mut codes)?;
            take(codes, i)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
