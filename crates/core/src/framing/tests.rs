use std::collections::HashSet;

use serde_json::{Value, json};

use super::*;

/// A scene of these objects, all of one material, with these meshes.
fn scene(objects: Value, meshes: Value) -> Scene {
    let mut objects = objects;
    for object in objects.as_array_mut().expect("a list") {
        object["material"] = json!("white");
    }
    let white = json!({ "name": "white", "model": { "physical": {} } });
    serde_json::from_value(
        json!({ "format": 1, "materials": [white], "meshes": meshes, "objects": objects }),
    )
    .expect("a scene")
}

/// A mesh `m` of some quads, and an object that shows it.
fn quads(quads: &[[[f64; 3]; 4]]) -> Scene {
    let positions: Vec<[f64; 3]> = quads.iter().flatten().copied().collect();
    let indices: Vec<[usize; 3]> = (0..quads.len())
        .flat_map(|q| [[4 * q, 4 * q + 1, 4 * q + 2], [4 * q, 4 * q + 2, 4 * q + 3]])
        .collect();
    let mesh = json!({ "name": "m", "source": { "inline": { "positions": positions, "indices": indices } } });
    scene(json!([{ "shape": { "mesh": "m" } }]), json!([mesh]))
}

/// Returns the extents of points in a framed picture, relative to its middle, from -1 to 1: left,
/// right, bottom and top.
fn reach(camera: &Camera, points: &[DVec3], aspect: f64) -> [f64; 4] {
    let (eye, frame) = crate::camera::eye_and_axes(&camera.pose);
    let (half, height) = match camera.projection {
        Projection::Pinhole(Pinhole {
            vertical_fov: Some(fov),
            ..
        }) => (libm::tan(fov.to_radians() * 0.5), 0.0),
        Projection::Orthographic { height } => (0.0, height),
        _ => panic!("{camera:?}"),
    };
    let mut reach = [
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    for &point in points {
        let p = frame.transpose() * (point - eye);
        assert!(p.z < 0.0, "{point} is behind {camera:?}");
        let half = -p.z * half + 0.5 * height;
        let (x, y) = (p.x / (half * aspect), p.y / half);
        reach = [
            reach[0].min(x),
            reach[1].max(x),
            reach[2].min(y),
            reach[3].max(y),
        ];
    }
    reach
}

/// Protects: for every shape, view, field of view and picture, the silhouette is centred and fills
/// its share of the tighter side, at every scale and place.
#[test]
fn silhouettes_fill_their_share() {
    let box_of = |low: [f64; 3], high: [f64; 3]| {
        let silhouette = Silhouette::from_scene(&scene(
            json!([{ "shape": { "box": { "min": low, "max": high } } }]),
            json!([]),
        ));
        (
            silhouette,
            Aabb {
                min: low.into(),
                max: high.into(),
            }
            .corners()
            .to_vec(),
        )
    };
    let ball = |centre: DVec3, radius: f64| {
        let shape = json!({ "sphere": { "centre": centre.to_array(), "radius": radius } });
        let around = (0..4000).map(|i| {
            let height = 1.0 - f64::from(2 * i + 1) / 4000.0;
            centre + radius * direction_from_angles(f64::from(i) * 2.4, libm::asin(height))
        });
        (
            Silhouette::from_scene(&scene(json!([{ "shape": shape }]), json!([]))),
            around.collect(),
        )
    };
    let models = [
        box_of([-1.0; 3], [1.0; 3]),
        box_of([5.0, 0.0, -3.0], [25.0, 0.5, -2.0]),
        box_of([0.0; 3], [0.1, 7.0, 0.2]),
        box_of([1e9, 0.0, 0.0], [1.1e9, 1e8, 2e8]),
        box_of([0.0; 3], [1e-6, 2e-6, 1e-6]),
        ball(DVec3::new(3.0, -1.0, 2.0), 0.7),
    ];
    let views = ViewAngles::NAMED.iter().map(|(_, view)| *view).chain([
        ViewAngles::DEFAULT,
        ViewAngles {
            azimuth: -200.0,
            elevation: -75.0,
        },
    ]);
    for (model, view) in models
        .iter()
        .flat_map(|model| views.clone().map(move |view| (model, view)))
    {
        for (fov, aspect) in [
            (40.0, 16.0 / 9.0),
            (5.0, 1.0),
            (100.0, 0.5),
            (0.0, 1.5),
            (0.0, 0.7),
        ] {
            let (silhouette, points) = model;
            let [left, right, bottom, top] =
                reach(&silhouette.frame_camera(view, fov, aspect), points, aspect);
            let fill = 0.5 * (right - left).max(top - bottom);
            assert!(
                (fill - FRAMED_SHARE).abs() < 0.01,
                "{view:?}, {fov}, {aspect}: {fill}"
            );
            assert!(
                (left + right).abs() < 0.02 && (bottom + top).abs() < 0.02,
                "{view:?}, {fov}, {aspect}: {left} {right} {bottom} {top}"
            );
        }
    }
}

/// Protects: the few kept points frame a mesh of many vertices equally well, also for a slanted
/// needle; unused vertices do not count.
#[test]
fn few_points_stand_for_many() {
    const N: usize = 300;
    let lean = |p: DVec3| DVec3::new(p.x + 20.0 * p.y, p.y, p.z + 7.0 * p.y + 3.0);
    let points: Vec<DVec3> = (0..N * N)
        .map(|i| {
            direction_from_angles(
                (i % N) as f64 * 6.3 / N as f64,
                ((i / N) as f64 / N as f64 - 0.5) * 3.13,
            )
        })
        .map(|p| lean(p * DVec3::new(0.3, 9.0, 1.0)))
        .collect();
    let mut positions: Vec<[f64; 3]> = points.iter().map(|p| p.to_array()).collect();
    positions.push([1e4; 3]);
    let indices: Vec<[usize; 3]> = (0..N * N - 2).map(|i| [i, i + 1, i + 2]).collect();
    let mesh = json!({ "name": "m", "source": { "inline": { "positions": positions, "indices": indices } } });
    let silhouette =
        Silhouette::from_scene(&scene(json!([{ "shape": { "mesh": "m" } }]), json!([mesh])));
    assert!(silhouette.points.len() <= 6 * FINE_CELLS * FINE_CELLS);
    for (_, view) in ViewAngles::NAMED {
        let [left, right, bottom, top] =
            reach(&silhouette.frame_camera(view, 30.0, 1.5), &points, 1.5);
        let fill = 0.5 * (right - left).max(top - bottom);
        assert!((fill - FRAMED_SHARE).abs() < 0.02, "{view:?}: {fill}");
    }
}

/// Protects: sheets are seen from the side that they face, boards from a side, rooms through their
/// open side, terrain from above, and all others from above and from the side.
#[test]
fn flat_and_open_things_are_seen_from_their_front() {
    let at = |azimuth: f64, elevation: f64| ViewAngles { azimuth, elevation };
    // Facing +z and -z; +x and -x; up.
    let front = |z: f64| {
        [
            [-1.0, -1.0, z],
            [1.0, -1.0, z],
            [1.0, 1.0, z],
            [-1.0, 1.0, z],
        ]
    };
    let turned = |quad: [[f64; 3]; 4]| quad.map(|[x, y, z]| [z, y, -x]);
    let flipped = |[a, b, c, d]: [[f64; 3]; 4]| [d, c, b, a];
    let lying = |y: f64| front(0.0).map(|[x, z, _]| [x, y, -z]);
    let view = |list: &[[[f64; 3]; 4]]| Silhouette::from_scene(&quads(list)).default_view();
    assert_eq!(view(&[front(3.0)]), at(0.0, 0.0));
    assert_eq!(view(&[flipped(front(3.0))]), at(180.0, 0.0));
    assert_eq!(view(&[turned(front(0.0))]), at(90.0, 0.0));
    assert_eq!(view(&[flipped(turned(front(0.0)))]), at(-90.0, 0.0));
    assert_eq!(view(&[lying(0.0)]), at(0.0, 90.0));
    assert_eq!(
        view(&[lying(0.1), flipped(lying(-0.1))]),
        ViewAngles {
            elevation: 40.0,
            ..ViewAngles::DEFAULT
        }
    );
    // An island with palms is no drawing, though it is as thin as one.
    let palms: Vec<_> = (0..20)
        .map(|i| front(0.0).map(|[x, y, _]| [0.01 * x + 0.02 * f64::from(i), 0.01 * y, 0.1]))
        .collect();
    assert_eq!(
        view(&[&[lying(0.0)], palms.as_slice()].concat()),
        ViewAngles {
            elevation: 40.0,
            ..ViewAngles::DEFAULT
        }
    );
    assert_eq!(
        view(&[front(0.1), flipped(front(-0.1))]),
        at(0.0, 0.0),
        "a board with two sides"
    );
    // A room of inward faces without the one towards +z.
    let room = [
        front(-1.0),
        turned(front(-1.0)),
        flipped(turned(front(1.0))),
        lying(-1.0),
        flipped(lying(1.0)),
    ];
    assert_eq!(view(&room), at(0.0, 0.0));
    let open_at_x = room.map(turned);
    assert_eq!(view(&open_at_x), at(90.0, 0.0));
    let closed: Vec<_> = room
        .into_iter()
        .chain([flipped(front(1.0))])
        .map(flipped)
        .collect();
    assert_eq!(view(&closed), ViewAngles::DEFAULT);
    assert_eq!(
        Silhouette::from_scene(&scene(json!([]), json!([]))).default_view(),
        ViewAngles::DEFAULT
    );
}

/// Protects: a mirrored sheet is seen from the side that it faces after mirroring. A slightly
/// rotated room is seen straight, one rotated by half a right angle as it stands.
#[test]
fn mirrored_and_turned_things_are_seen_from_their_front() {
    let sheet = [
        [-1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
    ];
    let under = |quads_of: &[[[f64; 3]; 4]], step: Value| {
        let mut scene = quads(quads_of);
        scene.objects[0].transform = serde_json::from_value(json!([step])).expect("a step");
        Silhouette::from_scene(&scene).default_view()
    };
    assert_eq!(
        under(&[sheet], json!({ "scale": [-1, 1, 1] })),
        ViewAngles {
            azimuth: 0.0,
            elevation: 0.0
        }
    );
    assert_eq!(
        under(&[sheet], json!({ "scale": [1, 1, -1] })),
        ViewAngles {
            azimuth: 180.0,
            elevation: 0.0
        }
    );
    // Inward faces on all sides but towards +z.
    let side =
        |[x, z]: [f64; 2], [u, w]: [f64; 2]| [[x, -1.0, z], [u, -1.0, w], [u, 1.0, w], [x, 1.0, z]];
    let room = [
        side([-1.0, -1.0], [1.0, -1.0]),
        side([1.0, -1.0], [1.0, 1.0]),
        side([-1.0, 1.0], [-1.0, -1.0]),
    ];
    let turned = |degrees: f64| {
        under(
            &room,
            json!({ "rotate": { "axis": [0, 1, 0], "degrees": degrees } }),
        )
        .azimuth
    };
    assert_eq!((turned(0.0), turned(10.0)), (0.0, 0.0));
    assert!((turned(40.0) - 40.0).abs() < 1e-4, "{}", turned(40.0));
}

/// Protects: a moving object is framed with both ends of its motion.
#[test]
fn moving_things_are_framed_from_start_to_end() {
    let cube = json!([{ "shape": { "box": { "min": [-1, -1, -1], "max": [1, 1, 1] } }, "transform_end": [{ "translate": [8, 0, 0] }] }]);
    let silhouette = Silhouette::from_scene(&scene(cube, json!([])));
    let points = Aabb {
        min: DVec3::NEG_ONE,
        max: DVec3::new(9.0, 1.0, 1.0),
    }
    .corners();
    let [left, right, ..] = reach(
        &silhouette.frame_camera(ViewAngles::NAMED[0].1, 40.0, 1.5),
        &points,
        1.5,
    );
    assert!(
        (0.5 * (right - left) - FRAMED_SHARE).abs() < 0.01,
        "{left} {right}"
    );
}

/// Protects: scenes without an extent along some axes get a finite camera that sees them: a point,
/// a line along the view and across it, an empty scene.
#[test]
fn degenerate_scenes_have_a_view() {
    let line = |a: [f64; 3], b: [f64; 3]| quads(&[[a, b, b, a]]);
    for scene in [
        scene(json!([]), json!([])),
        line([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
        line([0.0; 3], [0.0; 3]),
        line([1e9; 3], [1e9; 3]),
        line([0.0; 3], [0.0, 0.0, 5.0]),
        line([-1e9, 0.0, 0.0], [1e9, 0.0, 0.0]),
        line([0.0; 3], [0.0, 1e-30, 0.0]),
    ] {
        let silhouette = Silhouette::from_scene(&scene);
        for view in ViewAngles::NAMED
            .map(|(_, view)| view)
            .into_iter()
            .chain([silhouette.default_view()])
        {
            for fov in [40.0, 0.0] {
                let camera = silhouette.frame_camera(view, fov, 1.6);
                let (eye, frame) = crate::camera::eye_and_axes(&camera.pose);
                let is_right = (frame.determinant() - 1.0).abs() < 1e-9;
                assert!(
                    eye.is_finite() && frame.is_finite() && is_right,
                    "{camera:?}"
                );
                reach(&camera, &silhouette.points, 1.6);
            }
        }
    }
}

/// Protects: points visited without storage equal, to the bit, those found by storing all: all
/// points of few objects, the outermost of many, boxes for objects beyond the limit, both ends of
/// moving ones.
#[test]
fn outlines_are_found_without_keeping_points() {
    let ball = |x: f64, radius: f64| json!({ "shape": { "sphere": { "centre": [x, 0.1 * x, 3], "radius": radius } } });
    let moving = json!({ "shape": { "box": { "min": [0, 0, 0], "max": [1, 2, 3] } }, "transform_end": [{ "translate": [0, 9, 0] }] });
    for count in [1, 5, 100, 6000] {
        let balls = (0..count).map(|i| ball(0.7 * f64::from(i), 0.3 + f64::from(i % 7)));
        let scene = scene(balls.chain([moving.clone()]).collect(), json!([]));
        let lookup = SceneLookup::new(&scene);
        let outlines = OutlinePoints::from_scene(&scene, &lookup);
        let mut kept = Vec::new();
        outlines.visit_points(&scene, &mut |point| kept.push(point));
        assert_eq!(
            kept.len(),
            if count == 6000 {
                864 * 4854 + 8 * (6000 - 4854) + 16
            } else {
                864 * count as usize + 16
            }
        );
        let found = Silhouette::from_scene(&scene).points;
        match kept.len() <= 6 * FINE_CELLS * FINE_CELLS {
            true => assert_eq!(found, kept),
            false => {
                let places: HashSet<[u64; 3]> = kept
                    .iter()
                    .map(|point| point.to_array().map(f64::to_bits))
                    .collect();
                assert!(
                    found
                        .iter()
                        .all(|point| places.contains(&point.to_array().map(f64::to_bits)))
                );
                assert_eq!(
                    found,
                    select_outermost_points(
                        |visit| kept.iter().copied().for_each(visit),
                        FINE_CELLS
                    )
                );
                assert!(found.len() <= 6 * FINE_CELLS * FINE_CELLS);
            }
        }
    }
}

/// Protects: what has no area does not count in a view: triangles of coinciding or collinear corners,
/// and objects that are scaled to a point or a line. The camera is that of the scene without them, at
/// any distance of the invisible parts.
#[test]
fn parts_without_area_are_not_framed() {
    let square = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]].map(|p| p.map(f64::from));
    let mesh = |positions: &[[f64; 3]], indices: Value| json!({ "name": "m", "source": { "inline": { "positions": positions, "indices": indices } } });
    let shown = |transform: Value| json!({ "shape": { "mesh": "m" }, "transform": transform });
    let faces = json!([[0, 1, 2], [0, 2, 3]]);
    let view = |scene: Scene| {
        let silhouette = Silhouette::from_scene(&scene);
        let extent = crate::measure_scene_extent(&scene, Default::default()).bounds;
        (
            silhouette.frame_camera(silhouette.default_view(), 40.0, 1.0),
            extent,
        )
    };
    let plain = view(scene(
        json!([shown(json!([]))]),
        json!([mesh(&square, faces.clone())]),
    ));
    for far in [60.0, 1e-3, 1e6] {
        let mut positions = square.to_vec();
        positions.extend([
            [far, 0.0, 0.0],
            [2.0 * far, 0.0, 0.0],
            [4.0 * far, 0.0, 0.0],
        ]);
        for degenerate in [[4, 4, 4], [4, 5, 4], [4, 5, 6]] {
            let indices = json!([[0, 1, 2], degenerate, [0, 2, 3]]);
            let scene = scene(
                json!([shown(json!([]))]),
                json!([mesh(&positions, indices)]),
            );
            assert_eq!(view(scene), plain, "{degenerate:?} at {far}");
        }
        for scale in [[0, 0, 0], [0, 1, 0]] {
            let hidden = shown(json!([{ "scale": scale }, { "translate": [far, 0, 0] }]));
            let scene = scene(
                json!([shown(json!([])), hidden]),
                json!([mesh(&square, faces.clone())]),
            );
            assert_eq!(view(scene), plain, "scale {scale:?} at {far}");
        }
    }
}

/// Protects: a part of a thousandth of the surface, 500 sizes away, is left out of the view and
/// told, in a mesh of its own and in the same one; a greater or a nearer part is shown.
#[test]
fn stray_parts_are_left_out_of_the_view() {
    let square = |[x, z]: [f64; 2], half: f64| {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[a, b]| [x + half * a, half * b, z])
    };
    let body = || (0..5).map(|i| square([0.0, 0.1 * f64::from(i)], 1.0));
    let two = |far: f64, half: f64| {
        let own = quads(&body().collect::<Vec<_>>());
        let mut scene = quads(&[square([far, 0.0], half)]);
        scene.meshes[0].name = "far".to_owned();
        scene.meshes.extend(own.meshes);
        scene.objects[0].shape = Shape::Mesh("far".to_owned());
        scene.objects.extend(own.objects);
        scene
    };
    let one =
        |far: f64, half: f64| quads(&body().chain([square([far, 0.0], half)]).collect::<Vec<_>>());
    let plain = Silhouette::from_scene(&quads(&body().collect::<Vec<_>>()));
    assert!(!plain.has_stray_parts());
    let camera = |silhouette: &Silhouette| silhouette.frame_camera(ViewAngles::DEFAULT, 40.0, 1.0);
    for (far, half, is_stray) in [
        (1e3, 0.06, true),
        (1e9, 0.06, true),
        (1e3, 0.2, false),
        (400.0, 0.06, false),
    ] {
        // A mesh that reaches so far keeps no shape in single precision.
        let scenes = [two(far, half), one(far.min(1e4), half)];
        for scene in scenes {
            let silhouette = Silhouette::from_scene(&scene);
            assert_eq!(silhouette.has_stray_parts(), is_stray, "{half} at {far}");
            assert_eq!(
                camera(&silhouette) == camera(&plain),
                is_stray,
                "{half} at {far}"
            );
        }
    }
}
