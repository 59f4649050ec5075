//! Result of a render.

use std::borrow::Cow;

use crate::counters::Counters;
use crate::denoise::{DenoiseError, DenoiseOutput, denoise};
use crate::film::{Film, Uncertainty};
use crate::observer::Observer;
use crate::picture::Picture;

/// Result of a render: the picture, the denoised picture if requested, and counts of rays and
/// samples.
#[derive(Clone, Debug)]
pub struct RenderOutput {
    /// The picture. If the render is unfinished, each pixel is the mean of its samples so far; a
    /// pixel without samples is black.
    pub picture: Picture,
    /// The denoised picture, or the reason why denoising failed; `None` if it was not requested.
    pub denoised: Option<Result<DenoiseOutput, DenoiseError>>,
    /// Counters of rays and samples.
    pub counters: Counters,
    /// Number of pixels that lack samples because the observer stopped the render.
    pub unfinished: u64,
    /// Whether every pixel has all its samples.
    pub finished: bool,
}

impl RenderOutput {
    /// Returns the picture of a film so far. It is denoised if the film's settings request it.
    pub fn from_film(film: &Film, observer: &dyn Observer) -> Self {
        let denoised = film.is_to_be_denoised().then(|| denoise(film, observer));
        Self {
            denoised,
            ..Self::from_film_without_denoising(film)
        }
    }

    /// Returns the picture of a film so far, without denoising.
    pub fn from_film_without_denoising(film: &Film) -> Self {
        Self::with_picture(film, film.picture())
    }

    /// Returns the result for a film whose picture is already computed.
    pub(super) fn with_picture(film: &Film, picture: Picture) -> Self {
        let unfinished = film.unfinished_pixels();
        Self {
            picture,
            denoised: None,
            counters: film.counters(),
            unfinished,
            finished: unfinished == 0,
        }
    }

    /// Returns the denoised picture with its error estimate, if any.
    pub fn denoise_output(&self) -> Option<&DenoiseOutput> {
        self.denoised.as_ref()?.as_ref().ok()
    }

    /// Returns the estimated error of the film's picture before denoising, if known.
    pub fn error_before_denoising(&self, film: &Film) -> Option<Uncertainty> {
        match self.denoise_output() {
            Some(denoised) => denoised.noisy_error,
            None => film.estimate_uncertainty(),
        }
    }

    /// Returns the denoised picture. If there is none, the sampled picture is returned.
    pub fn final_picture(&self) -> &Picture {
        self.denoise_output()
            .map_or(&self.picture, |denoised| &denoised.picture)
    }

    /// Returns the same result with its pictures composited over a background colour. They then
    /// have no coverage.
    #[must_use]
    pub fn composite_over(&self, colour: [f64; 3]) -> Self {
        let over = |denoised: &DenoiseOutput| DenoiseOutput {
            picture: denoised.picture.composite_over(colour),
            ..denoised.clone()
        };
        let denoised = self
            .denoised
            .as_ref()
            .map(|denoised| denoised.as_ref().map(over).map_err(|error| *error));
        Self {
            picture: self.picture.composite_over(colour),
            denoised,
            ..self.clone()
        }
    }

    /// Returns the sampled picture with its own layers and those of the denoised picture.
    pub fn picture_with_all_layers(&self) -> Cow<'_, Picture> {
        let Some(denoised) = self.denoise_output() else {
            return Cow::Borrowed(&self.picture);
        };
        let mut all = self.picture.clone();
        all.layers.extend(denoised.to_picture_layers());
        Cow::Owned(all)
    }
}
