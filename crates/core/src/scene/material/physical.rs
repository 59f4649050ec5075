//! The physical family of materials: what a file says of one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::input::{Colour, ColourInput, NumberInput, TextureRef, Varying, early};

/// The metallic-roughness model of glTF 2.0. Every factor multiplies its texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Physical {
    /// Base colour, linear.
    pub base_colour: ColourInput,
    /// Image that multiplies the base colour.
    pub base_colour_texture: Option<TextureRef>,
    /// Whether the colours of the mesh's vertices multiply the base colour.
    pub vertex_colours: bool,
    /// 0 dielectric to 1 metal.
    #[serde(deserialize_with = "early")]
    pub metallic: NumberInput,
    /// Perceptual roughness, 0 mirror to 1 matte; the microfacet α is its square.
    #[serde(deserialize_with = "early")]
    pub roughness: NumberInput,
    /// Image with roughness in green and metalness in blue.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Image of directions about the normal: red along the way in which u grows, green up in the image, blue outwards, each
    /// from −1 to 1 over the codes. Its texture's colour space must be linear.
    pub normal_texture: Option<TextureRef>,
    /// Factor of the image's red and green directions; 0: the surface is smooth.
    pub normal_scale: f64,
    /// Index of refraction, from 1 to 1000; what varies is clamped to that where it is read.
    #[serde(deserialize_with = "early")]
    pub ior: NumberInput,
    /// Share of light that passes through the surface instead of being diffused, 0 to 1; what varies is clamped to that.
    #[serde(deserialize_with = "early")]
    pub transmission: NumberInput,
    /// Image whose red channel, where it names no other, multiplies the transmission.
    pub transmission_texture: Option<TextureRef>,
    /// Colour that white light has after `attenuation_distance` inside.
    pub attenuation_colour: Colour,
    /// Distance in metres after which light inside has the `attenuation_colour`, above zero; none: nothing is absorbed.
    pub attenuation_distance: Option<f64>,
    /// Radiance given off.
    #[serde(deserialize_with = "early")]
    pub emission: ColourInput,
    /// Image that multiplies the emission.
    pub emission_texture: Option<TextureRef>,
    /// What the alpha of the base colour means.
    pub alpha: AlphaMode,
    /// Alpha that multiplies the texture's.
    #[serde(deserialize_with = "early")]
    pub opacity: NumberInput,
    /// Whether the base colour is shown as it is, without light.
    pub unlit: bool,
}

impl Default for Physical {
    fn default() -> Self {
        Self {
            base_colour: ColourInput::default(),
            base_colour_texture: None,
            vertex_colours: false,
            metallic: 0.0.into(),
            roughness: 1.0.into(),
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            ior: 1.5.into(),
            transmission: 0.0.into(),
            transmission_texture: None,
            attenuation_colour: Colour([1.0; 3]),
            attenuation_distance: None,
            emission: Colour::BLACK.into(),
            emission_texture: None,
            alpha: AlphaMode::Opaque,
            opacity: 1.0.into(),
            unlit: false,
        }
    }
}

/// The inputs by their keys, for whatever is asked of all of them.
macro_rules! inputs {
    ($($key:ident),*) => {
        impl Physical {
            /// Every input, and every image that multiplies one, with its key.
            pub fn inputs(&self) -> Vec<(&'static str, &dyn Varying)> {
                vec![$((stringify!($key), &self.$key)),*]
            }

            /// The same, to be changed.
            pub fn inputs_mut(&mut self) -> Vec<&mut dyn Varying> {
                vec![$(&mut self.$key),*]
            }
        }
    };
}
inputs!(
    base_colour,
    base_colour_texture,
    metallic,
    roughness,
    metallic_roughness_texture,
    normal_texture,
    ior,
    transmission,
    transmission_texture,
    emission,
    emission_texture,
    opacity
);

impl Physical {
    /// Indices of refraction that it may have.
    pub const IOR: [f64; 2] = [1.0, 1e3];

    /// What it absorbs of light that passes through it, per metre; none where it absorbs nothing.
    pub fn absorption(&self) -> Option<[f64; 3]> {
        let distance =
            self.attenuation_distance.filter(|_| self.may_transmit() && self.attenuation_colour != Colour([1.0; 3]))?;
        Some(self.attenuation_colour.0.map(|colour| -libm::log(colour) / distance))
    }

    /// The image that bends its normals, where light asks for them.
    pub fn bent_by(&self) -> Option<&TextureRef> {
        self.normal_texture.as_ref().filter(|_| self.normal_scale != 0.0 && !self.unlit)
    }

    /// Whether light may pass through it somewhere.
    pub fn may_transmit(&self) -> bool {
        self.transmission != 0.0.into()
    }
}

/// What the alpha channel of a base colour means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AlphaMode {
    /// Nothing.
    #[default]
    Opaque,
    /// The surface is absent where alpha is below the cutoff.
    Mask {
        /// Cutoff, 0 to 1.
        cutoff: f64,
    },
    /// The surface covers what is behind it by alpha.
    Blend,
}
