//! Validation of motion. At every time, an object's transform must be invertible and a camera's
//! view must be defined. The two ends of a motion are checked before the times between them.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::Motion;

use super::check::{SceneCheck, format_list};
use crate::motion::object_transforms_at_ends;
use crate::scene::{Camera, Material, Object, Pose};

/// Sine of the least permitted angle between a camera's view and its up direction.
pub(super) const MIN_VIEW_SINE: f64 = 1e-6;

/// Greatest number of pieces into which a camera's motion is divided for its check. Most motions
/// need far fewer. Without a limit, a motion that is nearly degenerate everywhere would take long.
const MOST_PIECES: usize = 4096;

/// Checks the motion of an object. Its transforms at time 0 and at time 1 must already be valid.
pub(super) fn check_object_motion(check: &mut SceneCheck<'_>, object: &Object) {
    let Some(ends) = object_transforms_at_ends(object) else {
        return;
    };
    if Motion::new(ends).is_err() {
        let hint = "turn the object by less than 180 degrees between the two transforms, and keep the sign of every scale factor";
        check.report_with_hint("transform_end", "between `transform` and `transform_end`, there is a time at which the object is flattened to zero thickness",
                hint);
    }
    if check
        .material(&object.material)
        .and_then(Material::uniform_emission)
        .is_some()
    {
        let hint = "remove `transform_end`, or give the object a material without emission";
        check.report_with_hint("transform_end", "an object that emits light cannot move: its light is sampled at its position at time 0", hint);
    }
}

/// Checks the shutter of a camera. If both poses of the camera are valid (`right`), its motion is
/// checked too.
pub(super) fn check_camera_motion(check: &mut SceneCheck<'_>, camera: &Camera, right: bool) {
    if let Some([open, close]) = camera.shutter
        && !(0.0 <= open && open <= close && close <= 1.0)
    {
        let times = format_list(&[open, close]);
        let message = format!(
            "`shutter` must hold an opening time and a closing time, both from 0 to 1 and the earlier first, not {times}"
        );
        check.report_with_hint("shutter", message, "motion runs from time 0 to time 1");
    }
    if let Some(end) = camera.pose_end.as_ref().filter(|_| right) {
        check.with_key("pose_end", |check| {
            check_pose_motion(check, &camera.pose, end)
        });
    }
}

/// Checks that a camera's view is defined at every time between two valid poses.
fn check_pose_motion(check: &mut SceneCheck<'_>, start: &Pose, end: &Pose) {
    let v = |a: [f64; 3]| DVec3::from(a);
    let sees = match (start, end) {
        (
            Pose::LookAt { eye, target, up },
            Pose::LookAt {
                eye: e,
                target: t,
                up: u,
            },
        ) => view_is_always_defined([v(*target) - v(*eye), v(*t) - v(*e)], [v(*up), v(*u)]),
        // Distance and elevation stay between their values at the ends, so the view is always
        // defined.
        (Pose::Orbit { .. }, Pose::Orbit { .. }) => true,
        (
            Pose::Axes {
                right, up, back, ..
            },
            Pose::Axes {
                right: r,
                up: u,
                back: b,
                ..
            },
        ) => {
            let axes = |x: &[f64; 3], y: &[f64; 3], z: &[f64; 3]| {
                DAffine3::from_mat3(DMat3::from_cols(
                    v(*x).normalize(),
                    v(*y).normalize(),
                    v(*z).normalize(),
                ))
            };
            let (start, end) = (axes(right, up, back), axes(r, u, b));
            start == end || Motion::new([start, end]).is_ok()
        }
        _ => {
            let hint = "write both poses as `look_at`, as `orbit` or as `axes`";
            return check.report_with_hint("",
                "`pose_end` must be of the same kind as `pose`: poses of two kinds cannot be interpolated",
                hint,
            );
        }
    };
    if !sees {
        let hint = "choose two poses between which the viewing direction is never parallel to `up`, or use `orbit`, which turns about its target";
        check.report_with_hint("", "at some time between `pose` and `pose_end` the camera has no viewing direction or no upward direction", hint);
    }
}

/// Whether a view direction and an up direction are provably never parallel and never zero. Both
/// are interpolated linearly, so their cross product is a quadratic curve. The curve lies within
/// the triangle of its Bernstein coefficients. If all coefficients are on the same side of a plane
/// through the origin, the curve is never zero. Otherwise, both halves of the curve are examined.
/// After [`MOST_PIECES`] pieces, an undecided motion counts as undefined.
fn view_is_always_defined(view: [DVec3; 2], up: [DVec3; 2]) -> bool {
    let mut waiting = vec![(view, up)];
    for _ in 0..MOST_PIECES {
        let Some(([v0, v1], [u0, u1])) = waiting.pop() else {
            return true;
        };
        let curve = [
            v0.cross(u0),
            (v0.cross(u1) + v1.cross(u0)) * 0.5,
            v1.cross(u1),
        ];
        let minimum = MIN_VIEW_SINE * v0.length().max(v1.length()) * u0.length().max(u1.length());
        let side = (curve[0] + curve[1] * 2.0 + curve[2]).normalize_or_zero();
        if !curve.iter().all(|c| c.dot(side) > minimum) {
            let (v, u) = ((v0 + v1) * 0.5, (u0 + u1) * 0.5);
            waiting.extend([([v0, v], [u0, u]), ([v, v1], [u, u1])]);
        }
    }
    false
}

#[cfg(test)]
mod tests;
