//! Cameras as in a scene file: position, orientation and projection.

use serde::{Deserialize, Serialize};

use super::Triple;

/// A camera: a view of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Name for `--camera`. A camera without a name is chosen by its index.
    #[serde(default)]
    pub name: String,
    /// Position and orientation.
    pub pose: Pose,
    /// Mapping of directions to the picture.
    pub projection: Projection,
    /// Width over height of the view, for a picture of any shape. None: the view has the shape of
    /// the picture and keeps the vertical field of view.
    #[serde(default)]
    pub aspect: Option<f64>,
    /// Fit of the view to a picture whose shape differs from `aspect`.
    #[serde(default)]
    pub fit: AspectFit,
    /// Pose at time 1 of a moving camera, of the same kind as `pose`, which is the pose at time 0.
    /// Each number is interpolated linearly. None: the camera stands still.
    #[serde(default)]
    pub pose_end: Option<Pose>,
    /// Opening and closing time of the shutter, each from 0 to 1. Each sample of a pixel has its
    /// own time between the two, at which it sees moving objects. None: the picture shows time 0.
    #[serde(default)]
    pub shutter: Option<[f64; 2]>,
}

/// Fit of a camera's view to a picture of another shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum AspectFit {
    /// The view is stretched to the picture.
    #[default]
    Stretch,
    /// The picture shows the whole view, and more at two sides.
    Contain,
    /// The view fills the picture and is cut off at two sides.
    Cover,
}

/// Position and orientation of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Pose {
    /// The camera looks from an eye towards a target.
    LookAt {
        /// Centre of projection.
        eye: Triple,
        /// Point in the middle of the picture, different from the eye.
        target: Triple,
        /// Upward direction, not parallel to the view.
        #[serde(default = "default_up")]
        up: Triple,
    },
    /// The camera is on a sphere around its target: eye = target + distance · (cos e · sin a, sin
    /// e, cos e · cos a).
    Orbit {
        /// Centre of the sphere, in the middle of the picture.
        target: Triple,
        /// Radius of the sphere, above zero.
        distance: f64,
        /// Azimuth a in degrees. At 0 the eye is on the +z side of the target.
        azimuth: f64,
        /// Elevation e in degrees above the horizon, within ±90 (exclusive).
        elevation: f64,
    },
    /// The camera's axes in world coordinates: a direction (x, y, z) of the camera becomes x·right
    /// + y·up + z·back.
    Axes {
        /// Centre of projection.
        eye: Triple,
        /// The camera's x axis, to the right.
        right: Triple,
        /// The camera's y axis, upwards.
        up: Triple,
        /// The camera's z axis, backwards: the camera looks along the opposite direction.
        back: Triple,
    },
}

fn default_up() -> Triple {
    [0.0, 1.0, 0.0]
}

/// Mapping of directions to the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[doc(alias("PerspectiveCamera", "OrthographicCamera"))]
pub enum Projection {
    /// Perspective: all rays pass through a point.
    Pinhole(Pinhole),
    /// Orthographic: all rays are parallel.
    Orthographic {
        /// Height of the view in world units, above zero.
        height: f64,
    },
    /// A lens with an aperture, which shows a single distance sharply.
    ThinLens {
        /// The pinhole camera of the same view at aperture zero.
        pinhole: Pinhole,
        /// Radius of the lens in world units, at least zero.
        aperture_radius: f64,
        /// Distance of the sharp plane along the view in world units, above zero.
        focus_distance: f64,
    },
}

/// Opening angle of a pinhole camera. Exactly one of the three keys is given.
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
    /// Distance from the centre of projection to an image of height 1, above zero: 0.5 /
    /// tan(vertical fov / 2).
    #[serde(default)]
    pub focal_length: Option<f64>,
}
