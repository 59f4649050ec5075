//! Tangent frames at hits of shapes and meshes.

use super::*;
use crate::effects::EffectSet;
use crate::scene::Scene;
use crate::settings::Settings;
use raywright_bvh::{Interval, Ray};
use serde_json::{Value, json};

/// Tangent, bitangent and normal where a ray hits an object.
fn frame<R: Real>(object: &Value, data: &Value, [origin, direction]: [DVec3; 2]) -> [DVec3; 3] {
    let scene: Scene = serde_json::from_value(json!({
        "format": 1, "materials": [{ "name": "paint", "model": { "physical": {} } }], "objects": [object],
        "meshes": [{ "name": "leaf", "source": { "inline": data } }],
    }))
    .expect("a scene");
    let settings = Settings {
        size: [1, 1],
        ..Settings::from_scene(&scene)
    };
    let prepared = PreparedScene::<R>::new(&scene, &settings, EffectSet::ALL, &())
        .expect("it can be prepared");
    let [origin, direction] = [origin, direction.normalize()].map(R::Vec3::from_f64);
    let segment = PathSegment::from_ray(Ray::new(origin, direction));
    let hit = prepared
        .geometry
        .closest(&segment.ray, Interval::positive(), &mut ())
        .expect("a hit");
    let interaction = Interaction::from_hit(&prepared, &segment, &hit);
    let frame = interaction.shading_frame(&prepared, &segment, &hit);
    [frame.tangent, frame.bitangent, frame.normal].map(Vector::to_f64)
}

/// Asserts the frame in every precision, and that its directions are orthonormal.
#[track_caller]
fn expect_frame(object: Value, data: &Value, ray: [DVec3; 2], tangent: DVec3, bitangent: DVec3) {
    let found = [frame::<f32>, frame::<f64>].map(|frame| frame(&object, data, ray));
    for (found, tolerance) in found.into_iter().zip([1e-5, 1e-9]) {
        let [t, b, n] = found;
        assert!(
            t.distance(tangent.normalize()) < tolerance,
            "{object}: tangent {t:?}, not {:?}",
            tangent.normalize()
        );
        assert!(
            b.distance(bitangent.normalize()) < tolerance,
            "{object}: bitangent {b:?}, not {:?}",
            bitangent.normalize()
        );
        for (one, other) in [(t, b), (b, n), (n, t)] {
            assert!(
                (one.length() - 1.0).abs() < tolerance && one.dot(other).abs() < tolerance,
                "{object}: {found:?}"
            );
        }
    }
}

/// A triangle in the plane z = 0, facing +z, with optional texture coordinates.
fn leaf(uvs: Option<Value>) -> Value {
    let mut data =
        json!({ "positions": [[0, 0, 0], [3, 0, 0], [0, 3, 0]], "indices": [[0, 1, 2]] });
    if let Some(uvs) = uvs {
        data["uvs"] = json!([uvs]);
    }
    data
}

const ONTO: [DVec3; 2] = [DVec3::new(0.5, 0.5, 4.0), DVec3::NEG_Z];
const MIRRORED: [f64; 3] = [-1.0, 1.0, 1.0];

/// Protects: on a sphere the tangent is east and the bitangent north, from inside mirrored; on
/// a floor x and −z; stretched, rotated and mirrored by transforms.
#[test]
fn frames_of_shapes() {
    let shape = |shape: Value, steps: Value| json!({ "shape": shape, "material": "paint", "transform": steps });
    let ball = |steps| {
        shape(
            json!({ "sphere": { "centre": [0, 0, 0], "radius": 1 } }),
            steps,
        )
    };
    let none = leaf(None);
    let n = DVec3::new(0.48, 0.6, 0.64);
    let (east, north) = (
        DVec3::new(n.z, 0.0, -n.x),
        DVec3::new(-n.x * n.y, n.x * n.x + n.z * n.z, -n.z * n.y),
    );
    expect_frame(ball(json!([])), &none, [n * 3.0, -n], east, north);
    expect_frame(ball(json!([])), &none, [DVec3::ZERO, n], east, north);
    expect_frame(
        ball(json!([{ "rotate": { "axis": [0, 1, 0], "degrees": 90 } }])),
        &none,
        [n * 3.0, -n],
        east,
        north,
    );
    expect_frame(
        ball(json!([{ "scale": MIRRORED }])),
        &none,
        [n * 3.0, -n],
        -east,
        north,
    );
    // Stretched along x by 2: the point is scaled, and the normal is n/(2, 1, 1), which leans.
    let stretched = ball(json!([{ "scale": [2, 1, 1] }]));
    let (point, normal) = (n * DVec3::new(2.0, 1.0, 1.0), n * DVec3::new(0.5, 1.0, 1.0));
    let along = east * DVec3::new(2.0, 1.0, 1.0);
    expect_frame(
        stretched,
        &none,
        [point + normal, -normal],
        along,
        normal.cross(along),
    );
    let floor = |steps| {
        shape(
            json!({ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }),
            steps,
        )
    };
    let down = [DVec3::new(0.5, 2.0, 0.25), DVec3::NEG_Y];
    expect_frame(floor(json!([])), &none, down, DVec3::X, DVec3::NEG_Z);
    expect_frame(
        floor(json!([{ "scale": MIRRORED }])),
        &none,
        down,
        DVec3::NEG_X,
        DVec3::NEG_Z,
    );
    expect_frame(
        floor(json!([])),
        &none,
        [-down[0], DVec3::Y],
        DVec3::X,
        DVec3::NEG_Z,
    );
}

/// Protects: on a mesh the tangent follows u of its own coordinates and the bitangent −v, for
/// any order of corners, transform and side; without coordinates they follow the barycentric
/// coordinates.
#[test]
fn frames_of_meshes() {
    let shown = |steps: Value| json!({ "shape": { "mesh": "leaf" }, "material": "paint", "transform": steps });
    let plain = || shown(json!([]));
    // u = x/3, v = 1 − y/3: an image upright and unmirrored.
    let upright = || leaf(Some(json!([[0, 1], [1, 1], [0, 0]])));
    expect_frame(plain(), &upright(), ONTO, DVec3::X, DVec3::Y);
    expect_frame(
        plain(),
        &upright(),
        [-ONTO[0] + DVec3::new(1.0, 1.0, 0.0), DVec3::Z],
        DVec3::X,
        DVec3::Y,
    );
    // u = 1 − x/3: mirrored.
    expect_frame(
        plain(),
        &leaf(Some(json!([[1, 1], [0, 1], [1, 0]]))),
        ONTO,
        DVec3::NEG_X,
        DVec3::Y,
    );
    // u = (x + y)/3, v = y/3: dp/dv, along (−1, 1), is not perpendicular to dp/du, but the
    // bitangent is perpendicular to the tangent.
    expect_frame(
        plain(),
        &leaf(Some(json!([[0, 0], [1, 0], [1, 1]]))),
        ONTO,
        DVec3::X,
        DVec3::NEG_Y,
    );
    expect_frame(plain(), &leaf(None), ONTO, DVec3::X, DVec3::NEG_Y);
    // Mirrored in x: the triangle is reversed, so that it still faces +z.
    let over = [ONTO[0] * DVec3::new(-1.0, 1.0, 1.0), ONTO[1]];
    expect_frame(
        shown(json!([{ "scale": MIRRORED }])),
        &upright(),
        over,
        DVec3::NEG_X,
        DVec3::Y,
    );
    expect_frame(
        shown(json!([{ "scale": MIRRORED }])),
        &leaf(None),
        over,
        DVec3::NEG_X,
        DVec3::NEG_Y,
    );
    // Sheared along y by x: x goes to (1, 1, 0); normals stay.
    let sheared = json!([{ "matrix": [[1, 0, 0, 0], [1, 1, 0, 0], [0, 0, 1, 0]] }]);
    let [t, b] = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, 1.0, 0.0)];
    expect_frame(
        shown(sheared),
        &upright(),
        [ONTO[0] + DVec3::Y * 0.5, ONTO[1]],
        t,
        b,
    );
    // Coordinates without an area define no tangent: any frame is right.
    let [t, b, n] = frame::<f32>(&plain(), &leaf(Some(json!([[0, 0], [1, 1], [2, 2]]))), ONTO);
    assert!(
        t.cross(b).distance(n) < 1e-6 && t.dot(n).abs() < 1e-6,
        "{t:?} {b:?} {n:?}"
    );
}

/// Protects: the tangent is perpendicular to the shading normal, which may lean from the
/// geometric one: here by 37° along x.
#[test]
fn frames_follow_the_shading_normal() {
    let mut data = leaf(Some(json!([[0, 1], [1, 1], [0, 0]])));
    data["normals"] = json!([[3, 0, 4], [3, 0, 4], [3, 0, 4]]);
    let object = json!({ "shape": { "mesh": "leaf" }, "material": "paint" });
    expect_frame(object, &data, ONTO, DVec3::new(4.0, 0.0, -3.0), DVec3::Y);
}

/// Protects: the tangent of an instance that changes during the exposure belongs to the ray's
/// time.
#[test]
fn frames_of_what_moves() {
    let matrix = |lean: f64| json!([{ "matrix": [[1, 0, 0, 0], [lean, 1, 0, 0], [0, 0, 1, 0]] }]);
    let scene: Scene = serde_json::from_value(json!({
        "format": 1, "materials": [{ "name": "paint", "model": { "physical": {} } }],
        "objects": [{ "shape": { "mesh": "leaf" }, "material": "paint", "transform": matrix(0.0), "transform_end": matrix(2.0) }],
        "meshes": [{ "name": "leaf", "source": { "inline": leaf(Some(json!([[0, 1], [1, 1], [0, 0]]))) } }],
    }))
    .expect("a scene");
    let settings = Settings {
        size: [1, 1],
        ..Settings::from_scene(&scene)
    };
    let prepared = PreparedScene::<f32>::new(&scene, &settings, EffectSet::ALL, &())
        .expect("it can be prepared");
    for (time, tangent) in [
        (0.0, DVec3::X),
        (0.5, DVec3::new(1.0, 1.0, 0.0)),
        (1.0, DVec3::new(1.0, 2.0, 0.0)),
    ] {
        let segment = PathSegment::from_ray(
            Ray::new(glam::Vec3::new(0.5, 0.5 + time, 4.0), glam::Vec3::NEG_Z).with_time(time),
        );
        let hit = prepared
            .geometry
            .closest(&segment.ray, Interval::positive(), &mut ())
            .expect("a hit");
        let frame = Interaction::from_hit(&prepared, &segment, &hit)
            .shading_frame(&prepared, &segment, &hit);
        let [t, b] = [frame.tangent, frame.bitangent].map(|v| v.as_dvec3());
        let (tangent, across) = (tangent.normalize(), DVec3::Z.cross(tangent).normalize());
        assert!(
            t.distance(tangent) < 1e-6 && b.distance(across) < 1e-6,
            "at {time}: {t:?} {b:?}"
        );
    }
}

/// Protects: the tangent of a mirrored instance of a shared mesh.
#[test]
fn frames_of_mirrored_instances() {
    let shown = |steps: Value| json!({ "shape": { "mesh": "leaf" }, "material": "paint", "transform": steps });
    let upright = leaf(Some(json!([[0, 1], [1, 1], [0, 0]])));
    let scene: Scene = serde_json::from_value(json!({
        "format": 1, "materials": [{ "name": "paint", "model": { "physical": {} } }],
        "objects": [shown(json!([])), shown(json!([{ "scale": MIRRORED }, { "translate": [-1, 0, 0] }]))],
        "meshes": [{ "name": "leaf", "source": { "inline": upright } }],
    }))
    .expect("a scene");
    let settings = Settings {
        size: [1, 1],
        ..Settings::from_scene(&scene)
    };
    let prepared = PreparedScene::<f32>::new(&scene, &settings, EffectSet::ALL, &())
        .expect("it can be prepared");
    assert_eq!(prepared.geometry.instance_count(), 2);
    for (x, tangent) in [(0.5, DVec3::X), (-1.5, DVec3::NEG_X)] {
        let segment =
            PathSegment::from_ray(Ray::new(glam::Vec3::new(x, 0.5, 4.0), glam::Vec3::NEG_Z));
        let hit = prepared
            .geometry
            .closest(&segment.ray, Interval::positive(), &mut ())
            .expect("a hit");
        let frame = Interaction::from_hit(&prepared, &segment, &hit)
            .shading_frame(&prepared, &segment, &hit);
        let [t, b] = [frame.tangent, frame.bitangent].map(|v| v.as_dvec3());
        assert!(
            t.distance(tangent) < 1e-6 && b.distance(DVec3::Y) < 1e-6,
            "at {x}: {t:?} {b:?}"
        );
    }
}
