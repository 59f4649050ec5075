//! KHR_materials_pbrSpecularGlossiness in terms of the metallic-roughness model and
//! KHR_materials_specular, which together can say all of it: the diffuse colour is the base colour
//! of a dielectric, whose reflectance at normal incidence is the specular colour. Glossiness turns
//! into roughness, its image texel by texel.

use std::collections::{BTreeMap, HashMap};

use raywright_core::scene::{
    Colour, ColourSpace, Image, ImageData, Physical, Pixels, Scene, Texture, TextureRef,
};

use super::Import;
use super::entries::SpecularGlossiness;
use super::texture::Use;
use crate::import::{Budget, Outcome};

/// Reflectance at normal incidence of the index of refraction 1.5, which a specular colour
/// multiplies.
const DIELECTRIC: f64 = 0.04;

impl Import<'_> {
    /// Sets what a material of the old model says in place of base colour, metalness, roughness,
    /// opacity and reflectance.
    pub(super) fn specular_glossiness(
        &mut self,
        source: &SpecularGlossiness,
        label: &str,
        out: &mut Physical,
    ) -> Outcome<()> {
        let [r, g, b, a] = source.diffuse_factor.map(f64::from);
        out.base_colour = Colour([r, g, b].map(|c| self.unit(c, label, "diffuseFactor"))).into();
        out.opacity = self.unit(a, label, "diffuseFactor alpha").into();
        out.base_colour_texture = self.texture(source.diffuse_texture.as_ref(), Use::Colour)?;
        (out.metallic, out.ior, out.specular, out.specular_texture) =
            (0.0.into(), 1.5.into(), 1.0.into(), None);
        let specular = source
            .specular_factor
            .map(|c| self.unit(c.into(), label, "specularFactor") / DIELECTRIC);
        out.specular_colour = Colour(specular).into();
        out.specular_colour_texture =
            self.texture(source.specular_glossiness_texture.as_ref(), Use::Colour)?;
        let glossiness = self.unit(source.glossiness_factor.into(), label, "glossinessFactor");
        (out.roughness, out.metallic_roughness_texture) = ((1.0 - glossiness).into(), None);
        if let Some(glossy) = &out.specular_colour_texture {
            out.roughness = 1.0.into();
            out.metallic_roughness_texture = Some(TextureRef {
                name: self.baked(&glossy.name, glossiness),
                ..glossy.clone()
            });
        }
        Ok(())
    }

    /// Name of the texture of roughness that will be made of one of glossiness and its factor, each
    /// made once.
    fn baked(&mut self, glossy: &str, glossiness: f64) -> String {
        let key = (glossy.to_owned(), glossiness.to_bits());
        if let Some(known) = self.bakery.known.get(&key) {
            return known.clone();
        }
        let wish = format!("{glossy} as roughness");
        let (name, image) = (
            self.names.textures.unique(&wish),
            self.names.images.unique(&wish),
        );
        self.bakery.recipes.push(Recipe {
            glossy: glossy.to_owned(),
            glossiness,
            image: self.scene.images.len(),
            texture: self.scene.textures.len(),
        });
        // Filter and wrapping are those of the texture that it is made of, which is looked up when
        // all are known.
        self.scene.textures.push(Texture {
            name: name.clone(),
            image: image.clone(),
            colour_space: ColourSpace::Linear,
            filter: raywright_core::scene::Filter::default(),
            wrap_u: raywright_core::scene::Wrap::default(),
            wrap_v: raywright_core::scene::Wrap::default(),
        });
        self.scene.images.push(Image {
            name: image.clone(),
            path: image,
            data: None,
            mended: 0,
        });
        self.bakery.known.insert(key, name.clone());
        name
    }
}

/// What an image of roughness is made of, and which one it is.
#[derive(Clone, Debug)]
struct Recipe {
    /// Name of the texture with glossiness in alpha.
    glossy: String,
    glossiness: f64,
    /// Places of what is made in the scene's lists.
    image: usize,
    texture: usize,
}

/// Images of roughness that wait for those that they are made of.
#[derive(Debug, Default)]
pub(super) struct Bakery {
    recipes: Vec<Recipe>,
    /// Names of textures by what they are made of.
    known: BTreeMap<(String, u64), String>,
}

impl Bakery {
    /// Makes the images, once those that they are made of are decoded.
    ///
    /// # Errors
    /// A fault of kind limit where they take more memory than is left.
    pub fn bake(self, scene: &mut Scene, budget: &mut Budget) -> Outcome<()> {
        if self.recipes.is_empty() {
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
        for Recipe {
            glossy,
            glossiness,
            image,
            texture,
        } in self.recipes
        {
            let Some(like) = textures.get(&glossy).map(|&i| scene.textures[i].clone()) else {
                continue;
            };
            // One that can't be decoded leaves its factors.
            let white = || ImageData {
                width: 1,
                height: 1,
                pixels: Pixels::Codes(vec![[255; 4]]),
            };
            let data = images
                .get(&like.image)
                .and_then(|&i| scene.images[i].data.clone())
                .unwrap_or_else(|| white().into());
            budget.memory(
                data.width as usize * data.height as usize,
                size_of::<[u8; 4]>(),
            )?;
            scene.images[image].data = Some(roughness(&data, glossiness).into());
            let texture = &mut scene.textures[texture];
            (texture.filter, texture.wrap_u, texture.wrap_v) =
                (like.filter, like.wrap_u, like.wrap_v);
        }
        Ok(())
    }
}

/// What glossiness leaves of one, in the green channel of 8-bit codes; no metal.
fn roughness(glossy: &ImageData, factor: f64) -> ImageData {
    let code = |glossiness: f64| {
        [
            0,
            ((1.0 - (glossiness * factor).clamp(0.0, 1.0)) * 255.0).round() as u8,
            0,
            255,
        ]
    };
    let pixels = match &glossy.pixels {
        Pixels::Linear(pixels) => pixels.iter().map(|pixel| code(pixel[3].into())).collect(),
        Pixels::Codes(pixels) => pixels
            .iter()
            .map(|pixel| code(f64::from(pixel[3]) / 255.0))
            .collect(),
    };
    ImageData {
        width: glossy.width,
        height: glossy.height,
        pixels: Pixels::Codes(pixels),
    }
}
