//! Camera of a picture: the scene's camera or a camera that frames the scene, with the changes of
//! the flags.

use glam::DVec3;
use raywright_core::framing::{FIELD_OF_VIEW, ViewAngles};
use raywright_core::scene::{AspectFit, Camera, Pinhole, Pose, Projection, Scene, Triple};
use raywright_io::Error;

use crate::args::ViewArgs;
use crate::failure::Failure;
use crate::suggest;

/// Returns the camera for these flags and this view; `None` if the scene has no camera and no flag
/// changes a camera, so that the renderer frames the scene. `framed` returns the camera that frames
/// the whole scene from a view, or from the default view, with a vertical field of view in degrees.
pub fn resolve_camera(
    scene: &Scene,
    (args, view): (&ViewArgs, Option<ViewAngles>),
    framed: impl FnOnce(Option<ViewAngles>, f64) -> Camera,
) -> Result<Option<Camera>, Failure> {
    let changed = args.eye.is_some()
        || args.target.is_some()
        || args.up.is_some()
        || args.fov.is_some()
        || args.zoom.is_some();
    let frame = || framed(view, args.fov.unwrap_or(FIELD_OF_VIEW));
    let is_own = view.is_none() && (args.camera.is_some() || !scene.cameras.is_empty());
    let mut camera = match (&args.camera, scene.cameras.first()) {
        _ if view.is_some() => frame(),
        (Some(name), _) => find_camera(scene, name)?,
        (None, Some(first)) => first.clone(),
        (None, None) if changed => frame(),
        (None, None) => return Ok(None),
    };
    if args.eye.is_some() || args.target.is_some() || args.up.is_some() {
        camera.pose = apply_pose_flags(&camera.pose, args)?;
        // A pose given by flags does not move during the exposure time.
        camera.pose_end = None;
    }
    match args.fov {
        Some(fov) => {
            set_fov(&mut camera.projection, fov)?;
            // The requested field of view applies to the aspect ratio of the picture, not of the
            // camera.
            camera.aspect = camera.aspect.filter(|_| camera.fit == AspectFit::Stretch);
        }
        None => keep_vertical_fov(&mut camera, scene.render.size, args.size),
    }
    // `--fit` does not apply to a framed camera, which has the aspect ratio of the picture.
    if let Some(fit) = args.fit.filter(|_| is_own) {
        let [width, height] = scene.render.size.map(f64::from);
        (camera.aspect, camera.fit) = (camera.aspect.or(Some(width / height)), fit);
    }
    if let Some(factor) = args.zoom {
        zoom_projection(&mut camera.projection, factor);
    }
    Ok(Some(camera))
}

/// Finds a camera of the scene by its name or, if no name fits, by its index from 0.
fn find_camera(scene: &Scene, name: &str) -> Result<Camera, Failure> {
    let by_name = scene
        .cameras
        .iter()
        .find(|camera| !camera.name.is_empty() && camera.name == name);
    let by_index = || {
        name.parse::<usize>()
            .ok()
            .and_then(|index| scene.cameras.get(index))
    };
    if let Some(camera) = by_name.or_else(by_index) {
        return Ok(camera.clone());
    }
    let names: Vec<&str> = scene
        .cameras
        .iter()
        .map(|camera| camera.name.as_str())
        .filter(|name| !name.is_empty())
        .collect();
    Err(match (scene.cameras.len(), names.is_empty()) {
        (0, _) => Error::invalid_usage("the scene has no camera of its own").with_hint(
            "leave out --camera to show the whole scene, or place a camera with --eye and --target",
        ),
        (1, true) => suggest::unknown_name_error("camera", name, &names)
            .with_hint("the scene has one camera, index 0"),
        (n, true) => suggest::unknown_name_error("camera", name, &names)
            .with_hint(format!("the scene has {n} cameras, index 0 to {}", n - 1)),
        _ => suggest::unknown_name_error("camera", name, &names),
    }
    .into())
}

/// Returns the pose with the eye, target and up vector of the flags. A camera given by its axes
/// keeps its orientation if only its eye is moved.
fn apply_pose_flags(pose: &Pose, args: &ViewArgs) -> Result<Pose, Failure> {
    let (eye, target, up) = match *pose {
        Pose::LookAt { eye, target, up } => (eye, target, up),
        Pose::Orbit { target, .. } => (pose.eye().into(), target, [0.0, 1.0, 0.0]),
        Pose::Axes {
            right, up, back, ..
        } if args.target.is_none() && args.up.is_none() => {
            return Ok(Pose::Axes {
                eye: args.eye.unwrap_or_default(),
                right,
                up,
                back,
            });
        }
        Pose::Axes { eye, up, back, .. } => {
            let eye = args.eye.unwrap_or(eye);
            let target = args
                .target
                .unwrap_or((DVec3::from(eye) - DVec3::from(back)).into());
            // A camera turned to a target stands upright, whatever its roll in the file. If the
            // camera looks straight up or down, the up vector of the file is used.
            let upright = (DVec3::from(target) - DVec3::from(eye))
                .normalize_or_zero()
                .cross(DVec3::Y)
                .length()
                > 1e-6;
            (eye, target, if upright { [0.0, 1.0, 0.0] } else { up })
        }
    };
    let (eye, target, up) = (
        args.eye.unwrap_or(eye),
        args.target.unwrap_or(target),
        args.up.unwrap_or(up),
    );
    check_pose(eye, target, up)
}

fn check_pose(eye: Triple, target: Triple, up: Triple) -> Result<Pose, Failure> {
    let view = DVec3::from(target) - DVec3::from(eye);
    let show = |[x, y, z]: Triple| format!("{x},{y},{z}");
    if !(view.length() > 0.0 && view.length().is_finite()) {
        let message = format!(
            "the camera's eye and target are the same point, {}",
            show(eye)
        );
        return Err(Failure::usage(
            message,
            "give --eye and --target different points",
        ));
    }
    let sine = view
        .normalize()
        .cross(DVec3::from(up).normalize_or_zero())
        .length();
    if sine < 1e-9 {
        let message = format!(
            "the view from {} to {} is parallel to the up direction {}",
            show(eye),
            show(target),
            show(up)
        );
        return Err(Failure::usage(
            message,
            "give another up direction, such as --up 0,0,1",
        ));
    }
    Ok(Pose::LookAt { eye, target, up })
}

fn set_fov(projection: &mut Projection, fov: f64) -> Result<(), Failure> {
    match projection {
        Projection::Pinhole(pinhole) | Projection::ThinLens { pinhole, .. } => {
            *pinhole = Pinhole {
                vertical_fov: Some(fov),
                ..Pinhole::default()
            };
            Ok(())
        }
        Projection::Orthographic { .. } => Err(Failure::usage(
            "--fov has no meaning for an orthographic camera",
            "set the camera's `height` in the scene file",
        )),
    }
}

/// Magnifies the middle of the picture by a factor: narrows the field of view, or lowers the height
/// of an orthographic view.
fn zoom_projection(projection: &mut Projection, factor: f64) {
    match projection {
        Projection::Pinhole(pinhole) | Projection::ThinLens { pinhole, .. } => {
            let narrowed = |degrees: &mut f64| {
                *degrees =
                    (2.0 * libm::atan(libm::tan(degrees.to_radians() * 0.5) / factor)).to_degrees();
            };
            pinhole.vertical_fov.iter_mut().for_each(narrowed);
            pinhole.horizontal_fov.iter_mut().for_each(narrowed);
            pinhole
                .focal_length
                .iter_mut()
                .for_each(|length| *length *= factor);
        }
        Projection::Orthographic { height } => *height /= factor,
    }
}

/// Keeps the vertical field of view of a camera if `--size` changes the aspect ratio. A horizontal
/// field of view is therefore converted to a focal length, at the aspect ratio of the file.
fn keep_vertical_fov(camera: &mut Camera, file: [u32; 2], requested: Option<[u32; 2]>) {
    let [width, height] = file.map(f64::from);
    let other_shape = requested.is_some_and(|[w, h]| {
        u64::from(w) * u64::from(file[1]) != u64::from(h) * u64::from(file[0])
    });
    if let Projection::Pinhole(pinhole) | Projection::ThinLens { pinhole, .. } =
        &mut camera.projection
        && let Pinhole {
            vertical_fov: None,
            horizontal_fov: Some(fov),
            ..
        } = *pinhole
        && camera.aspect.is_none()
        && other_shape
    {
        let focal_length = 0.5 / libm::tan(fov.to_radians() / 2.0) * width / height;
        *pinhole = Pinhole {
            focal_length: Some(focal_length),
            ..Pinhole::default()
        };
    }
}

#[cfg(test)]
mod tests;
