//! Cameras: position, orientation and projection.

use serde::{Deserialize, Serialize};

use super::Triple;

/// A view of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Name for `--camera`; unnamed cameras are chosen by index.
    #[serde(default)]
    pub name: String,
    /// Position and orientation.
    pub pose: Pose,
    /// Projection of directions to the picture.
    pub projection: Projection,
    /// Width over height of the view, whatever the picture's; none: the picture's own, which keeps
    /// the vertical field of view.
    #[serde(default)]
    pub aspect: Option<f64>,
    /// View in a picture whose shape differs from `aspect`.
    #[serde(default)]
    pub fit: Fit,
    /// Pose at time 1 of a moving camera, of the same kind as `pose`, which holds at time 0. Each
    /// number is interpolated linearly. None: the camera stands still.
    #[serde(default)]
    pub pose_end: Option<Pose>,
    /// Opening and closing time of the shutter, from 0 to 1. Each sample of a pixel sees moving
    /// objects at its own time between them. None: everything is seen at time 0.
    #[serde(default)]
    pub shutter: Option<[f64; 2]>,
}

/// View of a camera in a picture of another shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Fit {
    /// The same view, stretched.
    #[default]
    Stretch,
    /// The whole view, and more at two sides.
    Contain,
    /// A part of the view, cut off at two sides.
    Cover,
}

/// Position and orientation of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Pose {
    /// From an eye towards a target.
    LookAt {
        /// Centre of projection.
        eye: Triple,
        /// Point in the middle of the picture; differs from the eye.
        target: Triple,
        /// Upward direction; not parallel to the view.
        #[serde(default = "y_up")]
        up: Triple,
    },
    /// On a sphere around a target: eye = target + distance · (cos e · sin a, sin e, cos e · cos
    /// a).
    Orbit {
        /// Centre of the sphere, in the middle of the picture.
        target: Triple,
        /// Radius of the sphere, above zero.
        distance: f64,
        /// Azimuth a in degrees; at 0 the eye is on the +z side.
        azimuth: f64,
        /// Elevation e in degrees above the horizon, within ±90 (exclusive).
        elevation: f64,
    },
    /// Explicit axes, in world coordinates: a camera-space direction (x, y, z) becomes x·right +
    /// y·up + z·back.
    Axes {
        /// Centre of projection.
        eye: Triple,
        /// Camera x axis.
        right: Triple,
        /// Camera y axis.
        up: Triple,
        /// Camera z axis; the camera looks along its negative.
        back: Triple,
    },
}

fn y_up() -> Triple {
    [0.0, 1.0, 0.0]
}

/// Mapping of directions to the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[doc(alias("PerspectiveCamera", "OrthographicCamera"))]
pub enum Projection {
    /// All rays through one point.
    Pinhole(Pinhole),
    /// Parallel rays.
    Orthographic {
        /// Height of the view in world units, above zero.
        height: f64,
    },
    /// A lens with an aperture, sharp at one distance.
    ThinLens {
        /// The pinhole camera of the same view at aperture zero.
        pinhole: Pinhole,
        /// Radius of the lens in world units, at least zero.
        aperture_radius: f64,
        /// Distance of the sharp plane along the view, above zero.
        focus_distance: f64,
    },
}

/// Opening angle of a pinhole camera, by exactly one of the keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Pinhole {
    /// Vertical field of view in degrees, above 0 and below 180.
    #[serde(default)]
    pub vertical_fov: Option<f64>,
    /// Horizontal field of view in degrees, above 0 and below 180.
    #[serde(default)]
    pub horizontal_fov: Option<f64>,
    /// Distance from the centre of projection to an image one unit high, above zero: 0.5 /
    /// tan(vertical fov / 2).
    #[serde(default)]
    pub focal_length: Option<f64>,
}
