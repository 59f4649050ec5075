//! State of a render in progress, as passed to a viewer.

use core::ops::RangeInclusive;
use std::cell::OnceCell;

use super::RenderOutput;
use crate::film::{Film, Uncertainty};
use crate::observer::Observer;
use crate::picture::Picture;

/// State of a render in progress. Picture and error are computed on first use and borrowed; nothing
/// is copied.
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

    /// Returns the picture with its layers: the mean of each pixel's samples so far, black without
    /// any.
    pub fn picture(&self) -> &Picture {
        self.picture.get_or_init(|| self.film.picture())
    }

    /// Returns the least and the greatest number of samples of a pixel.
    pub fn sample_range(&self) -> RangeInclusive<u32> {
        self.film.sample_range(&self.film.full_part())
    }

    /// Returns the estimated error of the picture with its interval; `None` without random
    /// sampling, or while samples are too few for an estimate.
    pub fn error(&self) -> Option<Uncertainty> {
        *self.error.get_or_init(|| self.film.estimate_uncertainty())
    }

    /// Returns the result of the render so far: [`Self::picture`], denoised if requested and
    /// possible.
    pub fn into_output(self, observer: &dyn Observer) -> RenderOutput {
        match self.picture.into_inner() {
            Some(picture) if !self.film.is_to_be_denoised() => {
                RenderOutput::with_picture(self.film, picture)
            }
            _ => RenderOutput::from_film(self.film, observer),
        }
    }
}
