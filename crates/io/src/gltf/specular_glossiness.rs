//! Conversion of KHR_materials_pbrSpecularGlossiness to the metallic-roughness model with
//! KHR_materials_specular, which together are equivalent. The diffuse colour becomes the base
//! colour of a dielectric, and the specular colour its reflectance at normal incidence. Glossiness
//! becomes roughness, texel by texel in an image.

use std::collections::{BTreeMap, HashMap};

use raywright_core::scene::{
    Colour, ColourSpace, Image, ImageData, Physical, PixelData, Scene, Texture, TextureRef,
};

use super::GltfImport;
use super::entries::SpecularGlossiness;
use super::texture::TextureRole;
use crate::import::{DecodeBudget, ImportResult};

/// Reflectance at normal incidence of a dielectric with the index of refraction 1.5. The renderer
/// multiplies the specular colour by this reflectance; therefore the file's specular colour is
/// divided by it.
const DIELECTRIC: f64 = 0.04;

impl GltfImport<'_> {
    /// Sets base colour, metalness, roughness, opacity and reflectance from specular-glossiness
    /// data.
    pub(super) fn convert_specular_glossiness(
        &mut self,
        source: &SpecularGlossiness,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        let [r, g, b, a] = source.diffuse_factor.map(f64::from);
        out.base_colour =
            Colour([r, g, b].map(|c| self.clamp_unit(c, label, "diffuseFactor"))).into();
        out.opacity = self.clamp_unit(a, label, "diffuseFactor alpha").into();
        out.base_colour_texture =
            self.convert_texture_ref(source.diffuse_texture.as_ref(), TextureRole::Colour)?;
        (out.metallic, out.ior, out.specular, out.specular_texture) =
            (0.0.into(), 1.5.into(), 1.0.into(), None);
        let specular = source
            .specular_factor
            .map(|c| self.clamp_unit(c.into(), label, "specularFactor") / DIELECTRIC);
        out.specular_colour = Colour(specular).into();
        out.specular_colour_texture = self.convert_texture_ref(
            source.specular_glossiness_texture.as_ref(),
            TextureRole::Colour,
        )?;
        let glossiness =
            self.clamp_unit(source.glossiness_factor.into(), label, "glossinessFactor");
        (out.roughness, out.metallic_roughness_texture) = ((1.0 - glossiness).into(), None);
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
    /// `glossiness`. The texture is created on first use; its image is computed later.
    fn register_roughness_texture(&mut self, glossy: &str, glossiness: f64) -> String {
        let key = (glossy.to_owned(), glossiness.to_bits());
        if let Some(known) = self.roughness_baker.texture_names.get(&key) {
            return known.clone();
        }
        let wish = format!("{glossy} as roughness");
        let (name, image) = (
            self.names.textures.make_unique(&wish),
            self.names.images.make_unique(&wish),
        );
        self.roughness_baker.bakes.push(RoughnessBake {
            glossy: glossy.to_owned(),
            glossiness,
            image: self.scene.images.len(),
            texture: self.scene.textures.len(),
        });
        // Filter and wrapping are copied from the glossiness texture when all textures are known.
        self.scene.textures.push(Texture {
            name: name.clone(),
            image: image.clone(),
            colour_space: ColourSpace::Linear,
            filter: raywright_core::scene::TextureFilter::default(),
            wrap_u: raywright_core::scene::WrapMode::default(),
            wrap_v: raywright_core::scene::WrapMode::default(),
        });
        self.scene.images.push(Image {
            name: image.clone(),
            path: image,
            data: None,
            mended: 0,
        });
        self.roughness_baker.texture_names.insert(key, name.clone());
        name
    }
}

/// A roughness image that is computed later, from the glossiness in a texture's alpha channel and a
/// factor on this glossiness.
#[derive(Clone, Debug)]
struct RoughnessBake {
    /// Name of the texture whose alpha channel is glossiness.
    glossy: String,
    glossiness: f64,
    /// Index of the new image in the scene's list of images.
    image: usize,
    texture: usize,
}

/// Roughness images to compute after their glossiness images are decoded.
#[derive(Debug, Default)]
pub(super) struct RoughnessBaker {
    bakes: Vec<RoughnessBake>,
    /// Names of the roughness textures, by name of the glossiness texture and by the bits of the
    /// factor.
    texture_names: BTreeMap<(String, u64), String>,
}

impl RoughnessBaker {
    /// Computes all roughness images from the decoded glossiness images.
    ///
    /// # Errors
    /// A fault of kind limit when the budget is exceeded.
    pub fn bake_roughness_images(
        self,
        scene: &mut Scene,
        budget: &mut DecodeBudget,
    ) -> ImportResult<()> {
        if self.bakes.is_empty() {
            return Ok(());
        }
        let textures: HashMap<String, usize> = scene
            .textures
            .iter()
            .enumerate()
            .map(|(i, t)| (t.name.clone(), i))
            .collect();
        let images: HashMap<String, usize> = scene
            .images
            .iter()
            .enumerate()
            .map(|(i, image)| (image.name.clone(), i))
            .collect();
        for RoughnessBake {
            glossy,
            glossiness,
            image,
            texture,
        } in self.bakes
        {
            let Some(like) = textures.get(&glossy).map(|&i| scene.textures[i].clone()) else {
                continue;
            };
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
            budget.reserve_memory(
                data.width as usize * data.height as usize,
                size_of::<[u8; 4]>(),
            )?;
            scene.images[image].data = Some(roughness_from_glossiness(&data, glossiness).into());
            let texture = &mut scene.textures[texture];
            (texture.filter, texture.wrap_u, texture.wrap_v) =
                (like.filter, like.wrap_u, like.wrap_v);
        }
        Ok(())
    }
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
