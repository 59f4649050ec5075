//! The physical family of materials, as in a file.

use serde::{Deserialize, Serialize};

use super::super::field::FieldBounds::{Any, Finite, Length, Within};
use super::super::field::{
    FieldBounds, FieldValue, MaterialField, MaterialFields, fields, file_struct,
};
use super::super::input::{Colour, ColourInput, NumberInput, TextureRef, early};
use super::layers::{
    Anisotropy, Clearcoat, Conductor, DiffuseTransmission, IOR, Iridescence, SHARE, Sheen,
};

/// Passes the list of the model's fields to a macro, each as `key: Type = DEFAULT, BOUNDS,
/// Effect;`, see [`file_struct`].
macro_rules! physical_fields {
    ($then:ident) => {
        $then! {
            /// The metallic-roughness model of glTF 2.0 with its extensions. Every factor
            /// multiplies its texture.
            Physical
            /// Base colour, linear.
            base_colour: ColourInput = ColourInput::default(), FieldBounds::Light;
            /// Image that multiplies the base colour.
            base_colour_texture: Option<TextureRef> = None, Any;
            /// Whether the mesh's vertex colours multiply the base colour.
            vertex_colours: bool = false, Any, VertexColours;
            /// 0 dielectric to 1 metal.
            #[serde(deserialize_with = "early")]
            metallic: NumberInput = 0.0.into(), SHARE;
            /// Perceptual roughness, 0 mirror to 1 matte; the microfacet α is its square.
            #[serde(deserialize_with = "early")]
            roughness: NumberInput = 1.0.into(), SHARE;
            /// Image with roughness in green and metalness in blue.
            metallic_roughness_texture: Option<TextureRef> = None, Any;
            /// Normal map: red along the direction of growing u, green up in the image, blue
            /// outwards, each from −1 to 1 over the codes. Its texture's colour space must be
            /// linear.
            normal_texture: Option<TextureRef> = None, Any, NormalMaps;
            /// Factor of the normal map's red and green components; at 0 the map has no effect.
            normal_scale: f64 = 1.0, Finite;
            /// Index of refraction, from 1 to 1000; a varying value is clamped to that range. 0:
            /// the dielectric part reflects all light at every angle, reduced only by `specular`
            /// and its colour, and transmits none.
            #[serde(deserialize_with = "early")]
            ior: NumberInput = 1.5.into(), FieldBounds::ZeroOrWithin(IOR[0], IOR[1]);
            /// Share of light that passes through the surface instead of being diffused, 0 to 1; a
            /// varying value is clamped to that range.
            #[serde(deserialize_with = "early")]
            transmission: NumberInput = 0.0.into(), SHARE, Refraction;
            /// Image that multiplies the transmission, by its red channel unless it names another.
            transmission_texture: Option<TextureRef> = None, Any, Refraction;
            /// Colour of white light after `attenuation_distance` inside.
            attenuation_colour: Colour = Colour([1.0; 3]), SHARE;
            /// Distance in metres after which light inside has the `attenuation_colour`, above
            /// zero; none: no absorption.
            attenuation_distance: Option<f64> = None, Length, Absorption;
            /// Whether the surface is a thin wall without an inside, which does not refract;
            /// otherwise it bounds a body.
            thin_walled: bool = false, Any, ThinWalls;
            /// Priority of the body where several bodies overlap: light is in the body of the
            /// greatest priority, of equal ones in the last entered. Where no visible body of glass
            /// has a priority above zero, each boundary refracts as from and into air.
            priority: u32 = 0, Any, NestedMedia;
            /// Strength of dispersion: 20 over the Abbe number, from 0 (none) to 400.
            dispersion: f64 = 0.0, Within(0.0, 400.0), Dispersion;
            /// Factor on the reflection of the dielectric part, 0 to 1.
            #[serde(deserialize_with = "early")]
            specular: NumberInput = 1.0.into(), SHARE, TintedReflection;
            /// Image that multiplies `specular`, by its red channel unless it names another.
            specular_texture: Option<TextureRef> = None, Any, TintedReflection;
            /// Colour of the dielectric part's reflection at normal incidence; may be above one.
            specular_colour: ColourInput = Colour::WHITE.into(), FieldBounds::Light, TintedReflection;
            /// Image that multiplies `specular_colour`.
            specular_colour_texture: Option<TextureRef> = None, Any, TintedReflection;
            /// Complex index of the metallic part, in place of the base colour.
            conductor: Option<Conductor> = None, Any, Conductors;
            /// Light diffused to the other side.
            diffuse_transmission: Option<DiffuseTransmission> = None, Any, DiffuseTransmission;
            /// Microfacets that are rougher along one direction.
            anisotropy: Option<Anisotropy> = None, Any, Anisotropy;
            /// A thin film on the microfacets.
            iridescence: Option<Iridescence> = None, Any, Iridescence;
            /// Fibres over the layers above.
            sheen: Option<Sheen> = None, Any, Sheen;
            /// A clear coat over everything.
            clearcoat: Option<Clearcoat> = None, Any, Clearcoat;
            /// Emitted radiance.
            #[serde(deserialize_with = "early")]
            emission: ColourInput = Colour::BLACK.into(), FieldBounds::Light, Emission;
            /// Image that multiplies the emission.
            emission_texture: Option<TextureRef> = None, Any;
            /// Meaning of the base colour's alpha.
            alpha: AlphaMode = AlphaMode::Opaque, Any, Transparency;
            /// Alpha that multiplies the texture's alpha.
            #[serde(deserialize_with = "early")]
            opacity: NumberInput = 1.0.into(), SHARE;
            /// Whether the base colour is shown as it is, without lighting.
            unlit: bool = false, Any;
        }
    };
}
pub(crate) use physical_fields;

physical_fields!(file_struct);

impl FieldValue for AlphaMode {}

impl Physical {
    /// Least and greatest index of refraction.
    pub const IOR: [f64; 2] = IOR;

    /// Returns the absorption coefficient per metre of transmitted light, or `None` without
    /// absorption.
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

    /// Returns the normal map where it changes shading.
    pub fn bent_by(&self) -> Option<&TextureRef> {
        self.normal_texture
            .as_ref()
            .filter(|_| self.normal_scale != 0.0 && !self.unlit)
    }

    /// Returns the emission, or `None` for black. An unlit material shows its base colour alone
    /// (KHR_materials_unlit).
    pub fn gives_off(&self) -> Option<&ColourInput> {
        Some(&self.emission).filter(|emission| **emission != Colour::BLACK.into() && !self.unlit)
    }

    /// Whether the material may transmit light without diffusing it.
    pub fn may_transmit(&self) -> bool {
        self.transmission != 0.0.into() && self.ior != 0.0.into() && !self.unlit
    }

    /// Whether the material bounds a body with a priority.
    pub fn is_nested(&self) -> bool {
        self.priority > 0 && self.may_transmit() && !self.thin_walled
    }

    /// Whether the material may diffuse light to the other side.
    pub fn may_diffuse_through(&self) -> bool {
        self.diffuse_transmission
            .as_ref()
            .is_some_and(|layer| layer.factor != 0.0.into() && !self.unlit)
    }

    /// Whether the dielectric reflection differs from that of the index of refraction alone.
    pub fn tints_reflections(&self) -> bool {
        self.specular != 1.0.into() || self.specular_texture.is_some() || self.colours_reflections()
    }

    /// Returns the ratio of the dielectric reflection to that of the index of refraction, from 0 to
    /// 1, where the ratio is one constant for the whole dielectric part. A boundary of glass has
    /// its own layers, so it has no such ratio.
    pub fn factor_of_reflections(&self) -> Option<f64> {
        let even =
            self.specular_texture.is_none() && !self.colours_reflections() && !self.may_transmit();
        self.specular.constant().filter(|_| even)
    }

    fn colours_reflections(&self) -> bool {
        self.specular_colour != Colour::WHITE.into() || self.specular_colour_texture.is_some()
    }

    /// Returns the metal's complex index where the material may be metallic.
    pub fn metal(&self) -> Option<Conductor> {
        self.conductor.filter(|_| self.metallic != 0.0.into())
    }

    /// Returns the coat unless its factor is zero: a layer without effect counts as absent.
    pub fn coat(&self) -> Option<&Clearcoat> {
        self.clearcoat
            .as_ref()
            .filter(|layer| layer.factor != 0.0.into())
    }

    /// Returns the sheen, as [`Self::coat`].
    pub fn fibres(&self) -> Option<&Sheen> {
        self.sheen
            .as_ref()
            .filter(|layer| layer.colour != Colour::BLACK.into())
    }

    /// Returns the anisotropy, as [`Self::coat`].
    pub fn active_anisotropy(&self) -> Option<&Anisotropy> {
        self.anisotropy
            .as_ref()
            .filter(|layer| layer.strength != 0.0.into())
    }

    /// Returns the iridescence, as [`Self::coat`].
    pub fn film(&self) -> Option<&Iridescence> {
        let thick = |layer: &&Iridescence| {
            let images = layer.thickness_texture.is_some() && layer.thinnest > 0.0;
            layer.factor != 0.0.into() && (layer.thickness != 0.0.into() || images)
        };
        self.iridescence.as_ref().filter(thick)
    }

    /// Returns the texture use along which tangents are defined, where directions on the surface
    /// matter.
    pub fn directed_by(&self) -> Option<&TextureRef> {
        let coat = || {
            self.coat()
                .and_then(|coat| coat.normal_texture.as_ref())
                .filter(|_| !self.unlit)
        };
        let anisotropy = || {
            self.active_anisotropy()
                .and_then(|layer| layer.texture.as_ref())
                .filter(|_| !self.unlit)
        };
        self.bent_by().or_else(coat).or_else(anisotropy)
    }
}

/// Meaning of the base colour's alpha.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// The surface is absent where alpha is below the cutoff.
    Mask {
        /// Cutoff, at least 0; above 1 the surface is absent everywhere.
        cutoff: f64,
    },
    /// The surface covers the background by alpha.
    Blend,
}
