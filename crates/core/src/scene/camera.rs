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
    /// How the camera projects the scene onto the picture.
    pub projection: Projection,
    /// Width over height of the view, whatever the shape of the picture; `fit` adapts the view to
    /// the picture. None: the view has the shape of the picture and keeps the vertical field of
    /// view.
    #[serde(default)]
    pub aspect: Option<f64>,
    /// How the view fits a picture whose shape differs from `aspect`.
    #[serde(default)]
    pub fit: AspectFit,
    /// Pose at time 1 of a moving camera, of the same kind as `pose`, which is the pose at time 0.
    /// Each number is interpolated linearly. None: the camera stands still.
    #[serde(default)]
    pub pose_end: Option<Pose>,
    /// Opening and closing time of the shutter, each from 0 to 1. Each sample of a pixel shows
    /// moving objects at its own time between the two. None: the picture shows time 0.
    #[serde(default)]
    pub shutter: Option<[f64; 2]>,
}

/// How a camera's view fits a picture of another shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum AspectFit {
    /// The view is stretched to the picture.
    #[default]
    Stretch,
    /// The picture shows the whole view, and more of the scene at two sides.
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

/// How the camera projects the scene onto the picture.
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
    /// A thin lens with an aperture: only points at `focus_distance` are sharp.
    ThinLens {
        /// Field of view, as of a pinhole camera: the same view with an aperture of zero.
        pinhole: Pinhole,
        /// Radius of the lens in world units, at least zero.
        aperture_radius: f64,
        /// Distance of the sharp plane from the lens, along the view, in world units, above zero.
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
    /// Focal length as a multiple of the image's height, above zero: 0.5 / tan(vertical_fov / 2).
    #[serde(default)]
    pub focal_length: Option<f64>,
}
