//! What may lie over, under and in the metallic-roughness model: glTF's extensions of it, as a file says them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::input::{Colour, ColourInput, NumberInput, TextureRef, early};

/// A clear coat of index 1.5 over everything (KHR_materials_clearcoat).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Clearcoat {
    /// Share of the surface that it covers, 0 to 1.
    #[serde(deserialize_with = "early")]
    pub factor: NumberInput,
    /// Image that multiplies it, by its red channel where it names no other.
    pub factor_texture: Option<TextureRef>,
    /// Perceptual roughness of the coat, 0 to 1.
    #[serde(deserialize_with = "early")]
    pub roughness: NumberInput,
    /// Image that multiplies it, by its red channel where it names no other.
    pub roughness_texture: Option<TextureRef>,
    /// Image of directions about the coat's normal; none: it is smooth, whatever bends the surface below.
    pub normal_texture: Option<TextureRef>,
    /// Factor of the image's red and green directions.
    pub normal_scale: f64,
}

impl Default for Clearcoat {
    fn default() -> Self {
        Self {
            factor: 1.0.into(),
            factor_texture: None,
            roughness: 0.0.into(),
            roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }
    }
}

/// Fibres that catch light at grazing angles, as on velvet (KHR_materials_sheen).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Sheen {
    /// Colour, which is also how much of it there is.
    pub colour: ColourInput,
    /// Image that multiplies the colour.
    pub colour_texture: Option<TextureRef>,
    /// Perceptual roughness of the fibres, 0 to 1; below 0.07 as at it.
    #[serde(deserialize_with = "early")]
    pub roughness: NumberInput,
    /// Image that multiplies it, by its red channel where it names no other.
    pub roughness_texture: Option<TextureRef>,
}

impl Default for Sheen {
    fn default() -> Self {
        Self { colour: ColourInput::default(), colour_texture: None, roughness: 0.5.into(), roughness_texture: None }
    }
}

/// Facets that are rougher along one direction than across it, as on brushed metal (KHR_materials_anisotropy).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Anisotropy {
    /// From 0, as rough either way, to 1: α along the direction goes to one with its square.
    #[serde(deserialize_with = "early")]
    pub strength: NumberInput,
    /// Angle in degrees from the way in which the texture coordinate u grows to the rougher direction, counter-clockwise.
    pub rotation: f64,
    /// Image of that direction in red and green, from −1 to 1 over the codes, turned by the angle, and of a factor of the strength in
    /// blue. Its texture's colour space must be linear.
    pub texture: Option<TextureRef>,
}

impl Default for Anisotropy {
    fn default() -> Self {
        Self { strength: 0.5.into(), rotation: 0.0, texture: None }
    }
}

/// A film as thin as light's waves on the facets (KHR_materials_iridescence).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Iridescence {
    /// Share of the surface that has it, 0 to 1.
    #[serde(deserialize_with = "early")]
    pub factor: NumberInput,
    /// Image that multiplies it, by its red channel where it names no other.
    pub factor_texture: Option<TextureRef>,
    /// Index of refraction of the film, 1 to 1000.
    pub ior: f64,
    /// Thickness in nanometres, 0 to 1e6.
    #[serde(deserialize_with = "early")]
    pub thickness: NumberInput,
    /// Image by which the thickness goes from `thinnest` to `thickness`, by its red channel where it names no other.
    pub thickness_texture: Option<TextureRef>,
    /// Thickness in nanometres where that image is black.
    pub thinnest: f64,
}

impl Default for Iridescence {
    fn default() -> Self {
        Self {
            factor: 1.0.into(),
            factor_texture: None,
            ior: 1.3,
            thickness: 400.0.into(),
            thickness_texture: None,
            thinnest: 100.0,
        }
    }
}

/// What is diffused to the other side, as by leaves and paper (KHR_materials_diffuse_transmission).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DiffuseTransmission {
    /// Share of diffused light that goes through, 0 to 1.
    #[serde(deserialize_with = "early")]
    pub factor: NumberInput,
    /// Image that multiplies it, by its red channel where it names no other.
    pub factor_texture: Option<TextureRef>,
    /// Its colour.
    pub colour: ColourInput,
    /// Image that multiplies the colour.
    pub colour_texture: Option<TextureRef>,
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self { factor: 0.5.into(), factor_texture: None, colour: ColourInput::default(), colour_texture: None }
    }
}

/// Complex index of refraction n + ik of a metal in red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Conductor {
    /// Real part n, from 0.001 to 1000.
    pub n: Colour,
    /// Imaginary part k, from 0 to 1000.
    pub k: Colour,
}
