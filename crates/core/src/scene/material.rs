//! Materials as in a scene file. They belong to two families: classic (a local lighting model of
//! several terms) and physical (metallic-roughness).

mod layers;
mod physical;

pub use layers::*;
pub(crate) use physical::physical_fields;
pub use physical::{AlphaMode, Boundary, Physical};
use serde::{Deserialize, Serialize};

use super::field::{FieldValue, MaterialFields};
use super::input::{Colour, ColourInput, ScalarFactor, TextureRef, default_white};

/// A named material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Unique name that objects refer to.
    pub name: String,
    /// Model of the scattered and emitted light.
    pub model: MaterialModel,
}

impl Material {
    /// Whether the material emits light anywhere.
    pub fn emits(&self) -> bool {
        match &self.model {
            MaterialModel::Classic(m) => m
                .emission
                .as_ref()
                .is_some_and(|e| *e != ColourInput::Constant(Colour::BLACK)),
            MaterialModel::Physical(m) => m.active_emission().is_some(),
        }
    }

    /// Returns the radiance of a constant emission; `None` if the emission is absent or varies.
    pub fn uniform_emission(&self) -> Option<Colour> {
        let emission = match &self.model {
            MaterialModel::Classic(m) => m.emission.as_ref(),
            MaterialModel::Physical(m) => {
                m.active_emission().filter(|_| m.emission_texture.is_none())
            }
        };
        emission
            .and_then(ColourInput::constant)
            .filter(|emission| *emission != Colour::BLACK)
    }

    /// Whether the surface may be partly transparent by alpha (mask or blend).
    pub fn is_partly_transparent(&self) -> bool {
        matches!(&self.model, MaterialModel::Physical(m) if m.alpha != AlphaMode::Opaque)
    }

    /// Whether a clear coat may lie over the material.
    pub fn is_coated(&self) -> bool {
        matches!(&self.model, MaterialModel::Physical(m) if m.active_clearcoat().is_some())
    }

    /// Iterates over the texture uses of the material.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let values: Vec<&dyn FieldValue> = match &self.model {
            MaterialModel::Classic(m) => core::iter::once(&m.colour)
                .chain(&m.emission)
                .map(|input| input as &dyn FieldValue)
                .collect(),
            MaterialModel::Physical(m) => m.fields().into_iter().map(|field| field.value).collect(),
        };
        values
            .into_iter()
            .filter_map(FieldValue::texture)
            .map(|(_, texture)| texture)
    }

    /// Returns the sets of texture coordinates that the material's textures read, ascending,
    /// without duplicates.
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
pub enum MaterialModel {
    /// The classic model: a local lighting model of several terms.
    Classic(Box<ClassicMaterial>),
    /// The metallic-roughness model of glTF.
    Physical(Box<Physical>),
}

/// A local lighting model: the sum of ambient, diffuse, specular and rim light, emission, and
/// traced reflection or refraction. At a point with normal n, viewed along the unit direction d,
/// its radiance is
///
/// local · ( colour·(ambient + Σ diffuse·max(0, n·l)·shadow·light) + Σ specular + rim ) + emission
///
/// plus the radiance of a reflected or refracted ray, if the material has `reflection` or
/// `transmission`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ClassicMaterial {
    /// Base colour.
    pub colour: ColourInput,
    /// Factor on the local term in parentheses: 0 for a pure mirror or glass, 1 for a matte
    /// surface.
    pub local: ScalarFactor,
    /// Ambient light. None: the scene's `classic.ambient`.
    pub ambient: Option<Colour>,
    /// Factor on the Lambert term. An expression is evaluated for each light.
    pub diffuse: ScalarFactor,
    /// Highlight of each light.
    pub specular: Option<ClassicHighlight>,
    /// Additional light at grazing angles.
    pub rim: Option<RimLight>,
    /// A traced mirror reflection.
    pub reflection: Option<MirrorReflection>,
    /// Traced refraction, with the mirror reflection of glass. It cannot be combined with
    /// `reflection`.
    pub transmission: Option<Transmission>,
    /// Emitted radiance.
    pub emission: Option<ColourInput>,
    /// Mixture of reflection, transmission and diffusion for path tracing, in place of all terms
    /// except `colour` and `emission`.
    pub mixture: Option<Mixture>,
    /// Share of a light that passes through this surface as an occluder, 0 (opaque) to 1.
    pub shadow_transmittance: f64,
    /// Share of a light that reaches the surface, in place of the shadow rule's factor. The
    /// expression may read `occluder_distance` (infinite without an occluder), `shadow` (the rule's
    /// factor) and the variables of the hit. If it reads neither `occluder_distance` nor `shadow`,
    /// no shadow ray is traced.
    pub shadow: Option<ScalarFactor>,
}

/// Shape of a highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SpecularModel {
    /// max(0, n·h)^exponent with the half vector h between light and viewer (Blinn, "Models of
    /// Light Reflection for Computer Synthesized Pictures", 1977).
    Blinn,
    /// As `blinn`, but with h = unit(l − r), where r is the mirrored view. The preset `whitted`
    /// uses it.
    BlinnReflected,
    /// max(0, r·l)^exponent with r the mirrored view (Phong, "Illumination for Computer Generated
    /// Pictures", 1975).
    Phong,
    /// max(0, d·r)^exponent: a highlight at grazing angles that does not depend on the light's
    /// direction, as in some procedural shaders.
    Grazing,
}

/// A highlight: strength · model · tint for each light that makes highlights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ClassicHighlight {
    /// Shape of the highlight.
    pub model: SpecularModel,
    /// Sharpness, a whole number from 1 to 65536.
    pub exponent: u32,
    /// Factor on the highlight.
    pub strength: ScalarFactor,
    /// Whether the light's colour tints the highlight; otherwise the highlight is white.
    #[serde(default = "default_true")]
    pub lit: bool,
    /// Whether shadows dim the highlight.
    #[serde(default = "default_true")]
    pub shadowed: bool,
    /// Whether the highlight is multiplied by the weight of the mirror reflection instead of the
    /// factor `local`. The preset `whitted` uses it.
    #[serde(default)]
    pub on_reflection: bool,
}

fn default_true() -> bool {
    true
}

/// Additional light at grazing angles: strength · (1 − (n·d)²)^exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RimLight {
    /// Factor on the light at grazing angles.
    pub strength: ScalarFactor,
    /// Whole exponent from 1 to 64.
    pub exponent: u32,
}

/// Mirror reflection of a classic material, found by tracing a reflected ray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MirrorReflection {
    /// Factor on the radiance of the mirrored ray. In an expression, `l`, `shadow` and
    /// `occluder_distance` have the values for the first light that reaches the point.
    pub weight: ScalarFactor,
    /// Whether the base colour tints the reflection.
    #[serde(default = "default_true")]
    pub tinted: bool,
    /// Disturbance of the mirrored direction. None: an exact mirror.
    #[serde(default)]
    pub fuzz: Option<ReflectionFuzz>,
}

/// A disturbance of the mirrored direction by a fixed pattern: direction = unit(mirror + amount·w),
/// with w_i = sin(f_i · p) at the hit point p.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ReflectionFuzz {
    /// Length of the disturbance.
    pub amount: f64,
    /// Row i is f_i: the factors on x, y and z of the hit point in the i-th sine, in radians per
    /// world unit.
    pub frequencies: [[f64; 3]; 3],
}

/// Refraction of a classic material, and the reflection at the same boundary, both found by tracing
/// rays.
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
    #[serde(default = "default_white")]
    pub reflected_tint: Colour,
    /// Factor on the radiance of the refracted ray.
    #[serde(default = "default_white")]
    pub refracted_tint: Colour,
}

/// Rays that a refracting surface traces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TransmissionChoice {
    /// A reflected and a refracted ray, weighted by the Fresnel equations of a dielectric.
    #[default]
    Split,
    /// A single ray, whose radiance is not weighted by a reflectance. It is reflected if Schlick's
    /// reflectance at the angle of incidence exceeds the threshold, or if refraction is impossible;
    /// else it is refracted.
    Switch {
        /// Reflectance above which the ray reflects.
        threshold: f64,
    },
}

// The mixture of a classic material for path tracing, as in a scene file.

/// A surface that mirrors, transmits or diffuses each ray at random, with given probabilities, as
/// several well-known path-tracing shaders do. The base colour tints the diffused light. Only path
/// tracing uses the mixture, in place of all other terms except `colour` and `emission`.
///
/// Directions are computed with roughnesses r and q, the normal n, a uniform point s on the unit
/// sphere, the mirrored direction m and the refracted direction t. Let h = unit(n + s) and h' =
/// unit(−n + s). The mirrored ray has the direction unit((1 − r²)·m + r²·h). The transmitted ray
/// has the direction unit((1 − q²)·t + q²·h'). The diffused ray has the direction h. Mirrored and
/// transmitted rays have no density, so lights are not sampled for these rays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Mixture {
    /// Probability s of a mirrored ray, 0 to 1. If it is above zero and an `ior` is given, the
    /// probability becomes s + (1 − s)·F with Schlick's reflectance F.
    pub specular_chance: f64,
    /// Factor on the radiance of the mirrored ray.
    pub specular_colour: Colour,
    /// Roughness r of the mirrored ray, 0 to 1.
    pub specular_roughness: f64,
    /// Probability of a transmitted ray, 0 to 1 − `specular_chance`. Where Schlick's reflectance
    /// increases the probability of a mirrored ray, it reduces the probabilities of a transmitted
    /// and of a diffused ray in proportion.
    pub refraction_chance: f64,
    /// Roughness q of the transmitted ray, 0 to 1.
    pub refraction_roughness: f64,
    /// Index of refraction of the inside over the outside, above zero. None: transmitted rays go
    /// straight on, and Schlick's reflectance is not used.
    pub ior: Option<f64>,
    /// Absorption coefficient of the inside per metre, at least zero: light is multiplied by
    /// exp(−absorption · distance).
    pub absorption: Colour,
    /// Whether throughput and Russian roulette follow a published path-tracing shader instead of
    /// unbiased rules. The throughput is divided by the probability of the chosen ray (at least
    /// 0.001). Russian roulette may end a path whose largest channel is below 1, and scales the
    /// throughput of each surviving path to a largest channel of 1. This changes the brightness of
    /// mirrored and refracted light.
    pub published_roulette: bool,
}

impl Default for Mixture {
    fn default() -> Self {
        Self {
            specular_chance: 0.0,
            specular_colour: default_white(),
            specular_roughness: 0.0,
            refraction_chance: 0.0,
            refraction_roughness: 0.0,
            ior: None,
            absorption: Colour::BLACK,
            published_roulette: false,
        }
    }
}
