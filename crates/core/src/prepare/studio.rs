//! What a studio puts behind and below a scene: the backdrop that camera rays see, and the ground
//! that catches shadows.

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use crate::camera::axes;
use crate::light::SphereGrid;
use crate::motion::{opening, pose_at};
use crate::scene::{Camera, Projection};

/// What camera rays see that hit nothing, where that is not the sky.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Backdrop<R: Real> {
    /// The same everywhere.
    Plain(R::Vec3),
    /// A studio's: brightest along the camera's axis.
    Studio {
        /// Radiance there.
        radiance: R,
        axis: R::Vec3,
    },
}

impl<R: Real> Backdrop<R> {
    /// Of a studio, as a camera sees it. Parallel rays see one radiance.
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

    /// Along a unit direction.
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

/// Share of a backdrop's radiance that is left far from its middle.
const DARKEST: f64 = 0.5;

/// A ground that is seen by the light that the scene takes from it.
#[derive(Clone, Debug)]
pub(crate) struct Ground<R: Real> {
    /// Where it lies.
    pub height: R,
    /// Around which point it is asked, and how far from there: nothing is taken that counts beyond.
    pub centre: R::Vec3,
    pub reach: R,
    /// Directions from above, by what arrives from there on the ground.
    pub light: SphereGrid,
}
