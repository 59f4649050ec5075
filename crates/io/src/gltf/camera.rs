//! Cameras of a glTF file, placed by the nodes that carry them.

use raywright_core::scene::{Camera, Pinhole, Pose, Projection};
use raywright_core::validate::{FARTHEST, SMALLEST};

use super::entries::Camera as Source;
use super::nodes::Placed;
use crate::import::{Warnings, number};

/// A camera as the scene wants it, or none with a warning when its numbers make no view.
///
/// The aspect of the file is dropped: the vertical field of view is what a picture of any shape keeps.
pub(super) fn convert(camera: &Source, index: usize, name: String, placed: &Placed, warnings: &mut Warnings) -> Option<Camera> {
    let mut skip = |why: &str| {
        warnings.add(format!("cameras[{index}]: {why}; the camera was left out"));
        None
    };
    let projection = match (camera.kind.as_str(), &camera.perspective, &camera.orthographic) {
        ("perspective", Some(view), _) => {
            let yfov = f64::from(view.yfov);
            if !(yfov > 0.0 && yfov < std::f64::consts::PI) {
                return skip(&format!("its yfov of {yfov} is not between 0 and pi"));
            }
            Projection::Pinhole(Pinhole { vertical_fov: Some(yfov.to_degrees()), ..Pinhole::default() })
        }
        ("orthographic", _, Some(view)) => {
            let height = 2.0 * f64::from(view.ymag).abs();
            if !(SMALLEST..=FARTHEST).contains(&height) {
                return skip(&format!("its ymag of {} gives no view", number(view.ymag.into())));
            }
            Projection::Orthographic { height }
        }
        _ => return skip("it has no view of its type"),
    };
    let Some(pose) = pose(placed) else { return skip("its node squeezes it flat") };
    Some(Camera { name, pose, projection, aspect: None, pose_end: None, shutter: None })
}

/// The node's axes without their lengths; a mirrored node keeps its mirrored view. None where the node flattens space.
fn pose(placed: &Placed) -> Option<Pose> {
    let m = placed.world.matrix3;
    let back = m.z_axis.try_normalize()?;
    let right = (m.x_axis - back * back.dot(m.x_axis)).try_normalize()?;
    let up = (m.y_axis - back * back.dot(m.y_axis) - right * right.dot(m.y_axis)).try_normalize()?;
    Some(Pose::Axes { eye: placed.world.translation.into(), right: right.into(), up: up.into(), back: back.into() })
}
