//! Pictures of a run, by view, by angle of a turntable or by time of the animation, and the camera of
//! each: the scene's camera or a camera that frames the scene, with the changes of the flags.

use glam::DVec3;
use raywright_core::framing::{FIELD_OF_VIEW, Silhouette, ViewAngles};
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
    framed: impl Fn(Option<ViewAngles>, f64) -> Camera,
) -> Result<Option<Camera>, Failure> {
    let changed = args.ortho
        || args.eye.is_some()
        || args.target.is_some()
        || args.up.is_some()
        || args.fov.is_some()
        || args.zoom.is_some();
    // A field of view of 0 stands for parallel rays.
    let fov = match args.ortho {
        true => 0.0,
        false => args.fov.unwrap_or(FIELD_OF_VIEW),
    };
    let frame = |view| framed(view, fov);
    let is_framed = view.is_some() || args.ortho;
    let is_own = !is_framed && (args.camera.is_some() || !scene.cameras.is_empty());
    let mut camera = match (&args.camera, scene.cameras.first()) {
        _ if is_framed => frame(view),
        (Some(name), _) => find_camera(scene, name)?,
        (None, Some(first)) => first.clone(),
        (None, None) if changed => frame(view),
        (None, None) => return Ok(None),
    };
    if args.eye.is_some() || args.target.is_some() || args.up.is_some() {
        camera.pose = apply_pose_flags(&camera.pose, is_own, args)?;
        if args.ortho {
            camera.projection = frame(Some(view_of(&camera.pose))).projection;
        }
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

/// Returns the direction of the view of an upright pose.
fn view_of(pose: &Pose) -> ViewAngles {
    let Pose::LookAt { eye, target, .. } = *pose else {
        return ViewAngles::DEFAULT;
    };
    let back = (DVec3::from(eye) - DVec3::from(target)).normalize_or_zero();
    ViewAngles {
        azimuth: libm::atan2(back.x, back.z).to_degrees(),
        elevation: libm::asin(back.y.clamp(-1.0, 1.0)).to_degrees(),
    }
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

/// Applies eye, target and up vector of the flags to a pose. A camera of the file that is only moved
/// keeps its directions, and a look-at of the file its up vector. Every other camera stands upright,
/// whatever its roll: that of a top view, for example. If the camera looks straight up or down, the
/// up vector of the pose is used.
fn apply_pose_flags(pose: &Pose, is_own: bool, args: &ViewArgs) -> Result<Pose, Failure> {
    let (eye, target, up) = match *pose {
        Pose::LookAt { eye, target, up } => (eye, target, up),
        Pose::Orbit { target, .. } => (pose.eye().into(), target, UPRIGHT),
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
            (eye, (DVec3::from(eye) - DVec3::from(back)).into(), up)
        }
    };
    let (eye, target) = (args.eye.unwrap_or(eye), args.target.unwrap_or(target));
    let ahead = (DVec3::from(target) - DVec3::from(eye)).normalize_or_zero();
    let is_vertical = ahead.cross(UPRIGHT.into()).length() <= 1e-6;
    let keeps_up = is_vertical || is_own && matches!(pose, Pose::LookAt { .. });
    let up = args.up.unwrap_or(if keeps_up { up } else { UPRIGHT });
    check_pose(eye, target, up)
}

/// Up vector of an upright camera.
const UPRIGHT: Triple = [0.0, 1.0, 0.0];

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

/// A picture of a scene: its view, its time and its labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PictureJob {
    /// Index of its scene in the run.
    pub scene: usize,
    /// Suffix of the default file name; empty: none.
    pub label: String,
    /// Caption on a contact sheet.
    pub caption: String,
    /// Time in the animation in seconds; `None`: the time of `--at`.
    pub at: Option<f64>,
    /// View of the whole scene; `None`: the scene's own camera.
    pub view: Option<ViewAngles>,
    /// Rotation of a turntable in degrees, added to the azimuth of the view.
    pub turntable_degrees: Option<f64>,
}

impl PictureJob {
    /// Returns the view of the picture; `None` stands for the scene's own camera. `silhouette`
    /// returns the scene's silhouette. A turntable without a view starts at the front of the scene,
    /// which is found from the silhouette.
    pub fn resolve_view<'a>(
        &self,
        silhouette: impl FnOnce() -> &'a Silhouette,
    ) -> Option<ViewAngles> {
        let Some(turn) = self.turntable_degrees else {
            return self.view;
        };
        let view = self.view.unwrap_or_else(|| silhouette().default_view());
        Some(ViewAngles {
            azimuth: view.azimuth + turn,
            ..view
        })
    }
}

/// Lists the pictures of each scene for these flags: a single picture without label, or the
/// pictures of `--views`, `--turntable` or `--frames`.
pub(super) fn list_jobs(args: &ViewArgs) -> Vec<PictureJob> {
    let numbered = |number: usize, caption: String| PictureJob {
        label: format!("{number:04}"),
        caption,
        view: args.view,
        ..PictureJob::default()
    };
    if let Some(views) = &args.views {
        let shot = |(name, view): &(String, ViewAngles)| PictureJob {
            label: name.replace(',', "_"),
            caption: name.clone(),
            view: Some(*view),
            ..PictureJob::default()
        };
        views.0.iter().map(shot).collect()
    } else if let Some(count) = args.turntable {
        let degrees = (0..count).map(|i| 360.0 * f64::from(i) / f64::from(count));
        degrees
            .enumerate()
            .map(|(i, turn)| PictureJob {
                turntable_degrees: Some(turn),
                ..numbered(i, format!("{turn:.0}°"))
            })
            .collect()
    } else if let Some(frames) = args.frames {
        let times = frames.picture_times().enumerate();
        times
            .map(|(i, time)| PictureJob {
                at: Some(time),
                ..numbered(i, format!("{time:.2} s"))
            })
            .collect()
    } else {
        vec![PictureJob {
            view: args.view,
            ..PictureJob::default()
        }]
    }
}

/// Seconds of a turn of `--turntable` without `--fps`.
const TURN_SECONDS: f64 = 4.0;

/// Returns the pictures per second of an animation file.
pub(super) fn frame_rate(args: &ViewArgs) -> f64 {
    let turn = args.turntable.map(|count| f64::from(count) / TURN_SECONDS);
    let own = args.frames.map(|frames| frames.rate).or(turn);
    args.fps.or(own).unwrap_or(1.0)
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod shots_tests {
    use super::*;
    use crate::args::values;

    /// Protects: each flag makes its pictures in order; without such flags, the default picture has
    /// the requested view.
    #[test]
    fn flags_make_pictures() {
        let view = Some(ViewAngles {
            azimuth: 3.0,
            elevation: 4.0,
        });
        for (requested, expected) in [(None, None), (view, view)] {
            let found = list_jobs(&ViewArgs {
                view: requested,
                ..ViewArgs::default()
            });
            assert_eq!(
                found,
                [PictureJob {
                    view: expected,
                    ..PictureJob::default()
                }]
            );
        }
        let views = values::parse_views("front,30,-20,iso").expect("views");
        let found = list_jobs(&ViewArgs {
            views: Some(views),
            ..ViewArgs::default()
        });
        let labels: Vec<_> = found.iter().map(|shot| shot.label.as_str()).collect();
        assert_eq!(labels, ["front", "30_-20", "iso"]);
        assert_eq!(
            found[1].view,
            Some(ViewAngles {
                azimuth: 30.0,
                elevation: -20.0
            })
        );
        let turns = list_jobs(&ViewArgs {
            turntable: Some(4),
            ..ViewArgs::default()
        });
        assert_eq!(
            turns
                .iter()
                .map(|shot| shot.turntable_degrees)
                .collect::<Vec<_>>(),
            [0.0, 90.0, 180.0, 270.0].map(Some)
        );
        let played = ViewArgs {
            frames: Some(values::parse_frame_times("0..1:12").expect("moments")),
            ..ViewArgs::default()
        };
        let rates = [
            played,
            ViewArgs {
                turntable: Some(10),
                ..ViewArgs::default()
            },
            ViewArgs {
                turntable: Some(10),
                fps: Some(25.0),
                ..ViewArgs::default()
            },
            ViewArgs::default(),
        ]
        .map(|args| frame_rate(&args));
        assert_eq!(rates, [12.0, 2.5, 25.0, 1.0]);
        let frames = |text: &str| {
            let frames = Some(values::parse_frame_times(text).expect("moments"));
            list_jobs(&ViewArgs {
                frames,
                ..ViewArgs::default()
            })
            .iter()
            .filter_map(|shot| shot.at)
            .collect::<Vec<_>>()
        };
        assert_eq!(frames("0..1:4"), [0.0, 0.25, 0.5, 0.75]);
        assert_eq!(
            (frames("-1..0.5:2"), frames("0..0.1:3")),
            (vec![-1.0, -0.5, 0.0], vec![0.0])
        );
        for wrong in [
            "",
            "1",
            "0..1",
            "1..0:5",
            "0..1:0",
            "0..1:-2",
            "0..1e9:25",
            "a..b:c",
            "all",
            "all:0",
            "0..inf:25",
        ] {
            assert!(values::parse_frame_times(wrong).is_err(), "{wrong}");
        }
        assert!(
            values::parse_views("front,top,sideways").is_err()
                && values::parse_views("30").is_err()
        );
    }
}
