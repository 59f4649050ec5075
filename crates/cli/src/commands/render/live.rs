//! Whoever looks on while a picture is rendered, shown each time that it has about twice as many
//! samples as before: a file, and a viewer.

use std::path::PathBuf;

use raywright_core::display::Display;
use raywright_core::film::Film;
use raywright_core::picture::{Layer, Picture};
use raywright_core::{Observer, RenderStage, Rendered};
use raywright_io::Error;
use raywright_io::output::{Metadata, png_bytes, write_atomically};

use super::tev::Tev;
use crate::failure::{Exit, Failure};
use crate::plan::Task;

/// Those who look on, if there are any.
#[derive(Default)]
pub struct Onlookers {
    preview: Option<PathBuf>,
    tev: Option<Tev>,
    /// Whether the picture chooses its own exposure.
    is_exposed: bool,
    /// Samples of all pixels that the next stage has; none before the first one.
    next: Option<u64>,
}

impl Onlookers {
    /// Those whom a task has, of a picture with that name.
    pub fn of(task: &Task, name: &str, is_exposed: bool) -> Result<Self, Failure> {
        let refused = |cause: std::io::Error, host: &str, port: u16| {
            let failure = Failure::new(
                Exit::File,
                format_args!("cannot reach tev at {host}:{port}: {cause}"),
            );
            failure.with_hint("start it first; --display tev:HOST:PORT says where it is")
        };
        let connect = |address| {
            Tev::connect(address, name).map_err(|cause| refused(cause, &address.host, address.port))
        };
        let (preview, tev) = (
            task.preview.clone(),
            task.display.as_ref().map(connect).transpose()?,
        );
        Ok(Self {
            preview,
            tev,
            is_exposed,
            next: None,
        })
    }

    /// Samples of all pixels at which they are shown the picture, first one of each pixel; none
    /// where nobody looks on.
    pub fn next(&self, film: &Film) -> Option<u64> {
        let pixels = || film.size().into_iter().map(u64::from).product();
        (self.preview.is_some() || self.tev.is_some()).then(|| self.next.unwrap_or_else(pixels))
    }

    /// Shows what there is; what went wrong, which is no reason to give up the picture. Whoever has
    /// gone is not shown anything again.
    pub fn show(
        &mut self,
        film: &Film,
        (done, observer): (u64, &dyn Observer),
        (display, metadata): (Display, &Metadata),
    ) -> Option<String> {
        self.next = self.next(film).map(|next| next.max(done).saturating_mul(2));
        let rendered = RenderStage::of(film).rendered(observer);
        if rendered.counters.samples == 0 {
            return None;
        }
        let display = if self.is_exposed {
            display.suited_to(rendered.shown())
        } else {
            display
        };
        let mut failed = None;
        if let Some(path) = &self.preview {
            let bytes = png_bytes(rendered.shown(), display, metadata)
                .map_err(|cause| Error::write(path, &cause));
            failed = bytes
                .and_then(|bytes| write_atomically(path, &bytes))
                .err()
                .map(|error| error.message().to_owned());
        }
        if let Some(tev) = &mut self.tev
            && let Err(cause) = tev.show(&with_errors(film, &rendered))
        {
            failed = Some(format!("tev is not there any more: {cause}"));
            self.tev = None;
        }
        failed
    }
}

/// The picture with all its layers, and with the standard errors of its pixels.
fn with_errors(film: &Film, rendered: &Rendered) -> Picture {
    let mut picture = rendered.all_layers().into_owned();
    if let Some((errors, _)) = film
        .standard_errors()
        .filter(|_| picture.layer("stderr.R").is_none())
    {
        let layer = |(channel, name): (usize, &str)| Layer {
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
