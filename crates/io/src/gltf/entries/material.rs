//! Entries of a glTF file for appearance: materials with their extensions, textures, samplers,
//! images.

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;

use super::{defaulted, extended};

/// Reference of a material to a texture.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct TextureInfo {
    pub index: u32,
    #[serde(default)]
    pub tex_coord: u32,
    /// Scale of a normal map's x and y.
    #[serde(default = "default_scale")]
    pub scale: f32,
    #[serde(default)]
    pub extensions: TextureInfoExtensions,
}

fn default_scale() -> f32 {
    1.0
}

/// Supported extensions of a texture reference.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

defaulted!(
    /// Transform of texture coordinates; the rotation is in radians.
    TextureTransform { offset: [f32; 2] = [0.0; 2], rotation: f32 = 0.0, scale: [f32; 2] = [1.0; 2], tex_coord: Option<u32> = None }
);
defaulted!(
    /// A material.
    MaterialEntry {
        name: Option<String> = None,
        pbr_metallic_roughness: MetallicRoughness = MetallicRoughness::default(),
        normal_texture: Option<TextureInfo> = None,
        occlusion_texture: Option<TextureInfo> = None,
        emissive_texture: Option<TextureInfo> = None,
        emissive_factor: [f32; 3] = [0.0; 3],
        alpha_mode: Option<String> = None,
        alpha_cutoff: Option<f32> = None,
        double_sided: bool = false,
        extensions: MaterialExtensions = MaterialExtensions::default(),
    }
);
defaulted!(
    /// The metallic-roughness model.
    MetallicRoughness {
        base_color_factor: [f32; 4] = [1.0; 4],
        base_color_texture: Option<TextureInfo> = None,
        metallic_factor: f32 = 1.0,
        roughness_factor: f32 = 1.0,
        metallic_roughness_texture: Option<TextureInfo> = None,
    }
);

extended! {
    /// Supported extensions of a material. Each is boxed, so that a material without extensions
    /// takes little memory.
    MaterialExtensions: Value {
        emissive_strength: Option<EmissiveStrength> = "KHR_materials_emissive_strength",
        ior: Option<Ior> = "KHR_materials_ior",
        transmission: Option<Box<TransmissionData>> = "KHR_materials_transmission",
        unlit: Option<IgnoredAny> = "KHR_materials_unlit",
        specular_glossiness: Option<Box<SpecularGlossiness>> = "KHR_materials_pbrSpecularGlossiness",
        volume: Option<Box<VolumeData>> = "KHR_materials_volume",
        specular: Option<Box<SpecularData>> = "KHR_materials_specular",
        clearcoat: Option<Box<ClearcoatData>> = "KHR_materials_clearcoat",
        sheen: Option<Box<SheenData>> = "KHR_materials_sheen",
        anisotropy: Option<Box<AnisotropyData>> = "KHR_materials_anisotropy",
        iridescence: Option<Box<IridescenceData>> = "KHR_materials_iridescence",
        dispersion: Option<Dispersion> = "KHR_materials_dispersion",
        diffuse_transmission: Option<Box<DiffuseTransmissionData>> = "KHR_materials_diffuse_transmission",
    }
}

defaulted!(
    /// Data of the extension KHR_materials_emissive_strength.
    EmissiveStrength { emissive_strength: f32 = 1.0 }
);
defaulted!(
    /// Data of the extension KHR_materials_ior.
    Ior { ior: f32 = 1.5 }
);
defaulted!(
    /// Data of the extension KHR_materials_transmission.
    TransmissionData { transmission_factor: f32 = 0.0, transmission_texture: Option<TextureInfo> = None }
);
defaulted!(
    /// Data of the extension KHR_materials_pbrSpecularGlossiness.
    SpecularGlossiness {
        diffuse_factor: [f32; 4] = [1.0; 4],
        diffuse_texture: Option<TextureInfo> = None,
        specular_factor: [f32; 3] = [1.0; 3],
        glossiness_factor: f32 = 1.0,
        specular_glossiness_texture: Option<TextureInfo> = None,
    }
);
defaulted!(
    /// Data of the extension KHR_materials_volume.
    VolumeData { thickness_factor: f64 = 0.0, attenuation_distance: Option<f64> = None, attenuation_color: [f64; 3] = [1.0; 3] }
);
defaulted!(
    /// Data of the extension KHR_materials_specular.
    SpecularData {
        specular_factor: f64 = 1.0,
        specular_texture: Option<TextureInfo> = None,
        specular_color_factor: [f64; 3] = [1.0; 3],
        specular_color_texture: Option<TextureInfo> = None,
    }
);
defaulted!(
    /// Data of the extension KHR_materials_clearcoat.
    ClearcoatData {
        clearcoat_factor: f64 = 0.0,
        clearcoat_texture: Option<TextureInfo> = None,
        clearcoat_roughness_factor: f64 = 0.0,
        clearcoat_roughness_texture: Option<TextureInfo> = None,
        clearcoat_normal_texture: Option<TextureInfo> = None,
    }
);
defaulted!(
    /// Data of the extension KHR_materials_sheen.
    SheenData {
        sheen_color_factor: [f64; 3] = [0.0; 3],
        sheen_color_texture: Option<TextureInfo> = None,
        sheen_roughness_factor: f64 = 0.0,
        sheen_roughness_texture: Option<TextureInfo> = None,
    }
);
defaulted!(
    /// Data of the extension KHR_materials_anisotropy.
    AnisotropyData { anisotropy_strength: f64 = 0.0, anisotropy_rotation: f64 = 0.0, anisotropy_texture: Option<TextureInfo> = None }
);
defaulted!(
    /// Data of the extension KHR_materials_iridescence.
    IridescenceData {
        iridescence_factor: f64 = 0.0,
        iridescence_texture: Option<TextureInfo> = None,
        iridescence_ior: f64 = 1.3,
        iridescence_thickness_minimum: f64 = 100.0,
        iridescence_thickness_maximum: f64 = 400.0,
        iridescence_thickness_texture: Option<TextureInfo> = None,
    }
);
defaulted!(
    /// Data of the extension KHR_materials_dispersion.
    Dispersion { dispersion: f64 = 0.0 }
);
defaulted!(
    /// Data of the extension KHR_materials_diffuse_transmission.
    DiffuseTransmissionData {
        diffuse_transmission_factor: f64 = 0.0,
        diffuse_transmission_texture: Option<TextureInfo> = None,
        diffuse_transmission_color_factor: [f64; 3] = [1.0; 3],
        diffuse_transmission_color_texture: Option<TextureInfo> = None,
    }
);

/// A texture sampler, with the OpenGL codes of the specification; `None` leaves the choice to the
/// importer.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(in crate::gltf) struct TextureSampler {
    pub mag_filter: Option<u32>,
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
}

/// An image: in another file, embedded in the JSON, or in a buffer view.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(in crate::gltf) struct ImageEntry {
    pub buffer_view: Option<u32>,
    pub name: Option<String>,
    pub uri: Option<String>,
}

/// A texture: an image with a sampler.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct TextureEntry {
    pub name: Option<String>,
    pub sampler: Option<u32>,
    pub source: Option<u32>,
    pub extensions: TextureExtensions,
}

impl TextureEntry {
    /// Image indices in order of preference: images of extensions before the fallback.
    pub fn image_sources(&self) -> impl Iterator<Item = u32> {
        let TextureExtensions { webp, basis } = &self.extensions;
        [webp.source, basis.source, self.source]
            .into_iter()
            .flatten()
    }
}

/// Images of a texture in WebP and Basis Universal, each from an extension.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    pub webp: TextureSource,
    #[serde(rename = "KHR_texture_basisu")]
    pub basis: TextureSource,
}

/// Reference of a texture extension to an image.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct TextureSource {
    pub source: Option<u32>,
}
