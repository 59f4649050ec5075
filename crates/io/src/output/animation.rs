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
            self.move_temporary_file()?;
            self.spool.write_all(&png)?;
        }
        self.lengths.push(png.len());
        Ok(())
    }

    /// Moves the added pictures from the folder of the output file, which is full, to the system's
    /// temporary folder.
    fn move_temporary_file(&mut self) -> io::Result<()> {
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
mod tests {
    use super::*;

    /// Returns an animation of three uniform grey pictures, at this rate.
    fn animation(format: AnimationFormat, rate: f64, alpha: Option<f32>) -> Vec<u8> {
        let folder = tempfile::tempdir().expect("a folder");
        let mut animation = AnimationWriter::new(
            &folder.path().join("a"),
            format,
            rate,
            PictureMetadata::default(),
        )
        .expect("a folder to write to");
        for grey in [0.0, 1.0, 0.0] {
            let alpha = alpha.map(|alpha| vec![alpha; 12]);
            let picture = Picture {
                rgb: vec![[grey; 3]; 12],
                alpha,
                ..Picture::new(4, 3)
            };
            animation
                .add_picture(&picture, Display::PLAIN)
                .expect("one size");
        }
        animation.to_bytes().expect("all of them")
    }

    /// Protects: a GIF has the requested rate, each picture to the nearest hundredth of a second
    /// and exactly in total, and repeats for ever; a transparent picture is removed before the
    /// next.
    #[test]
    fn gifs_keep_their_time() {
        for (alpha, dispose) in [
            (None, DisposalMethod::Keep),
            (Some(0.0), DisposalMethod::Background),
        ] {
            let bytes = animation(AnimationFormat::Gif, 30.0, alpha);
            let mut reader = gif::DecodeOptions::new()
                .read_info(bytes.as_slice())
                .expect("a GIF");
            let mut frames = Vec::new();
            while let Some(frame) = reader.read_next_frame().expect("a picture") {
                frames.push((frame.delay, frame.dispose, [frame.width, frame.height]));
            }
            assert_eq!(frames, [3, 4, 3].map(|delay| (delay, dispose, [4, 3])));
            assert_eq!(reader.repeat(), Repeat::Infinite);
        }
    }

    /// Protects: if the folder of an animation has no room for another picture, the earlier
    /// pictures are kept, and the file has the same bytes as with enough room.
    #[cfg(unix)]
    #[test]
    fn a_full_folder_loses_no_picture() {
        let folder = tempfile::tempdir().expect("a folder");
        let make = |is_full: bool| {
            let path = folder.path().join("a.apng");
            let format = AnimationFormat::Apng;
            let mut animation =
                AnimationWriter::new(&path, format, 10.0, PictureMetadata::default())
                    .expect("a spool");
            for (i, grey) in [0.2, 0.5, 0.8, 1.0].into_iter().enumerate() {
                if is_full && i == 2 {
                    // A file that is readable but not writable.
                    let mut png = Vec::new();
                    animation.spool.seek(SeekFrom::Start(0)).expect("a file");
                    animation.spool.read_to_end(&mut png).expect("a file");
                    std::fs::write(&path, &png).expect("a file");
                    animation.spool = File::open(&path).expect("a file");
                }
                let rgb = vec![[grey; 3]; 12];
                let picture = Picture {
                    rgb,
                    ..Picture::new(4, 3)
                };
                animation
                    .add_picture(&picture, Display::PLAIN)
                    .expect("room");
            }
            animation.to_bytes().expect("all of them")
        };
        assert!(make(true) == make(false));
    }

    /// Protects: an APNG has the requested rate, repeats for ever, and has the codes of its
    /// pictures.
    #[test]
    fn apngs_keep_their_time() {
        let bytes = animation(AnimationFormat::Apng, 25.0, None);
        let mut reader = Decoder::new(io::Cursor::new(bytes))
            .read_info()
            .expect("a PNG");
        let control = reader.info().animation_control.expect("an animation");
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        for code in [0, 255, 0] {
            let mut codes = vec![7; 36];
            reader.next_frame(&mut codes).expect("a picture");
            let frame = reader.info().frame_control.expect("its time");
            assert_eq!(
                (
                    f64::from(frame.delay_num) / f64::from(frame.delay_den),
                    codes
                ),
                (0.04, vec![code; 36])
            );
        }
    }

    /// Protects: a GIF, which has no partial coverage, omits shadows instead of black spots; an
    /// APNG keeps them, and over a background both do.
    #[test]
    fn shadows_are_no_black_spots() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let picture = Picture {
            alpha: Some(vec![0.4; 12]),
            shadow: Some(vec![0.4; 12]),
            ..Picture::new(4, 3)
        };
        let alpha_of = |format, background: Option<[f64; 3]>| {
            let mut animation = AnimationWriter::new(
                &folder.path().join("a"),
                format,
                10.0,
                PictureMetadata::default(),
            )
            .expect("a spool");
            animation
                .add_picture(
                    &picture,
                    Display {
                        background,
                        ..Display::PLAIN
                    },
                )
                .expect("a picture");
            let mut codes = Vec::new();
            animation
                .for_each_picture(|own, _| {
                    codes = own;
                    Ok(())
                })
                .expect("codes");
            codes[codes.len() - 1]
        };
        assert_eq!(alpha_of(AnimationFormat::Gif, None), 0);
        assert!(
            (45..60).contains(&alpha_of(AnimationFormat::Apng, None)),
            "{}",
            alpha_of(AnimationFormat::Apng, None)
        );
        for format in [AnimationFormat::Gif, AnimationFormat::Apng] {
            assert!((150..250).contains(&alpha_of(format, Some([1.0; 3]))));
        }
    }
}
