//! Camera of a picture: found by name, and changed by each flag.

use super::*;

fn scene() -> Scene {
    let camera = |name: &str, pose: Pose, pinhole: Pinhole| Camera {
        name: name.to_owned(),
        pose,
        projection: Projection::Pinhole(pinhole),
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    };
    let wide = Pinhole {
        horizontal_fov: Some(90.0),
        ..Pinhole::default()
    };
    let look_at = Pose::LookAt {
        eye: [0.0, 0.0, 5.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
    };
    let orbit = Pose::Orbit {
        target: [0.0; 3],
        distance: 2.0,
        azimuth: 90.0,
        elevation: 0.0,
    };
    let axes = Pose::Axes {
        eye: [0.0; 3],
        right: [1.0, 0.0, 0.0],
        up: [0.0, 1.0, 0.0],
        back: [0.0, 0.0, 1.0],
    };
    let mut scene = Scene {
        cameras: vec![camera("front", look_at, wide)],
        ..Scene::default()
    };
    scene.cameras.push(camera(
        "side",
        orbit,
        Pinhole {
            vertical_fov: Some(40.0),
            ..Pinhole::default()
        },
    ));
    scene.cameras.push(camera(
        "",
        axes,
        Pinhole {
            vertical_fov: Some(40.0),
            ..Pinhole::default()
        },
    ));
    scene.render.size = [200, 100];
    scene
}

fn camera_from_args(args: &ViewArgs) -> Result<Camera, Failure> {
    let taken = resolve_camera(&scene(), (args, None), |_, _| {
        panic!("the scene has cameras")
    })?;
    Ok(taken.expect("the scene has cameras"))
}

fn view_args(name: &str) -> ViewArgs {
    ViewArgs {
        camera: Some(name.to_owned()),
        ..ViewArgs::default()
    }
}

/// Protects: names take precedence over indices, and an unknown name gives a helpful error.
#[test]
fn cameras_are_found_by_name_and_by_index() {
    assert_eq!(
        camera_from_args(&ViewArgs::default())
            .expect("the first")
            .name,
        "front"
    );
    assert_eq!(
        camera_from_args(&view_args("side")).expect("by name").name,
        "side"
    );
    assert_eq!(
        camera_from_args(&view_args("1")).expect("by index").name,
        "side"
    );
    assert_eq!(
        camera_from_args(&view_args("2")).expect("by index").name,
        ""
    );
    assert!(
        camera_from_args(&view_args("")).is_err(),
        "a camera without a name has an index alone"
    );
    let message = camera_from_args(&view_args("fornt"))
        .expect_err("unknown")
        .message;
    assert!(message.contains("did you mean `front`?"), "{message}");
    assert!(camera_from_args(&view_args("3")).is_err());
}

/// Protects: a flag changes only its own part of a pose (eye, target or up vector), for each
/// form of pose in the file.
#[test]
fn flags_change_one_part_of_a_pose() {
    let pose = |args: ViewArgs| camera_from_args(&args).expect("a camera").pose;
    let eye = Some([1.0, 2.0, 3.0]);
    let up = [0.0, 1.0, 0.0];
    assert_eq!(
        pose(ViewArgs {
            eye,
            ..view_args("front")
        }),
        Pose::LookAt {
            eye: [1.0, 2.0, 3.0],
            target: [0.0; 3],
            up
        }
    );
    let Pose::LookAt {
        eye: from, target, ..
    } = pose(ViewArgs {
        target: Some([0.0, 1.0, 0.0]),
        ..view_args("side")
    })
    else {
        panic!("an orbit that is turned becomes a look-at");
    };
    assert!(
        (DVec3::from(from) - DVec3::new(2.0, 0.0, 0.0)).length() < 1e-12,
        "{from:?}"
    );
    assert_eq!(target, [0.0, 1.0, 0.0]);
    let Pose::Axes {
        eye: moved, back, ..
    } = pose(ViewArgs {
        eye,
        ..view_args("2")
    })
    else {
        panic!("axes that are only moved stay axes");
    };
    assert_eq!((moved, back), ([1.0, 2.0, 3.0], [0.0, 0.0, 1.0]));
    assert_eq!(
        pose(ViewArgs {
            up: Some([1.0, 0.0, 0.0]),
            eye,
            ..view_args("2")
        }),
        Pose::LookAt {
            eye: [1.0, 2.0, 3.0],
            target: [1.0, 2.0, 2.0],
            up: [1.0, 0.0, 0.0]
        }
    );
}

/// Protects: a camera with roll stands upright after a turn to a target, unless the target is
/// straight below.
#[test]
fn a_turned_camera_stands_upright() {
    let mut scene = scene();
    let h = std::f64::consts::FRAC_1_SQRT_2;
    scene.cameras[2].pose = Pose::Axes {
        eye: [0.0, 0.0, 5.0],
        right: [h, h, 0.0],
        up: [-h, h, 0.0],
        back: [0.0, 0.0, 1.0],
    };
    let pose = |target: Triple| {
        let args = ViewArgs {
            target: Some(target),
            ..view_args("2")
        };
        resolve_camera(&scene, (&args, None), |_, _| {
            panic!("the scene has cameras")
        })
        .expect("a camera")
        .expect("one")
        .pose
    };
    let eye = [0.0, 0.0, 5.0];
    assert_eq!(
        pose([1.0, 2.0, 0.0]),
        Pose::LookAt {
            eye,
            target: [1.0, 2.0, 0.0],
            up: [0.0, 1.0, 0.0]
        }
    );
    assert_eq!(
        pose([0.0, -9.0, 5.0]),
        Pose::LookAt {
            eye,
            target: [0.0, -9.0, 5.0],
            up: [-h, h, 0.0]
        }
    );
}

/// Protects: a camera that frames the scene from above stands upright after a flag moves it, unless
/// it still looks straight down; a look-at of the file keeps its own up vector.
#[test]
fn a_moved_top_view_stands_upright() {
    let top = |eye: Triple| {
        let args = ViewArgs {
            eye: Some(eye),
            ..ViewArgs::default()
        };
        let framed = |_, _| Camera {
            pose: Pose::LookAt {
                eye: [0.0, 5.0, 0.0],
                target: [0.0; 3],
                up: [0.0, 0.0, -1.0],
            },
            ..scene().cameras[0].clone()
        };
        let camera = resolve_camera(&Scene::default(), (&args, None), framed);
        camera.expect("a camera").expect("one").pose
    };
    let up_of = |pose: Pose| match pose {
        Pose::LookAt { up, .. } => up,
        other => panic!("{other:?}"),
    };
    assert_eq!(up_of(top([3.0, 4.0, 0.0])), [0.0, 1.0, 0.0]);
    assert_eq!(up_of(top([0.0, 9.0, 0.0])), [0.0, 0.0, -1.0]);
    let mut scene = scene();
    scene.cameras[0].pose = Pose::LookAt {
        eye: [0.0, 0.0, 5.0],
        target: [0.0; 3],
        up: [1.0, 0.0, 0.0],
    };
    let args = ViewArgs {
        eye: Some([0.0, 3.0, 5.0]),
        ..ViewArgs::default()
    };
    let own = resolve_camera(&scene, (&args, None), |_, _| {
        panic!("the scene has cameras")
    });
    let own = own.expect("a camera").expect("one").pose;
    assert_eq!(up_of(own), [1.0, 0.0, 0.0]);
}

/// Protects: an animated camera that a flag places stands still, and keeps its exposure time
/// for the motion of objects.
#[test]
fn a_camera_that_is_put_somewhere_stands_there() {
    let mut scene = scene();
    let end = Pose::LookAt {
        eye: [1.0; 3],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
    };
    (scene.cameras[0].pose_end, scene.cameras[0].shutter) = (Some(end.clone()), Some([0.0, 1.0]));
    let taken = |args: &ViewArgs| {
        resolve_camera(&scene, (args, None), |_, _| panic!("the scene has cameras"))
            .expect("a camera")
            .expect("one")
    };
    assert_eq!(
        taken(&ViewArgs {
            fov: Some(20.0),
            ..view_args("front")
        })
        .pose_end,
        Some(end)
    );
    let put = taken(&ViewArgs {
        eye: Some([1.0, 2.0, 3.0]),
        ..view_args("front")
    });
    assert_eq!((put.pose_end, put.shutter), (None, Some([0.0, 1.0])));
}

/// Protects: a zoom magnifies by its factor for every kind of camera, also with a field of view
/// from `--fov`. A view replaces the scene's cameras, and frames the scene with the requested
/// field of view.
#[test]
fn zooms_and_views_go_with_an_angle() {
    let half = |args: ViewArgs| {
        let Projection::Pinhole(pinhole) = camera_from_args(&args).expect("a camera").projection
        else {
            panic!("a pinhole")
        };
        libm::tan(
            pinhole
                .vertical_fov
                .or(pinhole.horizontal_fov)
                .expect("an angle")
                .to_radians()
                / 2.0,
        )
    };
    for args in [
        view_args("front"),
        view_args("side"),
        ViewArgs {
            fov: Some(50.0),
            ..view_args("side")
        },
    ] {
        let zoomed = half(ViewArgs {
            zoom: Some(4.0),
            ..args.clone()
        });
        assert!((half(args) / zoomed - 4.0).abs() < 1e-12);
    }
    let mut flat = Projection::Orthographic { height: 3.0 };
    zoom_projection(&mut flat, 1.5);
    assert_eq!(flat, Projection::Orthographic { height: 2.0 });
    let side = ViewAngles {
        azimuth: 10.0,
        elevation: 20.0,
    };
    for (fov, expected) in [(None, FIELD_OF_VIEW), (Some(15.0), 15.0)] {
        let requested = |view, fov| {
            assert_eq!((view, fov), (Some(side), expected));
            scene().cameras[1].clone()
        };
        let args = ViewArgs {
            fov,
            ..ViewArgs::default()
        };
        assert_eq!(
            resolve_camera(&scene(), (&args, Some(side)), requested)
                .expect("a view")
                .map(|camera| camera.name),
            Some("side".to_owned())
        );
    }
}

/// Protects: a degenerate view is refused before the render.
#[test]
fn impossible_views_are_refused() {
    assert!(
        camera_from_args(&ViewArgs {
            eye: Some([0.0; 3]),
            ..view_args("front")
        })
        .is_err()
    );
    assert!(
        camera_from_args(&ViewArgs {
            up: Some([0.0, 0.0, 1.0]),
            ..view_args("front")
        })
        .is_err()
    );
    assert!(
        camera_from_args(&ViewArgs {
            up: Some([0.0; 3]),
            ..view_args("front")
        })
        .is_err()
    );
}

/// Protects: with another aspect ratio a picture shows more at the sides and the same height;
/// with the aspect ratio of the file it is unchanged.
#[test]
fn the_vertical_angle_survives_another_shape() {
    let projection = |size| {
        camera_from_args(&ViewArgs {
            size,
            ..view_args("front")
        })
        .expect("a camera")
        .projection
    };
    let Projection::Pinhole(square) = projection(Some([100, 100])) else {
        panic!("still a pinhole")
    };
    assert_eq!(
        (
            square.horizontal_fov,
            square.focal_length.map(|f| (f * 1e9).round())
        ),
        (None, Some(1e9))
    );
    assert_eq!(projection(Some([400, 200])), projection(None));
    let Projection::Pinhole(narrow) = camera_from_args(&ViewArgs {
        fov: Some(20.0),
        ..view_args("front")
    })
    .expect("a camera")
    .projection
    else {
        panic!("still a pinhole")
    };
    assert_eq!(
        (narrow.vertical_fov, narrow.horizontal_fov),
        (Some(20.0), None)
    );
}

/// Protects: `--fit` uses the camera's aspect ratio or, without one, the file's; a requested
/// angle is that of the picture.
#[test]
fn pictures_of_another_shape_are_fitted() {
    let mut scene = scene();
    scene.cameras[1].aspect = Some(1.5);
    scene.cameras[1].fit = AspectFit::Contain;
    let value_of = |args: ViewArgs| {
        let taken = resolve_camera(&scene, (&args, None), |_, _| {
            panic!("the scene has cameras")
        })
        .expect("a camera")
        .expect("one");
        (taken.aspect, taken.fit)
    };
    let fit = Some(AspectFit::Cover);
    assert_eq!(
        value_of(ViewArgs {
            fit,
            ..view_args("side")
        }),
        (Some(1.5), AspectFit::Cover)
    );
    assert_eq!(
        value_of(ViewArgs {
            fit,
            ..view_args("2")
        }),
        (Some(2.0), AspectFit::Cover)
    );
    assert_eq!(value_of(view_args("side")), (Some(1.5), AspectFit::Contain));
    assert_eq!(
        value_of(ViewArgs {
            fov: Some(30.0),
            ..view_args("side")
        })
        .0,
        None
    );
    let framed = scene.cameras[1].clone();
    let none = Scene {
        cameras: Vec::new(),
        ..scene.clone()
    };
    let args = ViewArgs {
        fit,
        zoom: Some(1.0),
        ..ViewArgs::default()
    };
    let taken = resolve_camera(&none, (&args, None), |_, _| framed.clone())
        .expect("a camera")
        .expect("one");
    assert_eq!((taken.aspect, taken.fit), (framed.aspect, framed.fit));
}

/// Protects: a camera with its own aspect ratio shows the same part of the scene in a picture
/// of any size.
#[test]
fn a_fixed_shape_is_kept() {
    let mut scene = scene();
    scene.cameras[0].aspect = Some(1.0);
    let args = ViewArgs {
        size: Some([100, 100]),
        ..view_args("front")
    };
    let taken = resolve_camera(&scene, (&args, None), |_, _| {
        panic!("the scene has cameras")
    })
    .expect("a camera");
    assert_eq!(
        taken.map(|camera| camera.projection),
        Some(scene.cameras[0].projection.clone())
    );
}
