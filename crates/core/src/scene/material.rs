//! Materials in two families: classic (a local lighting model made of terms) and physical (metallic-roughness).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::input::{Colour, ColourInput, NumberInput, TextureRef, Varying, Weight, early, white};

/// A named material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Unique name that objects refer to.
    pub name: String,
    /// What it does to light.
    pub model: Model,
}

impl Material {
    /// Whether it gives off light anywhere.
    pub fn emits(&self) -> bool {
        match &self.model {
            Model::Classic(m) => m.emission.as_ref().is_some_and(|e| *e != ColourInput::Constant(Colour::BLACK)),
            Model::Physical(m) => m.emission != Colour::BLACK.into(),
        }
    }

    /// Radiance that the whole surface gives off evenly; none where it gives off none or it varies.
    pub fn even_emission(&self) -> Option<Colour> {
        let emission = match &self.model {
            Model::Classic(m) => m.emission.as_ref(),
            Model::Physical(m) => Some(&m.emission).filter(|_| m.emission_texture.is_none()),
        };
        emission.and_then(ColourInput::constant).filter(|emission| *emission != Colour::BLACK)
    }

    /// Its uses of textures.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let inputs: Vec<&dyn Varying> = match &self.model {
            Model::Classic(m) => core::iter::once(&m.colour).chain(&m.emission).map(|input| input as &dyn Varying).collect(),
            Model::Physical(m) => m.inputs().into_iter().map(|(_, input)| input).collect(),
        };
        inputs.into_iter().filter_map(Varying::texture).map(|(_, texture)| texture)
    }

    /// Sets of texture coordinates that its textures read, ascending, each once.
    pub fn uv_sets(&self) -> Vec<u32> {
        let mut sets: Vec<u32> = self.textures().filter(|t| t.uv.is_none()).map(|t| t.uv_set).collect();
        sets.sort_unstable();
        sets.dedup();
        sets
    }
}

/// The two families of materials. Any integrator can read both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Model {
    /// A local lighting model made of terms.
    Classic(Box<Classic>),
    /// The metallic-roughness model of glTF.
    Physical(Box<Physical>),
}

/// A local lighting model made of terms. Seen along unit d at a point with normal n it adds
///
/// local · ( colour·(ambient + Σ diffuse·max(0, n·l)·shadow·light) + Σ specular + rim ) + emission
///
/// and then follows a reflected or refracted ray where it has one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// A highlight of the lights.
    pub specular: Option<Specular>,
    /// Light at grazing angles.
    pub rim: Option<Rim>,
    /// A traced mirror reflection.
    pub reflection: Option<Reflection>,
    /// Traced refraction; with it the reflection of glass too. Excludes `reflection`.
    pub transmission: Option<Transmission>,
    /// Radiance the surface gives off by itself.
    pub emission: Option<ColourInput>,
    /// Share of a light that passes when this surface is the occluder, 0 (opaque) to 1.
    pub shadow_transmittance: f64,
    /// How much of a shadowed light arrives, in place of the rule's own factor: an expression of `occluder_distance`
    /// (infinite where nothing occludes), `shadow` (the rule's factor) and the hit. One that reads neither needs no ray.
    pub shadow: Option<Weight>,
}

/// Shape of a highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpecularModel {
    /// max(0, n·h)^exponent with h halfway between light and viewer (Blinn, "Models of Light Reflection for Computer
    /// Synthesized Pictures", 1977).
    Blinn,
    /// As Blinn, but with the *reflected* direction in the viewer's place: h = unit(l − r). The documented preset's mirror does so.
    BlinnReflected,
    /// max(0, r·l)^exponent with r the mirrored view (Phong, "Illumination for Computer Generated Pictures", 1975).
    Phong,
    /// max(0, d·r)^exponent: a sheen at grazing angles wherever the light is, as some procedural shaders have it.
    Grazing,
}

/// A highlight of the lights: strength · model · tint, for each light that makes highlights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Specular {
    /// Shape of the highlight.
    pub model: SpecularModel,
    /// Sharpness, a whole number from 1 to 65536.
    pub exponent: u32,
    /// Factor.
    pub strength: Weight,
    /// Whether the light's colour tints it; otherwise it is white.
    #[serde(default = "yes")]
    pub lit: bool,
    /// Whether a shadow dims it.
    #[serde(default = "yes")]
    pub shadowed: bool,
    /// Whether the reflection's own throughput tints it, outside the `local` factor: the preset's mirror does so.
    #[serde(default)]
    pub on_reflection: bool,
}

fn yes() -> bool {
    true
}

/// Light at grazing angles: strength · (1 − (n·d)²)^exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rim {
    /// Factor.
    pub strength: Weight,
    /// Whole exponent from 1 to 64.
    pub exponent: u32,
}

/// A traced mirror reflection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reflection {
    /// Factor of what the mirrored ray sees. An expression finds in `l`, `shadow` and `occluder_distance` what the local term
    /// found of the first light that reaches the point.
    pub weight: Weight,
    /// Whether the base colour tints it.
    #[serde(default = "yes")]
    pub tinted: bool,
    /// Disturbs the mirrored direction.
    #[serde(default)]
    pub fuzz: Option<Fuzz>,
}

/// A disturbance of the mirrored direction by a fixed pattern: direction = unit(mirror + amount·w), w_i = sin(f_i · p).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fuzz {
    /// Length of the disturbance.
    pub amount: f64,
    /// Row i holds the coefficients of the hit point's x, y, z inside sine i, radians per world unit.
    pub frequencies: [[f64; 3]; 3],
}

/// Traced refraction with its reflection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transmission {
    /// Index of refraction of the inside over the outside, above zero.
    pub ior: f64,
    /// Which of the two rays is followed.
    #[serde(default)]
    pub choice: TransmissionChoice,
    /// Factor of what the reflected ray sees.
    #[serde(default = "white")]
    pub reflected_tint: Colour,
    /// Factor of what the refracted ray sees.
    #[serde(default = "white")]
    pub refracted_tint: Colour,
}

/// Which rays a refracting surface spawns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TransmissionChoice {
    /// Both, weighted by the exact dielectric Fresnel equations.
    #[default]
    Split,
    /// One of them, unweighted: the reflection where Schlick's reflectance, taken at the incident angle on both sides,
    /// exceeds the threshold or refraction is impossible.
    Switch {
        /// Reflectance above which the ray reflects.
        threshold: f64,
    },
}

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
    /// Index of refraction, from 1 to 1000; what varies is clamped to that where it is read.
    #[serde(deserialize_with = "early")]
    pub ior: NumberInput,
    /// Share of light that passes through the surface instead of being diffused, 0 to 1; what varies is clamped to that.
    #[serde(deserialize_with = "early")]
    pub transmission: NumberInput,
    /// Image whose red channel, where it names no other, multiplies the transmission.
    pub transmission_texture: Option<TextureRef>,
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
            ior: 1.5.into(),
            transmission: 0.0.into(),
            transmission_texture: None,
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
