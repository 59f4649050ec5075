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
    /// Whether something in between dims it.
    #[serde(default = "yes")]
    pub shadows: bool,
    /// Whether it makes highlights.
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
pub enum LightKind {
    /// Parallel light from far away.
    Directional {
        /// Direction from a surface to the light; any length above zero.
        to_light: Triple,
    },
    /// From one point into all directions.
    Point {
        /// Where it is.
        position: Triple,
        /// How it weakens with distance.
        #[serde(default)]
        falloff: Falloff,
        /// Distance at which it has faded to nothing (the windowing of KHR_lights_punctual); none:
        /// never.
        #[serde(default)]
        range: Option<f64>,
    },
    /// From one point into a cone.
    Spot {
        /// Where it is.
        position: Triple,
        /// Where it points; any length above zero.
        direction: Triple,
        /// Half-angle in degrees within which it is at full strength.
        inner_angle: f64,
        /// Half-angle in degrees beyond which it is dark; above 0, not below the inner one, at
        /// most 90. Equal to it: a hard edge.
        outer_angle: f64,
        /// How it weakens with distance.
        #[serde(default)]
        falloff: Falloff,
        /// Distance at which it has faded to nothing; none: never.
        #[serde(default)]
        range: Option<f64>,
    },
}

/// How a light weakens with distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Falloff {
    /// With the square of the distance, as real light does.
    #[default]
    InverseSquare,
    /// Not at all, as several classic shaders have it.
    None,
}

/// What a ray sees that hits nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Sky {
    /// The same radiance everywhere.
    Constant(Colour),
    /// Linear in the height of the direction: bottom·(1−s) + top·s with s = (y + 1)/2, plus suns.
    Gradient {
        /// Radiance straight down.
        bottom: Colour,
        /// Radiance straight up.
        top: Colour,
        /// Bright spots added to it.
        #[serde(default)]
        suns: Vec<Sun>,
    },
    /// An expression of the ray's direction `d` and origin `o`, and of `t` and the parameters.
    Expression(ColourInput),
    /// An equirectangular environment picture.
    Map(SkyMap),
    /// A photographer's studio: soft lights that go round with the camera, and a grey backdrop.
    Studio(Studio),
}

/// A studio: key, fill and rim lights far away, which stand about the camera's azimuth, and a grey
/// backdrop that camera rays alone see.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Studio {
    /// Degrees by which the lights are turned about +y from where they stand about the camera; 90
    /// brings to +z what was at +x.
    pub rotation: f64,
    /// Factor on the lights.
    pub strength: f64,
    /// Radiance of the backdrop in the middle of the picture; none: dark behind what is bright and
    /// light behind what is dark.
    pub backdrop: Option<f64>,
    /// Whether a ground below everything catches shadows: camera rays see the backdrop dimmed there
    /// by what the scene takes of the studio's light. No other ray meets it.
    pub ground: bool,
}

impl Studio {
    /// Radiance of the backdrop behind what is bright, and behind what is dark.
    pub const DARK_BACKDROP: f64 = 0.075;
    /// See [`Self::DARK_BACKDROP`].
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
    /// Degrees by which the picture is turned about +y; 90 shows along +z what was along +x.
    #[serde(default)]
    pub rotation: f64,
    /// Factor on its radiance.
    #[serde(default = "unit")]
    pub strength: f64,
}

fn unit() -> f64 {
    1.0
}
