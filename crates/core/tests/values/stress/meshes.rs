//! Faults of meshes and bodies, and of their placement.

use raywright_core::topology::SolidSummary;

use super::*;

/// A closed cube with an edge of 1.6 metres, centred at `at`. `change` edits its positions and
/// triangles.
pub(super) fn cube(
    at: [f64; 3],
    change: impl FnOnce(&mut Vec<[f64; 3]>, &mut Vec<[u32; 3]>),
) -> Value {
    let sign = |i: usize, axis: usize| if i >> axis & 1 == 1 { 0.8 } else { -0.8 };
    let mut positions: Vec<[f64; 3]> = (0..8)
        .map(|i| core::array::from_fn(|axis| at[axis] + sign(i, axis)))
        .collect();
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let mut indices: Vec<[u32; 3]> = faces
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    change(&mut positions, &mut indices);
    json!({ "name": "cube", "source": { "inline": { "positions": positions, "indices": indices } } })
}

/// A scene with that cube, of a material and with a side rule.
fn with_cube(mesh: Value, material: &str, side: &str) -> Scene {
    let mut cube = object("cube", json!({ "mesh": "cube" }), material);
    cube["side"] = json!(side);
    scene(
        &json!({ "meshes": [mesh], "objects": [cube, object("ball", ball([2.5, 0.0, -1.0], 0.7), "paint")] }),
    )
}

pub(super) fn plain(
    change: impl FnOnce(&mut Vec<[f64; 3]>, &mut Vec<[u32; 3]>),
    material: &str,
    side: &str,
) -> Scene {
    with_cube(cube([0.0; 3], change), material, side)
}

/// Protects: a closed cube has no fault, whether opaque, of glass or with back-face culling.
#[test]
fn a_closed_cube_has_no_findings() {
    for (material, side) in [("paint", "both"), ("glass", "both"), ("paint", "culled")] {
        let findings = summarise_findings(&plain(|_, _| {}, material, side)).findings;
        assert_eq!(listed(&findings), [], "{material} {side}");
    }
}

/// Protects: the summary of a solid has its size, its volume and its open edges, with the number of
/// their connected groups, also for scaled objects.
#[test]
fn solids_are_measured() {
    let of = |holes: &[core::ops::Range<usize>]| {
        let without = |_: &mut Vec<[f64; 3]>, triangles: &mut Vec<[u32; 3]>| {
            for hole in holes.iter().rev() {
                triangles.drain(hole.clone());
            }
        };
        let mut cubes = plain(without, "paint", "both");
        cubes.objects.truncate(1);
        cubes.objects[0].transform =
            vec![raywright_core::scene::TransformStep::Scale([2.0, 1.0, 1.0])];
        SolidSummary::from_scene(&cubes).map(|solid| solid.to_string())
    };
    let closed = "yes; size 3.2 x 1.6 x 1.6, volume 8.192";
    assert_eq!(of(&[]).as_deref(), Some(closed));
    // The top and the bottom of the cube, and then one of its sides too.
    let holes = [4..8, 10..12];
    for (count, start) in [
        (1, "no, 8 open edges in 2 places; "),
        (2, "no, 8 open edges in 1 place; "),
    ] {
        let text = of(&holes[..count]).expect("a mesh");
        assert!(text.starts_with(start), "{text}");
    }
    assert_eq!(SolidSummary::from_scene(&scene(&json!({}))), None);
}

/// Protects: a flipped triangle takes nothing from the volume of its body and is counted, wherever the
/// body stands; the volume of an open body does not depend on its place; meshes that together make
/// a body, one for each material, are closed, and count twice if they are
/// listed twice.
#[test]
fn solids_are_measured_as_a_whole() {
    let of = |scene: &Scene| {
        let text = SolidSummary::from_scene(scene).expect("a mesh").to_string();
        let (start, volume) = text.split_once("; size").expect("a size");
        let volume = volume.rsplit(' ').next().expect("a volume");
        (start.to_owned(), volume.to_owned())
    };
    let change = |at: f64, change: fn(&mut Vec<[u32; 3]>)| {
        let mut scene = plain(
            |positions, triangles| {
                positions.iter_mut().flatten().for_each(|x| *x += at);
                change(triangles);
            },
            "paint",
            "both",
        );
        scene.objects.truncate(1);
        scene
    };
    for at in [0.0, 40.0] {
        for flip in [(|all| all[3].swap(0, 1)) as fn(&mut Vec<[u32; 3]>), |all| {
            all[11].swap(1, 2)
        }] {
            let flipped = of(&change(at, flip));
            assert_eq!(
                flipped,
                ("yes, 1 triangle flipped".to_owned(), "4.096".to_owned())
            );
        }
        let open = |all: &mut Vec<[u32; 3]>| drop(all.drain(0..2));
        assert_eq!(of(&change(at, open)), of(&change(0.0, open)));
        // One body of two meshes.
        let mut body = change(at, |all| drop(all.drain(..5)));
        let mut other = change(at, |all| all.truncate(5));
        other.meshes[0].name = "rest".to_owned();
        other.objects[0].shape = raywright_core::scene::Shape::Mesh("rest".to_owned());
        assert_ne!(of(&body).0, "yes");
        body.meshes.append(&mut other.meshes);
        body.objects.append(&mut other.objects);
        assert_eq!(of(&body), ("yes".to_owned(), "4.096".to_owned()), "{at}");
        body.objects.extend(body.objects.clone());
        assert_eq!(of(&body), ("yes".to_owned(), "8.192".to_owned()), "{at}");
    }
}

/// Protects: degenerate and repeated triangles are found. The degenerate one is named
/// with its position.
#[test]
fn single_triangles() {
    let finding = expect_finding(
        &plain(|_, i| i.push([0, 0, 1]), "paint", "both"),
        FaultKind::DegenerateTriangles,
        Harmless,
        &[],
    );
    assert_eq!(
        (finding.count, finding.of, finding.primitive),
        (1, 13, Some(12))
    );
    assert!(
        finding
            .place
            .is_some_and(|[_, y, _]| (y + 0.8).abs() < 1e-6),
        "{:?}",
        finding.place
    );
    expect_finding(
        &plain(|_, i| i.push(i[4]), "paint", "both"),
        FaultKind::DuplicateTriangles,
        Harmless,
        &[],
    );
    expect_finding(
        &plain(|_, i| i.push(i[4]), "glass", "both"),
        FaultKind::DuplicateTriangles,
        Harmless,
        &[],
    );
}

/// Protects: a glass body makes the picture wrong if it has a hole, edges with three triangles or
/// flipped triangles. An opaque body with the same hole is not reported.
#[test]
fn bodies_of_glass_are_closed() {
    let open = |_: &mut Vec<[f64; 3]>, i: &mut Vec<[u32; 3]>| i.truncate(10);
    let finding = expect_finding(
        &plain(open, "glass", "both"),
        FaultKind::OpenEdges,
        PictureWrong,
        &[],
    );
    assert_eq!(finding.count, 4);
    assert!(
        summarise_findings(&plain(open, "paint", "both"))
            .findings
            .is_empty()
    );
    let fin = |p: &mut Vec<[f64; 3]>, i: &mut Vec<[u32; 3]>| {
        p.push([2.0, 2.0, 2.0]);
        i.push([7, 5, 8]);
    };
    expect_finding(
        &plain(fin, "glass", "both"),
        FaultKind::NonManifoldEdges,
        PictureWrong,
        &[FaultKind::OpenEdges],
    );
    let turned = |_: &mut Vec<[f64; 3]>, i: &mut Vec<[u32; 3]>| {
        i[10..].iter_mut().for_each(|t| t.swap(1, 2))
    };
    expect_finding(
        &plain(turned, "glass", "both"),
        FaultKind::FlippedTriangles,
        PictureWrong,
        &[],
    );
}

/// Protects: flipped triangles make the picture wrong if their backs are hidden, and are harmless
/// if both sides are shown.
#[test]
fn flipped_meshes() {
    let one = |_: &mut Vec<[f64; 3]>, i: &mut Vec<[u32; 3]>| {
        i[10..].iter_mut().for_each(|t| t.swap(1, 2))
    };
    let all =
        |_: &mut Vec<[f64; 3]>, i: &mut Vec<[u32; 3]>| i.iter_mut().for_each(|t| t.swap(1, 2));
    expect_finding(
        &plain(one, "paint", "culled"),
        FaultKind::FlippedTriangles,
        PictureWrong,
        &[],
    );
    expect_finding(
        &plain(one, "paint", "both"),
        FaultKind::FlippedTriangles,
        Harmless,
        &[],
    );
    expect_finding(
        &plain(all, "paint", "culled"),
        FaultKind::InsideOut,
        PictureWrong,
        &[],
    );
    expect_finding(
        &plain(all, "paint", "both"),
        FaultKind::InsideOut,
        Harmless,
        &[],
    );
    expect_finding(
        &plain(all, "glass", "both"),
        FaultKind::InsideOut,
        PictureWrong,
        &[],
    );
    let mut cube = cube([0.0; 3], |_, _| {});
    let inwards: Vec<[f64; 3]> = (0..8)
        .map(|i| core::array::from_fn(|axis| if i >> axis & 1 == 1 { -0.577 } else { 0.577 }))
        .collect();
    cube["source"]["inline"]["normals"] = json!(inwards);
    expect_finding(
        &with_cube(cube, "paint", "both"),
        FaultKind::NormalsAgainstFaces,
        PictureWrong,
        &[],
    );
}

/// Protects: glass bodies that are open by their shape or nested without priorities are found, and
/// so are objects in the same place.
#[test]
fn bodies_of_shapes() {
    let tube = json!({ "hyperboloid": { "centre": [0, 0, 0], "waist_radius": 0.8, "c": 1, "half_height": 0.7 } });
    let alone = |objects: Value| scene(&json!({ "objects": objects }));
    expect_finding(
        &alone(json!([object("tube", tube, "glass")])),
        FaultKind::OpenBody,
        PictureWrong,
        &[],
    );
    let glass = |radius: f64| object("glass", ball([0.0; 3], radius), "glass");
    expect_finding(
        &alone(json!([glass(1.2), glass(0.6)])),
        FaultKind::NestedGlass,
        PictureWrong,
        &[],
    );
    expect_finding(
        &alone(json!([glass(1.2), glass(1.2)])),
        FaultKind::DuplicateObject,
        Harmless,
        &[],
    );
    let veil = || object("veil", ball([0.0; 3], 1.2), "veil");
    expect_finding(
        &alone(json!([veil(), veil()])),
        FaultKind::DuplicateObject,
        PictureWrong,
        &[],
    );
    let paint = |material: &str| object("paint", ball([0.3, 0.0, 0.0], 1.0), material);
    expect_finding(
        &alone(json!([paint("paint"), paint("paint")])),
        FaultKind::DuplicateObject,
        Harmless,
        &[],
    );
    expect_finding(
        &alone(json!([paint("paint"), paint("other")])),
        FaultKind::DuplicateObject,
        PictureWrong,
        &[],
    );
    let mut turned = object("turned", ball([0.0, 0.3, 0.0], 1.0), "paint");
    turned["transform"] = json!([{ "rotate": { "axis": [0, 0, 1], "degrees": -90 } }]);
    expect_finding(
        &alone(json!([paint("paint"), turned])),
        FaultKind::DuplicateObject,
        Harmless,
        &[],
    );
}

/// Protects: two slanted coplanar sheets make the picture wrong if rounding decides which of them
/// is visible.
#[test]
fn surfaces_in_one_place() {
    let (u, v) = ([0.71, 0.33, 0.29], [-0.37, 0.69, 0.17]);
    // Far from a ball at zero, so that corners are stored with fewer digits than distances from the
    // camera.
    let away = [61.0, 43.0, 52.0];
    let at = |s: f64, t: f64| -> [f64; 3] {
        core::array::from_fn(|axis| away[axis] + s * u[axis] + t * v[axis])
    };
    let sheet = |name: &str, [a, b]: [f64; 2], [c, d]: [f64; 2]| {
        let positions = [at(a, c), at(b, c), at(b, d), at(a, d)];
        json!({ "name": name, "source": { "inline": { "positions": positions, "indices": [[0, 1, 2], [0, 2, 3]] } } })
    };
    let mut scene = scene(&json!({
        "meshes": [sheet("a", [-1.3, 1.1], [-1.2, 1.4]), sheet("b", [-1.17, 1.27], [-1.31, 1.13])],
        "objects": [object("a", json!({ "mesh": "a" }), "paint"), object("b", json!({ "mesh": "b" }), "other"), object("ball", ball([0.0; 3], 1.0), "paint")],
    }));
    let look = json!({ "look_at": { "eye": [62.0, 42.0, 55.0], "target": away } });
    scene.cameras[0].pose = serde_json::from_value(look).expect("a pose");
    expect_finding(&scene, FaultKind::FlickeringSurfaces, PictureWrong, &[]);
}

/// Protects: each kind of loss by coarse coordinates is found for small objects far away.
#[test]
fn small_things_far_away() {
    let moved = |name: &str, at: [f64; 3], scale: f64| {
        let mut far = object(name, json!({ "mesh": name }), "paint");
        far["transform"] = json!([{ "scale": [scale, scale, scale] }, { "translate": at }]);
        far
    };
    let named = |name: &str, mut mesh: Value| {
        mesh["name"] = json!(name);
        mesh
    };
    let cubes = || {
        (0..4).map(|i| {
            named(
                &format!("near{i}"),
                cube([3.0 * f64::from(i) - 4.0, 0.0, 0.0], |_, _| {}),
            )
        })
    };
    let near = || (0..4).map(|i| object("near", json!({ "mesh": format!("near{i}") }), "paint"));
    let far = |mesh: Value, at: [f64; 3], scale: f64, target: [f64; 3]| {
        let meshes: Vec<Value> = cubes().chain([named("far", mesh)]).collect();
        let objects: Vec<Value> = near().chain([moved("far", at, scale)]).collect();
        let mut scene = scene(&json!({ "meshes": meshes, "objects": objects }));
        let eye = at.map(|x| if target == at { x - 4.0 * scale } else { 4.0 });
        scene.cameras[0].pose =
            serde_json::from_value(json!({ "look_at": { "eye": eye, "target": target } }))
                .expect("a pose");
        scene
    };
    let whole = || cube([0.0; 3], |_, _| {});
    let away = [1e7, 1e7, 1e7];
    for (target, severity) in [(away, PictureWrong), ([0.0; 3], Harmless)] {
        let seen = [FaultKind::NothingSeen];
        expect_finding(
            &far(whole(), away, 1e-2, target),
            FaultKind::LostObject,
            severity,
            &seen,
        );
        let of = far(whole(), [1e7, 0.0, 0.0], 2.0, [target[0], 0.0, 0.0]);
        expect_finding(&of, FaultKind::UnresolvedObject, severity, &seen);
    }
    let speck = json!({ "box": { "min": [1e6, 0, 0], "max": [1e6 + 1e-3, 1, 1] } });
    let lost = scene(
        &json!({ "objects": [object("ball", ball([0.0; 3], 1.0), "paint"), object("speck", speck, "paint")] }),
    );
    expect_finding(&lost, FaultKind::LostShape, PictureWrong, &[]);
}

/// Protects: correct scenes have no findings. Cases:
/// - glass in each closed shape
/// - hollow glass
/// - parts that touch along an edge
/// - separate vertices for each corner of each face
/// - nested glass with priorities
/// - mirrored objects
/// - several objects with the same mesh
/// - a room with the camera inside
#[test]
fn what_is_right_has_no_findings() {
    let shapes = [
        json!({ "torus": { "centre": [0, 0, 0], "axis": [0, 1, 0.5], "major_radius": 1, "minor_radius": 0.4 } }),
        json!({ "cylinder": { "base": [0, -1, 0], "axis": [0, 1, 0.2], "radius": 0.7, "height": 2 } }),
        json!({ "cone": { "base": [0, -1, 0], "axis": [0, 1, 0], "radius": 0.9, "height": 2 } }),
        json!({ "ellipsoid": { "centre": [0, 0, 0], "semi_axes": [1.2, 0.6, 0.8] } }),
        json!({ "box": { "min": [-1, -1, -1], "max": [1, 0.5, 1] } }),
        json!({ "plane": { "point": [0, -1, 0], "normal": [0, 1, 0] } }),
    ];
    let clean = |parts: &Value, label: &str| {
        let findings = summarise_findings(&scene(parts)).findings;
        assert_eq!(listed(&findings), [], "{label}");
    };
    for shape in shapes {
        clean(
            &json!({ "objects": [object("glass", shape.clone(), "glass")] }),
            &shape.to_string(),
        );
    }
    let one = || object("cube", json!({ "mesh": "cube" }), "glass");
    let meshes = |mesh: Value, objects: Value| json!({ "meshes": [mesh], "objects": objects });
    let hollow = |p: &mut Vec<[f64; 3]>, i: &mut Vec<[u32; 3]>| {
        p.extend(p.clone().iter().map(|corner| corner.map(|x| 0.5 * x)));
        i.extend(i.clone().iter().map(|&[a, b, c]| [a + 8, c + 8, b + 8]));
    };
    clean(&meshes(cube([0.0; 3], hollow), json!([one()])), "hollow");
    let beside = |p: &mut Vec<[f64; 3]>, i: &mut Vec<[u32; 3]>| {
        p.extend(p.clone().iter().map(|&[x, y, z]| [x + 1.6, y + 1.6, z]));
        i.extend(i.clone().iter().map(|&[a, b, c]| [a + 8, b + 8, c + 8]));
    };
    clean(
        &meshes(cube([-0.8, -0.8, 0.0], beside), json!([one()])),
        "touching along an edge",
    );
    let split = |p: &mut Vec<[f64; 3]>, i: &mut Vec<[u32; 3]>| {
        *p = i
            .iter()
            .flatten()
            .map(|&corner| p[corner as usize])
            .collect();
        *i = (0..i.len() as u32)
            .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
            .collect();
    };
    clean(
        &meshes(cube([0.0; 3], split), json!([one()])),
        "a vertex for each corner",
    );
    let mirrored = |x: f64, material: &str, side: &str| {
        let mut object = object("cube", json!({ "mesh": "cube" }), material);
        object["transform"] = json!([{ "scale": [-0.5, 0.6, 0.7] }, { "translate": [x, 0, 0] }]);
        object["side"] = json!(side);
        object
    };
    clean(
        &meshes(
            cube([0.0; 3], |_, _| {}),
            json!([mirrored(0.0, "paint", "culled")]),
        ),
        "mirrored",
    );
    let three = json!([
        mirrored(-1.0, "glass", "both"),
        mirrored(0.2, "glass", "both"),
        mirrored(1.4, "glass", "both")
    ]);
    clean(&meshes(cube([0.0; 3], |_, _| {}), three), "instances");
    let nested = |name: &str, priority: u32| {
        paint(
            name,
            json!({ "transmission": 1, "roughness": 0, "priority": priority }),
        )
    };
    let materials = json!([nested("cup", 2), nested("tea", 1)]);
    let objects = json!([
        object("cup", ball([0.0; 3], 1.2), "cup"),
        object("tea", ball([0.0; 3], 0.7), "tea")
    ]);
    clean(
        &json!({ "materials": materials, "objects": objects }),
        "priorities",
    );
    let room = json!([
        object(
            "room",
            json!({ "box": { "min": [-5, -3, -5], "max": [5, 5, 8] } }),
            "paint"
        ),
        object("lamp", ball([0.0, 3.0, 0.0], 0.5), "lamp"),
        object("ball", ball([0.0; 3], 1.0), "paint")
    ]);
    let materials = json!([
        paint("paint", json!({ "base_colour": 0.5 })),
        paint("lamp", json!({ "emission": 5 }))
    ]);
    clean(
        &json!({ "materials": materials, "objects": room, "sky": null }),
        "a room",
    );
}

/// Protects: a quad in the plane of another surface makes the picture wrong if it is hidden
/// everywhere, in either orientation. Quads beside, slightly above, of the same material or earlier
/// in the file than the surface do not.
#[test]
fn surfaces_in_one_plane() {
    let plane = |normal: [f64; 3]| json!({ "plane": { "point": [0, -1, 0], "normal": normal } });
    let floor = || object("floor", plane([0.0, 1.0, 0.0]), "paint");
    let rug = |y: f64, [u, v]: [[f64; 3]; 2], material: &str| {
        object("rug", quad([0.0, y, 0.0], u, v), material)
    };
    let edges = [[1.5, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let value_of = |objects: Value| scene(&json!({ "objects": objects }));
    for (floor, edges) in [
        (floor(), edges),
        (floor(), [edges[1], edges[0]]),
        (object("floor", plane([0.0, -3.0, 0.0]), "paint"), edges),
        (
            object(
                "floor",
                quad([-9.0, -1.0, -9.0], [20.0, 0.0, 1.0], [1.0, 0.0, 20.0]),
                "paint",
            ),
            edges,
        ),
        (
            object(
                "floor",
                json!({ "box": { "min": [-9, -2, -9], "max": [9, -1, 9] } }),
                "paint",
            ),
            edges,
        ),
        (
            object(
                "floor",
                json!({ "disk": { "centre": [0, -1, 0], "normal": [0, 1, 0], "radius": 9 } }),
                "paint",
            ),
            edges,
        ),
    ] {
        let finding = expect_finding(
            &value_of(json!([floor, rug(-1.0, edges, "other")])),
            FaultKind::CoplanarSurfaces,
            PictureWrong,
            &[],
        );
        assert_eq!(finding.subject, raywright_core::fault::Subject::Object(1));
        let [x, y, z] = finding.place.expect("a place");
        assert!(
            finding.count > 100
                && (y + 1.0).abs() < 1e-6
                && (0.0..1.5).contains(&x)
                && (0.0..1.0).contains(&z),
            "{finding:?}"
        );
    }
    let block = || {
        object(
            "block",
            json!({ "box": { "min": [0.3, -1, -0.5], "max": [1.3, 0.4, 0.5] } }),
            "other",
        )
    };
    for clean in [
        json!([floor(), rug(-0.999, edges, "other")]),
        json!([floor(), rug(-1.0, edges, "paint")]),
        json!([floor(), block()]),
        json!([
            block(),
            object(
                "table",
                quad([-9.0, -1.0, -9.0], [20.0, 0.0, 0.0], [0.0, 0.0, 20.0]),
                "paint"
            )
        ]),
        json!([
            object(
                "left",
                quad([-2.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
                "paint"
            ),
            rug(-1.0, edges, "other")
        ]),
    ] {
        assert_eq!(
            listed(&summarise_findings(&value_of(clean.clone())).findings),
            [],
            "{clean}"
        );
    }
    let before =
        summarise_findings(&value_of(json!([rug(-1.0, edges, "other"), floor()]))).findings;
    assert_eq!(
        before
            .iter()
            .map(|finding| (finding.kind, finding.severity))
            .collect::<Vec<_>>(),
        [(FaultKind::CoplanarSurfaces, Harmless)]
    );
}

/// Protects: many tiles side by side in one plane are not reported. A rug that they hide is a
/// single finding.
#[test]
fn many_surfaces_in_one_plane() {
    let tile = |i: usize, material: &str| {
        let (x, z) = ((i % 60) as f64 * 0.05 - 1.5, (i / 60) as f64 * 0.05 - 1.5);
        object(
            &format!("tile {i}"),
            quad([x, -1.0, z], [0.05, 0.0, 0.0], [0.0, 0.0, 0.05]),
            material,
        )
    };
    let mut tiles: Vec<Value> = (0..3600)
        .map(|i| tile(i, if i % 2 == 0 { "paint" } else { "other" }))
        .collect();
    let value_of =
        |tiles: &[Value]| summarise_findings(&scene(&json!({ "objects": tiles }))).findings;
    assert_eq!(listed(&value_of(&tiles)), []);
    let rug = object(
        "rug",
        quad([-0.5, -1.0, -0.5], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        "glass",
    );
    tiles.push(rug);
    let findings = value_of(&tiles);
    let findings: Vec<&Fault> = findings
        .iter()
        .filter(|finding| finding.kind == FaultKind::CoplanarSurfaces)
        .collect();
    assert!(
        findings.len() == 1
            && findings[0].severity == PictureWrong
            && findings[0].message.contains("tile"),
        "{findings:?}"
    );
    assert_eq!(
        findings[0].subject,
        raywright_core::fault::Subject::Object(3600)
    );
}
