//! Validation of cameras. A pose must define a view, and a projection must have a size or angle
//! above zero.

use glam::DVec3;

use super::check::{SceneCheck, format_list};
use super::motion::{self, MIN_VIEW_SINE};
use super::{LEAST_ASPECT, MIN_LENGTH, MOST_ASPECT};
use crate::scene::{Camera, Pinhole, Pose, Projection, Triple};

/// Checks a camera.
pub(super) fn check_camera(check: &mut SceneCheck<'_>, camera: &Camera) {
    if camera.name.parse::<u64>().is_ok() {
        let message = format!("`{}` cannot be the name of a camera", camera.name);
        check.report_with_hint(
            "name",
            message,
            "`--camera` takes a number as the index of a camera, so the name needs a letter",
        );
    }
    let before = check.problem_count();
    check.with_key("pose", |check| check_pose(check, &camera.pose));
    if let Some(end) = &camera.pose_end {
        check.with_key("pose_end", |check| check_pose(check, end));
    }
    let right = check.problem_count() == before;
    motion::check_camera_motion(check, camera, right);
    check.with_key("projection", |check| {
        check_projection(check, &camera.projection)
    });
    if let Some(aspect) = camera.aspect {
        check.require_within("aspect", aspect, LEAST_ASPECT, MOST_ASPECT);
    }
}

fn check_pose(check: &mut SceneCheck<'_>, pose: &Pose) {
    match *pose {
        Pose::LookAt { eye, target, up } => {
            check.with_key("look_at", |check| check_look_at(check, eye, target, up))
        }
        Pose::Orbit {
            target,
            distance,
            azimuth,
            elevation,
        } => check.with_key("orbit", |check| {
            check.require_point("target", target);
            check.require_length("distance", distance);
            check.require_finite("azimuth", azimuth);
            check.require_between("elevation", elevation, -90.0, 90.0);
        }),
        Pose::Axes {
            eye,
            right,
            up,
            back,
        } => check.with_key("axes", |check| {
            check.require_point("eye", eye);
            check.require_direction("right", right);
            check.require_direction("up", up);
            check.require_direction("back", back);
            let unit = |axis: Triple| DVec3::from(axis).normalize_or_zero();
            let volume = unit(right).cross(unit(up)).dot(unit(back));
            if volume.abs() < MIN_VIEW_SINE
                && [right, up, back]
                    .iter()
                    .all(|axis| unit(*axis) != DVec3::ZERO)
            {
                check.report(
                    "",
                    "`right`, `up` and `back` lie in a plane, so they define no orientation",
                );
            }
        }),
    }
}

fn check_look_at(check: &mut SceneCheck<'_>, eye: Triple, target: Triple, up: Triple) {
    check.require_point("eye", eye);
    check.require_point("target", target);
    check.require_direction("up", up);
    let view = DVec3::from(target) - DVec3::from(eye);
    if view.length() < MIN_LENGTH {
        check.report(
            "target",
            "`target` equals `eye`, so the camera has no viewing direction",
        );
        return;
    }
    let sine = view
        .normalize_or_zero()
        .cross(DVec3::from(up).normalize_or_zero())
        .length();
    if sine < MIN_VIEW_SINE && up.iter().any(|x| *x != 0.0) {
        let message = format!(
            "`up`, {}, is parallel to the viewing direction, so the picture has no upward direction",
            format_list(&up)
        );
        let hint = "choose an `up` that is not parallel to the viewing direction, such as [0, 0, -1] for a camera that looks down";
        check.report_with_hint("up", message, hint);
    }
}

fn check_projection(check: &mut SceneCheck<'_>, projection: &Projection) {
    match projection {
        Projection::Pinhole(lens) => check.with_key("pinhole", |check| check_pinhole(check, lens)),
        Projection::Orthographic { height } => {
            check.require_length("orthographic.height", *height);
        }
        Projection::ThinLens {
            pinhole: lens,
            aperture_radius,
            focus_distance,
        } => check.with_key("thin_lens", |check| {
            check.with_key("pinhole", |check| check_pinhole(check, lens));
            check.require_not_negative("aperture_radius", *aperture_radius);
            check.require_length("focus_distance", *focus_distance);
        }),
    }
}

fn check_pinhole(check: &mut SceneCheck<'_>, lens: &Pinhole) {
    let keys = [
        ("vertical_fov", lens.vertical_fov),
        ("horizontal_fov", lens.horizontal_fov),
        ("focal_length", lens.focal_length),
    ];
    let given: Vec<&str> = keys
        .iter()
        .filter(|(_, value)| value.is_some())
        .map(|(key, _)| *key)
        .collect();
    let hint =
        "give exactly one of `vertical_fov`, `horizontal_fov` (both in degrees) and `focal_length`";
    match given.as_slice() {
        [] => check.report_with_hint("", "the pinhole camera has no field of view", hint),
        [_] => {}
        [first, second, ..] => {
            let message = format!(
                "`{first}` and `{second}` both set the field of view of the pinhole camera"
            );
            check.report_with_hint(second, message, hint);
        }
    }
    for (key, value) in keys {
        match value {
            None => {}
            Some(length) if key == "focal_length" => check.require_within(key, length, 1e-6, 1e6),
            Some(angle) => check.require_between(key, angle, 0.0, 180.0),
        }
    }
}
