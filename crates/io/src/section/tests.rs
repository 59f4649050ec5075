use serde_json::{Value, json};

use super::*;

/// Positions, and triangles of their indices.
type Triangles = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Positions and triangles of a cube that faces outwards or inwards.
fn cube(minimum: f64, maximum: f64, inwards: bool) -> Triangles {
    let at = |bit: u32| if bit == 0 { minimum } else { maximum };
    let corners = (0..8_u32)
        .map(|i| [at(i & 1), at(i >> 1 & 1), at(i >> 2 & 1)])
        .collect();
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let mut triangles: Vec<[u32; 3]> = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    if inwards {
        triangles
            .iter_mut()
            .for_each(|[_, b, c]| core::mem::swap(b, c));
    }
    (corners, triangles)
}

/// Builds a scene of meshes and objects.
fn scene(meshes: &[(&str, Value)], objects: Value) -> Scene {
    let meshes: Vec<Value> = meshes
        .iter()
        .map(|(name, data)| json!({ "name": name, "source": { "inline": data } }))
        .collect();
    let scene = json!({ "format": 1, "materials": [{ "name": "m", "model": { "physical": {} } }], "meshes": meshes, "objects": objects });
    serde_json::from_value(scene).expect("a scene")
}

fn data((positions, indices): Triangles) -> Value {
    json!({ "positions": positions, "indices": indices })
}

fn object(mesh: &str, transform: Value) -> Value {
    json!({ "shape": { "mesh": mesh }, "material": "m", "transform": transform })
}

/// Volumes of the objects in world space after a section, and the codes of the warnings.
fn left(scene: &Scene, section: &str) -> (Vec<f64>, Vec<FaultKind>) {
    let mut scene = scene.clone();
    let warnings = cut_scene(
        &mut scene,
        &section.parse().expect("a section"),
        UpAxis::Y,
        "s",
    );
    let mut volumes: Vec<f64> = Vec::new();
    let mut capped = 0.0;
    for (object, data) in scene.objects.iter().zip(meshes_to_cut(&scene)) {
        let Some(data) = data else { continue };
        let (map, n) = (affine_from_steps(&object.transform), data.positions.len());
        let sets = [data.normals.len(), data.colours.len()]
            .into_iter()
            .chain(data.uvs.iter().map(Vec::len));
        assert!(
            sets.into_iter().all(|len| len == 0 || len == n),
            "{section}: each vertex carries all"
        );
        let volume = data.indices.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| data.positions.position(vertex as usize));
            a.dot(b.cross(c)) / 6.0
        });
        let volume = volume.sum::<f64>() * map.matrix3.determinant().abs();
        // A cap precedes its body.
        if data.is_cap {
            capped = volume
        } else {
            volumes.push(volume + core::mem::take(&mut capped))
        }
    }
    (
        volumes,
        warnings.iter().map(|warning| warning.kind).collect(),
    )
}

#[track_caller]
fn leaves(scene: &Scene, section: &str, expected: &[f64]) {
    let (found, warnings) = left(scene, section);
    let is_near = found.len() == expected.len()
        && found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-5);
    assert!(
        is_near && warnings.iter().all(|_| expected.is_empty()),
        "{section}: {found:?} instead of {expected:?}, {warnings:?}"
    );
}

/// Protects: a closed body stays closed after a section, with the right volume and outward
/// orientation: on either side, along each axis, rotated, scaled and reflected; each instance is
/// cut at its own position.
#[test]
fn closed_bodies_stay_closed() {
    let bodies = [("cube", data(cube(0.0, 1.0, false)))];
    let alone = scene(&bodies, json!([object("cube", json!([]))]));
    for axis in ["x", "y", "z"] {
        leaves(&alone, &format!("{axis}=0.3"), &[0.3]);
        leaves(&alone, &format!("-{axis}=0.3"), &[0.7]);
        leaves(&alone, &format!("{axis}=25%"), &[0.25]);
    }
    let turned = json!([object(
        "cube",
        json!([{ "translate": [-0.5, -0.5, -0.5] }, { "rotate": { "axis": [0, 0, 1], "degrees": 45 } }])
    )]);
    leaves(&scene(&bodies, turned), "x=0", &[0.5]);
    let mirrored = json!([object("cube", json!([{ "scale": [-2, 1, 3] }]))]);
    leaves(&scene(&bodies, mirrored.clone()), "x=-0.5", &[4.5]);
    leaves(&scene(&bodies, mirrored), "-x=-0.5", &[1.5]);
    let twice = json!([
        object("cube", json!([])),
        object("cube", json!([{ "translate": [0.5, 0, 0] }]))
    ]);
    leaves(&scene(&bodies, twice), "x=0.75", &[0.75, 0.25]);
}

/// Protects: a plane through faces keeps or removes the body as a whole, without a sliver; a plane
/// outside keeps or removes everything, with a warning.
#[test]
fn planes_through_faces_leave_no_film() {
    let body = scene(
        &[("cube", data(cube(0.1, 0.3, false)))],
        json!([object("cube", json!([]))]),
    );
    let whole = 0.2_f64.powi(3);
    // Neither number is exact in single precision.
    leaves(&body, "x=0.3", &[whole]);
    leaves(&body, "-x=0.1", &[whole]);
    let beyond = left(&body, "x=7");
    assert!((beyond.0[0] - whole).abs() < 1e-5 && beyond.1 == [FaultKind::Section]);
    for nothing in ["x=0.1", "-x=0.3", "y=-1", "z=0%", "-z=100%"] {
        assert_eq!(
            left(&body, nothing),
            (vec![], vec![FaultKind::Section]),
            "{nothing}"
        );
    }
}

/// Protects: a face of a kept body that lies in the plane stays the body's own, with its attributes;
/// no cap takes its place.
#[test]
fn faces_in_the_plane_are_no_caps() {
    let (mut corners, mut triangles) = cube(-1.0, 0.0, false);
    let (removed, of) = cube(0.5, 1.0, false);
    corners.extend(removed);
    triangles.extend(of.into_iter().map(|triangle| triangle.map(|v| v + 8)));
    let mut both = scene(
        &[("both", data((corners, triangles)))],
        json!([object("both", json!([]))]),
    );
    leaves(&both, "x=0", &[1.0]);
    cut_scene(
        &mut both,
        &"x=0".parse().expect("a section"),
        UpAxis::Y,
        "s",
    );
    let meshes: Vec<_> = meshes_to_cut(&both).into_iter().flatten().collect();
    let counts: Vec<_> = meshes
        .iter()
        .map(|mesh| (mesh.is_cap, mesh.indices.len()))
        .collect();
    assert_eq!(counts, [(false, 12)]);
}

/// Protects: inner walls bound holes, so that a hollow body shows its wall; overlapping bodies of a
/// mesh share a cap; a body that only touches the plane from the removed side leaves nothing.
#[test]
fn caps_have_holes() {
    let join = |parts: Vec<Triangles>| {
        parts.into_iter().fold(
            (Vec::new(), Vec::new()),
            |(mut corners, mut triangles), (more, of)| {
                let first = corners.len() as u32;
                corners.extend(more);
                triangles.extend(
                    of.into_iter()
                        .map(|triangle: [u32; 3]| triangle.map(|vertex| vertex + first)),
                );
                (corners, triangles)
            },
        )
    };
    let hollow = data(join(vec![cube(0.0, 4.0, false), cube(1.0, 3.0, true)]));
    leaves(
        &scene(&[("hollow", hollow)], json!([object("hollow", json!([]))])),
        "y=2",
        &[32.0 - 4.0],
    );
    let beside = data(join(vec![cube(0.0, 1.0, false), cube(1.0, 2.0, false)]));
    leaves(
        &scene(&[("two", beside)], json!([object("two", json!([]))])),
        "x=1",
        &[1.0],
    );
}

/// Protects: an open section has no cap and is named in a warning, while closed neighbours in the
/// same mesh have caps; spheres and moving objects stay whole and are counted; attributes are
/// interpolated.
#[test]
fn open_meshes_and_other_shapes_are_told() {
    let (corners, triangles) = cube(0.0, 1.0, false);
    let lidless: Vec<[u32; 3]> = triangles.iter().copied().skip(2).collect();
    let (found, warnings) = left(
        &scene(
            &[("open", data((corners, lidless)))],
            json!([object("open", json!([]))]),
        ),
        "y=0.5",
    );
    assert_eq!((found.len(), warnings), (1, vec![FaultKind::Section]));
    let mut open = scene(
        &[(
            "open",
            data((cube(0.0, 1.0, false).0, vec![[0, 1, 2], [1, 3, 2]])),
        )],
        json!([object("open", json!([]))]),
    );
    open.objects[0].side = SideRule::Culled;
    cut_scene(
        &mut open,
        &"x=0.5".parse().expect("a section"),
        UpAxis::Y,
        "s",
    );
    assert_eq!(
        (open.objects.len(), open.objects[0].side),
        (1, SideRule::Both),
        "its inside is seen, and it has no cap"
    );
    let others = json!([object("cube", json!([])), { "shape": { "sphere": { "centre": [9, 0, 0], "radius": 1 } }, "material": "m" }]);
    let (found, warnings) = left(
        &scene(&[("cube", data(cube(0.0, 1.0, false)))], others),
        "x=0.5",
    );
    assert_eq!((found.len(), warnings), (1, vec![FaultKind::Section]));
    let leaf = json!({ "positions": [[0, 0, 0], [2, 0, 0], [0, 2, 0]], "indices": [[0, 1, 2]], "uvs": [[[0, 0], [1, 0], [0, 1]]],
        "colours": [[0, 0, 0, 1], [1, 0, 0, 1], [0, 0, 1, 1]], "normals": [[0, 0, 1], [0, 0, 1], [0, 0, 1]] });
    let mut leaf = scene(&[("leaf", leaf)], json!([object("leaf", json!([]))]));
    cut_scene(
        &mut leaf,
        &"x=1".parse().expect("a section"),
        UpAxis::Y,
        "s",
    );
    let data = meshes_to_cut(&leaf).remove(0).expect("a mesh");
    let between: Vec<_> = (0..data.positions.len())
        .filter(|&i| data.positions.position(i).x == 1.0)
        .map(|i| (data.uvs[0][i], data.colours[i][0]))
        .collect();
    assert_eq!(between, [([0.5, 0.0], 0.5), ([0.5, 0.5], 0.5)]);
}

/// Protects: caps have hatched materials of their own, one for each of two neighbouring materials,
/// and each is added once.
#[test]
fn caps_are_hatched() {
    let at = |x: f64, material: &str| json!({ "shape": { "mesh": "cube" }, "material": material, "transform": [{ "translate": [0, x, 0] }] });
    let objects = json!([at(0.0, "m"), at(3.0, "m"), at(6.0, "n"), at(9.0, "o")]);
    let mut scene = scene(&[("cube", data(cube(0.0, 1.0, false)))], objects);
    let section = "x=0.5".parse().expect("a section");
    cut_scene(&mut scene, &section, UpAxis::Y, "s");
    let caps: Vec<&str> = (scene.objects.iter().step_by(2))
        .map(|cap| cap.material.as_str())
        .collect();
    let [first, second] = ["(section cap 1)", "(section cap 2)"];
    assert_eq!(caps, [first, first, second, first]);
    assert_eq!(scene.materials.len(), 3);
    let MaterialModel::Physical(model) = &scene.materials[2].model else {
        panic!("a physical material")
    };
    let ColourInput::Expression(colour) = &model.base_colour else {
        panic!("an expression")
    };
    // The extent of 10 along y makes 30 lines.
    assert!(
        colour.contains("((p.y - 0e0) - (p.z - 0e0)) / 3.33"),
        "{colour}"
    );
    assert!(
        raywright_core::validate::validate(&scene)
            .iter()
            .all(|p| !p.path.contains("model"))
    );
}

/// Protects: a section is in the axes of the file whatever its up axis: its side, its share of the
/// box and the bounds that messages state; a plane beyond the model is told, and cuts nothing.
#[test]
fn sections_are_in_the_axes_of_the_file() {
    let body = |up: UpAxis| {
        let mut scene = scene(
            &[("cube", data(cube(1.0, 2.0, false)))],
            json!([object("cube", json!([{ "scale": [1, 2, 3] }]))]),
        );
        crate::up_axis::rotate_to_y_up(&mut scene, up);
        scene
    };
    for (name, up) in UpAxis::NAMED {
        for (section, expected) in [
            ("x=1.25", 1.5),
            ("-x=1.25", 4.5),
            ("y=2.5", 1.5),
            ("-y=25%", 4.5),
            ("z=25%", 1.5),
            ("-z=3.75", 4.5),
        ] {
            let mut scene = body(up);
            let warnings = cut_scene(&mut scene, &section.parse().expect("a section"), up, "s");
            assert!(warnings.is_empty(), "{name} {section}: {warnings:?}");
            let bounds = raywright_core::measure_scene_extent(
                &scene,
                raywright_core::settings::PrecisionChoice::Reference,
            )
            .bounds;
            let [least, most] = up.bounds_in_file([bounds.min.to_array(), bounds.max.to_array()]);
            let volume: f64 = (0..3).map(|axis| most[axis] - least[axis]).product();
            assert!(
                (volume - expected).abs() < 1e-5,
                "{name} {section}: {least:?} {most:?}"
            );
        }
        let mut scene = body(up);
        let warnings = cut_scene(&mut scene, &"-z=2.9".parse().expect("a section"), up, "s");
        assert_eq!(scene.objects.len(), 1);
        let message = "s: the section -z=2.9 cuts nothing: the model lies between 3.000000 and 6.000000 along z";
        assert!(
            warnings.len() == 1 && warnings[0].message == message,
            "{name}: {warnings:?}"
        );
    }
}
