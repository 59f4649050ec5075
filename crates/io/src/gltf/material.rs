//! Materials of a glTF file as physical materials.

use raywright_core::scene::{
    AlphaMode, Colour, Material, MaterialFields, Model, Physical, UnreadPart,
};
use raywright_core::validate::GREATEST;

use super::Import;
use super::buffers::absent;
use super::entries::{Material as Source, TextureUse};
use super::extensions;
use super::texture::TextureRole;
use crate::import::{Outcome, number, printable};
use crate::warning::WarningCode;

/// Largest normal scale.
const MOST_NORMAL_SCALE: f64 = 1e6;

/// A converted material, with the properties that its meshes depend on.
#[derive(Clone, Debug)]
pub(super) struct UsedMaterial {
    /// Name in the scene.
    pub name: String,
    /// Index in the scene's list of materials.
    place: usize,
    /// Whether surfaces of the material are two-sided.
    pub two_sided: bool,
    /// Whether surfaces of the material need tangents, for a normal map or for anisotropy.
    pub bumpy: bool,
    /// Sets of texture coordinates that the material's textures use.
    pub uv_sets: Vec<u32>,
}

impl Import<'_> {
    /// Returns the material of a primitive, converted on first use; `None` selects the
    /// specification's default material.
    pub(super) fn material(&mut self, index: Option<usize>) -> Outcome<UsedMaterial> {
        if let Some(known) = self.materials.get(&index) {
            return Ok(known.clone());
        }
        let default = Source::default();
        let list = &self.document.materials;
        let source = match index {
            Some(i) => list
                .get(i)
                .ok_or_else(|| absent("materials", i, list.len()))?,
            None => &default,
        };
        let label = index.map_or_else(
            || "the default material".to_owned(),
            |i| format!("materials[{i}]"),
        );
        let model = self
            .physical(source, &label)
            .map_err(|fault| fault.with_place(&label))?;
        let textures = model
            .fields()
            .into_iter()
            .filter_map(|field| field.value.texture());
        let used = UsedMaterial {
            name: self
                .names
                .materials
                .unique(source.name.as_deref().unwrap_or("default")),
            place: self.scene.materials.len(),
            // Rays must be able to leave a surface that they entered.
            two_sided: source.double_sided || model.may_transmit() || model.may_diffuse_through(),
            bumpy: model.directed_by().is_some() || model.active_anisotropy().is_some(),
            uv_sets: textures.map(|(_, texture)| texture.uv_set).collect(),
        };
        self.note_unread(source, &used.name);
        self.scene.materials.push(Material {
            name: used.name.clone(),
            model: Model::Physical(Box::new(model)),
        });
        self.materials.insert(index, used.clone());
        Ok(used)
    }

    /// Enables vertex colours in a material, for a mesh that has vertex colours.
    pub(super) fn use_vertex_colours(&mut self, material: &UsedMaterial) {
        if let Some(Material {
            model: Model::Physical(model),
            ..
        }) = self.scene.materials.get_mut(material.place)
        {
            model.vertex_colours = true;
        }
    }

    fn physical(&mut self, source: &Source, label: &str) -> Outcome<Physical> {
        self.warn_unread(source, label);
        let pbr = &source.pbr_metallic_roughness;
        let extensions = &source.extensions;
        let [r, g, b, a] = pbr.base_color_factor.map(f64::from);
        let mut out = Physical {
            base_colour: Colour([r, g, b].map(|c| self.unit(c, label, "baseColorFactor"))).into(),
            base_colour_texture: self
                .texture(pbr.base_color_texture.as_ref(), TextureRole::Colour)?,
            metallic: self
                .unit(pbr.metallic_factor.into(), label, "metallicFactor")
                .into(),
            roughness: self
                .unit(pbr.roughness_factor.into(), label, "roughnessFactor")
                .into(),
            metallic_roughness_texture: self
                .texture(pbr.metallic_roughness_texture.as_ref(), TextureRole::Data)?,
            normal_texture: self.texture(source.normal_texture.as_ref(), TextureRole::Data)?,
            normal_scale: self.normal_scale(
                source.normal_texture.as_ref(),
                label,
                "normalTexture.scale",
            ),
            emission: self.emission(source, label).into(),
            emission_texture: self
                .texture(source.emissive_texture.as_ref(), TextureRole::Colour)?,
            opacity: self.unit(a, label, "baseColorFactor alpha").into(),
            unlit: extensions.unlit.is_some(),
            ..Physical::default()
        };
        out.alpha = match source.alpha_mode.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => {
                // A cutoff above 1 removes the whole surface, so that all larger values are
                // equivalent.
                let cutoff = f64::from(source.alpha_cutoff.unwrap_or(0.5)).min(2.0);
                AlphaMode::Mask {
                    cutoff: self
                        .warnings
                        .clamped(cutoff, [0.0, 2.0], label, "alphaCutoff"),
                }
            }
            Some("BLEND") => AlphaMode::Blend,
            Some(_) => {
                self.warnings.add(
                    WarningCode::Format,
                    format!("{label}: unknown alphaMode; it was taken as opaque"),
                );
                AlphaMode::Opaque
            }
        };
        if let Some(ior) = &extensions.ior {
            out.ior = self.ior(ior.ior.into(), label).into();
        }
        if let Some(transmission) = &extensions.transmission {
            out.transmission = self
                .unit(
                    transmission.transmission_factor.into(),
                    label,
                    "transmissionFactor",
                )
                .into();
            out.transmission_texture = self.texture(
                transmission.transmission_texture.as_ref(),
                TextureRole::Data,
            )?;
        }
        self.layers(extensions, label, &mut out)?;
        // An unlit material shows the base colour of the core model.
        if let Some(glossy) = extensions
            .specular_glossiness
            .as_ref()
            .filter(|_| !out.unlit)
        {
            self.warnings.add(
                WarningCode::Conversion,
                format!("{label}: KHR_materials_pbrSpecularGlossiness was turned into metallic-roughness"),
            );
            self.specular_glossiness(glossy, label, &mut out)?;
        }
        Ok(out)
    }

    /// Records the unsupported parts of a material, reported as effects where an object uses the
    /// material.
    fn note_unread(&mut self, source: &Source, material: &str) {
        let extensions = &source.extensions;
        let unread = |label: String| UnreadPart {
            material: material.to_owned(),
            label,
        };
        self.scene
            .unread
            .extend(extensions::unread(&extensions.others).map(|name| unread(printable(name))));
    }

    /// Warns about the unsupported parts of a material.
    fn warn_unread(&mut self, source: &Source, label: &str) {
        if source.occlusion_texture.is_some() {
            self.warnings.add(
                WarningCode::Conversion,
                format!("{label}: its occlusion map is ignored: what light can't reach is found by tracing"),
            );
        }
    }

    fn emission(&mut self, source: &Source, label: &str) -> Colour {
        let strength = source
            .extensions
            .emissive_strength
            .as_ref()
            .map_or(1.0, |s| f64::from(s.emissive_strength));
        let strength = self
            .warnings
            .clamped(strength, [0.0, GREATEST], label, "emissiveStrength");
        Colour(
            source
                .emissive_factor
                .map(|c| self.unit(c.into(), label, "emissiveFactor") * strength),
        )
    }

    /// Returns a valid index of refraction. The value 0 stays, for total reflection. Other values
    /// below the range become 1.5, and values above the range are clamped, with a warning.
    fn ior(&mut self, value: f64, label: &str) -> f64 {
        if value == 0.0 {
            return value;
        }
        if value < Physical::IOR[0] {
            self.warnings.add(
                WarningCode::Range,
                format!(
                    "{label}: an index of refraction of {} is not supported; 1.5 was taken",
                    number(value)
                ),
            );
            return 1.5;
        }
        self.warnings
            .clamped(value, Physical::IOR, label, "an index of refraction of")
    }

    /// Clamps a factor to 0..1, because a larger factor would add energy.
    pub(super) fn unit(&mut self, value: f64, label: &str, subject: &str) -> f64 {
        self.warnings.clamped(value, [0.0, 1.0], label, subject)
    }

    /// Clamps the scale of a normal map to ±1e6. Larger scales would give the same normals, to
    /// which the original normal no longer contributes.
    pub(super) fn normal_scale(
        &mut self,
        normal: Option<&TextureUse>,
        label: &str,
        subject: &str,
    ) -> f64 {
        normal.map_or(1.0, |normal| {
            self.warnings.clamped(
                normal.scale.into(),
                [-MOST_NORMAL_SCALE, MOST_NORMAL_SCALE],
                label,
                subject,
            )
        })
    }
}
