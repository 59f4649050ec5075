//! Live previews of a render, updated at each doubling of the sample count: a PNG file, and the
//! image viewer tev (<https://github.com/Tom94/tev>). A packet of its TCP protocol holds its length,
//! its kind and its content. Numbers are little-endian, and texts end with a zero byte.

use std::io;
use std::io::Write;
use std::net::{TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::time::Duration;

use raywright_core::display::Display;
use raywright_core::film::Film;
use raywright_core::picture::{Picture, PictureLayer};
use raywright_core::{Observer, RenderOutput, RenderStage};
use raywright_io::Error;
use raywright_io::output::{PictureMetadata, encode_png, write_atomically};

use crate::args::TevAddress;
use crate::failure::{Exit, Failure};
use crate::plan::RenderTask;

/// Live previews of a picture: a PNG file, an image in the viewer tev, both or neither.
#[derive(Default)]
pub struct LivePreviews {
    /// PNG file of `--preview`.
    preview: Option<PathBuf>,
    /// Connection to the image viewer tev.
    tev: Option<TevClient>,
    /// Sample count, summed over all pixels, at which the next update is due; `None` before the
    /// first update.
    next_update: Option<u64>,
}

impl LivePreviews {
    /// Creates the previews that a task requests, and connects to the viewer tev if requested.
    /// `name` is the picture's name in the viewer.
    pub fn from_task(task: &RenderTask, name: &str) -> Result<Self, Failure> {
        let refused = |cause: std::io::Error, host: &str, port: u16| {
            let failure = Failure::new(
                Exit::File,
                format_args!("cannot reach the image viewer tev at {host}:{port}: {cause}"),
            );
            failure.with_hint("start tev first; --display tev:HOST:PORT sets its address")
        };
        let connect = |address| {
            TevClient::connect(address, name)
                .map_err(|cause| refused(cause, &address.host, address.port))
        };
        let (preview, tev) = (
            task.report.preview.clone(),
            task.report.display.as_ref().map(connect).transpose()?,
        );
        Ok(Self {
            preview,
            tev,
            next_update: None,
        })
    }

    /// Returns the sample count, summed over all pixels, at which the next update is due, first at
    /// one sample per pixel; `None` without previews.
    pub fn next_update_sample_count(&self, film: &Film) -> Option<u64> {
        let pixels = || film.size().into_iter().map(u64::from).product();
        (self.preview.is_some() || self.tev.is_some())
            .then(|| self.next_update.unwrap_or_else(pixels))
    }

    /// Updates the previews. Returns a message if the update failed; the render continues
    /// nevertheless. If the viewer has closed its connection, later updates leave it out.
    pub fn update_previews(
        &mut self,
        film: &Film,
        (done, observer): (u64, &dyn Observer),
        (display, metadata): (Display, &PictureMetadata),
    ) -> Option<String> {
        self.next_update = self
            .next_update_sample_count(film)
            .map(|next| next.max(done).saturating_mul(2));
        let rendered = RenderStage::from_film(film).into_output(observer);
        if rendered.counters.samples == 0 {
            return None;
        }
        let mut failed = None;
        if let Some(path) = &self.preview {
            let bytes = encode_png(rendered.final_picture(), display, metadata)
                .map_err(|cause| Error::unwritable(path, &cause));
            failed = bytes
                .and_then(|bytes| write_atomically(path, &bytes))
                .err()
                .map(|error| error.message().to_owned());
        }
        if let Some(tev) = &mut self.tev
            && let Err(cause) = tev.send_picture(&with_standard_errors(film, &rendered))
        {
            failed = Some(format!("the connection to tev failed: {cause}"));
            self.tev = None;
        }
        failed
    }
}

/// Returns the picture with all its layers, and with the standard errors of its pixels as layers
/// `stderr`.
fn with_standard_errors(film: &Film, rendered: &RenderOutput) -> Picture {
    let mut picture = rendered.picture_with_all_layers().into_owned();
    if let Some((errors, _)) = film
        .standard_errors()
        .filter(|_| picture.layer("stderr.R").is_none())
    {
        let layer = |(channel, name): (usize, &str)| PictureLayer {
            name: name.to_owned(),
            samples: errors.iter().map(|e| e[channel]).collect(),
        };
        picture.layers.extend(
            ["stderr.R", "stderr.G", "stderr.B"]
                .into_iter()
                .enumerate()
                .map(layer),
        );
    }
    picture
}

/// Kind of a packet that creates an image.
const CREATE_IMAGE: u8 = 4;
/// Kind of a packet that updates some channels of an image.
const UPDATE_IMAGE: u8 = 6;

/// Largest number of pixel values in a packet; an image with more values is sent in bands of rows.
const MOST_VALUES: usize = 4 << 20;
/// Time limit for the connection and for each write.
const MOST_TIME: Duration = Duration::from_secs(10);

/// A connection to tev that shows a single image.
pub struct TevClient {
    stream: TcpStream,
    name: String,
    /// Size in pixels and channel names of the image in the viewer; `None` before the first image.
    shown: Option<([u32; 2], Vec<String>)>,
}

impl TevClient {
    /// Connects to the viewer at an address, for an image with this name.
    pub fn connect(address: &TevAddress, name: &str) -> io::Result<Self> {
        let mut last = io::Error::from(io::ErrorKind::NotFound);
        for place in (address.host.as_str(), address.port).to_socket_addrs()? {
            match TcpStream::connect_timeout(&place, MOST_TIME) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(MOST_TIME))?;
                    return Ok(Self {
                        stream,
                        name: name.replace('\0', " "),
                        shown: None,
                    });
                }
                Err(cause) => last = cause,
            }
        }
        Err(last)
    }

    /// Sends a picture with its layers to the viewer. A picture of another size or with other
    /// channels replaces the image.
    pub fn send_picture(&mut self, picture: &Picture) -> io::Result<()> {
        let channels = list_channels(picture);
        let names: Vec<String> = channels.iter().map(|(name, _)| name.clone()).collect();
        let shown = Some(([picture.width, picture.height], names));
        if self.shown != shown {
            self.stream
                .write_all(&encode_create_packet(&self.name, picture, &channels))?;
            self.shown = shown;
        }
        let width = picture.width.max(1) as usize;
        let rows = (MOST_VALUES / (width * channels.len())).max(1);
        for top in (0..picture.height as usize).step_by(rows) {
            let rows = rows.min(picture.height as usize - top);
            self.stream.write_all(&encode_update_packet(
                &self.name,
                &channels,
                width,
                top..top + rows,
            ))?;
        }
        self.stream.flush()
    }
}

/// Name of a channel, and a function from the index of a pixel to the channel's value.
type TevChannel<'a> = (String, Box<dyn Fn(usize) -> f32 + 'a>);

fn list_channels(picture: &Picture) -> Vec<TevChannel<'_>> {
    let colour = |(channel, name): (usize, &str)| -> TevChannel<'_> {
        (
            name.to_owned(),
            Box::new(move |pixel| picture.rgb[pixel][channel]),
        )
    };
    let mut channels: Vec<TevChannel<'_>> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(colour)
        .collect();
    if let Some(alpha) = &picture.alpha {
        channels.push(("A".to_owned(), Box::new(|pixel| alpha[pixel])));
    }
    channels.extend(picture.layers.iter().map(|layer| -> TevChannel<'_> {
        (layer.name.clone(), Box::new(|pixel| layer.samples[pixel]))
    }));
    channels
}

fn encode_create_packet(name: &str, picture: &Picture, channels: &[TevChannel<'_>]) -> Vec<u8> {
    let mut packet = TevPacket::new(CREATE_IMAGE, name);
    [picture.width, picture.height, channels.len() as u32]
        .iter()
        .for_each(|number| packet.push_u32(*number));
    channels.iter().for_each(|(name, _)| packet.push_text(name));
    packet.finish()
}

/// Encodes a packet with new values for `rows` of an image, channel after channel.
fn encode_update_packet(
    name: &str,
    channels: &[TevChannel<'_>],
    width: usize,
    rows: std::ops::Range<usize>,
) -> Vec<u8> {
    let mut packet = TevPacket::new(UPDATE_IMAGE, name);
    packet.push_u32(channels.len() as u32);
    channels.iter().for_each(|(name, _)| packet.push_text(name));
    [0, rows.start as u32, width as u32, rows.len() as u32]
        .iter()
        .for_each(|number| packet.push_u32(*number));
    let pixels = rows.start * width..rows.end * width;
    (0..channels.len()).for_each(|channel| packet.push_u64((channel * pixels.len()) as u64));
    channels.iter().for_each(|_| packet.push_u64(1));
    for (_, value) in channels {
        packet
            .0
            .extend(pixels.clone().flat_map(|pixel| value(pixel).to_le_bytes()));
    }
    packet.finish()
}

/// A packet under construction: four bytes for its length, which is set at the end, then its
/// content.
struct TevPacket(Vec<u8>);

impl TevPacket {
    /// Starts a packet of this kind for the image `name`. The zero byte after the kind means that
    /// the viewer does not select the image.
    fn new(kind: u8, name: &str) -> Self {
        let mut packet = Self(vec![0, 0, 0, 0, kind, 0]);
        packet.push_text(name);
        packet
    }

    fn push_text(&mut self, text: &str) {
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }

    fn push_u32(&mut self, number: u32) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    fn push_u64(&mut self, number: u64) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    fn finish(mut self) -> Vec<u8> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

#[cfg(test)]
mod tests {
    use raywright_core::picture::PictureLayer;

    use super::*;

    /// Protects: packets have the bytes of tev's protocol: length, kind, focus, name, numbers,
    /// channel names, and values channel after channel.
    #[test]
    fn packets_have_their_bytes() {
        let layers = vec![PictureLayer {
            name: "stderr.R".to_owned(),
            samples: vec![0.5, 0.25],
        }];
        let picture = Picture {
            rgb: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
            layers,
            ..Picture::new(1, 2)
        };
        let channels = list_channels(&picture);
        let created = encode_create_packet("a", &picture, &channels);
        let mut expected = vec![
            0, 0, 0, 0, 4, 0, b'a', 0, 1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0,
        ];
        expected.extend_from_slice(b"R\0G\0B\0stderr.R\0");
        expected[0] = expected.len() as u8;
        assert_eq!(created, expected);
        let updated = encode_update_packet("a", &channels, 1, 1..2);
        let mut expected = vec![0, 0, 0, 0, 6, 0, b'a', 0, 4, 0, 0, 0];
        expected.extend_from_slice(b"R\0G\0B\0stderr.R\0");
        [0_u32, 1, 1, 1]
            .iter()
            .for_each(|number| expected.extend_from_slice(&number.to_le_bytes()));
        [0_u64, 1, 2, 3, 1, 1, 1, 1]
            .iter()
            .for_each(|number| expected.extend_from_slice(&number.to_le_bytes()));
        [4.0_f32, 5.0, 6.0, 0.25]
            .iter()
            .for_each(|number| expected.extend_from_slice(&number.to_le_bytes()));
        expected[0] = expected.len() as u8;
        assert_eq!(updated, expected);
    }
}
