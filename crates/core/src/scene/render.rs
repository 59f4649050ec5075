//! Settings of a picture as in a scene file (size, samples, depth, display), and the rules of
//! classic materials.

use serde::{Deserialize, Serialize};

use super::input::Colour;
use crate::filter::PixelFilter;

/// Settings of a picture. Flags of the command line override each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct RenderSettings {
    /// Width and height in pixels, each 1 to 65536.
    pub size: [u32; 2],
    /// Samples per pixel, above zero. Ignored if a pattern is given.
    pub samples: u32,
    /// Whether commands that make a picture denoise it, where it has noise and at least eight
    /// samples. In code, `Settings::denoise` decides.
    pub denoise: bool,
    /// Fixed sample positions in each pixel, in place of random positions.
    pub pattern: Option<SamplePattern>,
    /// Pixel filter: the weight of samples by their position relative to the pixel. Ignored if a
    /// pattern is given.
    pub filter: PixelFilter,
    /// Greatest number of ray segments of a path, the camera ray included; 1 to 64.
    pub max_depth: u32,
    /// Algorithm that computes light.
    pub integrator: Integrator,
    /// Seed of the sampler.
    pub seed: u64,
    /// Tone map from radiance to display values.
    pub tone_map: ToneMap,
    /// Transfer curve of an 8-bit picture.
    pub gamma: TransferCurve,
    /// Exposure in stops: radiance is multiplied by 2 to this power before the tone map.
    pub exposure: f64,
    /// Radiance that is added to every sample, as a veil over the whole picture.
    pub veil: Colour,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            samples: 64,
            denoise: false,
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

/// Fixed sample positions in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SamplePattern {
    /// A sample at the centre of the pixel.
    Centre,
    /// Four samples at the corners of the pixel, which neighbouring pixels share.
    Corners,
}

impl SamplePattern {
    /// Returns the samples per pixel.
    pub fn sample_count(self) -> u32 {
        match self {
            Self::Centre => 1,
            Self::Corners => 4,
        }
    }
}

/// Algorithm that computes the light of a picture: Whitted ray tracing or path tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[doc(alias("PathIntegrator", "RandomWalkIntegrator"))]
pub enum Integrator {
    /// The integrator is chosen by the effects that the scene needs.
    #[default]
    Auto,
    /// Local lighting, mirror reflection and refraction (Whitted, "An Improved Illumination Model
    /// for Shaded Display", 1980).
    Whitted,
    /// Path tracing: light between all surfaces, by random paths (Kajiya, "The Rendering Equation",
    /// 1986).
    Path,
}

/// Tone map from linear radiance to display-linear values in 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[doc(alias = "tone mapping operator")]
pub enum ToneMap {
    /// No tone map: values are clipped to 0..1.
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
    /// A power with the exponent 1/2.2.
    #[serde(rename = "2.2")]
    Gamma22,
    /// No curve: the code is the linear value.
    #[serde(rename = "none")]
    None,
}

/// Rules for all classic materials of a scene. The defaults suit new scenes. The alternatives
/// reproduce published shaders.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ClassicRules {
    /// Ambient light on every classic surface.
    pub ambient: Colour,
    /// Origin of reflected, refracted and shadow rays.
    pub spawn: SpawnRule,
    /// Rule for the occluders that block light.
    pub shadow: ShadowRule,
    /// Greatest distance in metres of an occluder of a directional light. None: no limit.
    pub shadow_max_distance: Option<f64>,
    /// Treatment of reflected and refracted rays beyond the maximum depth.
    pub depth_limit: DepthLimit,
}

/// Rule for the start of reflected, refracted and shadow rays: where they start, and the least
/// distance of their hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SpawnRule {
    /// A ray starts outside the rounding error of the hit point that it leaves. This is correct at every
    /// scale.
    #[default]
    ErrorBound,
    /// A ray starts a constant distance away from the hit point that it leaves, as in many shaders.
    /// One distance suits scenes of one size only.
    Constant(ConstantOffset),
}

/// Distances, in world units, of the rule by which rays start at a constant distance from the
/// surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ConstantOffset {
    /// Distance by which the origin of a reflected, refracted or shadow ray is moved.
    pub offset: f64,
    /// Direction in which the origins of reflected and refracted rays are moved. The origin of a
    /// shadow ray always moves along the ray.
    #[serde(default)]
    pub along: OffsetDirection,
    /// Least distance in world units at which a camera ray can hit a surface.
    #[serde(default)]
    pub camera_min: f64,
    /// Least distance in world units at which a reflected or refracted ray can hit a surface.
    #[serde(default)]
    pub secondary_min: f64,
    /// Least distance in world units at which a shadow ray can hit a surface.
    #[serde(default)]
    pub shadow_min: f64,
}

/// Direction in which the origin of a reflected or refracted ray is moved.
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

/// Rule for the occluders that block light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ShadowRule {
    /// All occluders count: the light is multiplied by the product of their transmittances.
    #[default]
    Product,
    /// Only the occluder counts that comes first in the order of the scene's objects, wherever it
    /// lies on the ray.
    FirstInOrder,
}

/// Treatment of reflected and refracted rays beyond the maximum depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum DepthLimit {
    /// The radiance of such rays is zero.
    #[default]
    Drop,
    /// The surface that the last ray hits shows its local term with the weight 1, and no reflection
    /// or refraction.
    LocalOnly,
}
