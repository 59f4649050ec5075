//! The physical family of materials: what a file says of one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::input::{Colour, ColourInput, NumberInput, TextureRef, Varying, early};
use super::layers::{Anisotropy, Clearcoat, Conductor, DiffuseTransmission, Iridescence, Sheen};

/// The metallic-roughness model of glTF 2.0 with its extensions. Every factor multiplies its texture.
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
    /// Whether the surface is a wall too thin to bend light, without an inside; else it bounds a body.
    pub thin_walled: bool,
    /// Which body light is in where several overlap: the one of the greatest priority, of equal ones the one that it entered last. Where
    /// no shown body of glass has one above zero, each boundary bends light as from and into air.
    pub priority: u32,
    /// How much more short waves bend than long ones: 20 over the Abbe number, from 0, as none, to 400.
    pub dispersion: f64,
    /// Factor of what the dielectric part reflects, 0 to 1.
    #[serde(deserialize_with = "early")]
    pub specular: NumberInput,
    /// Image that multiplies it, by its red channel where it names no other.
    pub specular_texture: Option<TextureRef>,
    /// Colour of what the dielectric part reflects at normal incidence; may be above one.
    pub specular_colour: ColourInput,
    /// Image that multiplies that colour.
    pub specular_colour_texture: Option<TextureRef>,
    /// Complex index of the metallic part, in place of the base colour.
    pub conductor: Option<Conductor>,
    /// Light that is diffused to the other side.
    pub diffuse_transmission: Option<DiffuseTransmission>,
    /// Facets that are rougher one way.
    pub anisotropy: Option<Anisotropy>,
    /// A thin film on the facets.
    pub iridescence: Option<Iridescence>,
    /// Fibres over all this.
    pub sheen: Option<Sheen>,
    /// A clear coat over everything.
    pub clearcoat: Option<Clearcoat>,
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
            thin_walled: false,
            priority: 0,
            dispersion: 0.0,
            specular: 1.0.into(),
            specular_texture: None,
            specular_colour: Colour::WHITE.into(),
            specular_colour_texture: None,
            conductor: None,
            diffuse_transmission: None,
            anisotropy: None,
            iridescence: None,
            sheen: None,
            clearcoat: None,
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
    ([$($key:ident),*], $({$layer:ident: $($part:ident),*}),*) => {
        impl Physical {
            /// Every input, and every image that multiplies one, with its key.
            pub fn inputs(&self) -> Vec<(&'static str, &dyn Varying)> {
                let mut list: Vec<(&'static str, &dyn Varying)> = vec![$((stringify!($key), &self.$key)),*];
                $(if let Some(layer) = &self.$layer {
                    list.extend([$((concat!(stringify!($layer), ".", stringify!($part)), &layer.$part as &dyn Varying)),*]);
                })*
                list
            }

            /// The same, to be changed.
            pub fn inputs_mut(&mut self) -> Vec<&mut dyn Varying> {
                let mut list: Vec<&mut dyn Varying> = vec![$(&mut self.$key),*];
                $(if let Some(layer) = &mut self.$layer {
                    list.extend([$(&mut layer.$part as &mut dyn Varying),*]);
                })*
                list
            }
        }
    };
}
inputs!(
    [
        base_colour,
        base_colour_texture,
        metallic,
        roughness,
        metallic_roughness_texture,
        normal_texture,
        ior,
        transmission,
        transmission_texture,
        specular,
        specular_texture,
        specular_colour,
        specular_colour_texture,
        emission,
        emission_texture,
        opacity
    ],
    { diffuse_transmission: factor, factor_texture, colour, colour_texture },
    { anisotropy: strength, texture },
    { iridescence: factor, factor_texture, thickness, thickness_texture },
    { sheen: colour, colour_texture, roughness, roughness_texture },
    { clearcoat: factor, factor_texture, roughness, roughness_texture, normal_texture }
);

impl Physical {
    /// Indices of refraction that it may have.
    pub const IOR: [f64; 2] = [1.0, 1e3];

    /// What it absorbs of light that passes through it, per metre; none where it absorbs nothing.
    pub fn absorption(&self) -> Option<[f64; 3]> {
        let body = (self.may_transmit() || self.may_diffuse_through()) && !self.thin_walled;
        let distance = self.attenuation_distance.filter(|_| body && self.attenuation_colour != Colour([1.0; 3]))?;
        Some(self.attenuation_colour.0.map(|colour| -libm::log(colour) / distance))
    }

    /// The image that bends its normals, where light asks for them.
    pub fn bent_by(&self) -> Option<&TextureRef> {
        self.normal_texture.as_ref().filter(|_| self.normal_scale != 0.0 && !self.unlit)
    }

    /// Whether light may pass through it undiffused somewhere.
    pub fn may_transmit(&self) -> bool {
        self.transmission != 0.0.into()
    }

    /// Whether it bounds a body with a priority.
    pub fn is_nested(&self) -> bool {
        self.priority > 0 && self.may_transmit() && !self.thin_walled && !self.unlit
    }

    /// Whether light may be diffused to its other side somewhere.
    pub fn may_diffuse_through(&self) -> bool {
        self.diffuse_transmission.as_ref().is_some_and(|layer| layer.factor != 0.0.into())
    }

    /// Whether what its dielectric part reflects is not what its index says.
    pub fn tints_reflections(&self) -> bool {
        self.specular != 1.0.into() || self.specular_texture.is_some() || self.colours_reflections()
    }

    /// What its dielectric part reflects over what its index says, from 0 to 1, where that is one number and all of that part reflects so: a
    /// boundary of glass has layers of its own.
    pub fn factor_of_reflections(&self) -> Option<f64> {
        let even = self.specular_texture.is_none() && !self.colours_reflections() && !self.may_transmit();
        self.specular.constant().filter(|_| even)
    }

    fn colours_reflections(&self) -> bool {
        self.specular_colour != Colour::WHITE.into() || self.specular_colour_texture.is_some()
    }

    /// The complex index of its metal, where there may be some.
    pub fn metal(&self) -> Option<Conductor> {
        self.conductor.filter(|_| self.metallic != 0.0.into())
    }

    /// The layers that something is of: what a file names with a factor of zero is not there.
    pub fn coat(&self) -> Option<&Clearcoat> {
        self.clearcoat.as_ref().filter(|layer| layer.factor != 0.0.into())
    }

    /// As [`Self::coat`].
    pub fn fibres(&self) -> Option<&Sheen> {
        self.sheen.as_ref().filter(|layer| layer.colour != Colour::BLACK.into())
    }

    /// As [`Self::coat`].
    pub fn combed(&self) -> Option<&Anisotropy> {
        self.anisotropy.as_ref().filter(|layer| layer.strength != 0.0.into())
    }

    /// As [`Self::coat`].
    pub fn film(&self) -> Option<&Iridescence> {
        let thick = |layer: &&Iridescence| {
            let images = layer.thickness_texture.is_some() && layer.thinnest > 0.0;
            layer.factor != 0.0.into() && (layer.thickness != 0.0.into() || images)
        };
        self.iridescence.as_ref().filter(thick)
    }

    /// The image along which tangents go, where directions on the surface count.
    pub fn directed_by(&self) -> Option<&TextureRef> {
        let coat = || self.coat().and_then(|coat| coat.normal_texture.as_ref()).filter(|_| !self.unlit);
        let combed = || self.combed().and_then(|layer| layer.texture.as_ref()).filter(|_| !self.unlit);
        self.bent_by().or_else(coat).or_else(combed)
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
