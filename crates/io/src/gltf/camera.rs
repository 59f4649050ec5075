//! Cameras and lights (KHR_lights_punctual) of a glTF file, posed by their nodes.

use std::collections::HashMap;

use glam::DVec3;
use raywright_core::affine_from_steps;
use raywright_core::scene::{
    AspectFit, Camera, Colour, Falloff, Light, LightKind, Mesh, MeshSource, Object, Pinhole, Pose,
    Projection, Scene, Shape,
};
use raywright_core::validate::{
    LEAST_ASPECT, MAX_COORDINATE, MAX_LIGHT_INTENSITY, MAX_MAGNITUDE, MIN_LENGTH, MOST_ASPECT,
};

use super::document::Document;
use super::entries::{CameraEntry, LightEntry, ProjectionEntry, SpotCone};
use super::nodes::NodeInstance;
use crate::import::{Warnings, format_count, format_number};

/// Converts a camera; returns `None`, and adds a warning, for invalid numbers.
///
/// If the picture has another aspect ratio than the camera, the picture shows the camera's whole
/// view, and more of the scene on two opposite sides.
pub(super) fn convert_camera(
    camera: &CameraEntry,
    index: usize,
    name: String,
    instance: &NodeInstance,
    warnings: &mut Warnings,
) -> Option<Camera> {
    let mut skip = |reason: &str| {
        warn!(
            warnings,
            CameraOrLight, "cameras[{index}]: {reason}; the camera was left out"
        );
        None
    };
    let Some(view) = projection(camera) else {
        return skip("its type is unknown, or the projection of its type is missing");
    };
    let (projection, aspect) = if camera.kind == "perspective" {
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
    } else {
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

/// Largest number of cameras that are checked for clipped objects. A file may have as many cameras
/// as objects.
const MOST_CHECKED: usize = 16;

/// Warns about objects that a camera's near or far plane would clip, because a picture shows them.
/// Such objects lie between the camera and its near plane, or extend beyond its far plane.
/// `sources` are the indices in the file of the scene's cameras.
pub(super) fn warn_clipped_objects(
    document: &Document,
    scene: &Scene,
    sources: &[usize],
    warnings: &mut Warnings,
) {
    let boxes: HashMap<&str, [DVec3; 2]> = scene
        .meshes
        .iter()
        .filter(|_| !sources.is_empty())
        .filter_map(|mesh| Some((mesh.name.as_str(), mesh_box(mesh)?)))
        .collect();
    for (camera, &source) in scene.cameras.iter().zip(sources).take(MOST_CHECKED) {
        let entry = &document.cameras[source];
        let (Some(planes), Pose::Axes { eye, back, .. }) = (projection(entry), &camera.pose) else {
            continue;
        };
        let [eye, back] = [eye, back].map(|vector| DVec3::from(*vector));
        let near = 0.0..f64::from(planes.znear);
        let far = f64::from(planes.zfar.unwrap_or(f32::INFINITY)) * (1.0 + 1e-6);
        let is_clipped = |object: &&Object| {
            let Shape::Mesh(mesh) = &object.shape else {
                return false;
            };
            boxes.get(mesh.as_str()).is_some_and(|[least, most]| {
                let world = affine_from_steps(&object.transform);
                let middle = (eye - world.transform_point3((least + most) / 2.0)).dot(back);
                let reach = (world.matrix3.transpose() * back).abs();
                let farthest = middle + reach.dot((most - least) / 2.0);
                near.contains(&farthest) || farthest > far
            })
        };
        let count = scene.objects.iter().filter(is_clipped).count();
        if count > 0 {
            warn!(
                warnings,
                CameraOrLight,
                "cameras[{source}]: its znear and zfar are ignored; {} outside them can be visible",
                format_count(count, "object")
            );
        }
    }
}

/// Returns the projection of a camera's own type.
fn projection(camera: &CameraEntry) -> Option<&ProjectionEntry> {
    match camera.kind.as_str() {
        "perspective" => camera.perspective.as_ref(),
        "orthographic" => camera.orthographic.as_ref(),
        _ => None,
    }
}

/// Returns the least and the largest coordinates of a mesh in its own space.
fn mesh_box(mesh: &Mesh) -> Option<[DVec3; 2]> {
    let MeshSource::Inline(data) = &mesh.source else {
        return None;
    };
    (0..data.positions.len())
        .map(|vertex| [data.positions.position(vertex); 2])
        .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
}

/// Converts a light; returns `None`, and adds a warning, for invalid numbers.
pub(super) fn convert_light(
    light: &LightEntry,
    index: usize,
    name: String,
    instance: &NodeInstance,
    warnings: &mut Warnings,
) -> Option<Light> {
    let label = format!("KHR_lights_punctual.lights[{index}]");
    let skip = |warnings: &mut Warnings, reason: &str| {
        warn!(
            warnings,
            CameraOrLight, "{label}: {reason}; the light was left out"
        );
        None
    };
    let maximum = if light.kind == "directional" {
        MAX_MAGNITUDE
    } else {
        MAX_LIGHT_INTENSITY
    };
    let intensity =
        warnings.clamp_with_warning(light.intensity.into(), [0.0, maximum], &label, "intensity");
    let colour = light
        .color
        .map(|c| warnings.clamp_with_warning(c.into(), [0.0, maximum], &label, "color"));
    let colour = colour.map(|c| (c * intensity).min(maximum));
    // Lights shine along their node's -z.
    let Some(back) = instance.world.matrix3.z_axis.try_normalize() else {
        return skip(
            warnings,
            "the transform of its node has no inverse: a scale is zero",
        );
    };
    let position = instance.world.translation.into();
    let range = light_range(light, &label, warnings);
    let kind = match light.kind.as_str() {
        "directional" => LightKind::Directional {
            to_light: back.into(),
        },
        "point" => LightKind::Point {
            position,
            falloff: Falloff::InverseSquare,
            range,
        },
        "spot" => {
            let Some([inner, outer]) = spot_angles(light.spot.as_ref(), &label, warnings) else {
                return skip(warnings, "its outer cone angle is not above 0");
            };
            LightKind::Spot {
                position,
                direction: (-back).into(),
                inner_angle: inner,
                outer_angle: outer,
                falloff: Falloff::InverseSquare,
                range,
            }
        }
        _ => return skip(warnings, "its type is unknown"),
    };
    Some(Light {
        name,
        kind,
        colour: Colour(colour),
        shadows: true,
        specular: true,
    })
}

/// Returns the range of a light in metres; `None` for an unbounded range. A range of zero or less,
/// or beyond the largest supported coordinate, counts as unbounded.
fn light_range(light: &LightEntry, label: &str, warnings: &mut Warnings) -> Option<f64> {
    let range = light
        .range
        .map(f64::from)
        .filter(|range| *range <= MAX_COORDINATE)?;
    if range <= 0.0 {
        warn!(
            warnings,
            Range,
            "{label}: the range {} is not above 0; the light has no range limit",
            format_number(range)
        );
        return None;
    }
    Some(warnings.clamp_with_warning(range, [MIN_LENGTH, MAX_COORDINATE], label, "range"))
}

/// Returns the inner and the outer angle of a spotlight, in degrees from the axis; `None` for an
/// empty cone. The light has a hard edge if the inner angle is not smaller than the outer angle.
fn spot_angles(spot: Option<&SpotCone>, label: &str, warnings: &mut Warnings) -> Option<[f64; 2]> {
    let spot = spot.map_or_else(SpotCone::default, SpotCone::clone);
    let [inner, outer] =
        [spot.inner_cone_angle, spot.outer_cone_angle].map(|angle| f64::from(angle).to_degrees());
    // π/2 in single precision is slightly more than 90 degrees.
    let outer = if (outer - 90.0).abs() < 1e-4 {
        90.0
    } else {
        outer
    };
    if outer <= 0.0 {
        return None;
    }
    let outer = warnings.clamp_with_warning(outer, [0.0, 90.0], label, "outerConeAngle in degrees");
    Some([
        warnings.clamp_with_warning(inner, [0.0, outer], label, "innerConeAngle in degrees"),
        outer,
    ])
}
