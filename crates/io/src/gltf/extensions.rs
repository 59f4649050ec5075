//! Supported glTF extensions, and the table of the material properties that glTF 2.0 and its
//! extensions define. An extension is one row: its keys with defaults and ranges, its textures with
//! their channels, and the fields of the scene's material that they set. Reading, clamps with their
//! warnings, targets of animations and the list of supported extensions follow from the table.

use core::f64::consts::TAU;
use std::collections::BTreeMap;

use raywright_core::scene::{AlphaMode, Channel, Colour, Physical, TextureRef};
use raywright_core::validate::{MAX_COORDINATE, MAX_MAGNITUDE, MIN_LENGTH};
use serde_json::Value;

use Channel::{Alpha, Green, Red};
use TextureRole::{Color, Data, Single};

use crate::import::{ImportResult, Warnings, sanitise_text};

/// Reflectance at normal incidence of a dielectric with the index of refraction 1.5. The renderer
/// multiplies the specular colour by this reflectance; therefore the file's specular colour is
/// divided by it.
const DIELECTRIC: f64 = 0.04;

/// Use of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TextureRole {
    /// Colours, encoded in sRGB.
    Color,
    /// Data that is not a colour, such as roughness or normals; stored linearly.
    Data,
    /// A single channel of data.
    Single(Channel),
}

/// Sets a value of a material of the scene.
type Setter<T> = fn(&mut Physical, T);

/// Kind of a property, with the default and the range of its numbers.
pub(super) enum MaterialProperty {
    /// A number.
    Number(f64, [f64; 2], Setter<f64>),
    /// A number that is replaced by its default, with a warning, if it fails the test.
    Checked(f64, [f64; 2], fn(f64) -> bool, Setter<f64>),
    /// A colour, and the default and range of each channel.
    Color(f64, [f64; 2], Setter<Colour>),
    /// A colour and an alpha value, each 1 by default and from 0 to 1.
    ColorAlpha(Setter<Colour>, Setter<f64>),
    /// A texture.
    Map(TextureRole, Setter<Option<TextureRef>>),
    /// A normal map, and its scale.
    NormalMap(Setter<Option<TextureRef>>, Setter<f64>),
}

/// An object of a material's JSON. It has no effect if its first property is 0 in the file and by
/// default.
pub(super) struct MaterialObject {
    /// Name of the extension, [`CORE`], or the empty name of the material itself.
    pub name: &'static str,
    /// Rounds a number to the precision in which the object's numbers are kept.
    pub round: fn(f64) -> f64,
    pub properties: &'static [(&'static str, MaterialProperty)],
}

/// Name of the object of the metallic-roughness model.
pub(super) const CORE: &str = "pbrMetallicRoughness";
/// Name of the extension with the specular-glossiness model.
pub(super) const GLOSSY: &str = "KHR_materials_pbrSpecularGlossiness";
/// Name of the extension without properties that shows the base colour without lighting.
pub(super) const UNLIT: &str = "KHR_materials_unlit";

const UNIT: [f64; 2] = [0.0, 1.0];
const UNBOUNDED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const NOT_NEGATIVE: [f64; 2] = [0.0, f64::INFINITY];
/// Range of a thin film's thickness in nanometres, and of the specular colour.
const MILLION: [f64; 2] = [0.0, 1e6];

/// Creates the setter of a field of the material or of one of its layers.
macro_rules! setter {
    ($layer:ident.$field:ident) => {
        |out, value| out.$layer.get_or_insert_default().$field = value.into()
    };
    ($field:ident) => {
        |out, value| out.$field = value.into()
    };
    ($closure:expr) => {
        $closure
    };
}

/// Creates the table: for each object the precision of its numbers, and the keys, each with its
/// kind, the numbers of the kind, and the fields that it sets.
macro_rules! material_objects {
    ($($name:tt $number:ident { $($key:literal: $kind:ident ($($argument:expr),*) $([$($field:tt)+])+;)* })*) => {
        &[$(MaterialObject {
            name: $name,
            round: |number| (number as $number).into(),
            properties: &[$(
                ($key, MaterialProperty::$kind($($argument,)* $(setter!($($field)+)),+)),
            )*],
        },)*]
    };
}

/// The objects of a material, in the order in which they apply.
pub(super) static MATERIAL_OBJECTS: &[MaterialObject] = material_objects! {
    CORE f32 {
        "baseColorFactor": ColorAlpha()[base_colour][opacity];
        "baseColorTexture": Map(Color)[base_colour_texture];
        "metallicFactor": Number(1.0, UNIT)[metallic];
        "roughnessFactor": Number(1.0, UNIT)[roughness];
        "metallicRoughnessTexture": Map(Data)[metallic_roughness_texture];
    }
    "" f32 {
        "normalTexture": NormalMap()[normal_texture][normal_scale];
        "emissiveFactor": Color(0.0, UNIT)[emission];
        "emissiveTexture": Map(Color)[emission_texture];
        // A cutoff above 1 removes the whole surface, so that all larger values are equivalent.
        "alphaCutoff": Number(0.5, NOT_NEGATIVE)[|out, value| {
            if let AlphaMode::Mask { cutoff } = &mut out.alpha {
                *cutoff = value.min(2.0);
            }
        }];
    }
    UNLIT f32 {}
    "KHR_materials_emissive_strength" f32 {
        "emissiveStrength": Number(1.0, [0.0, MAX_MAGNITUDE])[|out, strength| {
            if let Some(Colour(factor)) = out.emission.constant() {
                out.emission = Colour(factor.map(|c| c * strength)).into();
            }
        }];
    }
    "KHR_materials_ior" f32 {
        // The value 0 stays, for total reflection.
        "ior": Checked(1.5, [0.0, Physical::IOR[1]], |ior| ior == 0.0 || ior >= Physical::IOR[0])[ior];
    }
    "KHR_materials_transmission" f32 {
        "transmissionTexture": Map(Data)[transmission_texture];
        "transmissionFactor": Number(0.0, UNIT)[transmission];
    }
    "KHR_materials_specular" f64 {
        "specularFactor": Number(1.0, UNIT)[specular];
        "specularTexture": Map(Single(Alpha))[specular_texture];
        "specularColorFactor": Color(1.0, MILLION)[specular_colour];
        "specularColorTexture": Map(Color)[specular_colour_texture];
    }
    "KHR_materials_clearcoat" f64 {
        "clearcoatFactor": Number(0.0, UNIT)[clearcoat.factor];
        "clearcoatTexture": Map(Single(Red))[clearcoat.factor_texture];
        "clearcoatRoughnessFactor": Number(0.0, UNIT)[clearcoat.roughness];
        "clearcoatRoughnessTexture": Map(Single(Green))[clearcoat.roughness_texture];
        "clearcoatNormalTexture": NormalMap()[clearcoat.normal_texture][clearcoat.normal_scale];
    }
    "KHR_materials_sheen" f64 {
        "sheenColorFactor": Color(0.0, UNIT)[sheen.colour];
        "sheenColorTexture": Map(Color)[sheen.colour_texture];
        "sheenRoughnessFactor": Number(0.0, UNIT)[sheen.roughness];
        "sheenRoughnessTexture": Map(Single(Alpha))[sheen.roughness_texture];
    }
    "KHR_materials_anisotropy" f64 {
        "anisotropyStrength": Number(0.0, UNIT)[anisotropy.strength];
        // Full turns have no effect on the direction.
        "anisotropyRotation": Number(0.0, UNBOUNDED)[|out, angle| {
            out.anisotropy.get_or_insert_default().rotation = (angle % TAU).to_degrees();
        }];
        "anisotropyTexture": Map(Data)[anisotropy.texture];
    }
    "KHR_materials_iridescence" f64 {
        "iridescenceFactor": Number(0.0, UNIT)[iridescence.factor];
        "iridescenceTexture": Map(Single(Red))[iridescence.factor_texture];
        "iridescenceIor": Number(1.3, Physical::IOR)[iridescence.ior];
        "iridescenceThicknessMinimum": Number(100.0, MILLION)[iridescence.thinnest];
        "iridescenceThicknessMaximum": Number(400.0, MILLION)[iridescence.thickness];
        "iridescenceThicknessTexture": Map(Single(Green))[iridescence.thickness_texture];
    }
    "KHR_materials_diffuse_transmission" f64 {
        "diffuseTransmissionFactor": Number(0.0, UNIT)[diffuse_transmission.factor];
        "diffuseTransmissionTexture": Map(Single(Alpha))[diffuse_transmission.factor_texture];
        "diffuseTransmissionColorFactor": Color(1.0, UNIT)[diffuse_transmission.colour];
        "diffuseTransmissionColorTexture": Map(Color)[diffuse_transmission.colour_texture];
    }
    "KHR_materials_dispersion" f64 {
        "dispersion": Number(0.0, [0.0, 400.0])[dispersion];
    }
    "KHR_materials_volume" f64 {
        "thicknessFactor": Number(0.0, NOT_NEGATIVE)[|out, _| out.thin_walled = false];
        "attenuationColor": Color(1.0, UNIT)[attenuation_colour];
        // An infinite distance means no absorption.
        "attenuationDistance": Checked(f64::INFINITY, [MIN_LENGTH, f64::INFINITY], |distance| distance > 0.0)[
            |out, distance| out.attenuation_distance = Some(distance).filter(|d| *d <= MAX_COORDINATE)
        ];
    }
    // A draft: scattering in the body of KHR_materials_volume.
    "KHR_materials_volume_scatter" f64 {
        "multiscatterColor": Color(0.0, UNIT)[|out, colour| {
            out.interior.get_or_insert_default().colour = Some(colour);
        }];
        "scatterAnisotropy": Number(0.0, [-0.999, 0.999])[interior.anisotropy];
    }
    GLOSSY f32 {
        "diffuseFactor": ColorAlpha()[base_colour][opacity];
        "diffuseTexture": Map(Color)[base_colour_texture];
        "specularFactor": Color(1.0, UNIT)[|out, Colour(specular)| {
            out.specular_colour = Colour(specular.map(|c| c / DIELECTRIC)).into();
        }];
        "specularGlossinessTexture": Map(Color)[specular_colour_texture];
        // The conversion of the model needs the glossiness, and then sets the roughness.
        "glossinessFactor": Number(1.0, UNIT)[roughness];
    }
};

/// Returns the object of a material with this name.
pub(super) fn find_material_object(name: &str) -> Option<&'static MaterialObject> {
    MATERIAL_OBJECTS.iter().find(|object| object.name == name)
}

/// Returns the property with this key of an object, and the key.
pub(super) fn find_property(
    object: &str,
    key: &str,
) -> Option<&'static (&'static str, MaterialProperty)> {
    let properties = find_material_object(object)?.properties;
    properties.iter().find(|(name, _)| *name == key)
}

impl MaterialProperty {
    /// Number of the numbers that the file stores: 0 for a texture.
    pub fn length(&self) -> usize {
        match self {
            Self::Number(..) | Self::Checked(..) => 1,
            Self::Color(..) => 3,
            Self::ColorAlpha(..) => 4,
            _ => 0,
        }
    }
}

/// Supported extensions other than those of materials. Extensions that cannot change a picture,
/// such as metadata, are included.
const SUPPORTED: [&str; 14] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    // Metadata.
    "KHR_xmp_json_ld",
    "KHR_xmp",
];

/// Whether an extension is supported.
pub(super) fn is_supported(name: &str) -> bool {
    SUPPORTED.contains(&name) || find_material_object(name).is_some()
}

/// Refuses a file with an unsupported required extension.
///
/// # Errors
/// A fault of kind input that names the extensions.
pub(super) fn check_required_extensions(required: &[String]) -> ImportResult<()> {
    let missing: Vec<&str> = required
        .iter()
        .filter(|name| !is_supported(name))
        .map(String::as_str)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let list: Vec<String> = missing
        .iter()
        .take(8)
        .map(|name| format!("`{}`", sanitise_text(name)))
        .collect();
    Err(fault!(
        "requires the extension {}, which is not supported",
        list.join(", ")
    ))
}

/// Warns about unsupported extensions among `named`. Unsupported extensions of materials are not
/// included: they are reported for each material that they change.
pub(super) fn warn_unsupported_extensions<'a>(
    named: impl Iterator<Item = &'a String>,
    warnings: &mut Warnings,
) {
    let of_materials =
        |name: &str| name.starts_with("KHR_materials_") || name.starts_with("EXT_materials_");
    for name in named.filter(|name| !is_supported(name) && !of_materials(name)) {
        warn!(
            warnings,
            Unsupported,
            "the extension {} is not supported and is ignored",
            sanitise_text(name)
        );
    }
}

/// Unsupported material extensions that some programs write for all materials, each with a key. An
/// extension has no effect if the value of its key is 0.
const DISABLED_BY_ZERO: [(&str, &str); 1] = [("KHR_materials_subsurface", "scatterDistance")];

/// Returns the names of the unsupported extensions of a material that would change its appearance.
pub(super) fn unsupported_extensions(
    extensions: &BTreeMap<String, Value>,
) -> impl Iterator<Item = &String> {
    let counts = |(name, value): &(&String, &Value)| {
        let idle = DISABLED_BY_ZERO
            .iter()
            .any(|(known, key)| known == name && value[key].as_f64().unwrap_or(0.0) == 0.0);
        !is_supported(name) && !idle
    };
    extensions.iter().filter(counts).map(|(name, _)| name)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::super::animation_pointer::property_type;
    use super::super::json::list_length;
    use super::*;

    /// Protects: each number of the table is a target of animations, each colour is a list of known
    /// length, each extension is supported, and no key of an object stands in the table twice.
    #[test]
    fn rows_are_read_animated_and_supported() {
        let mut keys = HashSet::new();
        for object in MATERIAL_OBJECTS {
            let name = object.name;
            let path = match name {
                "" => "materials/7".to_owned(),
                CORE => format!("materials/7/{CORE}"),
                _ => format!("materials/7/extensions/{name}"),
            };
            assert!(!name.starts_with("KHR_") || is_supported(name), "{name}");
            for (key, property) in object.properties {
                assert!(keys.insert((name, key)), "{name} {key}");
                let length = property.length();
                let is_map = matches!(property, MaterialProperty::NormalMap(..));
                let target = property_type(&format!("{path}/{key}"));
                assert_eq!(target.is_some(), length > 0, "{name} {key}");
                let scale = property_type(&format!("{path}/{key}/scale"));
                assert_eq!(scale.is_some(), is_map, "{name} {key}");
                let list = Some(length).filter(|length| *length > 1);
                assert_eq!(list_length(key, Some(name)), list, "{name} {key}");
            }
        }
        assert!(
            property_type("materials/7/extensions/KHR_materials_ior/clearcoatFactor").is_none()
        );
        assert!(property_type("materials/7/KHR_materials_ior/ior").is_none());
    }
}

#[cfg(test)]
mod extensions_tests {
    use super::*;

    /// Protects: an extension without effect is not reported, and one with an effect is.
    #[test]
    fn idle_extensions_are_told() {
        let counts = |text: &str| {
            let extensions: BTreeMap<String, Value> = serde_json::from_str(text).expect(text);
            unsupported_extensions(&extensions)
                .cloned()
                .collect::<Vec<_>>()
        };
        for idle in [
            r#"{"KHR_materials_subsurface":{}}"#,
            r#"{"KHR_materials_subsurface":{"scatterDistance":0}}"#,
            r#"{"KHR_materials_sheen":{"sheenColorFactor":[0,0,0.1]}}"#,
            r#"{"KHR_materials_unlit":{}}"#,
        ] {
            assert!(counts(idle).is_empty(), "{idle}");
        }
        for counted in [
            r#"{"KHR_materials_subsurface":{"scatterDistance":0.5}}"#,
            r#"{"EXT_of_someone":{}}"#,
        ] {
            assert_eq!(counts(counted).len(), 1, "{counted}");
        }
    }
}
