//! Live previews of a render, updated at each doubling of the sample count: a PNG file, and the
//! image viewer tev.

use std::path::PathBuf;

use raywright_core::display::Display;
use raywright_core::film::Film;
use raywright_core::picture::{Picture, PictureLayer};
use raywright_core::{Observer, RenderOutput, RenderStage};
use raywright_io::Error;
use raywright_io::output::{PictureMetadata, encode_png, write_atomically};

use super::tev::TevClient;
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
            task.files.preview.clone(),
            task.files.tev.as_ref().map(connect).transpose()?,
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
