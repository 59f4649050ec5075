//! Motion in a scene, and the scene at a single time. Effects, validation, preparation and the
//! camera use these functions.
//!
//! A motion runs from time 0 to time 1. The entries of an object's transform are interpolated
//! linearly (see [`raywright_bvh::Motion`]). The numbers of a camera's pose are interpolated in the
//! same manner.

use std::borrow::Cow;

use glam::DAffine3;
use raywright_bvh::Motion;

use crate::affine::affine_from_steps;
use crate::effects::{Effect, EffectSet};
use crate::scene::{Camera, Object, Pose, Scene, TransformStep};

/// Returns the affine maps of a moving object at time 0 and at time 1; `None` for a static object.
pub(crate) fn object_transforms_at_ends(object: &Object) -> Option<[DAffine3; 2]> {
    let end = affine_from_steps(object.transform_end.as_ref()?);
    let start = affine_from_steps(&object.transform);
    (start != end).then_some([start, end])
}

/// Whether the camera's pose at time 1 differs from its pose at time 0.
pub(crate) fn camera_moves(camera: &Camera) -> bool {
    camera
        .pose_end
        .as_ref()
        .is_some_and(|end| *end != camera.pose)
}

/// Returns the opening and the closing time of the camera's shutter, in [0, 1]. `None` without a
/// shutter, or if the two times are equal.
pub(crate) fn shutter_interval(camera: &Camera) -> Option<[f64; 2]> {
    camera.shutter.filter(|[open, close]| open < close)
}

/// Returns the opening time of the camera's shutter; 0 without a shutter. A picture in which motion
/// is not simulated shows the scene at this time.
pub(crate) fn shutter_opening(camera: &Camera) -> f64 {
    camera.shutter.map_or(0.0, |[open, _]| open)
}

/// Returns the camera's pose at a time in [0, 1]. Two poses of different kinds, which validation
/// refuses, are not interpolated.
pub(crate) fn pose_at(camera: &Camera, time: f64) -> Pose {
    let number = |a: f64, b: f64| a + (b - a) * time;
    let triple = |a: [f64; 3], b: [f64; 3]| core::array::from_fn(|i| number(a[i], b[i]));
    match (&camera.pose, &camera.pose_end) {
        (
            Pose::LookAt { eye, target, up },
            Some(Pose::LookAt {
                eye: e,
                target: t,
                up: u,
            }),
        ) => Pose::LookAt {
            eye: triple(*eye, *e),
            target: triple(*target, *t),
            up: triple(*up, *u),
        },
        (
            Pose::Orbit {
                target,
                distance,
                azimuth,
                elevation,
            },
            Some(Pose::Orbit {
                target: t,
                distance: d,
                azimuth: a,
                elevation: e,
            }),
        ) => Pose::Orbit {
            target: triple(*target, *t),
            distance: number(*distance, *d),
            azimuth: number(*azimuth, *a),
            elevation: number(*elevation, *e),
        },
        (
            Pose::Axes {
                eye,
                right,
                up,
                back,
            },
            Some(Pose::Axes {
                eye: e,
                right: r,
                up: u,
                back: b,
            }),
        ) => Pose::Axes {
            eye: triple(*eye, *e),
            right: triple(*right, *r),
            up: triple(*up, *u),
            back: triple(*back, *b),
        },
        (pose, _) => pose.clone(),
    }
}

/// Returns a static camera with the pose of `camera` at a time. The result has no shutter.
pub(crate) fn camera_at(camera: &Camera, time: f64) -> Camera {
    Camera {
        pose: pose_at(camera, time),
        pose_end: None,
        shutter: None,
        ..camera.clone()
    }
}

/// Returns the camera that preparation uses. Without simulated motion, it is the static camera at
/// the opening time of the shutter.
pub(crate) fn camera_with_simulated_motion(camera: Camera, simulated: EffectSet) -> Camera {
    if simulated.has(Effect::Motion) {
        camera
    } else {
        camera_at(&camera, shutter_opening(&camera))
    }
}

/// Returns the scene that preparation uses. Without simulated motion, every object is static, at
/// its position at the opening time of the shutter. A scene without motion is borrowed unchanged.
pub(crate) fn scene_with_simulated_motion<'a>(
    scene: &'a Scene,
    camera: Option<&Camera>,
    simulated: EffectSet,
) -> Cow<'a, Scene> {
    let generated = scene.generators.iter().map(|generator| &generator.object);
    if simulated.has(Effect::Motion)
        || scene
            .objects
            .iter()
            .chain(generated)
            .all(|object| object.transform_end.is_none())
    {
        return Cow::Borrowed(scene);
    }
    let (mut scene, time) = (scene.clone(), camera.map_or(0.0, shutter_opening));
    let generated = scene
        .generators
        .iter_mut()
        .map(|generator| &mut generator.object);
    scene
        .objects
        .iter_mut()
        .chain(generated)
        .for_each(|object| freeze_object(object, time));
    Cow::Owned(scene)
}

/// Makes an object static, at its position at a time. If its transform at that time is singular,
/// the object stays unchanged, and the construction of its geometry reports the error.
fn freeze_object(object: &mut Object, time: f64) {
    if let Some(ends) = object_transforms_at_ends(object) {
        let Ok(motion) = Motion::new(ends) else {
            return;
        };
        let map = motion.map_at(time);
        let row = |i: usize| [map.x_axis[i], map.y_axis[i], map.z_axis[i], map.w_axis[i]];
        object.transform = vec![TransformStep::Matrix([row(0), row(1), row(2)])];
    }
    object.transform_end = None;
}
