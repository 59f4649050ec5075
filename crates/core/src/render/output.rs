//! Result of a render.

use core::ops::RangeInclusive;
use std::borrow::Cow;
use std::cell::OnceCell;

use crate::counters::Counters;
use crate::denoise::{DenoiseError, DenoiseOutput, denoise};
use crate::film::{Film, FilmPlan, ReplicateBuffer, Uncertainty};
use crate::integrator::FirstHit;
use crate::observer::Observer;
use crate::picture::Picture;
use crate::settings::Aov;

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

// State of a render in progress, which a viewer receives.

/// State of a render in progress, for a viewer: the film, the picture so far and its estimated
/// error. Picture and error are computed when they are first needed.
pub struct RenderStage<'a> {
    film: &'a Film,
    picture: OnceCell<Picture>,
    error: OnceCell<Option<Uncertainty>>,
}

impl<'a> RenderStage<'a> {
    /// Returns the state of a film.
    pub fn from_film(film: &'a Film) -> Self {
        Self {
            film,
            picture: OnceCell::new(),
            error: OnceCell::new(),
        }
    }

    /// Returns the film.
    pub fn film(&self) -> &'a Film {
        self.film
    }

    /// Returns the picture with its layers. Each pixel is the mean of its samples so far; a pixel
    /// without samples is black.
    pub fn picture(&self) -> &Picture {
        self.picture.get_or_init(|| self.film.picture())
    }

    /// Returns the least and the greatest number of samples per pixel.
    pub fn sample_range(&self) -> RangeInclusive<u32> {
        self.film.sample_range(&self.film.full_part())
    }

    /// Returns the estimated error of the picture with its confidence interval. `None` without
    /// random sampling, or if there are too few samples for an estimate.
    pub fn error(&self) -> Option<Uncertainty> {
        *self.error.get_or_init(|| self.film.estimate_uncertainty())
    }

    /// Returns the result of the render so far. The picture is denoised if that was requested and
    /// is possible.
    pub fn into_output(self, observer: &dyn Observer) -> RenderOutput {
        match self.picture.into_inner() {
            Some(picture) if !self.film.is_to_be_denoised() => {
                RenderOutput::with_picture(self.film, picture)
            }
            _ => RenderOutput::from_film(self.film, observer),
        }
    }
}

// Layers that describe the first hits of camera rays, such as albedo. A pixel's value is the mean
// over its samples.

/// Sums of a pixel's first-hit layers, to which samples are added one by one.
pub(super) struct FirstHitSums<'a> {
    plan: &'a FilmPlan,
    sums: Vec<[f64; 3]>,
    hits: u16,
}

impl<'a> FirstHitSums<'a> {
    pub fn new(plan: &'a FilmPlan) -> Self {
        Self {
            plan,
            sums: vec![[0.0; 3]; plan.layers.mean.len()],
            hits: 0,
        }
    }

    /// Loads the sums of the samples that a pixel already has.
    pub fn resume_pixel(&mut self, buffer: &ReplicateBuffer, pixel: usize) {
        for (sum, layer) in self.sums.iter_mut().zip(&buffer.layers) {
            *sum = layer.get(pixel).copied().unwrap_or([0.0; 3]);
        }
        self.hits = buffer.first_hits.get(pixel).copied().unwrap_or(0);
    }

    /// Adds the first hit of a sample's camera ray. `first` returns the hit and the directly
    /// visible radiance; it is only called if a layer needs them. `entered` is whether the sample
    /// was finite.
    #[inline(always)]
    pub fn add_sample<'f>(
        &mut self,
        first: impl FnOnce() -> (Option<&'f FirstHit>, [f64; 3]),
        entered: bool,
    ) {
        if !self.sums.is_empty() {
            let (first, direct) = first();
            self.add_values(first, direct, entered);
        }
    }

    fn add_values(&mut self, first: Option<&FirstHit>, direct: [f64; 3], entered: bool) {
        self.hits += u16::from(first.is_some());
        for (sum, (aov, _)) in self.sums.iter_mut().zip(&self.plan.layers.mean) {
            let value = match (aov, first) {
                // Emission is a part of the colour, so it is dropped together with the colour.
                (Aov::Emission, _) if entered => direct,
                (Aov::Emission, _) | (_, None) => continue,
                (Aov::Albedo, Some(first)) => first.albedo,
                (Aov::Normal, Some(first)) => first.normal,
                (_, Some(first)) => first.position,
            };
            *sum = core::array::from_fn(|i| sum[i] + value[i]);
        }
    }

    /// Appends the sums of the pixel to the buffer. The next pixel can then begin.
    #[inline(always)]
    pub fn push_pixel(&mut self, buffer: &mut ReplicateBuffer) {
        if self.sums.is_empty() {
            return;
        }
        for (layer, sum) in buffer.layers.iter_mut().zip(&mut self.sums) {
            layer.push(core::mem::take(sum));
        }
        if self.plan.counts_first_hits() {
            buffer.first_hits.push(self.hits);
        }
        self.hits = 0;
    }
}
