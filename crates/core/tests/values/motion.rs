//! Motion blur against shares of time in closed form, and static scenes against pictures without a
//! shutter, bit by bit.

use glam::DVec3;
use raywright_core::camera::PreparedCamera;
use raywright_core::effects::{Effect, EffectSet};
use raywright_core::picture::Picture;
use raywright_core::scene::{Camera as CameraData, Projection, SamplePattern, Scene};
use raywright_core::settings::{Aov, PrecisionChoice, Sampling};
use raywright_core::{
    RenderOutput, Settings, estimate_scene_memory, measure_scene_extent, prepare,
};
use serde_json::{Value, json};

use crate::support::{ball, classic, expect_near, render_scene, scene, sun};

/// Columns of the picture, each a quarter of a metre wide, from x = 0 on.
const COLUMNS: u32 = 32;
const SAMPLES: u32 = 1024;
const PRECISIONS: [PrecisionChoice; 2] = [PrecisionChoice::Robust, PrecisionChoice::Reference];

fn translated(offset: [f64; 3]) -> Value {
    json!([{ "translate": offset }])
}

/// An orthographic camera along −z with one row of pixels, and further keys.
fn view(mut keys: Value) -> Value {
    keys["pose"] = json!({ "look_at": { "eye": [4, 0, 9], "target": [4, 0, 0] } });
    keys["projection"] = json!({ "orthographic": { "height": 0.25 } });
    json!([keys])
}

/// White objects in the dark.
fn white(objects: Value, cameras: Value) -> Scene {
    let model = classic(json!({ "ambient": 1, "colour": 1 }));
    scene(
        json!({ "cameras": cameras, "objects": objects, "materials": [{ "name": "white", "model": model }] }),
    )
}

/// A wall of three metres from x = 0.5 on, which moves five metres to the right.
fn wall(end: Option<[f64; 3]>) -> Value {
    let quad = json!({ "corner": [0.5, -2, 0], "edge_u": [3, 0, 0], "edge_v": [0, 4, 0] });
    json!([{ "shape": { "quad": quad }, "material": "white", "transform_end": end.map(translated) }])
}

const FAR: Option<[f64; 3]> = Some([5.0, 0.0, 0.0]);

fn asked(scene: &Scene) -> Settings {
    Settings {
        size: [COLUMNS, 1],
        sampling: Sampling::General(SAMPLES),
        ..Settings::from_scene(scene)
    }
}

fn row(rendered: &RenderOutput) -> Vec<f64> {
    rendered
        .picture
        .rgb
        .iter()
        .map(|p| f64::from(p[0]))
        .collect()
}

/// The integral up to y of a number clamped to [0, 1].
fn kept(y: f64) -> f64 {
    if y <= 0.0 {
        0.0
    } else if y <= 1.0 {
        y * y / 2.0
    } else {
        y - 0.5
    }
}

/// Coverage of a column by the wall that moves from `start` by `travel`: the mean over the column
/// of the share of time at which the wall covers it, the time before the left edge passes less the
/// time before the right edge passes.
fn coverage(column: u32, start: f64, travel: f64) -> f64 {
    let (left, right) = (0.25 * f64::from(column), 0.25 * f64::from(column + 1));
    let passed = |edge: f64| {
        (kept((right - edge) / travel) - kept((left - edge) / travel)) * travel / (right - left)
    };
    passed(start) - passed(start + 3.0)
}

/// Protects: each column shows the share of time and width that the moving wall covers, within four
/// standard errors of independent samples, and exactly if the wall always or never covers it; for
/// the whole motion and for a shutter open in its middle, for a shape and for a mesh, in every
/// precision.
#[test]
fn a_moving_wall_covers_columns_by_its_share_of_time() {
    let mesh = json!([{ "name": "wall", "source": { "inline": { "indices": [[0, 1, 2], [0, 2, 3]],
        "positions": [[0.5, -2, 0], [3.5, -2, 0], [3.5, 2, 0], [0.5, 2, 0]] } } }]);
    for (shutter, start, travel) in [([0.0, 1.0], 0.5, 5.0), ([0.25, 0.5], 1.75, 1.25)] {
        let shape = white(wall(FAR), view(json!({ "shutter": shutter })));
        let mut of_mesh = shape.clone();
        of_mesh.meshes = serde_json::from_value(mesh.clone()).expect("a mesh");
        of_mesh.objects[0].shape =
            serde_json::from_value(json!({ "mesh": "wall" })).expect("a mesh");
        for (scene, precision) in [&shape, &of_mesh]
            .into_iter()
            .flat_map(|s| PRECISIONS.map(|p| (s, p)))
        {
            let seen = row(&render_scene(
                scene,
                &Settings {
                    precision,
                    ..asked(scene)
                },
            ));
            let mut between = 0;
            for (column, &found) in (0..COLUMNS).zip(&seen) {
                let expected = coverage(column, start, travel);
                let error = (expected * (1.0 - expected) / f64::from(SAMPLES))
                    .max(0.0)
                    .sqrt();
                assert!(
                    (found - expected).abs() <= 4.0 * error + 1e-6,
                    "column {column}: {found} instead of {expected}"
                );
                between += u32::from(error > 1e-3);
            }
            assert!(between >= 10, "{between}");
        }
    }
}

/// Protects: a moving object casts its shadow from its position at the path's time: a spot of the
/// floor is dark for the share of time with the wall above it. Shadow rays without their path's
/// time would find it lit, or dark.
#[test]
fn shadows_move() {
    let plank = json!({ "shape": { "quad": { "corner": [-3, 1, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2] } },
        "material": "matte", "transform_end": translated([5.0, 0.0, 0.0]) });
    let floor = json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "matte" });
    let scene = scene(json!({
        "cameras": [{ "pose": { "look_at": { "eye": [0, 1, 4], "target": [0, 0, 0] } },
            "projection": { "orthographic": { "height": 1e-4 } }, "shutter": [0, 1] }],
        "objects": [plank, floor], "lights": [sun([0.0, 1.0, 0.0])],
        "materials": [{ "name": "matte", "model": classic(json!({ "colour": 1, "diffuse": 1 })) }] }));
    let settings = Settings {
        size: [1, 1],
        sampling: Sampling::General(4096),
        ..Settings::from_scene(&scene)
    };
    // The plank is above the spot from time 1/5 to time 3/5.
    let actual = row(&render_scene(&scene, &settings))[0];
    let error = (0.4 * 0.6 / 4096.0_f64).sqrt();
    assert!((actual - 0.6).abs() < 4.0 * error, "{actual}");
}

/// Protects: without motion a shutter changes no bit and is no effect; nor does motion without a
/// shutter, or sampled at one time only.
#[test]
fn what_stands_still_has_the_same_bits() {
    let plain = white(wall(None), view(json!({})));
    let expected = render_scene(&plain, &asked(&plain)).picture.rgb;
    let pose = json!({ "look_at": { "eye": [4, 0, 9], "target": [4, 0, 0] } });
    for (objects, camera, status) in [
        (wall(None), json!({ "shutter": [0, 1] }), "absent"),
        (
            wall(None),
            json!({ "shutter": [0, 1], "pose_end": pose }),
            "absent",
        ),
        (wall(Some([0.0; 3])), json!({ "shutter": [0, 1] }), "absent"),
        (wall(FAR), json!({ "shutter": [0, 0] }), "absent"),
        (wall(FAR), json!({}), "left-out"),
    ] {
        let scene = white(objects, view(camera));
        let ready = prepare(&scene, &asked(&scene), &()).expect("a sound scene");
        let found = serde_json::to_value(ready.effects().status(Effect::Motion)).expect("a word");
        assert_eq!((found, ready.table_sizes().instances), (json!(status), 0));
        assert_eq!(ready.render(&()).picture.rgb, expected);
    }
}

/// Protects: if motion is switched off, or a fixed pattern samples one time only, objects and
/// camera stand as at the shutter's opening, and no data of the motion is kept.
#[test]
fn without_motion_everything_stands_as_the_shutter_opens() {
    let shifted = |x: f64| json!({ "look_at": { "eye": [x, 0, 9], "target": [x, 0, 0] } });
    let moving = white(
        wall(FAR),
        view(json!({ "shutter": [0.25, 1], "pose_end": shifted(8.0) })),
    );
    let mut cameras = view(json!({}));
    cameras[0]["pose"] = shifted(5.0);
    let mut objects = wall(None);
    objects[0]["transform"] = translated([1.25, 0.0, 0.0]);
    let standing = white(objects, cameras);
    let without = EffectSet::from_effects(&[Effect::Motion]);
    let fixed = |settings: Settings| Settings {
        sampling: Sampling::Pattern(SamplePattern::Corners),
        ..settings
    };
    for (settings, expected) in [
        (
            Settings {
                without,
                ..asked(&moving)
            },
            asked(&standing),
        ),
        (fixed(asked(&moving)), fixed(asked(&standing))),
    ] {
        let ready = prepare(&moving, &settings, &()).expect("a sound scene");
        let picture = ready.render(&()).picture.rgb;
        assert_eq!(
            (picture, ready.table_sizes().instances),
            (render_scene(&standing, &expected).picture.rgb, 0)
        );
        assert_eq!(
            ready
                .effects()
                .left_out()
                .map(|f| f.effect)
                .collect::<Vec<_>>(),
            [Effect::Motion]
        );
    }
    let blurred = render_scene(&moving, &asked(&moving)).picture.rgb;
    assert_ne!(
        blurred,
        render_scene(&standing, &asked(&standing)).picture.rgb
    );
}

/// Protects: a camera that moves along with an object sees it static, to the bit for exact numbers;
/// layers of pixel centres show the moment of the shutter's opening.
#[test]
fn a_camera_that_goes_along_sees_it_still() {
    let pose = json!({ "look_at": { "eye": [12, 0, 9], "target": [12, 0, 0] } });
    let along = white(
        wall(Some([8.0, 0.0, 0.0])),
        view(json!({ "shutter": [0, 1], "pose_end": pose })),
    );
    let still = white(wall(None), view(json!({})));
    let picture = |scene: &Scene| {
        let settings = Settings {
            precision: PrecisionChoice::Reference,
            aovs: vec![Aov::Object],
            ..asked(scene)
        };
        let picture = render_scene(scene, &settings).picture;
        (
            picture.rgb.clone(),
            picture
                .layer("object.id")
                .expect("asked for")
                .samples
                .clone(),
        )
    };
    assert_eq!(picture(&along), picture(&still));
    assert!(
        picture(&still).0.iter().any(|p| p[0] == 1.0)
            && picture(&still).0.iter().any(|p| p[0] == 0.0)
    );
}

fn camera(pose: Value, end: Value) -> PreparedCamera<f64> {
    let projection = json!({ "pinhole": { "vertical_fov": 40 } });
    let data =
        json!({ "pose": pose, "pose_end": end, "shutter": [0.5, 1], "projection": projection });
    let data: CameraData = serde_json::from_value(data).expect("a camera");
    PreparedCamera::new(&data, [2, 2])
}

/// Protects: a camera's eye, target, angles and axes are interpolated linearly, each number by
/// itself, from the opening to the closing of its shutter; its rays carry their times.
#[test]
fn poses_run_number_by_number() {
    let middle = |camera: &PreparedCamera<f64>, share: f32| {
        camera.generate_timed_ray(1.0, 1.0, [0.5; 2], share)
    };
    let expect_camera_ray = |camera: &PreparedCamera<f64>,
                             share: f32,
                             time: f64,
                             eye: DVec3,
                             target_direction: DVec3| {
        let ray = middle(camera, share);
        assert_eq!(ray.time, time);
        assert!(
            (ray.origin - eye).length() < 1e-12,
            "{} instead of {eye}",
            ray.origin
        );
        let direction = (target_direction - eye).normalize();
        assert!(
            (ray.direction - direction).length() < 1e-12,
            "{} instead of {direction}",
            ray.direction
        );
    };
    let looking = camera(
        json!({ "look_at": { "eye": [0, 0, 8], "target": [0, 0, 0] } }),
        json!({ "look_at": { "eye": [8, 4, 8], "target": [0, 4, -4] } }),
    );
    expect_camera_ray(
        &looking,
        0.0,
        0.5,
        DVec3::new(4.0, 2.0, 8.0),
        DVec3::new(0.0, 2.0, -2.0),
    );
    expect_camera_ray(
        &looking,
        0.5,
        0.75,
        DVec3::new(6.0, 3.0, 8.0),
        DVec3::new(0.0, 3.0, -3.0),
    );
    let orbiting = camera(
        json!({ "orbit": { "target": [1, 0, 0], "distance": 2, "azimuth": 0, "elevation": 0 } }),
        json!({ "orbit": { "target": [1, 0, 0], "distance": 6, "azimuth": 180, "elevation": 0 } }),
    );
    expect_camera_ray(&orbiting, 0.0, 0.5, DVec3::new(5.0, 0.0, 0.0), DVec3::X);
    let axes = |x: f64| json!({ "axes": { "eye": [x, 0, 0], "right": [1, 0, 0], "up": [0, 1, 0], "back": [0, 0, 1.0 + x] } });
    expect_camera_ray(
        &camera(axes(0.0), axes(4.0)),
        0.0,
        0.5,
        DVec3::X * 2.0,
        DVec3::new(2.0, 0.0, -1.0),
    );
}

/// Protects: normals of a mesh that is stretched during the exposure follow the transform at the
/// path's time, not at either end: halfway from 1 to 3 the inverse of 2.
#[test]
fn normals_turn_with_the_map() {
    let n = [0.6, 0.0, 0.8];
    let mesh = json!({ "name": "leaf", "source": { "inline": { "indices": [[0, 1, 2]], "normals": [n, n, n],
        "positions": [[-9, -9, 0], [9, -9, 0], [0, 18, 0]] } } });
    let object = json!({ "shape": { "mesh": "leaf" }, "material": "white", "transform": [],
        "transform_end": [{ "scale": [3, 1, 1] }] });
    let mut moving = white(json!([]), view(json!({ "shutter": [0.5, 0.500_000_1] })));
    moving.meshes = vec![serde_json::from_value(mesh).expect("a mesh")];
    moving.objects = vec![serde_json::from_value(object).expect("an object")];
    for precision in PRECISIONS {
        let settings = Settings {
            precision,
            aovs: vec![Aov::Normal],
            ..asked(&moving)
        };
        let picture = render_scene(
            &moving,
            &Settings {
                size: [1, 1],
                ..settings
            },
        )
        .picture;
        let layer = |name: &str| f64::from(picture.layer(name).expect("asked for").samples[0]);
        let found = ["normal.X", "normal.Y", "normal.Z"].map(layer);
        let expected = DVec3::new(0.3, 0.0, 0.8).normalize();
        expect_near(found, expected.into(), 1e-6, &format!("{precision:?}"));
    }
}

/// Protects: a generator's objects move from their own positions; the scene's bounds hold both
/// ends, and memory is estimated, whether motion is simulated or not.
#[test]
fn generated_things_move() {
    let mut object = ball([0.0; 3], 0.5, "white");
    object["transform_end"] = translated([0.0, 4.0, 0.0]);
    let grid = json!({ "grid": { "counts": [50, 1, 1], "origin": [0, 0, 0], "step": [2, 0, 0] } });
    let mut moving = white(json!([]), view(json!({ "shutter": [0, 1] })));
    moving.generators =
        serde_json::from_value(json!([{ "kind": grid, "object": object }])).expect("a generator");
    for precision in PRECISIONS {
        let bounds = measure_scene_extent(&moving, precision).bounds;
        assert_eq!(
            (bounds.min, bounds.max),
            (DVec3::splat(-0.5), DVec3::new(98.5, 4.5, 0.5))
        );
        for without in [EffectSet::EMPTY, EffectSet::from_effects(&[Effect::Motion])] {
            let settings = Settings {
                precision,
                without,
                size: [8, 1],
                ..asked(&moving)
            };
            let (told, ready) = (
                estimate_scene_memory(&moving, &settings),
                prepare(&moving, &settings, &()).expect("a sound scene"),
            );
            let real = ready.memory();
            let all = told
                .bytes_by_purpose()
                .into_iter()
                .zip(real.bytes_by_purpose());
            // The filling of a tree's leaves is unknown before the tree is built.
            all.for_each(|((label, reported), (_, real))| {
                assert!(
                    real <= reported && reported <= 3 * real,
                    "{label}: {reported} for {real}"
                )
            });
            assert_eq!(
                ready.table_sizes().instances,
                if without.is_empty() { 50 } else { 0 }
            );
        }
    }
    // The ball at x = 4 starts in the row and leaves upwards: at a distance u from its middle, up
    // to a quarter to the left, its height above the row is √(¼ − u²), of a motion of four metres.
    let actual = row(&render_scene(
        &moving,
        &Settings {
            sampling: Sampling::General(4096),
            ..asked(&moving)
        },
    ))[15];
    let share = 0.5 * (0.25 * 0.1875_f64.sqrt() + 0.25 * 0.5_f64.asin());
    let error = (share * (1.0 - share) / 4096.0).sqrt();
    assert!(
        (actual - share).abs() < 4.0 * error,
        "{actual} instead of {share}"
    );
}

/// Protects: a moving camera at a map's coordinates far away sees objects there as near zero.
#[test]
fn cameras_move_where_a_map_puts_them() {
    let seen = |at: f64| {
        let look =
            |x: f64| json!({ "look_at": { "eye": [at + x, 0, 9], "target": [at + x, 0, 0] } });
        let mut cameras = view(json!({ "shutter": [0, 1], "pose_end": look(9.0) }));
        cameras[0]["pose"] = look(4.0);
        let quad = json!({ "corner": [at + 0.5, -2, 0], "edge_u": [3, 0, 0], "edge_v": [0, 4, 0] });
        let scene = white(
            json!([{ "shape": { "quad": quad }, "material": "white" }]),
            cameras,
        );
        row(&render_scene(
            &scene,
            &Settings {
                precision: PrecisionChoice::Robust,
                ..asked(&scene)
            },
        ))
    };
    let (near, far) = (seen(0.0), seen(4_865_499.5));
    assert!(
        near.iter().any(|&x| x > 0.3) && near.iter().zip(&far).all(|(a, b)| (a - b).abs() < 0.01),
        "{near:?} {far:?}"
    );
}

/// Protects: the lines of a wireframe lie on the edges of a triangle or a mesh where it is at the
/// time of the ray, and where a transform puts it: a shape that is caught in the middle of its
/// motion has the picture of one that stands there.
#[test]
fn edges_lie_where_their_triangles_are() {
    let corners = [[0.2, -1.5, 0.0], [2.2, -1.0, 0.3], [1.0, 1.5, 0.0]];
    let mesh = json!([{ "name": "one", "source": { "inline": { "indices": [[0, 1, 2]], "positions": corners } } }]);
    let turned = |steps: Value| {
        let turn = json!({ "rotate": { "axis": [0, 0, 1], "degrees": 20 } });
        json!([vec![turn], steps.as_array().cloned().unwrap_or_default()].concat())
    };
    let place = |x: f64| turned(translated([x, 0.3, 0.0]));
    for shape in [
        json!({ "triangle": { "vertices": corners } }),
        json!({ "mesh": "one" }),
    ] {
        let picture = |precision, transform: Value, end: Option<Value>, wireframe| {
            let shutter = end.is_some().then_some([0.5, 0.5 + 1e-9]);
            let object = json!([{ "shape": shape, "material": "white", "transform": transform, "transform_end": end }]);
            let model = classic(json!({ "ambient": 1, "colour": 1 }));
            let mut scene = scene(json!({
                "cameras": view(json!({ "shutter": shutter })),
                "materials": [{ "name": "white", "model": model }],
                "meshes": mesh,
                "objects": object,
            }));
            scene.cameras[0].projection = Projection::Orthographic { height: 8.0 };
            let settings = Settings {
                size: [32, 32],
                sampling: Sampling::General(16),
                precision,
                wireframe,
                ..Settings::from_scene(&scene)
            };
            render_scene(&scene, &settings).picture
        };
        for precision in PRECISIONS {
            let still = picture(precision, place(2.0), None, true);
            let moving = picture(precision, place(0.0), Some(place(4.0)), true);
            let plain = picture(precision, place(2.0), None, false);
            let other = |picture: &Picture| {
                let pairs = still.rgb.iter().zip(&picture.rgb);
                pairs.filter(|(a, b)| (a[0] - b[0]).abs() > 1e-3).count()
            };
            assert!(
                other(&moving) <= 2,
                "{shape}, {precision:?}: {}",
                other(&moving)
            );
            assert!(other(&plain) > 15, "{shape}, {precision:?}: no edges");
        }
    }
}
