//! Settings of a picture that are data like the rest: size, samples, depth, display, and the
//! classic model's rules.

use serde::{Deserialize, Serialize};

use super::input::Colour;
use crate::filter::PixelFilter;

/// Settings of a picture; flags of the command line override each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Render {
    /// Width and height in pixels, each 1 to 65536.
    pub size: [u32; 2],
    /// Samples a pixel, above zero; ignored where a pattern is given.
    pub samples: u32,
    /// A fixed pattern in place of the general sampler.
    pub pattern: Option<Pattern>,
    /// How much of a pixel's surroundings counts towards it; ignored where a pattern is given.
    pub filter: PixelFilter,
    /// Ray segments a path may have, the camera ray included; 1 to 64.
    pub max_depth: u32,
    /// How light is computed.
    pub integrator: Integrator,
    /// Seed of the general sampler.
    pub seed: u64,
    /// How radiance becomes display values.
    pub tone_map: ToneMap,
    /// Transfer curve of an 8-bit picture.
    pub gamma: TransferCurve,
    /// Stops: radiance is multiplied by 2 to this power before the tone map.
    pub exposure: f64,
    /// Radiance added to every sample: a veil over the whole picture.
    pub veil: Colour,
}

impl Default for Render {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            samples: 64,
            pattern: None,
            filter: PixelFilter::Box,
            max_depth: 8,
            integrator: Integrator::Auto,
            seed: 0,
            tone_map: ToneMap::KhronosNeutral,
            gamma: TransferCurve::Srgb,
            exposure: 0.0,
            veil: Colour::BLACK,
        }
    }
}

/// A fixed set of sample positions in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// One sample at the centre.
    Centre,
    /// Four at the corners, shared with the neighbours.
    Corners,
}

impl Pattern {
    /// Samples a pixel.
    pub fn count(self) -> u32 {
        match self {
            Self::Centre => 1,
            Self::Corners => 4,
        }
    }
}

/// How light is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// The one that the scene calls for.
    #[default]
    Auto,
    /// Local lighting, mirror reflection and refraction (Whitted, "An Improved Illumination Model
    /// for Shaded Display", 1980).
    Whitted,
    /// Light as it goes: every surface lights every other, found by paths that are followed by
    /// chance (Kajiya, "The Rendering Equation", 1986).
    Path,
}

/// How linear radiance becomes display-linear values in 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum ToneMap {
    /// Clipped.
    None,
    /// Narkowicz's fit of the ACES curve ("ACES Filmic Tone Mapping Curve", 2015), per channel.
    Aces,
    /// Hill's fit of the ACES reference and output transforms, with its exposure of 1/0.6.
    AcesHill,
    /// AgX (Sobotka), base look.
    Agx,
    /// The Khronos PBR neutral tone mapper (2024).
    #[default]
    KhronosNeutral,
}

/// Transfer curve from display-linear values to 8-bit codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum TransferCurve {
    /// The piecewise curve of IEC 61966-2-1.
    #[default]
    #[serde(rename = "srgb")]
    Srgb,
    /// Pure power 1/2.2.
    #[serde(rename = "2.2")]
    Gamma22,
    /// None: the code is the value.
    #[serde(rename = "none")]
    None,
}

/// Rules that the classic materials of a scene share. The defaults are the sensible ones; the
/// others exist because documented shaders behave so.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ClassicRules {
    /// Light that reaches every surface.
    pub ambient: Colour,
    /// Where a ray that leaves a surface starts.
    pub spawn: SpawnRule,
    /// What stands in the way of light.
    pub shadow: ShadowRule,
    /// Farthest occluder of a directional light; none: no limit.
    pub shadow_max_distance: Option<f64>,
    /// What happens to a reflection that would exceed the maximum depth.
    pub depth_limit: DepthLimit,
}

/// Where a ray that leaves a surface starts, and the least distance it may hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SpawnRule {
    /// Outside the rounding error of the hit point, per hit: right at every scale.
    #[default]
    ErrorBound,
    /// By constants, as shaders do: right at one scale.
    Constant(ConstantOffset),
}

/// Constants of [`SpawnRule::Constant`], in world units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ConstantOffset {
    /// How far a spawned ray's origin is moved.
    pub offset: f64,
    /// Which way reflected and refracted origins are moved; a shadow ray's is always moved along
    /// itself.
    #[serde(default)]
    pub along: OffsetDirection,
    /// Least distance that counts as a hit of a camera ray.
    #[serde(default)]
    pub camera_min: f64,
    /// Least distance that counts as a hit of a reflected or refracted ray.
    #[serde(default)]
    pub secondary_min: f64,
    /// Least distance that counts as a hit of a shadow ray.
    #[serde(default)]
    pub shadow_min: f64,
}

/// Which way a spawned origin is moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum OffsetDirection {
    /// Along the normal, to the side the ray leaves on.
    #[default]
    Normal,
    /// Along the ray itself.
    Ray,
}

/// What stands in the way of light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ShadowRule {
    /// Every occluder: their transmittances are multiplied.
    #[default]
    Product,
    /// The occluder that comes first in the scene's order decides alone, wherever it is on the ray.
    FirstInOrder,
}

/// What happens at the maximum depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum DepthLimit {
    /// What the reflected or refracted ray would have brought is dropped.
    #[default]
    Drop,
    /// A surface hit by the last segment shows its local term with weight one, as if it did not
    /// reflect.
    LocalOnly,
}
