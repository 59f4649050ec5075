//! The physical family of materials, as in a scene file.

use serde::{Deserialize, Serialize};

use super::super::Medium;
use super::super::field::FieldBounds::{Any, Finite, Length, Range};
use super::super::field::{
    FieldBounds, FieldValue, MaterialField, MaterialFields, fields, file_struct,
};
use super::super::input::{Colour, ColourInput, NumberInput, TextureRef, deserialize_early};
use super::layers::{
    Anisotropy, Clearcoat, Conductor, DiffuseTransmission, IOR, Iridescence, SHARE, Sheen,
};

/// Passes the list of the model's fields to a macro. Each field is `key: Type = DEFAULT, BOUNDS,
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
            /// Share of metal, 0 (dielectric) to 1 (metal).
            #[serde(deserialize_with = "deserialize_early")]
            metallic: NumberInput = 0.0.into(), SHARE;
            /// Perceptual roughness, 0 (mirror) to 1 (matte); the microfacet α is its square.
            #[serde(deserialize_with = "deserialize_early")]
            roughness: NumberInput = 1.0.into(), SHARE;
            /// Image with roughness in green and metalness in blue.
            metallic_roughness_texture: Option<TextureRef> = None, Any;
            /// Normal map: red along the direction of growing u, green up in the image, blue
            /// outwards; codes map to −1 to 1. The texture's colour space must be linear.
            normal_texture: Option<TextureRef> = None, Any, NormalMaps;
            /// Factor on the normal map's red and green components. At 0 the map has no effect.
            normal_scale: f64 = 1.0, Finite;
            /// Index of refraction, from 1 to 1000; a varying value is clamped to this range. At 0,
            /// the dielectric part reflects all light at every angle and transmits none. Only
            /// `specular` and `specular_colour` reduce this reflection.
            #[serde(deserialize_with = "deserialize_early")]
            ior: NumberInput = 1.5.into(), FieldBounds::ZeroOrWithin(IOR[0], IOR[1]);
            /// Share of the light that is transmitted instead of diffused, 0 to 1; a varying value
            /// is clamped to this range.
            #[serde(deserialize_with = "deserialize_early")]
            transmission: NumberInput = 0.0.into(), SHARE, Refraction;
            /// Image that multiplies the transmission by its red channel, or by its `channel`.
            transmission_texture: Option<TextureRef> = None, Any, Refraction;
            /// Colour of white light after it has travelled `attenuation_distance` inside the body.
            attenuation_colour: Colour = Colour([1.0; 3]), SHARE;
            /// Distance in metres after which white light inside the body has the
            /// `attenuation_colour`, above zero. None: no absorption.
            attenuation_distance: Option<f64> = None, Length, Absorption;
            /// Medium inside the body, which scatters and absorbs light; in place of
            /// `attenuation_colour` and `attenuation_distance`.
            interior: Option<Medium> = None, Any, ScatteringMedia;
            /// Boundary of the body: its surface, or none for a cloud.
            boundary: Boundary = Boundary::Surface, Any;
            /// Whether the surface is a thin wall, which has no inside and does not refract.
            /// Otherwise the surface bounds a solid body.
            thin_walled: bool = false, Any, ThinWalls;
            /// Priority of the body where several bodies overlap. In an overlap, light is in the
            /// body of the greatest priority. Among equal priorities, it is in the body that it
            /// entered last. If no visible body of glass has a priority above zero, each boundary
            /// refracts as between air and the body.
            priority: u32 = 0, Any, NestedMedia;
            /// Strength of dispersion: 20 over the Abbe number, from 0 (none) to 400.
            dispersion: f64 = 0.0, Range(0.0, 400.0), Dispersion;
            /// Factor on the dielectric part's reflectance, 0 to 1.
            #[serde(deserialize_with = "deserialize_early")]
            specular: NumberInput = 1.0.into(), SHARE, TintedReflection;
            /// Image that multiplies `specular` by its red channel, or by its `channel`.
            specular_texture: Option<TextureRef> = None, Any, TintedReflection;
            /// Colour of the dielectric part's reflectance at normal incidence; it may be above 1.
            specular_colour: ColourInput = Colour::WHITE.into(), FieldBounds::Light, TintedReflection;
            /// Image that multiplies `specular_colour`.
            specular_colour_texture: Option<TextureRef> = None, Any, TintedReflection;
            /// Complex index of refraction of the metallic part, in place of the base colour.
            conductor: Option<Conductor> = None, Any, Conductors;
            /// Diffuse transmission, as by leaves and paper.
            diffuse_transmission: Option<DiffuseTransmission> = None, Any, DiffuseTransmission;
            /// Microfacets that are rougher along one direction than across it.
            anisotropy: Option<Anisotropy> = None, Any, Anisotropy;
            /// A thin film on the microfacets.
            iridescence: Option<Iridescence> = None, Any, Iridescence;
            /// Fibres over all layers except the clear coat.
            sheen: Option<Sheen> = None, Any, Sheen;
            /// A clear coat over all layers.
            clearcoat: Option<Clearcoat> = None, Any, Clearcoat;
            /// Emitted radiance.
            #[serde(deserialize_with = "deserialize_early")]
            emission: ColourInput = Colour::BLACK.into(), FieldBounds::Light, Emission;
            /// Image that multiplies the emission.
            emission_texture: Option<TextureRef> = None, Any;
            /// Meaning of the base colour's alpha.
            alpha: AlphaMode = AlphaMode::Opaque, Any, Transparency;
            /// Factor on the alpha of the base colour's texture.
            #[serde(deserialize_with = "deserialize_early")]
            opacity: NumberInput = 1.0.into(), SHARE;
            /// Whether the base colour is shown without lighting.
            unlit: bool = false, Any;
        }
    };
}
pub(crate) use physical_fields;

physical_fields!(file_struct);

impl FieldValue for AlphaMode {}
impl FieldValue for Boundary {}

impl Physical {
    /// Least and greatest index of refraction.
    pub const IOR: [f64; 2] = IOR;

    /// Whether light can enter the body that the surface bounds.
    pub fn bounds_body(&self) -> bool {
        (self.may_transmit() || self.may_transmit_diffusely() || self.boundary == Boundary::None)
            && !self.thin_walled
    }

    /// Returns the coefficient per metre of `attenuation_colour` after `attenuation_distance`.
    pub fn attenuation(&self) -> Option<[f64; 3]> {
        let distance = self.attenuation_distance?;
        let of_channel = |colour: f64| -libm::log(colour) / distance;
        Some(self.attenuation_colour.0.map(of_channel))
    }

    /// Returns the absorption coefficient per metre inside a body that scatters nothing, or `None`
    /// without absorption.
    pub fn absorption(&self) -> Option<[f64; 3]> {
        let absorption = match &self.interior {
            Some(medium) => medium.even_absorption()?,
            None => self.attenuation()?,
        };
        Some(absorption).filter(|&a| self.bounds_body() && a != [0.0; 3])
    }

    /// Returns the medium inside the body if it scatters light or its density varies.
    pub fn scattering_medium(&self) -> Option<&Medium> {
        self.interior
            .as_ref()
            .filter(|medium| self.bounds_body() && medium.even_absorption().is_none())
    }

    /// Returns the normal map, or `None` if it has no effect on shading.
    pub fn active_normal_map(&self) -> Option<&TextureRef> {
        self.normal_texture
            .as_ref()
            .filter(|_| self.normal_scale != 0.0 && !self.unlit)
    }

    /// Returns the emission, or `None` if it is black or the material is unlit: an unlit material
    /// shows only its base colour (KHR_materials_unlit).
    pub fn active_emission(&self) -> Option<&ColourInput> {
        Some(&self.emission).filter(|emission| **emission != Colour::BLACK.into() && !self.unlit)
    }

    /// Whether the material may transmit light other than diffusely.
    pub fn may_transmit(&self) -> bool {
        self.transmission != 0.0.into() && self.ior != 0.0.into() && !self.unlit
    }

    /// Whether the material bounds a transmissive body with a priority above zero.
    pub fn has_priority(&self) -> bool {
        let is_boundary = self.may_transmit() || self.boundary == Boundary::None;
        self.priority > 0 && is_boundary && !self.thin_walled
    }

    /// Whether the material may transmit light diffusely.
    pub fn may_transmit_diffusely(&self) -> bool {
        self.diffuse_transmission
            .as_ref()
            .is_some_and(|layer| layer.factor != 0.0.into() && !self.unlit)
    }

    /// Whether `specular` or `specular_colour` changes the dielectric part's reflectance.
    pub fn has_specular_tint(&self) -> bool {
        self.specular != 1.0.into() || self.specular_texture.is_some() || self.has_specular_colour()
    }

    /// Returns the factor `specular`, from 0 to 1, if this number alone describes how the
    /// dielectric part's reflectance changes. `None` if the factor varies, if the reflectance has a
    /// colour, or if the material transmits light.
    pub fn constant_specular_factor(&self) -> Option<f64> {
        let even =
            self.specular_texture.is_none() && !self.has_specular_colour() && !self.may_transmit();
        self.specular.constant().filter(|_| even)
    }

    /// Whether the dielectric part's reflectance has a colour.
    fn has_specular_colour(&self) -> bool {
        self.specular_colour != Colour::WHITE.into() || self.specular_colour_texture.is_some()
    }

    /// Returns the metal's complex index of refraction; `None` without an index or metallic part.
    pub fn active_conductor(&self) -> Option<Conductor> {
        self.conductor.filter(|_| self.metallic != 0.0.into())
    }

    /// Returns the clear coat; `None` if it is absent or its factor is zero.
    pub fn active_clearcoat(&self) -> Option<&Clearcoat> {
        self.clearcoat
            .as_ref()
            .filter(|layer| layer.factor != 0.0.into())
    }

    /// Returns the sheen; `None` if it is absent or black.
    pub fn active_sheen(&self) -> Option<&Sheen> {
        self.sheen
            .as_ref()
            .filter(|layer| layer.colour != Colour::BLACK.into())
    }

    /// Returns the anisotropy; `None` if it is absent or its strength is zero.
    pub fn active_anisotropy(&self) -> Option<&Anisotropy> {
        self.anisotropy
            .as_ref()
            .filter(|layer| layer.strength != 0.0.into())
    }

    /// Returns the thin film; `None` if it is absent, its factor is zero, or it has no thickness.
    pub fn active_iridescence(&self) -> Option<&Iridescence> {
        let thick = |layer: &&Iridescence| {
            let images = layer.thickness_texture.is_some() && layer.thinnest > 0.0;
            layer.factor != 0.0.into() && (layer.thickness != 0.0.into() || images)
        };
        self.iridescence.as_ref().filter(thick)
    }

    /// Returns the texture use that defines the tangents: the normal map of the surface or of the
    /// coat, or the image of the anisotropy. `None` without any of these.
    pub fn tangent_texture(&self) -> Option<&TextureRef> {
        let coat = || {
            self.active_clearcoat()
                .and_then(|coat| coat.normal_texture.as_ref())
                .filter(|_| !self.unlit)
        };
        let anisotropy = || {
            self.active_anisotropy()
                .and_then(|layer| layer.texture.as_ref())
                .filter(|_| !self.unlit)
        };
        self.active_normal_map().or_else(coat).or_else(anisotropy)
    }
}

/// Boundary of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Boundary {
    /// A surface, which reflects and refracts.
    #[default]
    Surface,
    /// No surface: the body is its interior alone, as a cloud.
    None,
}

/// Meaning of the base colour's alpha.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// The surface is absent at points where alpha is below the cutoff.
    Mask {
        /// Cutoff, at least 0. Above 1 the surface is absent everywhere.
        cutoff: f64,
    },
    /// The surface is blended with its background by alpha.
    Blend,
}
