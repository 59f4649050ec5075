//! Lights of the default studio, which stand relative to a camera.
//!
//! Key, fill and rim light are lobes of radiance around distant directions, added to a gradient.
//! This sky is sampled in closed form, so its soft light costs little noise. The lights follow the
//! camera's azimuth, as a photographer keeps the lights in place while the model turns. So every
//! side of a model is seen in the same light. The elevations of the lights are fixed in the world.

use core::f64::consts::TAU;

use glam::DVec3;

use crate::camera::{direction_from_angles, eye_and_axes};
use crate::motion::{pose_at, shutter_opening};
use crate::scene::{Camera, Colour, Falloff, Light, LightKind, Pose, Sky, Studio, Sun};

/// Radiance of the gradient straight down.
const BELOW: f64 = 0.15;
/// Radiance of the gradient straight up.
const ABOVE: f64 = 0.45;

/// A soft light of the studio: a lobe of radiance around a direction.
struct SoftLight {
    /// Azimuth of the light in degrees, to the right of the camera as seen from the model.
    azimuth: f64,
    /// Elevation of the light above the horizon, in degrees.
    elevation: f64,
    /// Radiance in the middle of the lobe.
    radiance: f64,
    /// Exponent of the cosine of the angle to the light's direction. A greater exponent gives a
    /// narrower lobe.
    exponent: u32,
}

/// Key, fill and rim light. A surface that faces a light has the irradiance 2π/(exponent + 2) times
/// the light's radiance.
const LIGHTS: [SoftLight; 3] = [
    SoftLight {
        azimuth: -40.0,
        elevation: 45.0,
        radiance: 3.8,
        exponent: 12,
    },
    SoftLight {
        azimuth: 60.0,
        elevation: 15.0,
        radiance: 0.4,
        exponent: 4,
    },
    SoftLight {
        azimuth: 155.0,
        elevation: 35.0,
        radiance: 5.0,
        exponent: 30,
    },
];

/// Returns the sky with the studio's lights, placed relative to a camera.
pub(crate) fn studio_sky(studio: &Studio, camera: &Camera) -> Sky {
    let turn = camera_azimuth(camera) - studio.rotation.to_radians();
    let suns = LIGHTS.iter().map(|light| Sun {
        direction: direction_from_angles(
            turn + light.azimuth.to_radians(),
            light.elevation.to_radians(),
        )
        .to_array(),
        colour: Colour::WHITE,
        weight: light.radiance * studio.strength,
        exponent: light.exponent,
    });
    let grey = |radiance: f64| Colour([radiance * studio.strength; 3]);
    Sky::Gradient {
        bottom: grey(BELOW),
        top: grey(ABOVE),
        suns: suns.collect(),
    }
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
