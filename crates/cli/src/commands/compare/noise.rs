//! `compare --noise`: pictures with their standard errors, and the result of the test for noise as
//! text.

use std::path::Path;

use raywright_core::display::Display;
use raywright_core::metrics::{NoiseTestResult, PictureWithErrors};
use raywright_core::picture::{Encoding, Picture};
use raywright_io::output::{PictureMetadata, StoredFilm, StoredPicture, read_film, read_picture};
use raywright_io::report::{format_four_digits, format_significant_digits};
use raywright_io::{Error, Limits};

use crate::args::names;
use crate::failure::Failure;

/// A picture of a comparison, with the standard errors of its pixels.
pub struct ComparisonPicture {
    /// The picture, with its layers and metadata.
    pub stored_picture: StoredPicture,
    /// Display settings recorded in the picture's file, if any.
    pub display: Option<Display>,
    /// Standard error of each pixel and channel, and the degrees of freedom that all of them have;
    /// `None` for a noiseless picture.
    pub errors: Option<(Vec<[f32; 3]>, f64)>,
}

/// Wraps a linear picture that comes from no picture file.
fn linear_picture(format_name: &'static str, picture: Picture) -> StoredPicture {
    StoredPicture {
        format_name,
        picture,
        encoding: Encoding::Linear,
        has_colour: true,
        texts: Default::default(),
    }
}

/// Returns the standard errors of a picture's layer `stderr` with their degrees of freedom, if it
/// has that layer.
fn standard_errors(picture: &Picture, metadata: &PictureMetadata) -> Option<(Vec<[f32; 3]>, f64)> {
    let layer = |name| picture.layer(name).map(|layer| layer.samples.iter());
    let (green, blue) = (layer("stderr.G")?, layer("stderr.B")?);
    let pixels = layer("stderr.R")?.zip(green).zip(blue);
    let errors = pixels.map(|((&red, &green), &blue)| [red, green, blue]);
    Some((errors.collect(), degrees_of_freedom(metadata)))
}

/// Returns the degrees of freedom of a picture's standard errors, from the picture's metadata. They
/// are one less than the number of replicates (independent renders, each with a share of the
/// samples):
/// - 3 for pictures of at least 64 samples per pixel and for denoised pictures, which have four
///   replicates;
/// - 1 for all other pictures, which have two replicates or, from other programs, an unknown number.
fn degrees_of_freedom(metadata: &PictureMetadata) -> f64 {
    let many = metadata
        .setting("samples")
        .and_then(|samples| samples.parse::<u32>().ok())
        .is_some_and(|samples| samples >= 64);
    if many || metadata.setting("reconstruction").is_some() {
        3.0
    } else {
        1.0
    }
}

/// Returns the display settings recorded in a picture's metadata; `None` if any setting is missing.
fn read_recorded_display(metadata: &PictureMetadata) -> Option<Display> {
    Some(Display {
        tone_map: names::parse_variant(metadata.setting("tone_map")?).ok()?,
        curve: names::parse_variant(metadata.setting("gamma")?).ok()?,
        exposure_stops: metadata.setting("exposure")?.parse().ok()?,
        ..Display::default()
    })
}

impl ComparisonPicture {
    /// Reads a picture file or the picture of a film file. The standard errors come from the film or
    /// from the layer `stderr`.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let limits = Limits::default();
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("film") {
            let StoredFilm { film, display, .. } = read_film(path, &limits)?;
            let errors = film.standard_errors();
            return Ok(Self {
                stored_picture: linear_picture("film", film.picture()),
                display: Some(display),
                errors: errors.map(|(errors, freedom)| (errors, f64::from(freedom))),
            });
        }
        let stored_picture = read_picture(path, &limits)?;
        if !stored_picture.has_colour {
            let layers = &stored_picture.picture.layers;
            let channels: Vec<&str> = layers.iter().map(|layer| layer.name.as_str()).collect();
            let error =
                Error::invalid_input(path.display(), "the picture has no colour channels R, G, B");
            return Err(error
                .with_hint(format!("its channels: {}", channels.join(", ")))
                .into());
        }
        let metadata = stored_picture.metadata();
        Ok(Self {
            errors: standard_errors(&stored_picture.picture, &metadata),
            display: read_recorded_display(&metadata),
            stored_picture,
        })
    }

    /// Wraps a linear picture in memory, with the metadata that its file would have.
    pub fn from_memory(picture: &Picture, display: Display, metadata: &PictureMetadata) -> Self {
        Self {
            errors: standard_errors(picture, metadata),
            display: Some(display),
            stored_picture: linear_picture("memory", picture.clone()),
        }
    }

    fn to_noisy_picture(&self) -> PictureWithErrors<'_> {
        let Picture {
            width, height, rgb, ..
        } = &self.stored_picture.picture;
        let (standard_errors, freedom) = match &self.errors {
            Some((errors, freedom)) => (Some(errors.clone()), *freedom),
            None => (None, 1.0),
        };
        PictureWithErrors {
            width: *width,
            height: *height,
            rgb,
            standard_errors,
            freedom,
        }
    }
}

/// Tests whether two pictures differ by more than their noise. `level` is the probability of a
/// false alarm over all tested blocks of pixels together.
pub fn test_against_noise(
    pair: &[ComparisonPicture; 2],
    paths: [&Path; 2],
    level: f64,
) -> Result<NoiseTestResult, Failure> {
    let refuse = |name: &str, reason: &str, hint: &str| -> Failure {
        Error::invalid_input(name, reason).with_hint(hint).into()
    };
    let names = paths.map(|path| path.display().to_string());
    for (judged, name) in pair.iter().zip(&names) {
        if judged.stored_picture.encoding != Encoding::Linear {
            return Err(refuse(
                name,
                "--noise compares radiance, and this picture stores display values in place of radiance",
                "compare .exr pictures, or film files of --checkpoint",
            ));
        }
    }
    let names = names.join(" and ");
    if pair.iter().all(|judged| judged.errors.is_none()) {
        return Err(refuse(
            &names,
            "neither picture has standard errors",
            "render with -o picture.exr --aov stderr, or compare film files of --checkpoint",
        ));
    }
    let [picture, reference] = pair.each_ref().map(ComparisonPicture::to_noisy_picture);
    raywright_core::metrics::test_against_noise(&picture, &reference, level)
        .map_err(|cause| Error::invalid_input(names, cause).into())
}

/// Formats the result of the test for noise as text for the table.
pub fn describe_noise_test(verdict: &NoiseTestResult) -> String {
    let NoiseTestResult {
        level,
        blocks,
        beyond,
        clearest,
        untested,
    } = verdict;
    let found = if *beyond == 0 {
        "no difference beyond the noise".to_owned()
    } else {
        format!("{beyond} of {blocks} blocks of pixels differ by more than the noise")
    };
    let clearest = clearest.as_ref().filter(|_| *beyond > 0).map(|block| {
        let channel = ["red", "green", "blue"][block.channel.min(2)];
        let share = block
            .share
            .map(|share| format!(", {:+.2} %", 100.0 * share))
            .unwrap_or_default();
        let deviation = if block.deviation.is_finite() {
            format!(
                "{} standard errors",
                format_significant_digits(block.deviation.abs(), 2)
            )
        } else {
            "although neither picture has noise in this block".to_owned()
        };
        let (x, y, edge) = (block.x, block.y, block.edge);
        format!(
            "; the clearest difference is in the block at {x}, {y}, {edge} pixels wide: {channel} differs by {}{share}, {deviation}",
            format_four_digits(block.difference)
        )
    });
    let left = if *untested == 0 {
        String::new()
    } else {
        format!("; {untested} pixels could not be tested, because their value or noise is unknown")
    };
    format!(
        "{found} (expected false alarms: in {} of 100 comparisons){}{left}",
        format_significant_digits(100.0 * level, 2),
        clearest.unwrap_or_default()
    )
}
