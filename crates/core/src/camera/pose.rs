//! Eye, axes and focal length of a camera as the scene file gives them.

use glam::{DMat3, DVec3};

use crate::scene::{Pinhole, Pose};

impl Pose {
    /// Returns the position of the eye in world coordinates.
    pub fn eye(&self) -> DVec3 {
        match *self {
            Self::LookAt { eye, .. } | Self::Axes { eye, .. } => eye.into(),
            Self::Orbit {
                target,
                distance,
                azimuth,
                elevation,
            } => {
                let back = direction_from_angles(azimuth.to_radians(), elevation.to_radians());
                DVec3::from(target) + back * distance
            }
        }
    }
}

/// Returns the unit direction of an azimuth and an elevation in radians. Azimuth 0 is +z, and a
/// quarter turn is +x.
pub(crate) fn direction_from_angles(azimuth: f64, elevation: f64) -> DVec3 {
    let (sin, cos) = libm::sincos(azimuth);
    let (height, level) = libm::sincos(elevation);
    DVec3::new(level * sin, height, level * cos)
}

/// Returns the position of the eye, and the orthonormal axes right, up and back of a pose.
pub(crate) fn eye_and_axes(pose: &Pose) -> (DVec3, DMat3) {
    match *pose {
        // Validation rejects a view along `up`.
        Pose::LookAt { eye, target, up } => (
            eye.into(),
            look_at(eye.into(), target.into(), up.into(), DVec3::X),
        ),
        Pose::Orbit {
            target, azimuth, ..
        } => {
            let a = azimuth.to_radians();
            let level = DVec3::new(libm::cos(a), 0.0, -libm::sin(a));
            (
                pose.eye(),
                look_at(pose.eye(), target.into(), DVec3::Y, level),
            )
        }
        Pose::Axes {
            eye,
            right,
            up,
            back,
        } => (
            eye.into(),
            DMat3::from_cols(right.into(), up.into(), back.into()),
        ),
    }
}

/// Returns the axes right, up and back of a view from `eye` to `target`. `level` replaces the right
/// axis if the view is along `up`. Rounding may cause this for an eye close to a target far from
/// the origin.
fn look_at(eye: DVec3, target: DVec3, up: DVec3, level: DVec3) -> DMat3 {
    let forward = (target - eye).normalize();
    let right = forward.cross(up).try_normalize().unwrap_or(level);
    DMat3::from_cols(right, right.cross(forward), -forward)
}

/// Returns the focal length for a film one unit high and `aspect` units wide.
pub(super) fn focal_length(pinhole: &Pinhole, aspect: f64) -> f64 {
    let from_degrees = |fov: f64| 0.5 / libm::tan(fov.to_radians() * 0.5);
    match *pinhole {
        Pinhole {
            vertical_fov: Some(fov),
            ..
        } => from_degrees(fov),
        Pinhole {
            horizontal_fov: Some(fov),
            ..
        } => from_degrees(fov) * aspect,
        Pinhole {
            focal_length: Some(length),
            ..
        } => length,
        // Validation requires one of the three.
        _ => from_degrees(45.0),
    }
}
