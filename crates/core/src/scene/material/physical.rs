//! The physical family of materials: what a file says of one.

use serde::{Deserialize, Serialize};

use super::super::field::Bounds::{Any, Finite, Length, Within};
use super::super::field::{Bounds, Field, FieldValue, Fields, fields, file_struct};
use super::super::input::{Colour, ColourInput, NumberInput, TextureRef, early};
use super::layers::{
    Anisotropy, Clearcoat, Conductor, DiffuseTransmission, IOR, Iridescence, SHARE, Sheen,
};

/// Hands the list of the model's fields to a macro, each as `key: Type = DEFAULT, BOUNDS, Effect;`,
/// see [`file_struct`].
macro_rules! physical_fields {
    ($then:ident) => {
        $then! {
            /// The metallic-roughness model of glTF 2.0 with its extensions. Every factor
            /// multiplies its texture.
            Physical
            /// Base colour, linear.
            base_colour: ColourInput = ColourInput::default(), Bounds::Light;
            /// Image that multiplies the base colour.
            base_colour_texture: Option<TextureRef> = None, Any;
            /// Whether the colours of the mesh's vertices multiply the base colour.
            vertex_colours: bool = false, Any, VertexColours;
            /// 0 dielectric to 1 metal.
            #[serde(deserialize_with = "early")]
            metallic: NumberInput = 0.0.into(), SHARE;
            /// Perceptual roughness, 0 mirror to 1 matte; the microfacet α is its square.
            #[serde(deserialize_with = "early")]
            roughness: NumberInput = 1.0.into(), SHARE;
            /// Image with roughness in green and metalness in blue.
            metallic_roughness_texture: Option<TextureRef> = None, Any;
            /// Image of directions about the normal: red along the way in which u grows, green up
            /// in the image, blue outwards, each from −1 to 1 over the codes. Its texture's colour
            /// space must be linear.
            normal_texture: Option<TextureRef> = None, Any, NormalMaps;
            /// Factor of the image's red and green directions; 0: the surface is smooth.
            normal_scale: f64 = 1.0, Finite;
            /// Index of refraction, from 1 to 1000; what varies is clamped to that where it is
            /// read. 0: the dielectric part reflects all light at every angle but what `specular`
            /// and its colour take away, and lets none through.
            #[serde(deserialize_with = "early")]
            ior: NumberInput = 1.5.into(), Bounds::ZeroOrWithin(IOR[0], IOR[1]);
            /// Share of light that passes through the surface instead of being diffused, 0 to 1;
            /// what varies is clamped to that.
            #[serde(deserialize_with = "early")]
            transmission: NumberInput = 0.0.into(), SHARE, Refraction;
            /// Image whose red channel, where it names no other, multiplies the transmission.
            transmission_texture: Option<TextureRef> = None, Any, Refraction;
            /// Colour that white light has after `attenuation_distance` inside.
            attenuation_colour: Colour = Colour([1.0; 3]), SHARE;
            /// Distance in metres after which light inside has the `attenuation_colour`, above
            /// zero; none: nothing is absorbed.
            attenuation_distance: Option<f64> = None, Length, Absorption;
            /// Whether the surface is a wall too thin to bend light, without an inside; else it
            /// bounds a body.
            thin_walled: bool = false, Any, ThinWalls;
            /// Which body light is in where several overlap: the one of the greatest priority, of
            /// equal ones the one that it entered last. Where no shown body of glass has one above
            /// zero, each boundary bends light as from and into air.
            priority: u32 = 0, Any, NestedMedia;
            /// How much more short waves bend than long ones: 20 over the Abbe number, from 0, as
            /// none, to 400.
            dispersion: f64 = 0.0, Within(0.0, 400.0), Dispersion;
            /// Factor of what the dielectric part reflects, 0 to 1.
            #[serde(deserialize_with = "early")]
            specular: NumberInput = 1.0.into(), SHARE, TintedReflection;
            /// Image that multiplies it, by its red channel where it names no other.
            specular_texture: Option<TextureRef> = None, Any, TintedReflection;
            /// Colour of what the dielectric part reflects at normal incidence; may be above one.
            specular_colour: ColourInput = Colour::WHITE.into(), Bounds::Light, TintedReflection;
            /// Image that multiplies that colour.
            specular_colour_texture: Option<TextureRef> = None, Any, TintedReflection;
            /// Complex index of the metallic part, in place of the base colour.
            conductor: Option<Conductor> = None, Any, Conductors;
            /// Light that is diffused to the other side.
            diffuse_transmission: Option<DiffuseTransmission> = None, Any, DiffuseTransmission;
            /// Facets that are rougher one way.
            anisotropy: Option<Anisotropy> = None, Any, Anisotropy;
            /// A thin film on the facets.
            iridescence: Option<Iridescence> = None, Any, Iridescence;
            /// Fibres over all this.
            sheen: Option<Sheen> = None, Any, Sheen;
            /// A clear coat over everything.
            clearcoat: Option<Clearcoat> = None, Any, Clearcoat;
            /// Radiance given off.
            #[serde(deserialize_with = "early")]
            emission: ColourInput = Colour::BLACK.into(), Bounds::Light, Emission;
            /// Image that multiplies the emission.
            emission_texture: Option<TextureRef> = None, Any;
            /// What the alpha of the base colour means.
            alpha: AlphaMode = AlphaMode::Opaque, Any, Transparency;
            /// Alpha that multiplies the texture's.
            #[serde(deserialize_with = "early")]
            opacity: NumberInput = 1.0.into(), SHARE;
            /// Whether the base colour is shown as it is, without light.
            unlit: bool = false, Any;
        }
    };
}
pub(crate) use physical_fields;

physical_fields!(file_struct);

impl FieldValue for AlphaMode {}

impl Physical {
    /// Least and greatest index of refraction that it may have.
    pub const IOR: [f64; 2] = IOR;

    /// What it absorbs of light that passes through it, per metre; none where it absorbs nothing.
    pub fn absorption(&self) -> Option<[f64; 3]> {
        let body = (self.may_transmit() || self.may_diffuse_through()) && !self.thin_walled;
        let distance = self
            .attenuation_distance
            .filter(|_| body && self.attenuation_colour != Colour([1.0; 3]))?;
        Some(
            self.attenuation_colour
                .0
                .map(|colour| -libm::log(colour) / distance),
        )
    }

    /// The image that bends its normals, where light asks for them.
    pub fn bent_by(&self) -> Option<&TextureRef> {
        self.normal_texture
            .as_ref()
            .filter(|_| self.normal_scale != 0.0 && !self.unlit)
    }

    /// What it gives off; none where it is nothing. What is unlit shows its base colour alone
    /// (KHR_materials_unlit).
    pub fn gives_off(&self) -> Option<&ColourInput> {
        Some(&self.emission).filter(|emission| **emission != Colour::BLACK.into() && !self.unlit)
    }

    /// Whether light may pass through it undiffused somewhere.
    pub fn may_transmit(&self) -> bool {
        self.transmission != 0.0.into() && self.ior != 0.0.into() && !self.unlit
    }

    /// Whether it bounds a body with a priority.
    pub fn is_nested(&self) -> bool {
        self.priority > 0 && self.may_transmit() && !self.thin_walled
    }

    /// Whether light may be diffused to its other side somewhere.
    pub fn may_diffuse_through(&self) -> bool {
        self.diffuse_transmission
            .as_ref()
            .is_some_and(|layer| layer.factor != 0.0.into() && !self.unlit)
    }

    /// Whether what its dielectric part reflects is not what its index says.
    pub fn tints_reflections(&self) -> bool {
        self.specular != 1.0.into() || self.specular_texture.is_some() || self.colours_reflections()
    }

    /// What its dielectric part reflects over what its index says, from 0 to 1, where that is one
    /// number and all of that part reflects so: a boundary of glass has layers of its own.
    pub fn factor_of_reflections(&self) -> Option<f64> {
        let even =
            self.specular_texture.is_none() && !self.colours_reflections() && !self.may_transmit();
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
        self.clearcoat
            .as_ref()
            .filter(|layer| layer.factor != 0.0.into())
    }

    /// As [`Self::coat`].
    pub fn fibres(&self) -> Option<&Sheen> {
        self.sheen
            .as_ref()
            .filter(|layer| layer.colour != Colour::BLACK.into())
    }

    /// As [`Self::coat`].
    pub fn combed(&self) -> Option<&Anisotropy> {
        self.anisotropy
            .as_ref()
            .filter(|layer| layer.strength != 0.0.into())
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
        let coat = || {
            self.coat()
                .and_then(|coat| coat.normal_texture.as_ref())
                .filter(|_| !self.unlit)
        };
        let combed = || {
            self.combed()
                .and_then(|layer| layer.texture.as_ref())
                .filter(|_| !self.unlit)
        };
        self.bent_by().or_else(coat).or_else(combed)
    }
}

/// What the alpha channel of a base colour means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AlphaMode {
    /// Nothing.
    #[default]
    Opaque,
    /// The surface is absent where alpha is below the cutoff.
    Mask {
        /// Cutoff, 0 to 1; above it, nothing is there.
        cutoff: f64,
    },
    /// The surface covers what is behind it by alpha.
    Blend,
}
