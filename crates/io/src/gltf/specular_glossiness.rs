//! Conversion of KHR_materials_pbrSpecularGlossiness to the metallic-roughness model with
//! KHR_materials_specular, which together are equivalent. The diffuse colour becomes the base
//! colour of a dielectric, and the specular colour its reflectance at normal incidence. Glossiness
//! becomes roughness, texel by texel in an image.

use std::collections::{BTreeMap, HashMap};

use raywright_core::scene::{
    ColourSpace, Image, ImageData, Physical, PixelData, Texture, TextureRef,
};

use super::GltfImport;
use super::entries::MaterialEntry;
use super::material_table::MaterialObject;
use crate::import::ImportResult;

impl GltfImport<'_> {
    /// Sets base colour, metalness, roughness, opacity and reflectance from specular-glossiness
    /// data.
    pub(super) fn convert_specular_glossiness(
        &mut self,
        source: &MaterialEntry,
        object: &MaterialObject,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        (out.metallic, out.ior, out.specular) = (0.0.into(), 1.5.into(), 1.0.into());
        (out.specular_texture, out.metallic_roughness_texture) = (None, None);
        self.apply_properties(source, object, label, out)?;
        let glossiness = out.roughness.constant().unwrap_or(1.0);
        out.roughness = (1.0 - glossiness).into();
        if let Some(glossy) = &out.specular_colour_texture {
            out.roughness = 1.0.into();
            out.metallic_roughness_texture = Some(TextureRef {
                name: self.register_roughness_texture(&glossy.name, glossiness),
                ..glossy.clone()
            });
        }
        Ok(())
    }

    /// Returns the name of the roughness texture for a glossiness texture and its factor
    /// `glossiness`.
    fn register_roughness_texture(&mut self, glossy: &str, glossiness: f64) -> String {
        let names = &mut self.names.textures;
        self.roughness_textures
            .entry((glossy.to_owned(), glossiness.to_bits()))
            .or_insert_with(|| names.make_unique(&format!("{glossy} as roughness")))
            .clone()
    }

    /// Creates the roughness textures from the decoded glossiness images.
    ///
    /// # Errors
    /// A fault of kind limit when the budget is exceeded.
    pub(super) fn bake_roughness_images(&mut self) -> ImportResult<()> {
        let scene = &mut self.scene;
        let textures = index_by_name(scene.textures.iter().map(|texture| &texture.name));
        let images = index_by_name(scene.images.iter().map(|image| &image.name));
        for ((glossy, factor), name) in core::mem::take(&mut self.roughness_textures) {
            let like = &scene.textures[textures[&glossy]];
            // If the glossiness image could not be decoded, the factor alone applies.
            let white = || ImageData {
                width: 1,
                height: 1,
                pixels: PixelData::Codes(vec![[255; 4]]),
            };
            let data = images
                .get(&like.image)
                .and_then(|&i| scene.images[i].data.clone())
                .unwrap_or_else(|| white().into());
            let pixels = data.width as usize * data.height as usize;
            self.budget.reserve_memory(pixels, size_of::<[u8; 4]>())?;
            let image = self.names.images.make_unique(&name);
            scene.textures.push(Texture {
                name,
                image: image.clone(),
                colour_space: ColourSpace::Linear,
                ..like.clone()
            });
            scene.images.push(Image {
                name: image.clone(),
                path: image,
                data: Some(roughness_from_glossiness(&data, f64::from_bits(factor)).into()),
                mended: 0,
            });
        }
        Ok(())
    }
}

/// Names of the roughness textures to create, by name of the glossiness texture, whose alpha
/// channel is glossiness, and by the bits of a factor on it.
pub(super) type RoughnessTextures = BTreeMap<(String, u64), String>;

/// Returns the index of each name in a list.
fn index_by_name<'a>(names: impl Iterator<Item = &'a String>) -> HashMap<String, usize> {
    names.cloned().zip(0..).collect()
}

/// Converts glossiness to an image of 8-bit codes. Glossiness is the alpha channel times `factor`.
/// The green channel of the result is the roughness, 1 minus glossiness; the blue channel is the
/// metalness, zero.
fn roughness_from_glossiness(glossy: &ImageData, factor: f64) -> ImageData {
    let code = |glossiness: f64| {
        [
            0,
            ((1.0 - (glossiness * factor).clamp(0.0, 1.0)) * 255.0).round() as u8,
            0,
            255,
        ]
    };
    let pixels = match &glossy.pixels {
        PixelData::Linear(pixels) => pixels.iter().map(|pixel| code(pixel[3].into())).collect(),
        PixelData::Codes(pixels) => pixels
            .iter()
            .map(|pixel| code(f64::from(pixel[3]) / 255.0))
            .collect(),
    };
    ImageData {
        width: glossy.width,
        height: glossy.height,
        pixels: PixelData::Codes(pixels),
    }
}
