//! A studio's backdrop, which camera rays see, and its ground, which catches shadows.

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use crate::camera::axes;
use crate::light::SphereGrid;
use crate::motion::{opening, pose_at};
use crate::scene::{Camera, Projection};

/// Background of camera rays that hit nothing, in place of the sky.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Backdrop<R: Real> {
    /// A constant radiance.
    Plain(R::Vec3),
    /// A studio's backdrop: brightest along the camera's axis.
    Studio {
        /// Radiance along the axis.
        radiance: R,
        axis: R::Vec3,
    },
}

impl<R: Real> Backdrop<R> {
    /// A studio's backdrop for a camera. Parallel rays see a constant radiance.
    pub fn of_studio(radiance: f64, camera: &Camera) -> Self {
        match camera.projection {
            Projection::Orthographic { .. } => {
                Self::Plain(R::Vec3::from_f64(DVec3::splat(radiance)))
            }
            _ => {
                let (_, frame) = axes(&pose_at(camera, opening(camera)));
                Self::Studio {
                    radiance: R::from_f64(radiance),
                    axis: R::Vec3::from_f64(-frame.z_axis.normalize()),
                }
            }
        }
    }

    /// Radiance along a unit direction.
    #[inline]
    pub fn seen(&self, direction: R::Vec3) -> R::Vec3 {
        match *self {
            Self::Plain(radiance) => radiance,
            Self::Studio { radiance, axis } => {
                let away = R::ONE - direction.dot(axis);
                R::Vec3::ONE * (radiance * (R::ONE - away).max(R::from_f64(DARKEST)))
            }
        }
    }
}

/// Least share of a backdrop's radiance, far from its middle.
const DARKEST: f64 = 0.5;

/// An invisible ground that shows the shadow of the scene.
#[derive(Clone, Debug)]
pub(crate) struct StudioGround<R: Real> {
    /// Height of the ground.
    pub height: R,
    /// Centre of the shadow, and its radius: beyond it the scene blocks a negligible share of
    /// light.
    pub centre: R::Vec3,
    pub reach: R,
    /// Directions from above, sampled by their irradiance on the ground.
    pub light: SphereGrid,
}
