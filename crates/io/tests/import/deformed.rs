//! Deformed meshes: morph targets, skins and GPU instances, compared with positions computed by
//! hand.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use raywright_io::{
    Error, ErrorKind, Input, LoadOptions, LoadedScene, ModelOptions, ParameterOverrides, load,
};
use serde_json::{Value, json};

use crate::keyed::{KeyedTriangle, load_with};
use crate::shared::{assets, transform, world_triangles};

/// Corners of the model's triangle at rest.
const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

fn load_at(made: &KeyedTriangle, at: Option<f64>) -> LoadedScene {
    made.load_with(None, None, at)
        .unwrap_or_else(|e| panic!("{e}"))
}

/// World positions of the first object's only triangle, with its normals.
fn triangle(loaded: &LoadedScene) -> ([DVec3; 3], Option<[DVec3; 3]>) {
    let (corners, normals) = world_triangles(loaded, &loaded.scene.objects[0]);
    (corners[0], normals.first().copied())
}

#[track_caller]
fn near(found: [DVec3; 3], expected: [DVec3; 3]) {
    let apart = found
        .iter()
        .zip(expected)
        .map(|(a, b)| a.distance(b))
        .fold(0.0, f64::max);
    assert!(apart < 1e-6, "{found:?}, not {expected:?}");
}

/// Two targets: one lifts the corners by 1, 2 and 3 and turns normals to x, the other moves the
/// first corner along y.
fn morphing() -> KeyedTriangle {
    let mut made = KeyedTriangle::new();
    let lift = made.accessor("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0]);
    let turn = made.accessor("VEC3", &[1.0, 0.0, -1.0, 1.0, 0.0, -1.0, 1.0, 0.0, -1.0]);
    let push = made.accessor("VEC3", &[0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let up = made.accessor("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    made.with(|d| {
        let primitive = &mut d["meshes"][0]["primitives"][0];
        primitive["attributes"]["NORMAL"] = json!(up);
        primitive["targets"] = json!([{ "POSITION": lift, "NORMAL": turn }, { "POSITION": push }]);
    })
}

/// Expected triangle under two weights, with its node at (0, 0, 5).
fn morphed(a: f64, b: f64) -> ([DVec3; 3], DVec3) {
    let lifted = |i: usize| CORNERS[i] + DVec3::Z * (a * (i as f64 + 1.0) + 5.0);
    (
        [lifted(0) + DVec3::Y * (4.0 * b), lifted(1), lifted(2)],
        DVec3::new(a, 0.0, 1.0 - a).normalize(),
    )
}

/// Protects: targets are summed by their weights, given by the animation, otherwise by the node,
/// otherwise by the mesh; linear, stepped and by splines, each weight separately; normals are
/// renormalised.
#[test]
fn targets_move_by_their_weights() {
    let weighs = |made: &KeyedTriangle, at: Option<f64>, [a, b]: [f64; 2]| {
        let (corners, normals) = triangle(&load_at(made, at));
        let (expected, normal) = morphed(a, b);
        near(corners, expected);
        near(normals.expect("it has normals"), [normal; 3]);
    };
    weighs(&morphing(), None, [0.0, 0.0]);
    let mesh = || morphing().with(|d| d["meshes"][0]["weights"] = json!([0.5, 0.25]));
    weighs(&mesh(), None, [0.5, 0.25]);
    let node = || mesh().with(|d| d["nodes"][1]["weights"] = json!([0.25, -1]));
    weighs(&node(), None, [0.25, -1.0]);
    let line = node().animated("", 1, "weights", "LINEAR", &[0.0, 1.0, 0.5, 3.0]);
    weighs(&line, None, [0.25, -1.0]);
    for (time, weights) in [
        (0.0, [0.0, 1.0]),
        (1.5, [0.125, 1.5]),
        (2.0, [0.25, 2.0]),
        (9.0, [0.5, 3.0]),
    ] {
        weighs(&line, Some(time), weights);
    }
    weighs(
        &node().animated("", 1, "weights", "STEP", &[0.0, 1.0, 0.5, 3.0]),
        Some(2.9),
        [0.0, 1.0],
    );
    // In-tangent, value and out-tangent of each key, two weights each; the keys are two seconds
    // apart.
    let spline = [9.0, 9.0, 0.0, 1.0, 0.25, 0.0, 0.5, 0.0, 0.5, 3.0, 9.0, 9.0];
    weighs(
        &node().animated("", 1, "weights", "CUBICSPLINE", &spline),
        Some(2.0),
        [0.25 + 0.25 * (0.25 - 0.5), 2.0],
    );
    weighs(
        &node().animated("", 1, "weights", "CUBICSPLINE", &spline),
        Some(3.0),
        [0.5, 3.0],
    );
}

/// Protects: where a primitive uses some of the listed vertices, its targets move each by the
/// offset of its own index.
#[test]
fn targets_move_listed_vertices_by_their_indices() {
    let mut made = KeyedTriangle::new();
    let after_others = |other: f32, last: [f32; 9]| [&[other; 18][..], &last].concat();
    let corners = after_others(9.0, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let lift = after_others(5.0, [0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0]);
    let (corners, lift) = (
        made.accessor("VEC3", &corners),
        made.accessor("VEC3", &lift),
    );
    let indices = made.accessor("SCALAR", &[6, 7, 8].map(f32::from_bits));
    let made = made.with(|d| {
        d["accessors"][indices]["componentType"] = json!(5125);
        d["meshes"][0] = json!({ "weights": [1], "primitives": [{
            "attributes": { "POSITION": corners }, "indices": indices, "targets": [{ "POSITION": lift }] }] });
    });
    near(triangle(&load_at(&made, None)).0, morphed(1.0, 0.0).0);
}

/// Protects: a mesh under several nodes with different weights becomes several meshes; with equal
/// weights, one.
#[test]
fn shapes_are_told_apart() {
    let made = |weights: [f64; 2]| {
        morphing().with(|d| {
            d["scenes"][0]["nodes"] = json!([0, 2]);
            (d["nodes"][1]["weights"], d["nodes"][2]["weights"]) = (json!([1, 0]), json!(weights));
        })
    };
    assert_eq!(load_at(&made([1.0, 0.0]), None).scene.meshes.len(), 1);
    let loaded = load_at(&made([0.0, 1.0]), None);
    assert_eq!(loaded.scene.meshes.len(), 2);
    let z =
        |i: usize| world_triangles(&loaded, &loaded.scene.objects[i]).0[0].map(|corner| corner.z);
    assert_eq!([z(0), z(1)], [[6.0, 7.0, 8.0], [0.0; 3]]);
}

fn matrix(map: &DAffine3) -> Vec<f32> {
    let [x, y, z] =
        [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(|axis| axis.extend(0.0));
    [x, y, z, map.translation.extend(1.0)]
        .iter()
        .flat_map(|column| column.to_array())
        .map(|c| c as f32)
        .collect()
}

/// Model with two joints at these transforms, bound at the origin and at (0, 1, 0), and its
/// triangle with these weights in 255ths.
fn skinned(joints: [DAffine3; 2], weights: [[u8; 4]; 3]) -> KeyedTriangle {
    let mut made = KeyedTriangle::new();
    let binds = [
        matrix(&DAffine3::IDENTITY),
        matrix(&DAffine3::from_translation(-DVec3::Y)),
    ]
    .concat();
    let binds = made.accessor("MAT4", &binds);
    let up = made.accessor("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let hang = made.bytes(false, &[[0, 1, 0, 0]; 3]);
    let weights = made.bytes(true, &weights);
    made.with(|d| {
        let attributes = &mut d["meshes"][0]["primitives"][0]["attributes"];
        (attributes["NORMAL"], attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(up), json!(hang), json!(weights));
        d["skins"] = json!([{ "joints": [3, 4], "inverseBindMatrices": binds }]);
        d["nodes"][1]["skin"] = json!(0);
        let nodes = d["nodes"].as_array_mut().expect("a list");
        let node = |map: &DAffine3| {
            let (scale, turn, position) = map.to_scale_rotation_translation();
            json!({ "scale": scale.to_array(), "rotation": turn.to_array(), "translation": position.to_array() })
        };
        nodes.extend(joints.iter().map(node));
        d["scenes"][0]["nodes"] = json!([0, 3, 4]);
    })
}

/// Protects: a vertex follows its joints by its weights and not its node; weights are divided by
/// their sum, and without any the first joint has the vertex; normals rotate along.
#[test]
fn skins_go_with_their_joints() {
    let quarter = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let tall = DVec3::new(1.0, 3.0, 1.0);
    let second = DAffine3::from_scale_rotation_translation(tall, quarter, DVec3::Y);
    let joints = [DAffine3::from_translation(DVec3::X * 3.0), second];
    let loaded = load_at(
        &skinned(joints, [[255, 0, 0, 0], [0, 0, 0, 0], [100, 100, 0, 0]]),
        None,
    );
    let (corners, normals) = triangle(&loaded);
    // The third corner stays at (0, 1, 0) under the second joint, and moves to (3, 1, 0) with the
    // first.
    near(
        corners,
        [DVec3::X * 3.0, DVec3::X * 4.0, DVec3::new(1.5, 1.0, 0.0)],
    );
    let half = second.matrix3 * 0.5 + DMat3::IDENTITY * 0.5;
    near(
        normals.expect("it has normals"),
        [
            DVec3::Z,
            DVec3::Z,
            (half.inverse().transpose() * DVec3::Z).normalize(),
        ],
    );
    // All under the second joint: the model rotated about (0, 1, 0).
    let (corners, normals) = triangle(&load_at(&skinned(joints, [[0, 255, 0, 0]; 3]), None));
    near(
        corners,
        CORNERS.map(|corner| quarter * (tall * (corner - DVec3::Y)) + DVec3::Y),
    );
    near(normals.expect("it has normals"), [quarter * DVec3::Z; 3]);
}

/// Protects: a skinned mesh below a reflection keeps the front side of its file: corners follow the
/// joints, with the order and the normals of the reflected triangle. A node of the other handedness
/// makes another mesh.
#[test]
fn skins_below_mirrors_keep_their_front() {
    let made = skinned([DAffine3::IDENTITY; 2], [[255, 0, 0, 0]; 3]);
    let made = made.with(|d| {
        let nodes = d["nodes"].as_array_mut().expect("a list");
        nodes[1]["translation"] = json!([7, 7, 7]);
        nodes.push(json!({ "mesh": 0, "skin": 0 }));
        nodes.push(json!({ "scale": [-1, 1, 1], "children": [1, 3, 4] }));
        d["scenes"][0]["nodes"] = json!([6, 5]);
    });
    let loaded = load_at(&made, None);
    assert_eq!(
        (loaded.scene.meshes.len(), loaded.scene.objects.len()),
        (2, 2)
    );
    for object in &loaded.scene.objects {
        let (corners, normals) = world_triangles(&loaded, object);
        let [a, b, c] = corners[0];
        let geometric = (b - a).cross(c - a);
        let faces = if std::ptr::eq(object, &loaded.scene.objects[0]) {
            1.0
        } else {
            -1.0
        };
        near(
            [a, a.min(b).min(c), a.max(b).max(c)],
            [DVec3::ZERO, DVec3::NEG_X, DVec3::Y],
        );
        near(
            [geometric, normals[0][0], normals[0][2]],
            [DVec3::Z * faces; 3],
        );
    }
}

/// Protects: a skinned model a million kilometres away keeps its shape, beyond the range of single
/// precision; joints outside every scene have a transform too.
#[test]
fn skins_far_away_keep_their_shape() {
    let far = DVec3::new(1e9, -1e9, 0.25);
    let joints = [
        DAffine3::from_translation(far),
        DAffine3::from_translation(far + DVec3::Y),
    ];
    let weights = [[255, 0, 0, 0], [0, 255, 0, 0], [9, 9, 0, 0]];
    for nodes in [json!([0, 3, 4]), json!([0])] {
        let made = skinned(joints, weights).with(|d| d["scenes"][0]["nodes"] = nodes);
        near(
            triangle(&load_at(&made, None)).0,
            CORNERS.map(|corner| corner + far),
        );
    }
}

/// Protects: an animated skin deforms its vertices after the morph targets.
#[test]
fn skins_and_targets_play_together() {
    let joints = [DAffine3::IDENTITY, DAffine3::from_translation(DVec3::Y)];
    let mut made = skinned(joints, [[255, 0, 0, 0]; 3]);
    let lift = made.accessor("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0]);
    let made =
        made.with(|d| d["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": lift }]));
    let made = made.animated("", 1, "weights", "LINEAR", &[0.0, 1.0]);
    let made = made.animated(
        "",
        3,
        "translation",
        "LINEAR",
        &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0],
    );
    let moved = |t: f64| [1.0, 2.0, 3.0].map(|n| DVec3::new(4.0 * t, 0.0, n * t));
    for (time, t) in [(1.0, 0.0), (2.0, 0.5), (3.0, 1.0)] {
        let expected = [0, 1, 2].map(|i| CORNERS[i] + moved(t)[i]);
        near(triangle(&load_at(&made, Some(time))).0, expected);
    }
}

/// A change of a file's JSON that makes it invalid.
type SkinDamage = fn(&mut Value);

/// Protects: invalid skins and targets are errors with their position, at any time of an animation.
#[test]
fn broken_skins_and_targets_are_refused() {
    let joints = [DAffine3::IDENTITY; 2];
    let attributes = |d: &mut Value| {
        d["meshes"][0]["primitives"][0]["attributes"]
            .as_object_mut()
            .expect("a table")
            .clone()
    };
    let skins: [(SkinDamage, &str); 6] = [
        (
            |d| d["skins"][0]["joints"] = json!([3]),
            "joint 1 does not exist, the skin has 1 joint",
        ),
        (|d| d["skins"][0]["joints"] = json!([3, 99]), "nodes[99]"),
        (
            |d| d["skins"][0]["joints"] = json!([3, 4, 3]),
            "3 joints, but 2 inverseBindMatrices",
        ),
        (
            |d| d["skins"][0]["inverseBindMatrices"] = json!(0),
            "of 3 numbers",
        ),
        (|d| d["nodes"][1]["skin"] = json!(7), "skins[7]"),
        (
            |d| d["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(1),
            "JOINTS_0: has elements of 16 components",
        ),
    ];
    for (change, word) in skins {
        let made = skinned(joints, [[255, 255, 0, 0]; 3]).with(change);
        let error = made.load_with(None, None, None).expect_err(word);
        assert!(
            error.kind() == ErrorKind::Input && error.to_string().contains(word),
            "{word}: {error}"
        );
    }
    let bare = skinned(joints, [[255, 0, 0, 0]; 3]).with(|d| {
        let kept: serde_json::Map<_, _> = attributes(d)
            .into_iter()
            .filter(|(name, _)| name != "JOINTS_0")
            .collect();
        d["meshes"][0]["primitives"][0]["attributes"] = kept.into();
    });
    assert!(
        bare.load_with(None, None, None)
            .expect_err("no joints")
            .to_string()
            .contains("no JOINTS_0")
    );
    let targets: [(SkinDamage, &str); 3] = [
        (
            |d| d["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(99),
            "accessors[99]",
        ),
        (
            |d| d["accessors"][1]["count"] = json!(2),
            "has 2 elements of 3 numbers",
        ),
        (|d| d["accessors"][2]["type"] = json!("SCALAR"), "NORMAL"),
    ];
    for (change, word) in targets {
        let made = morphing()
            .with(|d| d["meshes"][0]["weights"] = json!([1, 1]))
            .with(change);
        let error = made.load_with(None, None, None).expect_err(word);
        assert!(
            error.kind() == ErrorKind::Input && error.to_string().contains("targets[0]"),
            "{word}: {error}"
        );
        assert!(error.to_string().contains(word), "{word}: {error}");
    }
}

/// Protects: EXT_mesh_gpu_instancing shows the mesh at each transform in its node's space, rotated
/// and scaled, stored once.
#[test]
fn instances_of_the_graphics_processor() {
    let (turn, position) = (DQuat::from_rotation_z(0.7), DVec3::new(1.0, 2.0, 3.0));
    let mut made = KeyedTriangle::new();
    let lists = [
        made.accessor("VEC3", &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]),
        made.accessor(
            "VEC4",
            &[
                [0.0, 0.0, 0.0, 1.0],
                turn.to_array().map(|c| 2.0 * c as f32),
            ]
            .concat(),
        ),
        made.accessor("VEC3", &[1.0, 1.0, 1.0, 2.0, -3.0, 4.0]),
    ];
    let made = made.with(|d| {
        let attributes =
            json!({ "TRANSLATION": lists[0], "ROTATION": lists[1], "SCALE": lists[2] });
        d["nodes"][1]["extensions"] =
            json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
        d["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    });
    let loaded = load_at(&made, None);
    assert_eq!(
        (loaded.scene.objects.len(), loaded.scene.meshes.len()),
        (2, 1)
    );
    near(
        triangle(&loaded).0,
        CORNERS.map(|corner| corner + DVec3::Z * 5.0),
    );
    let second = world_triangles(&loaded, &loaded.scene.objects[1]).0[0];
    near(
        second,
        CORNERS
            .map(|corner| turn * (corner * DVec3::new(2.0, -3.0, 4.0)) + position + DVec3::Z * 5.0),
    );
    let broken = made.with(|d| d["accessors"][lists[2]]["count"] = json!(1));
    let error = broken
        .load_with(None, None, None)
        .expect_err("fewer scales than places")
        .to_string();
    assert!(
        error.contains("nodes[1]: EXT_mesh_gpu_instancing: has different numbers of translations, rotations and scales: [2, 2, 1]"),
        "{error}"
    );
}

/// Protects: a node under two parents is shown under each, with a warning; repeated doubling is
/// refused, and so is a cycle, wherever it begins.
#[test]
fn nodes_of_several_parents() {
    let shared = KeyedTriangle::new().with(|d| {
        d["nodes"][2] = json!({ "children": [1], "translation": [7, 0, 0] });
        d["scenes"][0]["nodes"] = json!([0, 2]);
    });
    let loaded = load_at(&shared, None);
    let places: Vec<DVec3> = loaded
        .scene
        .objects
        .iter()
        .map(|object| transform(object).1)
        .collect();
    assert_eq!(places, [DVec3::Z * 5.0, DVec3::X * 7.0]);
    assert!(
        loaded
            .warnings
            .iter()
            .any(|w| w.message.contains("nodes[1]: has more than one parent")),
        "{:?}",
        loaded.warnings
    );
    let doubled = KeyedTriangle::new().with(|d| {
        let pairs = (0..64).map(|i| json!({ "children": [i + 1, i + 1] }));
        let chain: Vec<Value> = pairs.chain([json!({ "mesh": 0 })]).collect();
        (d["nodes"], d["scenes"]) = (chain.into(), json!([{ "nodes": [0] }]));
    });
    assert_eq!(
        doubled
            .load_with(None, None, None)
            .expect_err("two to the power of 64")
            .kind(),
        ErrorKind::Limit
    );
    for child in [0, 1] {
        let cycle = KeyedTriangle::new().with(|d| d["nodes"][1]["children"] = json!([child]));
        assert!(
            cycle
                .load_with(None, None, None)
                .expect_err("a cycle")
                .to_string()
                .contains("the hierarchy of nodes has a cycle")
        );
    }
}

/// Protects: a node listed 100,000 times, as a root, as a child or as an instance, is shown once at
/// each transform, with its descendants and a warning; at another transform it is shown again, and
/// a camera or light counts once.
#[test]
fn what_is_listed_again_and_again_is_shown_once() {
    const MANY: usize = 100_000;
    let as_roots = KeyedTriangle::new().with(|d| d["scenes"][0]["nodes"] = vec![0; MANY].into());
    let as_children =
        KeyedTriangle::new().with(|d| d["nodes"][0]["children"] = vec![1; MANY].into());
    let below = KeyedTriangle::new().with(|d| {
        d["nodes"][2] = json!({ "children": vec![1; MANY], "translation": [7, 0, 0] });
        d["scenes"][0]["nodes"] = json!([0, 2, 0]);
    });
    for (made, places) in [
        (as_roots, &[DVec3::Z * 5.0][..]),
        (as_children, &[DVec3::Z * 5.0]),
        (below, &[DVec3::Z * 5.0, DVec3::X * 7.0]),
    ] {
        let loaded = load_at(&made, None);
        assert_eq!(
            loaded
                .scene
                .objects
                .iter()
                .map(|object| transform(object).1)
                .collect::<Vec<_>>(),
            places
        );
        assert!(loaded.warnings.iter().any(|w| {
            w.message
                .contains("is listed more than once with the same transform")
        }));
    }
    let mut made = KeyedTriangle::new();
    let list = made.accessor(
        "VEC3",
        &[[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0]]
            .concat()
            .repeat(MANY / 2),
    );
    let made = made.with(|d| {
        d["nodes"][1]["extensions"] =
            json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": list } } });
    });
    let loaded = load_at(&made, None);
    assert_eq!(loaded.scene.objects.len(), 2);
    let left_out = format!(
        "{} instances repeat the transform of another instance",
        MANY - 2
    );
    assert!(
        loaded
            .warnings
            .iter()
            .any(|w| w.message.contains(&left_out)),
        "{:?}",
        loaded.warnings
    );
    let lit = KeyedTriangle::new().with(|d| {
        d["extensions"]["KHR_lights_punctual"] = json!({ "lights": [{ "type": "point" }] });
        d["nodes"][1]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
        d["nodes"][0]["children"] = json!([1, 1, 1]);
    });
    assert_eq!(load_at(&lit, None).scene.lights.len(), 1);
}

/// Protects: each animation of a file is found by name or index, and shown at its start without a
/// time; without a choice all are played together, the first in precedence; an unknown one is an
/// error that lists them.
#[test]
fn animations_are_chosen() {
    let Some(folder) = assets("gltf") else { return };
    let file = Input::Path(folder.join("Fox/Fox.glb"));
    let corners = |animation: Option<&str>, at: Option<f64>| {
        let model = ModelOptions {
            animation: animation.map(str::to_owned),
            ..ModelOptions::default()
        };
        let overrides = ParameterOverrides {
            time: at,
            set: Vec::new(),
        };
        let loaded = load(
            &file,
            &LoadOptions {
                overrides,
                model,
                ..LoadOptions::default()
            },
        )?;
        let triangles = loaded
            .scene
            .objects
            .iter()
            .flat_map(|object| world_triangles(&loaded, object).0);
        Ok::<_, Error>(triangles.flatten().collect::<Vec<DVec3>>())
    };
    let at = |animation, time| corners(animation, Some(time)).expect("a moment");
    let [survey, walk, run] = [Some("Survey"), Some("Walk"), Some("Run")].map(|name| at(name, 0.3));
    assert!(survey != walk && walk != run && run != survey);
    assert_eq!(
        (at(None, 0.3), at(Some("1"), 0.3), at(Some("2"), 0.3)),
        (survey, walk, run)
    );
    assert_eq!(
        corners(Some("Run"), None).expect("its beginning"),
        at(Some("Run"), 0.0)
    );
    let error = corners(Some("Runn"), None).expect_err("none of that name");
    assert_eq!(error.kind(), ErrorKind::Usage);
    assert!(
        error
            .to_string()
            .contains("did you mean `Run`? Its animations: 0 `Survey`, 1 `Walk`, 2 `Run`"),
        "{error}"
    );
}

/// Protects: real rigs have the poses of another program's skinning (in double precision, by
/// matrices): the least and the greatest corner, to a millionth of their size.
#[test]
fn real_rigs() {
    let Some(folder) = assets("gltf") else { return };
    let cases: [(&str, Option<f64>, [f64; 6]); 4] = [
        (
            "RiggedFigure/RiggedFigure.glb",
            None,
            [-0.5894609, 0.0, -0.1309178, 0.5894610, 1.4499199, 0.1949773],
        ),
        (
            "RiggedFigure/RiggedFigure.glb",
            Some(0.6),
            [-0.4501144, 0.0, -0.1223676, 0.4405977, 1.4676080, 0.2183717],
        ),
        (
            "Fox/Fox.glb",
            None,
            [
                -12.592719, -0.121744, -88.095006, 12.592717, 78.907198, 66.624860,
            ],
        ),
        (
            "Fox/Fox.glb",
            Some(0.3),
            [
                -24.657729, -0.130841, -85.623348, 11.595314, 74.921086, 60.891673,
            ],
        ),
    ];
    for (file, time, expected) in cases {
        let loaded =
            load_with(folder.join(file), None, None, time).unwrap_or_else(|e| panic!("{e}"));
        let objects = loaded.scene.objects.iter();
        let corners =
            objects.flat_map(|object| world_triangles(&loaded, object).0.into_iter().flatten());
        let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        let expected = [
            DVec3::from_slice(&expected[..3]),
            DVec3::from_slice(&expected[3..]),
        ];
        let size = expected[0].distance(expected[1]);
        let apart = low.distance(expected[0]).max(high.distance(expected[1]));
        assert!(
            apart < 1e-6 * size,
            "{file} at {time:?}: {low:?} {high:?}, not {expected:?}"
        );
    }
}

/// Protects: colours and texture coordinates move with morph targets too, by their weights; sums of
/// colours are clamped, and a target of another length is refused.
#[test]
fn targets_move_colours_and_coordinates() {
    let made = |weights: Value, offsets: usize| {
        let mut made = KeyedTriangle::new();
        let colours = made.accessor("VEC3", &[1.0, 0.0, 0.0].repeat(3));
        let recolour = made.accessor("VEC3", &[-1.0, 0.5, 2.0].repeat(offsets));
        let uvs = made.accessor("VEC2", &[0.25, 0.5].repeat(3));
        let shift = made.accessor("VEC2", &[0.5, -1.0].repeat(3));
        made.with(|d| {
            let primitive = &mut d["meshes"][0]["primitives"][0];
            primitive["attributes"]["COLOR_0"] = json!(colours);
            primitive["attributes"]["TEXCOORD_0"] = json!(uvs);
            primitive["targets"] = json!([{ "COLOR_0": recolour }, { "TEXCOORD_0": shift }]);
            d["meshes"][0]["weights"] = weights;
        })
    };
    for (weights, colour, uv) in [
        (json!([0, 0]), [1.0, 0.0, 0.0, 1.0], [0.25, 0.5]),
        (json!([0.5, 1]), [0.5, 0.25, 1.0, 1.0], [0.75, -0.5]),
        (json!([1, -1]), [0.0, 0.5, 1.0, 1.0], [-0.25, 1.5]),
    ] {
        let loaded = load_at(&made(weights, 3), None);
        let raywright_core::scene::MeshSource::Inline(data) = &loaded.scene.meshes[0].source else {
            panic!("a mesh")
        };
        assert_eq!((data.colours[2], data.uvs[0][2]), (colour, uv));
    }
    let error = made(json!([1, 0]), 2)
        .load_with(None, None, None)
        .expect_err("two of three");
    assert!(
        error
            .message()
            .contains("targets[0]: COLOR_0: has 2 elements"),
        "{error}"
    );
}

/// Protects: objects that znear or zfar would clip are told, and none where nothing is clipped.
#[test]
fn clipped_objects_are_told() {
    // The triangle lies at z = 5, and the camera looks at it from `z`, at a node of its own.
    let warned = |kind: &str, z: f64, near: f64, far: Value| {
        let mut view = json!({ "znear": near, "yfov": 1, "xmag": 1, "ymag": 1 });
        if !far.is_null() {
            view["zfar"] = far;
        }
        let made = KeyedTriangle::new().with(|d| {
            d["cameras"] = json!([{ "type": kind, kind: view }]);
            d["nodes"][2] = json!({ "camera": 0, "translation": [0, 0, z] });
            d["scenes"][0]["nodes"] = json!([0, 2]);
        });
        let warnings = load_at(&made, None).warnings;
        warnings
            .iter()
            .any(|warning| warning.message.contains("cameras[0]: its znear and zfar"))
    };
    for kind in ["perspective", "orthographic"] {
        assert!(!warned(kind, 15.0, 0.1, json!(100)) && !warned(kind, 15.0, 0.1, Value::Null));
        assert!(warned(kind, 15.0, 11.0, json!(100)) && warned(kind, 15.0, 0.1, json!(9)));
        assert!(!warned(kind, 0.0, 0.1, json!(9)), "it is behind the camera");
    }
}
