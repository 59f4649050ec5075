//! Light sources and the sky.

use serde::{Deserialize, Serialize};

use super::Triple;
use super::input::{Colour, ColourInput};

/// A light source that is not a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Name for messages.
    #[serde(default)]
    pub name: String,
    /// Geometry of the light.
    pub kind: LightKind,
    /// Irradiance of a directional light (per surface facing it), radiant intensity of a point or
    /// spot light. Classic materials multiply it by their base colour as it is, physical ones by
    /// the base colour over π.
    pub colour: Colour,
    /// Whether objects in front of the light cast shadows.
    #[serde(default = "yes")]
    pub shadows: bool,
    /// Whether the light makes highlights.
    #[serde(default = "yes")]
    pub specular: bool,
}

fn yes() -> bool {
    true
}

/// Geometry of a light source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[doc(alias("PointLight", "SpotLight", "DistantLight"))]
pub enum LightKind {
    /// Parallel light from far away.
    Directional {
        /// Direction from a surface to the light; any length above zero.
        to_light: Triple,
    },
    /// From one point into all directions.
    Point {
        /// Position.
        position: Triple,
        /// Falloff of the light with distance.
        #[serde(default)]
        falloff: Falloff,
        /// Distance at which the light has faded to zero (the windowing of KHR_lights_punctual);
        /// none: no limit.
        #[serde(default)]
        range: Option<f64>,
    },
    /// From one point into a cone.
    Spot {
        /// Position.
        position: Triple,
        /// Direction of the beam; any length above zero.
        direction: Triple,
        /// Half-angle in degrees within which the light has its full strength.
        inner_angle: f64,
        /// Half-angle in degrees beyond which the light is dark; above 0, at least the inner angle,
        /// at most 90. Equal to the inner angle: a hard edge.
        outer_angle: f64,
        /// Falloff of the light with distance.
        #[serde(default)]
        falloff: Falloff,
        /// Distance at which the light has faded to zero; none: no limit.
        #[serde(default)]
        range: Option<f64>,
    },
}

/// Falloff of a light with distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Falloff {
    /// By the square of the distance, as real light.
    #[default]
    InverseSquare,
    /// No falloff, as in several classic shaders.
    None,
}

/// Radiance of rays that hit nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[doc(alias("ImageInfiniteLight", "UniformInfiniteLight", "environment map"))]
pub enum Sky {
    /// The same radiance in every direction.
    Constant(Colour),
    /// Linear in the height of the direction: bottom·(1−s) + top·s with s = (y + 1)/2, plus suns.
    Gradient {
        /// Radiance straight down.
        bottom: Colour,
        /// Radiance straight up.
        top: Colour,
        /// Bright spots added to the gradient.
        #[serde(default)]
        suns: Vec<Sun>,
    },
    /// An expression of the ray's direction `d` and origin `o`, and of `t` and the parameters.
    Expression(ColourInput),
    /// An equirectangular environment map.
    Map(SkyMap),
    /// A photographer's studio: soft lights that turn with the camera, and a grey backdrop.
    Studio(Studio),
}

/// A photographer's studio: distant key, fill and rim lights placed around the camera's azimuth,
/// and a grey backdrop that only camera rays see.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Studio {
    /// Rotation in degrees of the lights about +y from their place around the camera; 90 moves a
    /// light at +x to +z.
    pub rotation: f64,
    /// Factor on the lights.
    pub strength: f64,
    /// Radiance of the backdrop in the middle of the picture; none: dark behind bright objects and
    /// light behind dark ones.
    pub backdrop: Option<f64>,
    /// Whether a ground below everything catches shadows: camera rays see the backdrop dimmed by
    /// the share of the studio's light that the scene blocks. No other ray hits the ground.
    pub ground: bool,
}

impl Studio {
    /// Radiance of the backdrop behind bright objects.
    pub const DARK_BACKDROP: f64 = 0.075;
    /// Radiance of the backdrop behind dark objects.
    pub const LIGHT_BACKDROP: f64 = 0.62;
}

impl Default for Studio {
    fn default() -> Self {
        Self {
            rotation: 0.0,
            strength: 1.0,
            backdrop: None,
            ground: true,
        }
    }
}

/// A lobe around a direction: weight · colour · max(0, d·direction)^exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// Direction from the scene to the sun; any length above zero.
    pub direction: Triple,
    /// Tint.
    pub colour: Colour,
    /// Strength.
    pub weight: f64,
    /// Sharpness, a whole number from 1 to 65536.
    pub exponent: u32,
}

/// An equirectangular environment: u = atan2(z, x)/2π + ½, v = acos(y)/π with v = 0 the top row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SkyMap {
    /// Name of the image.
    pub image: String,
    /// Rotation of the map in degrees about +y; 90 shows along +z what was along +x.
    #[serde(default)]
    pub rotation: f64,
    /// Factor on the radiance.
    #[serde(default = "unit")]
    pub strength: f64,
}

fn unit() -> f64 {
    1.0
}
