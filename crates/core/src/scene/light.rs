//! Light sources and the sky as in a scene file.

use serde::{Deserialize, Serialize};

use super::Triple;
use super::input::{Colour, ColourInput};

/// A light source without a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Name for messages.
    #[serde(default)]
    pub name: String,
    /// Geometry of the light.
    pub kind: LightKind,
    /// Irradiance of a directional light on a surface that faces it, or radiant intensity of a
    /// point or spot light. A classic material multiplies it by its base colour. A physical
    /// material multiplies it by its base colour over π.
    pub colour: Colour,
    /// Whether objects block the light.
    #[serde(default = "default_true")]
    pub shadows: bool,
    /// Whether the light makes highlights.
    #[serde(default = "default_true")]
    pub specular: bool,
}

fn default_true() -> bool {
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
    /// Light from a point into all directions.
    Point {
        /// Position.
        position: Triple,
        /// Falloff of the light with distance.
        #[serde(default)]
        falloff: Falloff,
        /// Distance in metres at which the light has faded to zero, as in KHR_lights_punctual.
        /// None: no limit.
        #[serde(default)]
        range: Option<f64>,
    },
    /// Light from a point into a cone.
    Spot {
        /// Position.
        position: Triple,
        /// Direction of the beam; any length above zero.
        direction: Triple,
        /// Half-angle of the cone in degrees within which the light has its full strength.
        inner_angle: f64,
        /// Half-angle of the cone in degrees beyond which there is no light: above 0, at least the
        /// inner angle, at most 90. If it equals the inner angle, the cone has a hard edge.
        outer_angle: f64,
        /// Falloff of the light with distance.
        #[serde(default)]
        falloff: Falloff,
        /// Distance in metres at which the light has faded to zero, as in KHR_lights_punctual.
        /// None: no limit.
        #[serde(default)]
        range: Option<f64>,
    },
}

/// Falloff of a light with distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Falloff {
    /// With the square of the distance, as physical light.
    #[default]
    InverseSquare,
    /// No falloff: the same strength at every distance.
    None,
}

/// The sky: radiance of rays that hit nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[doc(alias("ImageInfiniteLight", "UniformInfiniteLight", "environment map"))]
pub enum Sky {
    /// The same radiance in every direction.
    Constant(Colour),
    /// Interpolation by the height y of the unit direction: bottom·(1−s) + top·s with s = (y +
    /// 1)/2, plus suns.
    Gradient {
        /// Radiance straight down.
        bottom: Colour,
        /// Radiance straight up.
        top: Colour,
        /// Bright spots added to the gradient.
        #[serde(default)]
        suns: Vec<Sun>,
    },
    /// An expression of the ray's direction `d`, its origin `o`, the time `t` and the parameters.
    Expression(ColourInput),
    /// An equirectangular environment map.
    Map(SkyMap),
    /// A photo studio: soft lights that turn with the camera, and a grey backdrop.
    Studio(Studio),
}

/// A photo studio: distant key, fill and rim lights, placed relative to the camera's azimuth, and a
/// grey backdrop that only camera rays see.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Studio {
    /// Rotation of the lights in degrees about +y, from their default places around the camera. A
    /// rotation by 90 moves a light at +x to +z.
    pub rotation: f64,
    /// Factor on the lights' radiance.
    pub strength: f64,
    /// Radiance of the backdrop in the middle of the picture. None: it depends on the brightness of
    /// the objects, dark behind bright objects and light behind dark objects.
    pub backdrop: Option<f64>,
    /// Whether an invisible ground below all objects shows shadows. On the ground, camera rays see
    /// the backdrop, dimmed by the share of the studio's light that the scene blocks. Other rays do
    /// not hit the ground.
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

/// A bright spot of the sky around a direction: weight · colour · max(0, d·direction)^exponent, for
/// a ray of direction d.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// Direction from the scene to the sun; any length above zero.
    pub direction: Triple,
    /// Colour of the sun's radiance.
    pub colour: Colour,
    /// Factor on the colour.
    pub weight: f64,
    /// Sharpness: a whole number from 1 to 65536.
    pub exponent: u32,
}

/// An equirectangular environment map: u = atan2(z, x)/2π + ½, v = acos(y)/π, where v = 0 is the
/// image's top row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SkyMap {
    /// Name of the image.
    pub image: String,
    /// Rotation of the map in degrees about +y. A rotation by 90 moves the part at +x to +z.
    #[serde(default)]
    pub rotation: f64,
    /// Factor on the radiance.
    #[serde(default = "default_strength")]
    pub strength: f64,
}

fn default_strength() -> f64 {
    1.0
}
