//! A render on its way, as whoever looks on sees it.

use core::ops::RangeInclusive;
use std::cell::OnceCell;

use super::Rendered;
use crate::film::{Film, Uncertainty};
use crate::observer::Observer;
use crate::picture::Picture;

/// What there is of a picture so far. Each part of it is made where it is first asked for, and
/// lent: nothing is copied.
pub struct RenderStage<'a> {
    film: &'a Film,
    picture: OnceCell<Picture>,
    error: OnceCell<Option<Uncertainty>>,
}

impl<'a> RenderStage<'a> {
    /// What a film has by now.
    pub fn of(film: &'a Film) -> Self {
        Self {
            film,
            picture: OnceCell::new(),
            error: OnceCell::new(),
        }
    }

    /// The film itself.
    pub fn film(&self) -> &'a Film {
        self.film
    }

    /// The picture with its layers: of each pixel the mean of the samples that it has, black
    /// without any.
    pub fn picture(&self) -> &Picture {
        self.picture.get_or_init(|| self.film.picture())
    }

    /// Fewest and most samples of a pixel.
    pub fn samples(&self) -> RangeInclusive<u32> {
        self.film.samples(&self.film.whole())
    }

    /// How far the picture probably is from the true one, with its interval; none where nothing can
    /// be told yet, or chance has no part.
    pub fn error(&self) -> Option<Uncertainty> {
        *self.error.get_or_init(|| self.film.uncertainty())
    }

    /// What is to be shown: as [`Self::picture`], denoised where the picture is to be and can be by
    /// now.
    pub fn rendered(self, observer: &dyn Observer) -> Rendered {
        match self.picture.into_inner() {
            Some(picture) if !self.film.is_to_be_denoised() => {
                Rendered::with_picture(self.film, picture)
            }
            _ => Rendered::of(self.film, observer),
        }
    }
}
