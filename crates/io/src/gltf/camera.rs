//! Cameras of a glTF file, posed by their nodes.

use raywright_core::scene::{AspectFit, Camera, Pinhole, Pose, Projection};
use raywright_core::validate::{LEAST_ASPECT, MAX_COORDINATE, MIN_LENGTH, MOST_ASPECT};

use super::entries::CameraEntry as Source;
use super::nodes::NodeInstance;
use crate::import::{Warnings, format_number};
use crate::warning::WarningCode;

/// Converts a camera; returns `None`, and adds a warning, for invalid numbers.
///
/// If the picture has another aspect ratio than the camera, the picture shows the camera's whole
/// view, and more of the scene on two opposite sides.
pub(super) fn convert_camera(
    camera: &Source,
    index: usize,
    name: String,
    instance: &NodeInstance,
    warnings: &mut Warnings,
) -> Option<Camera> {
    let mut skip = |reason: &str| {
        warnings.add(
            WarningCode::CameraOrLight,
            format!("cameras[{index}]: {reason}; the camera was left out"),
        );
        None
    };
    let (projection, aspect) = match (
        camera.kind.as_str(),
        &camera.perspective,
        &camera.orthographic,
    ) {
        ("perspective", Some(view), _) => {
            let yfov = f64::from(view.yfov);
            if !(yfov > 0.0 && yfov < std::f64::consts::PI) {
                return skip(&format!(
                    "its yfov of {yfov} radians is not between 0 and pi"
                ));
            }
            let pinhole = Pinhole {
                vertical_fov: Some(yfov.to_degrees()),
                ..Pinhole::default()
            };
            (
                Projection::Pinhole(pinhole),
                view.aspect_ratio.map(f64::from),
            )
        }
        ("orthographic", _, Some(view)) => {
            let height = 2.0 * f64::from(view.ymag).abs();
            if !(MIN_LENGTH..=MAX_COORDINATE).contains(&height) {
                return skip(&format!(
                    "its ymag (half the height) of {} is zero, or outside the supported lengths from 1e-15 to 1e15",
                    format_number(view.ymag.into())
                ));
            }
            (
                Projection::Orthographic { height },
                Some(2.0 * f64::from(view.xmag).abs() / height),
            )
        }
        _ => return skip("its type is unknown, or the projection of its type is missing"),
    };
    let Some(pose) = camera_pose(instance) else {
        return skip("the transform of its node has no inverse: a scale is zero");
    };
    // An extreme aspect ratio is ignored.
    let aspect = aspect.filter(|aspect| (LEAST_ASPECT..=MOST_ASPECT).contains(aspect));
    Some(Camera {
        name,
        pose,
        projection,
        aspect,
        fit: AspectFit::Contain,
        pose_end: None,
        shutter: None,
    })
}

/// Returns the camera pose from the axes of the node, each normalised; `None` for a singular
/// transform. If the node's transform is a reflection, the view is mirrored too.
fn camera_pose(instance: &NodeInstance) -> Option<Pose> {
    let m = instance.world.matrix3;
    let back = m.z_axis.try_normalize()?;
    let right = (m.x_axis - back * back.dot(m.x_axis)).try_normalize()?;
    let up =
        (m.y_axis - back * back.dot(m.y_axis) - right * right.dot(m.y_axis)).try_normalize()?;
    Some(Pose::Axes {
        eye: instance.world.translation.into(),
        right: right.into(),
        up: up.into(),
        back: back.into(),
    })
}
