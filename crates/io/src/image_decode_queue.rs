//! Images of a model, collected first and then decoded in parallel.

use std::borrow::Cow;
use std::collections::HashSet;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use raywright_core::Scene;
use raywright_core::fault::FaultKind;
use raywright_core::scene::{Image, MaterialFields, MaterialModel};

use crate::Limits;
use crate::image_file::{DecodedImage, decode, remark_kind};
use crate::import::{FaultPlace, ImportResult, catch_invalid_input};

/// Messages about decoded images, in the order in which the images were added. Each message states
/// the image's position in the file.
#[derive(Debug, Default)]
pub(crate) struct ImageDecodeReport {
    /// Errors of images that could not be decoded. [`drop_missing_images`] removes the textures of
    /// these images; the materials keep the factors that the textures multiplied.
    pub errors: Vec<String>,
    /// Remarks about decoded images, such as replaced values.
    pub remarks: Vec<(FaultKind, String)>,
}

/// Images of a model that wait for decoding. Each entry is the image's index in the scene, the
/// image's position for messages, and the encoded bytes.
#[derive(Debug, Default)]
pub(crate) struct ImageDecodeQueue<'a>(Vec<(usize, String, Cow<'a, [u8]>)>);

impl<'a> ImageDecodeQueue<'a> {
    /// Adds the encoded bytes of the scene's image with the index `image`. `place` is the image's
    /// position in the file, for messages.
    pub fn add_image(&mut self, image: usize, place: String, bytes: Cow<'a, [u8]>) {
        self.0.push((image, place, bytes));
    }

    /// Decodes all collected images, and stores the pixels in `images`. `done` is called after each
    /// image.
    ///
    /// # Errors
    /// A fault of kind limit for the first image beyond the limits.
    pub fn decode_images(
        self,
        images: &mut [Image],
        limits: &Limits,
        done: &(dyn Fn() + Sync),
    ) -> ImportResult<ImageDecodeReport> {
        let decode_one = |(image, place, bytes): (usize, String, Cow<'a, [u8]>)| {
            let data = decode(&bytes, limits);
            done();
            (image, place, data)
        };
        // A single image is decoded without the pool.
        let decoded: Vec<(usize, String, ImportResult<DecodedImage>)> = match self.0.len() {
            0 | 1 => self.0.into_iter().map(decode_one).collect(),
            _ => self.0.into_par_iter().map(decode_one).collect(),
        };
        let mut report = ImageDecodeReport::default();
        for (image, place, data) in decoded {
            match catch_invalid_input(data.with_place(&place))? {
                Err(reason) => report.errors.push(reason),
                Ok(data) => {
                    let code = remark_kind(data.repaired_count);
                    report.remarks.extend(
                        data.remarks
                            .into_iter()
                            .map(|remark| (code, format!("{place}: {remark}"))),
                    );
                    if let Some(image) = images.get_mut(image) {
                        (image.data, image.mended) = (Some(data.image.into()), data.repaired_count);
                    }
                }
            }
        }
        Ok(report)
    }
}

/// Removes images without pixels from an imported scene. Textures of these images, and the
/// references of materials to these textures, are removed too.
pub(crate) fn drop_missing_images(scene: &mut Scene) {
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
        let MaterialModel::Physical(model) = &mut material.model else {
            continue;
        };
        model.change_values(&mut |value| {
            if value
                .texture()
                .is_some_and(|(_, used)| gone.contains(&used.name))
            {
                value.make_constant(true, false);
            }
        });
    }
}
