//! Layers of a physical material as in a scene file: the material extensions of glTF.

use serde::{Deserialize, Serialize};

use super::super::field::FieldBounds::{Any, Finite, Range};
use super::super::field::{
    FieldBounds, FieldValue, MaterialField, MaterialFields, fields, file_struct,
};
use super::super::input::{Colour, ColourInput, NumberInput, TextureRef, deserialize_early};

/// Bounds of a number, or of each channel of a colour, from 0 to 1.
pub(super) const SHARE: FieldBounds = Range(0.0, 1.0);

/// Least and greatest index of refraction.
pub(super) const IOR: [f64; 2] = [1.0, 1e3];
const INDICES: FieldBounds = Range(IOR[0], IOR[1]);

file_struct! {
    /// A clear coat of index 1.5 over all layers (KHR_materials_clearcoat).
    Clearcoat
    /// Share of the surface that the coat covers, 0 to 1.
    #[serde(deserialize_with = "deserialize_early")]
    factor: NumberInput = 1.0.into(), SHARE;
    /// Image that multiplies the share by its red channel, or by its `channel`.
    factor_texture: Option<TextureRef> = None, Any;
    /// Perceptual roughness of the coat, 0 to 1.
    #[serde(deserialize_with = "deserialize_early")]
    roughness: NumberInput = 0.0.into(), SHARE;
    /// Image that multiplies the roughness by its red channel, or by its `channel`.
    roughness_texture: Option<TextureRef> = None, Any;
    /// Normal map of the coat. None: the coat is smooth, even over a normal map of the surface.
    normal_texture: Option<TextureRef> = None, Any;
    /// Factor on the normal map's red and green components.
    normal_scale: f64 = 1.0, Finite;
}

file_struct! {
    /// Fibres that reflect light at grazing angles, as on velvet (KHR_materials_sheen).
    Sheen
    /// Colour, which is also the strength of the sheen.
    colour: ColourInput = ColourInput::default(), SHARE;
    /// Image that multiplies the colour.
    colour_texture: Option<TextureRef> = None, Any;
    /// Perceptual roughness of the fibres, 0 to 1; values below 0.07 act as 0.07.
    #[serde(deserialize_with = "deserialize_early")]
    roughness: NumberInput = 0.5.into(), SHARE;
    /// Image that multiplies the roughness by its red channel, or by its `channel`.
    roughness_texture: Option<TextureRef> = None, Any;
}

file_struct! {
    /// Microfacets that are rougher along one direction than across it, as on brushed metal
    /// (KHR_materials_anisotropy).
    Anisotropy
    /// Strength from 0 (equally rough in both directions) to 1. With the square of the strength,
    /// the microfacet α along the rougher direction rises from its isotropic value to 1.
    #[serde(deserialize_with = "deserialize_early")]
    strength: NumberInput = 0.5.into(), SHARE;
    /// Angle in degrees from the direction of growing u to the rougher direction,
    /// counter-clockwise.
    rotation: f64 = 0.0, Finite;
    /// Image that changes direction and strength. Red and green give the rougher direction: codes
    /// map to −1 to 1, and `rotation` then turns the direction. Blue is a factor on the strength.
    /// The texture's colour space must be linear.
    texture: Option<TextureRef> = None, Any;
}

file_struct! {
    /// A thin film on the microfacets, about a wavelength thick (KHR_materials_iridescence).
    Iridescence
    /// Share of the surface that has the film, 0 to 1.
    #[serde(deserialize_with = "deserialize_early")]
    factor: NumberInput = 1.0.into(), SHARE;
    /// Image that multiplies the share by its red channel, or by its `channel`.
    factor_texture: Option<TextureRef> = None, Any;
    /// Index of refraction of the film, 1 to 1000.
    ior: f64 = 1.3, INDICES;
    /// Thickness in nanometres, 0 to 1e6.
    #[serde(deserialize_with = "deserialize_early")]
    thickness: NumberInput = 400.0.into(), Range(0.0, 1e6);
    /// Image that interpolates the thickness from `thinnest` to `thickness` by its red channel, or
    /// by its `channel`.
    thickness_texture: Option<TextureRef> = None, Any;
    /// Thickness in nanometres where `thickness_texture` is black.
    thinnest: f64 = 100.0, Range(0.0, 1e6);
}

file_struct! {
    /// Diffuse transmission, as by leaves and paper (KHR_materials_diffuse_transmission).
    DiffuseTransmission
    /// Share of the diffuse light that is transmitted instead of reflected, 0 to 1.
    #[serde(deserialize_with = "deserialize_early")]
    factor: NumberInput = 0.5.into(), SHARE;
    /// Image that multiplies the share by its red channel, or by its `channel`.
    factor_texture: Option<TextureRef> = None, Any;
    /// Colour of the transmitted diffuse light.
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
fields!(Conductor n: Range(1e-3, 1e3); k: Range(0.0, 1e3););
