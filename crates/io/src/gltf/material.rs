//! Materials of a glTF file as physical materials.
//!
//! KHR_materials_pbrSpecularGlossiness becomes the metallic-roughness model with
//! KHR_materials_specular, which together are equivalent. The diffuse colour becomes the base colour
//! of a dielectric, and the specular colour its reflectance at normal incidence. Glossiness becomes
//! roughness, texel by texel in an image.

use std::collections::{BTreeMap, HashMap};

use raywright_core::scene::{
    AlphaMode, Colour, ColourInput, ColourSpace, Image, ImageData, Material, MaterialFields,
    MaterialModel, Medium, Physical, PixelData, Texture, TextureRef, UnsupportedProperty,
    single_scattering_albedo,
};
use raywright_core::validate::MAX_MAGNITUDE;

use super::accessor::find_entry;
use super::entries::MaterialEntry as Source;
use super::extensions::MaterialProperty::{Checked, Color, ColorAlpha, Map, NormalMap, Number};
use super::extensions::{CORE, GLOSSY, MATERIAL_OBJECTS, MaterialObject, TextureRole, UNLIT};
use super::{GltfImport, extensions};
use crate::import::{FaultPlace, ImportResult, format_count, format_number, sanitise_text};

/// Largest scale of a normal map, which is the factor on its x and y. At larger scales the normals
/// would not change any more: the original normal no longer contributes.
const MOST_NORMAL_SCALE: f64 = 1e6;

/// Least channel of a base colour and an emission that together hide all shading.
const FLAT_WHITE: f64 = 0.9;

/// Name and index of a converted material, and the properties that a mesh of this material depends
/// on.
#[derive(Clone, Debug)]
pub(super) struct ConvertedMaterial {
    /// Name in the scene.
    pub name: String,
    /// Index in the scene's list of materials.
    index: usize,
    /// Whether surfaces of the material are two-sided.
    pub two_sided: bool,
    /// Whether surfaces of the material need tangents, for a normal map or for anisotropy.
    pub needs_tangents: bool,
    /// Indices of the texture coordinate sets that the material's textures use.
    pub uv_sets: Vec<u32>,
}

impl GltfImport<'_> {
    /// Returns the material of a primitive, converted on first use; `None` selects the
    /// specification's default material.
    pub(super) fn convert_material(
        &mut self,
        index: Option<usize>,
    ) -> ImportResult<ConvertedMaterial> {
        if let Some(known) = self.materials.get(&index) {
            return Ok(known.clone());
        }
        let default = Source::default();
        let source = match index {
            Some(i) => find_entry(&self.document.materials, "materials", i)?,
            None => &default,
        };
        let label = index.map_or_else(
            || "the default material".to_owned(),
            |i| format!("materials[{i}]"),
        );
        let model = self.convert_physical(source, &label).with_place(&label)?;
        let textures = model
            .fields()
            .into_iter()
            .filter_map(|field| field.value.texture());
        let used = ConvertedMaterial {
            name: self
                .names
                .materials
                .make_unique(source.name.as_deref().unwrap_or("default")),
            index: self.scene.materials.len(),
            // Rays must be able to leave a surface that they entered.
            two_sided: source.double_sided
                || model.may_transmit()
                || model.may_transmit_diffusely(),
            needs_tangents: model.tangent_texture().is_some()
                || model.active_anisotropy().is_some(),
            uv_sets: textures.map(|(_, texture)| texture.uv_set).collect(),
        };
        // The effects report lists the unsupported extensions if an object uses the material.
        let unsupported = extensions::unsupported_extensions(&source.others);
        self.scene
            .unread
            .extend(unsupported.map(|name| UnsupportedProperty {
                material: used.name.clone(),
                label: sanitise_text(name),
            }));
        self.scene.materials.push(Material {
            name: used.name.clone(),
            model: MaterialModel::Physical(Box::new(model)),
        });
        self.materials.insert(index, used.clone());
        Ok(used)
    }

    /// Enables vertex colours in a material, for a mesh that has vertex colours.
    pub(super) fn enable_vertex_colours(&mut self, material: &ConvertedMaterial) {
        if let Some(Material {
            model: MaterialModel::Physical(model),
            ..
        }) = self.scene.materials.get_mut(material.index)
        {
            model.vertex_colours = true;
        }
    }

    /// Converts a material with its layers to a physical material. `label` names the material in
    /// messages.
    fn convert_physical(&mut self, source: &Source, label: &str) -> ImportResult<Physical> {
        // Without KHR_materials_volume, a transmissive surface is a thin wall, which does not
        // refract.
        let mut out = Physical {
            alpha: self.convert_alpha_mode(source, label),
            unlit: source.extensions.contains(&UNLIT),
            thin_walled: true,
            ..Physical::default()
        };
        for object in MATERIAL_OBJECTS {
            let is_extension = ![CORE, ""].contains(&object.name);
            if is_extension && !source.extensions.contains(&object.name) {
                continue;
            }
            if object.name != GLOSSY {
                self.apply_properties(source, object, label, &mut out)?;
            } else if !out.unlit {
                // An unlit material shows the base colour of the metallic-roughness model.
                self.convert_specular_glossiness(source, object, label, &mut out)?;
            }
        }
        out.thin_walled &= out.may_transmit() || out.may_transmit_diffusely();
        resolve_volume_scatter(&mut out);
        let is_white = |colour: &ColourInput| {
            let constant = colour.constant().unwrap_or_default();
            constant.0.iter().all(|&channel| channel >= FLAT_WHITE)
        };
        let is_plain = out.base_colour_texture.is_none() && out.emission_texture.is_none();
        if is_plain && is_white(&out.base_colour) && is_white(&out.emission) {
            warn!(
                self.warnings,
                Material,
                "{label}: a white material without a texture shines white (emissiveFactor): its surfaces show no shading"
            );
        }
        Ok(out)
    }

    /// Sets the properties of an object of a material. Numbers out of range are clamped or replaced
    /// by the default, with a warning.
    fn apply_properties(
        &mut self,
        source: &Source,
        object: &MaterialObject,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        for (i, (key, property)) in object.properties.iter().enumerate() {
            let numbers = source.numbers.get(&(object.name, *key));
            let numbers = numbers.map(|numbers| numbers.map(object.round));
            let info = source.textures.get(&(object.name, *key));
            let is_idle = |default: f64, numbers: &[f64]| {
                i == 0 && default == 0.0 && numbers.iter().all(|number| *number == 0.0)
            };
            match property {
                Number(default, range, set) | Checked(default, range, _, set) => {
                    let mut value = numbers.map_or(*default, |[value, ..]| value);
                    if let Checked(_, _, is_valid, _) = property
                        && !is_valid(value)
                    {
                        let [wrong, used] = [value, *default].map(format_number);
                        warn!(
                            self.warnings,
                            Range, "{label}: {key} {wrong} is not supported; {used} is used"
                        );
                        value = *default;
                    }
                    value = self.warnings.clamp_with_warning(value, *range, label, key);
                    if is_idle(*default, &[value]) {
                        return Ok(());
                    }
                    set(out, value);
                }
                Color(default, range, set) => {
                    let [r, g, b, _] = numbers.unwrap_or([*default; 4]);
                    let clamp = |c| self.warnings.clamp_with_warning(c, *range, label, key);
                    let colour = [r, g, b].map(clamp);
                    if is_idle(*default, &colour) {
                        return Ok(());
                    }
                    set(out, Colour(colour));
                }
                ColorAlpha(set_colour, set_alpha) => {
                    let clamp = |c| self.warnings.clamp_with_warning(c, [0.0, 1.0], label, key);
                    let [r, g, b, a] = numbers.unwrap_or([1.0; 4]).map(clamp);
                    set_colour(out, Colour([r, g, b]));
                    set_alpha(out, a);
                }
                Map(role, set) => set(out, self.convert_texture_ref(info, *role)?),
                NormalMap(set, set_scale) => {
                    set(out, self.convert_texture_ref(info, TextureRole::Data)?);
                    let scale = info.map_or(1.0, |info| info.scale.into());
                    let subject = format!("{key}.scale");
                    let range = [-MOST_NORMAL_SCALE, MOST_NORMAL_SCALE];
                    set_scale(
                        out,
                        self.warnings
                            .clamp_with_warning(scale, range, label, &subject),
                    );
                }
            }
        }
        Ok(())
    }

    /// Warns about the parts of materials that are shown in another way: once for each kind, with the
    /// number of its materials.
    pub(super) fn warn_converted_materials(&mut self) {
        let mut warn_kind = |is_meant: fn(&&Source) -> bool, label: &str, outcome: &str| {
            let indices = self.materials.keys().flatten();
            let used = indices.filter_map(|&index| self.document.materials.get(index));
            let count = used.filter(is_meant).count();
            if count > 0 {
                let materials = format_count(count, "material");
                warn!(
                    self.warnings,
                    Conversion, "{label} of {materials} is {outcome}"
                );
            }
        };
        warn_kind(
            |source| source.has_occlusion_map,
            "the occlusion map",
            "ignored, because occlusion is computed by ray tracing",
        );
        warn_kind(
            |source| source.extensions.contains(&GLOSSY) && !source.extensions.contains(&UNLIT),
            GLOSSY,
            "converted to metallic-roughness",
        );
    }

    /// Returns the alpha mode of a material. An unknown mode counts as opaque, with a warning.
    fn convert_alpha_mode(&mut self, source: &Source, label: &str) -> AlphaMode {
        match source.alpha_mode.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask { cutoff: 0.5 },
            Some("BLEND") => AlphaMode::Blend,
            Some(_) => {
                warn!(
                    self.warnings,
                    Format, "{label}: the alphaMode is unknown; the material is opaque"
                );
                AlphaMode::Opaque
            }
        }
    }
}

impl GltfImport<'_> {
    /// Sets base colour, metalness, roughness, opacity and reflectance from specular-glossiness
    /// data.
    fn convert_specular_glossiness(
        &mut self,
        source: &Source,
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

/// Converts the colour of multiple scattering to coefficients: the attenuation of
/// KHR_materials_volume is that of absorption and scattering together. Without a body or without
/// attenuation nothing scatters.
fn resolve_volume_scatter(out: &mut Physical) {
    let Some(medium) = out.interior.take() else {
        return;
    };
    let attenuation = out.attenuation().filter(|_| out.bounds_body());
    let Some((colour, attenuation)) = medium.colour.zip(attenuation) else {
        return;
    };
    let attenuation = attenuation.map(|a| a.clamp(0.0, MAX_MAGNITUDE));
    let albedo = colour
        .0
        .map(|c| single_scattering_albedo(c, medium.anisotropy));
    out.attenuation_distance = None;
    out.interior = Some(Medium {
        absorption: Colour(core::array::from_fn(|k| attenuation[k] * (1.0 - albedo[k]))),
        scattering: Colour(core::array::from_fn(|k| attenuation[k] * albedo[k])),
        colour: None,
        ..medium
    });
}
