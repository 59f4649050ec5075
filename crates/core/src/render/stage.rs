//! State of a render in progress, which a viewer receives.

use core::ops::RangeInclusive;
use std::cell::OnceCell;

use super::RenderOutput;
use crate::film::{Film, Uncertainty};
use crate::observer::Observer;
use crate::picture::Picture;

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
