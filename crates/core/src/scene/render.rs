//! Settings of a picture in the scene: size, samples, depth, display, and the classic model's
//! rules.

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
    /// Samples per pixel, above zero; ignored with a pattern.
    pub samples: u32,
    /// A fixed pattern in place of the general sampler.
    pub pattern: Option<Pattern>,
    /// Pixel filter: the weight of a pixel's surroundings in the pixel; ignored with a pattern.
    pub filter: PixelFilter,
    /// Most ray segments of a path, the camera ray included; 1 to 64.
    pub max_depth: u32,
    /// Computation of light.
    pub integrator: Integrator,
    /// Seed of the general sampler.
    pub seed: u64,
    /// Tone map from radiance to display values.
    pub tone_map: ToneMap,
    /// Transfer curve of an 8-bit picture.
    pub gamma: TransferCurve,
    /// Exposure in stops: radiance is multiplied by 2 to this power before the tone map.
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
    /// Four samples at the corners, shared with the neighbours.
    Corners,
}

impl Pattern {
    /// Returns the samples per pixel.
    pub fn count(self) -> u32 {
        match self {
            Self::Centre => 1,
            Self::Corners => 4,
        }
    }
}

/// Computation of light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[doc(alias("PathIntegrator", "RandomWalkIntegrator"))]
pub enum Integrator {
    /// The integrator that the scene needs.
    #[default]
    Auto,
    /// Local lighting, mirror reflection and refraction (Whitted, "An Improved Illumination Model
    /// for Shaded Display", 1980).
    Whitted,
    /// Path tracing: every surface lights every other, by random paths (Kajiya, "The Rendering
    /// Equation", 1986).
    Path,
}

/// Tone map from linear radiance to display-linear values in 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[doc(alias = "tone mapping operator")]
pub enum ToneMap {
    /// Clipped to 0..1.
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
#[doc(alias("OETF", "gamma", "ColorEncoding"))]
pub enum TransferCurve {
    /// The piecewise curve of IEC 61966-2-1.
    #[default]
    #[serde(rename = "srgb")]
    Srgb,
    /// Pure power 1/2.2.
    #[serde(rename = "2.2")]
    Gamma22,
    /// None: the code is the linear value.
    #[serde(rename = "none")]
    None,
}

/// Rules shared by the classic materials of a scene. The defaults are the sensible rules; the
/// others exist because documented shaders use them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ClassicRules {
    /// Ambient light on every surface.
    pub ambient: Colour,
    /// Origin of spawned rays.
    pub spawn: SpawnRule,
    /// Occluders that block light.
    pub shadow: ShadowRule,
    /// Farthest occluder of a directional light; none: no limit.
    pub shadow_max_distance: Option<f64>,
    /// Treatment of a reflection beyond the maximum depth.
    pub depth_limit: DepthLimit,
}

/// Origin of a spawned ray, and the least distance of its hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SpawnRule {
    /// Outside the rounding error of each hit point: correct at every scale.
    #[default]
    ErrorBound,
    /// By constants, as in shaders: correct at one scale.
    Constant(ConstantOffset),
}

/// Constants of [`SpawnRule::Constant`], in world units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ConstantOffset {
    /// Distance by which a spawned ray's origin is moved.
    pub offset: f64,
    /// Direction in which the origins of reflected and refracted rays are moved; a shadow ray's
    /// origin always moves along the ray.
    #[serde(default)]
    pub along: OffsetDirection,
    /// Least distance of a camera ray's hit.
    #[serde(default)]
    pub camera_min: f64,
    /// Least distance of a reflected or refracted ray's hit.
    #[serde(default)]
    pub secondary_min: f64,
    /// Least distance of a shadow ray's hit.
    #[serde(default)]
    pub shadow_min: f64,
}

/// Direction in which a spawned origin is moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum OffsetDirection {
    /// Along the normal, to the side on which the ray leaves.
    #[default]
    Normal,
    /// Along the ray.
    Ray,
}

/// Occluders that block light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ShadowRule {
    /// All occluders: the product of their transmittances.
    #[default]
    Product,
    /// Only the occluder that comes first in the scene's order, wherever it lies on the ray.
    FirstInOrder,
}

/// Treatment of rays beyond the maximum depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum DepthLimit {
    /// Their radiance is dropped.
    #[default]
    Drop,
    /// A surface hit by the last segment shows its local term with weight one, without reflection.
    LocalOnly,
}
