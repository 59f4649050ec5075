//! Pictures of a model that were found and are decoded together.

use std::borrow::Cow;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use raywright_core::scene::{Image, ImageData};

use crate::Limits;
use crate::image_file::decode;
use crate::import::Outcome;

/// Pictures on their way into a scene: looked at one by one, in order, and decoded together on the threads of the current pool.
#[derive(Debug, Default)]
pub(crate) struct Waiting<'a>(Vec<(usize, String, Cow<'a, [u8]>)>);

impl<'a> Waiting<'a> {
    /// Adds the picture of a scene's image, with the place that messages name.
    pub fn add(&mut self, image: usize, place: String, bytes: Cow<'a, [u8]>) {
        self.0.push((image, place, bytes));
    }

    /// Decodes all of them into their images; `done` is told of each.
    ///
    /// # Errors
    /// That of the first picture, in the order in which they came, which can't be decoded.
    pub fn decode(self, images: &mut [Image], limits: &Limits, done: &(dyn Fn() + Sync)) -> Outcome<()> {
        let one = |(image, place, bytes): (usize, String, Cow<'a, [u8]>)| {
            let data = decode(&bytes, limits).map_err(|fault| fault.at(place))?;
            done();
            Ok((image, data))
        };
        // A single one need not wake a pool.
        let decoded: Vec<Outcome<(usize, ImageData)>> = match self.0.len() {
            0 | 1 => self.0.into_iter().map(one).collect(),
            _ => self.0.into_par_iter().map(one).collect(),
        };
        for picture in decoded {
            let (image, data) = picture?;
            if let Some(image) = images.get_mut(image) {
                image.data = Some(data.into());
            }
        }
        Ok(())
    }
}
