//! Pictures of a model that were found and are decoded together.

use std::borrow::Cow;
use std::collections::HashSet;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use raywright_core::Scene;
use raywright_core::scene::{Fields, Image, Model};

use crate::Limits;
use crate::image_file::{Decoded, decode};
use crate::import::{Outcome, endurable};
use crate::warning::WarningCode;

/// What became of pictures, each with its place, in the order in which they came.
#[derive(Debug, Default)]
pub(crate) struct DecodeReport {
    /// Why those can't be decoded that can't: what uses them takes its factor alone, as
    /// [`drop_missing`] sees to.
    pub broken: Vec<String>,
    /// What of the others was not taken as it is.
    pub remarks: Vec<(WarningCode, String)>,
}

/// Pictures on their way into a scene: looked at one by one, in order, and decoded together on the
/// threads of the current pool.
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
    /// A fault of kind limit of the first picture that asks for more than is allowed.
    pub fn decode(
        self,
        images: &mut [Image],
        limits: &Limits,
        done: &(dyn Fn() + Sync),
    ) -> Outcome<DecodeReport> {
        let one = |(image, place, bytes): (usize, String, Cow<'a, [u8]>)| {
            let data = decode(&bytes, limits);
            done();
            (image, place, data)
        };
        // A single one need not wake a pool.
        let decoded: Vec<(usize, String, Outcome<Decoded>)> = match self.0.len() {
            0 | 1 => self.0.into_iter().map(one).collect(),
            _ => self.0.into_par_iter().map(one).collect(),
        };
        let mut report = DecodeReport::default();
        for (image, place, data) in decoded {
            match endurable(data.map_err(|fault| fault.at(&place)))? {
                Err(why) => report.broken.push(why),
                Ok(data) => {
                    let code = WarningCode::of_image(data.mended);
                    report.remarks.extend(
                        data.remarks
                            .into_iter()
                            .map(|remark| (code, format!("{place}: {remark}"))),
                    );
                    if let Some(image) = images.get_mut(image) {
                        (image.data, image.mended) = (Some(data.image.into()), data.mended);
                    }
                }
            }
        }
        Ok(report)
    }
}

/// Takes images without pixels, with the textures of them and their uses, out of an imported scene.
pub(crate) fn drop_missing(scene: &mut Scene) {
    let missing: HashSet<String> = scene
        .images
        .extract_if(.., |image| image.data.is_none())
        .map(|image| image.name)
        .collect();
    if missing.is_empty() {
        return;
    }
    let gone: HashSet<String> = scene
        .textures
        .extract_if(.., |texture| missing.contains(&texture.image))
        .map(|texture| texture.name)
        .collect();
    for material in &mut scene.materials {
        let Model::Physical(model) = &mut material.model else {
            continue;
        };
        model.change(&mut |value| {
            if value
                .texture()
                .is_some_and(|(_, used)| gone.contains(&used.name))
            {
                value.flatten(true, false);
            }
        });
    }
}
