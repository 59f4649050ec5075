//! Lights of the default studio, which stand relative to a camera.
//!
//! The lights are the picture [`SkyPicture::Studio`]. It follows the camera's azimuth, as a
//! photographer keeps the lights in place while the model turns. So every side of a model is seen
//! in the same light. The elevations of the lights are fixed in the world.

use core::f64::consts::TAU;

use glam::DVec3;
use raywright_bvh::Real;

use crate::camera::eye_and_axes;
use crate::light::SkyRadiance;
use crate::motion::{pose_at, shutter_opening};
use crate::scene::{Camera, Colour, Falloff, Light, LightKind, Pose, Studio};
use crate::sky_picture::SkyPicture;

/// Returns the sky of a studio: its picture, turned to a camera. Black if its light is off.
pub(crate) fn studio_sky<R: Real>(studio: &Studio, camera: &Camera) -> SkyRadiance<R> {
    if studio.strength == 0.0 {
        return SkyRadiance::BLACK;
    }
    let turn = studio.rotation.to_radians() - camera_azimuth(camera);
    SkyRadiance::from_picture(SkyPicture::Studio.image(), turn / TAU, studio.strength)
}

/// Radiant intensity of the headlight, without falloff: a white surface that faces it has a radiance
/// of 0.8.
const HEADLIGHT: f64 = 2.5;

/// Returns the headlight, a lamp at a camera that surfaces enclose.
pub(crate) fn headlight(studio: &Studio, camera: &Camera) -> Light {
    let (eye, _) = eye_and_axes(&pose_at(camera, shutter_opening(camera)));
    Light {
        name: "headlight".to_owned(),
        kind: LightKind::Point {
            position: eye.to_array(),
            falloff: Falloff::None,
            range: None,
        },
        colour: Colour([HEADLIGHT * studio.strength; 3]),
        shadows: true,
        specular: true,
    }
}

/// Returns the azimuth of a camera about its target, in radians. For a view straight down or up,
/// the camera is first tilted to the horizon.
fn camera_azimuth(camera: &Camera) -> f64 {
    let (back, up) = match pose_at(camera, shutter_opening(camera)) {
        Pose::LookAt { eye, target, up } => {
            (DVec3::from(eye) - DVec3::from(target), DVec3::from(up))
        }
        Pose::Orbit { azimuth, .. } => return azimuth.to_radians() % TAU,
        Pose::Axes { up, back, .. } => (DVec3::from(back), DVec3::from(up)),
    };
    let back = back.normalize_or_zero();
    let level = if back.x.hypot(back.z) > 0.01 {
        back
    } else {
        up * -back.y.signum()
    };
    if level.x == 0.0 && level.z == 0.0 {
        0.0
    } else {
        libm::atan2(level.x, level.z)
    }
}

#[cfg(test)]
mod tests;
