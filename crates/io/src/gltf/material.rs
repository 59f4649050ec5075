//! Materials of a glTF file as physical materials.

use raywright_core::scene::{
    AlphaMode, Colour, Material, MaterialFields, MaterialModel, Physical, UnsupportedProperty,
};
use raywright_core::validate::MAX_MAGNITUDE;

use super::GltfImport;
use super::buffers::missing_index_fault;
use super::entries::{MaterialEntry as Source, TextureInfo};
use super::extensions;
use super::texture::TextureRole;
use crate::import::{ImportResult, format_number, sanitise_text};
use crate::warning::WarningCode;

/// Largest scale of a normal map, which is the factor on its x and y.
const MOST_NORMAL_SCALE: f64 = 1e6;

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
        let list = &self.document.materials;
        let source = match index {
            Some(i) => list
                .get(i)
                .ok_or_else(|| missing_index_fault("materials", i, list.len()))?,
            None => &default,
        };
        let label = index.map_or_else(
            || "the default material".to_owned(),
            |i| format!("materials[{i}]"),
        );
        let model = self
            .convert_physical(source, &label)
            .map_err(|fault| fault.with_place(&label))?;
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
        self.record_unsupported_extensions(source, &used.name);
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
        self.warn_occlusion_texture(source, label);
        let pbr = &source.pbr_metallic_roughness;
        let extensions = &source.extensions;
        let [r, g, b, a] = pbr.base_color_factor.map(f64::from);
        let mut out = Physical {
            base_colour: Colour([r, g, b].map(|c| self.clamp_unit(c, label, "baseColorFactor")))
                .into(),
            base_colour_texture: self
                .convert_texture_ref(pbr.base_color_texture.as_ref(), TextureRole::Colour)?,
            metallic: self
                .clamp_unit(pbr.metallic_factor.into(), label, "metallicFactor")
                .into(),
            roughness: self
                .clamp_unit(pbr.roughness_factor.into(), label, "roughnessFactor")
                .into(),
            metallic_roughness_texture: self
                .convert_texture_ref(pbr.metallic_roughness_texture.as_ref(), TextureRole::Data)?,
            normal_texture: self
                .convert_texture_ref(source.normal_texture.as_ref(), TextureRole::Data)?,
            normal_scale: self.clamp_normal_scale(
                source.normal_texture.as_ref(),
                label,
                "normalTexture.scale",
            ),
            emission: self.convert_emission(source, label).into(),
            emission_texture: self
                .convert_texture_ref(source.emissive_texture.as_ref(), TextureRole::Colour)?,
            opacity: self.clamp_unit(a, label, "baseColorFactor alpha").into(),
            unlit: extensions.unlit.is_some(),
            ..Physical::default()
        };
        out.alpha = self.convert_alpha_mode(source, label);
        if let Some(ior) = &extensions.ior {
            out.ior = self.clamp_ior(ior.ior.into(), label).into();
        }
        if let Some(transmission) = &extensions.transmission {
            out.transmission = self
                .clamp_unit(
                    transmission.transmission_factor.into(),
                    label,
                    "transmissionFactor",
                )
                .into();
            out.transmission_texture = self.convert_texture_ref(
                transmission.transmission_texture.as_ref(),
                TextureRole::Data,
            )?;
        }
        self.add_layers(extensions, label, &mut out)?;
        // An unlit material shows the base colour of the metallic-roughness model, so that its
        // specular-glossiness data is ignored.
        if let Some(glossy) = extensions
            .specular_glossiness
            .as_ref()
            .filter(|_| !out.unlit)
        {
            self.warnings.add(
                WarningCode::Conversion,
                format!("{label}: KHR_materials_pbrSpecularGlossiness was converted to metallic-roughness"),
            );
            self.convert_specular_glossiness(glossy, label, &mut out)?;
        }
        Ok(out)
    }

    /// Returns the alpha mode of a material. An unknown mode counts as opaque, with a warning.
    fn convert_alpha_mode(&mut self, source: &Source, label: &str) -> AlphaMode {
        match source.alpha_mode.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => {
                // A cutoff above 1 removes the whole surface, so that all larger values are
                // equivalent.
                let cutoff = f64::from(source.alpha_cutoff.unwrap_or(0.5)).min(2.0);
                AlphaMode::Mask {
                    cutoff: self.warnings.clamp_with_warning(
                        cutoff,
                        [0.0, 2.0],
                        label,
                        "alphaCutoff",
                    ),
                }
            }
            Some("BLEND") => AlphaMode::Blend,
            Some(_) => {
                self.warnings.add(
                    WarningCode::Format,
                    format!("{label}: the alphaMode is unknown; the material is opaque"),
                );
                AlphaMode::Opaque
            }
        }
    }

    /// Records the unsupported extensions of a material in the scene. The effects report lists them
    /// if an object uses the material.
    fn record_unsupported_extensions(&mut self, source: &Source, material: &str) {
        let extensions = &source.extensions;
        let unread = |label: String| UnsupportedProperty {
            material: material.to_owned(),
            label,
        };
        self.scene.unread.extend(
            extensions::unsupported_extensions(&extensions.others)
                .map(|name| unread(sanitise_text(name))),
        );
    }

    /// Warns about an occlusion texture, which is ignored.
    fn warn_occlusion_texture(&mut self, source: &Source, label: &str) {
        if source.occlusion_texture.is_some() {
            self.warnings.add(
                WarningCode::Conversion,
                format!("{label}: the occlusion map is ignored, because occlusion is computed by ray tracing"),
            );
        }
    }

    /// Returns the emitted radiance: the emissive factor, scaled by KHR_materials_emissive_strength.
    fn convert_emission(&mut self, source: &Source, label: &str) -> Colour {
        let strength = source
            .extensions
            .emissive_strength
            .as_ref()
            .map_or(1.0, |s| f64::from(s.emissive_strength));
        let strength = self.warnings.clamp_with_warning(
            strength,
            [0.0, MAX_MAGNITUDE],
            label,
            "emissiveStrength",
        );
        Colour(
            source
                .emissive_factor
                .map(|c| self.clamp_unit(c.into(), label, "emissiveFactor") * strength),
        )
    }

    /// Returns a valid index of refraction. The value 0 stays, for total reflection. Other values
    /// below the range become 1.5, and values above the range are clamped, with a warning.
    fn clamp_ior(&mut self, value: f64, label: &str) -> f64 {
        if value == 0.0 {
            return value;
        }
        if value < Physical::IOR[0] {
            self.warnings.add(
                WarningCode::Range,
                format!(
                    "{label}: the index of refraction {} is not supported; 1.5 is used",
                    format_number(value)
                ),
            );
            return 1.5;
        }
        self.warnings
            .clamp_with_warning(value, Physical::IOR, label, "the index of refraction")
    }

    /// Clamps a factor to 0..1, with a warning, because a larger factor would add energy.
    pub(super) fn clamp_unit(&mut self, value: f64, label: &str, subject: &str) -> f64 {
        self.warnings
            .clamp_with_warning(value, [0.0, 1.0], label, subject)
    }

    /// Clamps the scale of a normal map to ±1e6, with a warning. At larger scales the normals would
    /// not change any more: the original normal no longer contributes.
    pub(super) fn clamp_normal_scale(
        &mut self,
        normal: Option<&TextureInfo>,
        label: &str,
        subject: &str,
    ) -> f64 {
        normal.map_or(1.0, |normal| {
            self.warnings.clamp_with_warning(
                normal.scale.into(),
                [-MOST_NORMAL_SCALE, MOST_NORMAL_SCALE],
                label,
                subject,
            )
        })
    }
}
