//! The backdrop of a studio, which only camera rays see, and the ground of a studio, which shows
//! shadows.

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use crate::camera::eye_and_axes;
use crate::light::SphereGrid;
use crate::motion::{pose_at, shutter_opening};
use crate::scene::{Camera, Projection};

/// Background of camera rays that hit nothing, in place of the sky.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Backdrop<R: Real> {
    /// A constant radiance.
    Constant(R::Vec3),
    /// A studio's backdrop, brightest along the camera's axis.
    Studio {
        /// Radiance along the axis.
        radiance: R,
        /// Unit direction of the camera's view.
        axis: R::Vec3,
    },
}

impl<R: Real> Backdrop<R> {
    /// Creates a studio's backdrop for a camera. An orthographic camera sees a constant radiance.
    pub fn from_studio(radiance: f64, camera: &Camera) -> Self {
        match camera.projection {
            Projection::Orthographic { .. } => {
                Self::Constant(R::Vec3::from_f64(DVec3::splat(radiance)))
            }
            _ => {
                let (_, frame) = eye_and_axes(&pose_at(camera, shutter_opening(camera)));
                Self::Studio {
                    radiance: R::from_f64(radiance),
                    axis: R::Vec3::from_f64(-frame.z_axis.normalize()),
                }
            }
        }
    }

    /// Multiplies the radiance by a factor.
    pub fn scale(&mut self, factor: R) {
        match self {
            Self::Constant(radiance) => *radiance *= factor,
            Self::Studio { radiance, .. } => *radiance *= factor,
        }
    }

    /// Returns the radiance along a unit direction.
    #[inline]
    pub fn radiance(&self, direction: R::Vec3) -> R::Vec3 {
        match *self {
            Self::Constant(radiance) => radiance,
            Self::Studio { radiance, axis } => {
                let away = R::ONE - direction.dot(axis);
                R::Vec3::ONE * (radiance * (R::ONE - away).max(R::from_f64(DARKEST)))
            }
        }
    }
}

/// Least radiance of a backdrop far from the axis, relative to the radiance along the axis.
const DARKEST: f64 = 0.5;

/// An invisible horizontal ground that shows the scene's shadow.
#[derive(Clone, Debug)]
pub(crate) struct StudioGround<R: Real> {
    /// Height of the ground.
    pub height: R,
    /// Centre of the shadow.
    pub centre: R::Vec3,
    /// Radius of the shadow on the ground. Outside it, the scene blocks a negligible part of the
    /// light.
    pub shadow_radius: R,
    /// Distribution of sampled directions above the ground, proportional to the irradiance that the
    /// ground receives from them.
    pub direction_sampler: SphereGrid,
}
