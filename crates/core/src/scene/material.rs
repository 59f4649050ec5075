//! Materials in two families: classic (a local lighting model made of terms) and physical
//! (metallic-roughness).

mod layers;
mod mixture;
mod physical;

use serde::{Deserialize, Serialize};

use super::field::{FieldValue, MaterialFields};
use super::input::{Colour, ColourInput, TextureRef, Weight, white};
pub use layers::*;
pub use mixture::Mixture;
pub(crate) use physical::physical_fields;
pub use physical::{AlphaMode, Physical};

/// A named material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Unique name that objects refer to.
    pub name: String,
    /// Model of the scattered and emitted light.
    pub model: Model,
}

impl Material {
    /// Whether the material emits light anywhere.
    pub fn emits(&self) -> bool {
        match &self.model {
            Model::Classic(m) => m
                .emission
                .as_ref()
                .is_some_and(|e| *e != ColourInput::Constant(Colour::BLACK)),
            Model::Physical(m) => m.gives_off().is_some(),
        }
    }

    /// Returns the radiance of a constant emission; `None` for no emission or a varying one.
    pub fn even_emission(&self) -> Option<Colour> {
        let emission = match &self.model {
            Model::Classic(m) => m.emission.as_ref(),
            Model::Physical(m) => m.gives_off().filter(|_| m.emission_texture.is_none()),
        };
        emission
            .and_then(ColourInput::constant)
            .filter(|emission| *emission != Colour::BLACK)
    }

    /// Whether the surface may be partly absent (alpha mask or blend).
    pub fn is_cut(&self) -> bool {
        matches!(&self.model, Model::Physical(m) if m.alpha != AlphaMode::Opaque)
    }

    /// Iterates over the texture uses.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let values: Vec<&dyn FieldValue> = match &self.model {
            Model::Classic(m) => core::iter::once(&m.colour)
                .chain(&m.emission)
                .map(|input| input as &dyn FieldValue)
                .collect(),
            Model::Physical(m) => m.fields().into_iter().map(|field| field.value).collect(),
        };
        values
            .into_iter()
            .filter_map(FieldValue::texture)
            .map(|(_, texture)| texture)
    }

    /// Returns the sets of texture coordinates that the material's textures read, ascending, each
    /// once.
    pub fn uv_sets(&self) -> Vec<u32> {
        let mut sets: Vec<u32> = self
            .textures()
            .filter(|t| t.uv.is_none())
            .map(|t| t.uv_set)
            .collect();
        sets.sort_unstable();
        sets.dedup();
        sets
    }
}

/// The two families of materials. Every integrator supports both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[doc(alias("principled", "Disney BSDF", "DielectricMaterial", "ConductorMaterial"))]
pub enum Model {
    /// A local lighting model made of terms.
    Classic(Box<Classic>),
    /// The metallic-roughness model of glTF.
    Physical(Box<Physical>),
}

/// A local lighting model made of terms. Seen along the unit direction d, at a point with normal n,
/// its radiance is
///
/// local · ( colour·(ambient + Σ diffuse·max(0, n·l)·shadow·light) + Σ specular + rim ) + emission
///
/// plus that of a reflected or refracted ray where the material has one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Classic {
    /// Base colour.
    pub colour: ColourInput,
    /// Factor of the whole local term; 0 for a pure mirror or glass, 1 for a matte surface.
    pub local: Weight,
    /// Ambient light; none: the scene's (`classic.ambient`).
    pub ambient: Option<Colour>,
    /// Factor of the Lambert term; an expression is evaluated for each light.
    pub diffuse: Weight,
    /// Highlight of the lights.
    pub specular: Option<Specular>,
    /// Light at grazing angles.
    pub rim: Option<Rim>,
    /// A traced mirror reflection.
    pub reflection: Option<Reflection>,
    /// Traced refraction, and the mirror reflection of glass. Cannot be combined with `reflection`.
    pub transmission: Option<Transmission>,
    /// Emitted radiance.
    pub emission: Option<ColourInput>,
    /// Mixture that path tracing reads in place of all other terms but `colour` and `emission`.
    pub mixture: Option<Mixture>,
    /// Share of a light that passes where this surface is the occluder, 0 (opaque) to 1.
    pub shadow_transmittance: f64,
    /// Share of a light that arrives, in place of the shadow rule's factor: an expression of
    /// `occluder_distance` (infinite without an occluder), `shadow` (the rule's factor) and the
    /// hit. An expression that reads neither variable needs no shadow ray.
    pub shadow: Option<Weight>,
}

/// Shape of a highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SpecularModel {
    /// max(0, n·h)^exponent with h halfway between light and viewer (Blinn, "Models of Light
    /// Reflection for Computer Synthesized Pictures", 1977).
    Blinn,
    /// As Blinn, but with the *reflected* direction in the viewer's place: h = unit(l − r), as in
    /// the documented preset's mirror.
    BlinnReflected,
    /// max(0, r·l)^exponent with r the mirrored view (Phong, "Illumination for Computer Generated
    /// Pictures", 1975).
    Phong,
    /// max(0, d·r)^exponent: a sheen at grazing angles wherever the light is, as in some procedural
    /// shaders.
    Grazing,
}

/// A highlight of the lights: strength · model · tint, for each light that makes highlights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Specular {
    /// Shape of the highlight.
    pub model: SpecularModel,
    /// Sharpness, a whole number from 1 to 65536.
    pub exponent: u32,
    /// Factor.
    pub strength: Weight,
    /// Whether the light's colour tints the highlight; otherwise the highlight is white.
    #[serde(default = "yes")]
    pub lit: bool,
    /// Whether shadows dim the highlight.
    #[serde(default = "yes")]
    pub shadowed: bool,
    /// Whether the reflection's own throughput tints the highlight, outside the `local` factor, as
    /// in the preset's mirror.
    #[serde(default)]
    pub on_reflection: bool,
}

fn yes() -> bool {
    true
}

/// Light at grazing angles: strength · (1 − (n·d)²)^exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Rim {
    /// Factor.
    pub strength: Weight,
    /// Whole exponent from 1 to 64.
    pub exponent: u32,
}

/// A traced mirror reflection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Reflection {
    /// Factor on the radiance of the mirrored ray. In an expression, `l`, `shadow` and
    /// `occluder_distance` have the values of the first light that reaches the point.
    pub weight: Weight,
    /// Whether the base colour tints the reflection.
    #[serde(default = "yes")]
    pub tinted: bool,
    /// Disturbs the mirrored direction.
    #[serde(default)]
    pub fuzz: Option<Fuzz>,
}

/// A disturbance of the mirrored direction by a fixed pattern: direction = unit(mirror + amount·w),
/// w_i = sin(f_i · p).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Fuzz {
    /// Length of the disturbance.
    pub amount: f64,
    /// Row i holds the coefficients of the hit point's x, y, z inside sine i, radians per world
    /// unit.
    pub frequencies: [[f64; 3]; 3],
}

/// Traced refraction with its reflection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Transmission {
    /// Index of refraction of the inside over the outside, above zero.
    pub ior: f64,
    /// Choice of the traced rays.
    #[serde(default)]
    pub choice: TransmissionChoice,
    /// Factor on the radiance of the reflected ray.
    #[serde(default = "white")]
    pub reflected_tint: Colour,
    /// Factor on the radiance of the refracted ray.
    #[serde(default = "white")]
    pub refracted_tint: Colour,
}

/// Choice of the rays that a refracting surface traces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TransmissionChoice {
    /// Both, weighted by the exact dielectric Fresnel equations.
    #[default]
    Split,
    /// One ray, unweighted: the reflection where Schlick's reflectance, at the incident angle on
    /// both sides, exceeds the threshold, or where refraction is impossible.
    Switch {
        /// Reflectance above which the ray reflects.
        threshold: f64,
    },
}
