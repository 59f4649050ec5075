//! What may lie over, under and in the metallic-roughness model: glTF's extensions of it, as a file
//! says them.

use serde::{Deserialize, Serialize};

use super::super::field::Bounds::{Any, Finite, Within};
use super::super::field::{Bounds, Field, FieldValue, Fields, fields, file_struct};
use super::super::input::{Colour, ColourInput, NumberInput, TextureRef, early};

/// Shares of a whole, and of a colour's channels.
pub(super) const SHARE: Bounds = Within(0.0, 1.0);

/// Least and greatest index of refraction.
pub(super) const IOR: [f64; 2] = [1.0, 1e3];
const INDICES: Bounds = Within(IOR[0], IOR[1]);

file_struct! {
    /// A clear coat of index 1.5 over everything (KHR_materials_clearcoat).
    Clearcoat
    /// Share of the surface that it covers, 0 to 1.
    #[serde(deserialize_with = "early")]
    factor: NumberInput = 1.0.into(), SHARE;
    /// Image that multiplies it, by its red channel where it names no other.
    factor_texture: Option<TextureRef> = None, Any;
    /// Perceptual roughness of the coat, 0 to 1.
    #[serde(deserialize_with = "early")]
    roughness: NumberInput = 0.0.into(), SHARE;
    /// Image that multiplies it, by its red channel where it names no other.
    roughness_texture: Option<TextureRef> = None, Any;
    /// Image of directions about the coat's normal; none: it is smooth, whatever bends the surface
    /// below.
    normal_texture: Option<TextureRef> = None, Any;
    /// Factor of the image's red and green directions.
    normal_scale: f64 = 1.0, Finite;
}

file_struct! {
    /// Fibres that catch light at grazing angles, as on velvet (KHR_materials_sheen).
    Sheen
    /// Colour, which is also how much of it there is.
    colour: ColourInput = ColourInput::default(), SHARE;
    /// Image that multiplies the colour.
    colour_texture: Option<TextureRef> = None, Any;
    /// Perceptual roughness of the fibres, 0 to 1; below 0.07 as at it.
    #[serde(deserialize_with = "early")]
    roughness: NumberInput = 0.5.into(), SHARE;
    /// Image that multiplies it, by its red channel where it names no other.
    roughness_texture: Option<TextureRef> = None, Any;
}

file_struct! {
    /// Facets that are rougher along one direction than across it, as on brushed metal
    /// (KHR_materials_anisotropy).
    Anisotropy
    /// From 0, as rough either way, to 1: α along the direction goes to one with its square.
    #[serde(deserialize_with = "early")]
    strength: NumberInput = 0.5.into(), SHARE;
    /// Angle in degrees from the way in which the texture coordinate u grows to the rougher
    /// direction, counter-clockwise.
    rotation: f64 = 0.0, Finite;
    /// Image of that direction in red and green, from −1 to 1 over the codes, turned by the angle,
    /// and of a factor of the strength in blue. Its texture's colour space must be linear.
    texture: Option<TextureRef> = None, Any;
}

file_struct! {
    /// A film as thin as light's waves on the facets (KHR_materials_iridescence).
    Iridescence
    /// Share of the surface that has it, 0 to 1.
    #[serde(deserialize_with = "early")]
    factor: NumberInput = 1.0.into(), SHARE;
    /// Image that multiplies it, by its red channel where it names no other.
    factor_texture: Option<TextureRef> = None, Any;
    /// Index of refraction of the film, 1 to 1000.
    ior: f64 = 1.3, INDICES;
    /// Thickness in nanometres, 0 to 1e6.
    #[serde(deserialize_with = "early")]
    thickness: NumberInput = 400.0.into(), Within(0.0, 1e6);
    /// Image by which the thickness goes from `thinnest` to `thickness`, by its red channel where
    /// it names no other.
    thickness_texture: Option<TextureRef> = None, Any;
    /// Thickness in nanometres where that image is black.
    thinnest: f64 = 100.0, Within(0.0, 1e6);
}

file_struct! {
    /// What is diffused to the other side, as by leaves and paper
    /// (KHR_materials_diffuse_transmission).
    DiffuseTransmission
    /// Share of diffused light that goes through, 0 to 1.
    #[serde(deserialize_with = "early")]
    factor: NumberInput = 0.5.into(), SHARE;
    /// Image that multiplies it, by its red channel where it names no other.
    factor_texture: Option<TextureRef> = None, Any;
    /// Its colour.
    colour: ColourInput = ColourInput::default(), SHARE;
    /// Image that multiplies the colour.
    colour_texture: Option<TextureRef> = None, Any;
}

/// Complex index of refraction n + ik of a metal in red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Conductor {
    /// Real part n, from 0.001 to 1000.
    pub n: Colour,
    /// Imaginary part k, from 0 to 1000.
    pub k: Colour,
}
fields!(Conductor n: Within(1e-3, 1e3); k: Within(0.0, 1e3););
