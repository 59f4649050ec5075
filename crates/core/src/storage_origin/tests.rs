//! Choice of the storage origin.

use serde_json::{Value, json};

use super::*;

fn scene(objects: &[Value]) -> Scene {
    let scene = json!({ "format": 1, "materials": [{ "name": "m", "model": { "classic": {} } }], "objects": objects });
    serde_json::from_value(scene).unwrap_or_else(|e| panic!("{e}"))
}

fn ball(centre: [f64; 3], radius: f64) -> Value {
    json!({ "shape": { "sphere": { "centre": centre, "radius": radius } }, "material": "m" })
}

fn of(objects: &[Value]) -> StorageOrigin {
    let scene = scene(objects);
    StorageOrigin::from_scene::<f32>(&scene, &SceneLookup::new(&scene))
}

/// Protects: a scene about or near zero is stored relative to zero, so that its pictures keep their
/// bits; so is a scene without bounded objects. Only the axes along which a scene is far get an
/// origin, at whole multiples of its size.
#[test]
fn only_what_is_far_has_an_origin() {
    let floor = json!({ "shape": { "plane": { "point": [0, 1e6, 0], "normal": [0, 1, 0] } }, "material": "m" });
    for objects in [
        vec![],
        vec![floor.clone()],
        vec![ball([0.0; 3], 1.0)],
        vec![ball([5.0, -7.0, 3.0], 1.0), floor.clone()],
    ] {
        assert_eq!(of(&objects).origin, DVec3::ZERO, "{objects:?}");
    }
    for sign in [1.0, -1.0] {
        let far = of(&[
            ball([sign * 448_200.25, sign * 4_865_499.5, 3.0], 1.0),
            floor.clone(),
        ]);
        assert_eq!(
            (far.origin, far.unresolved),
            (sign * DVec3::new(448_200.0, 4_865_500.0, 0.0), None)
        );
    }
}

/// Protects: where no single origin serves two clusters, the cluster with more objects is resolved,
/// and the first object of the other is reported; f64 resolves both.
#[test]
fn of_two_clusters_one_is_named() {
    let (near, far) = ([0.0; 3], [3e6, 0.0, 0.0]);
    let more_far = [ball(near, 1.0), ball(far, 1.0), ball(far, 0.5)];
    assert_eq!(
        (of(&more_far).origin.x, of(&more_far).unresolved),
        (3e6, Some(0))
    );
    let more_near = [ball(near, 1.0), ball(near, 0.5), ball(far, 1.0)];
    assert_eq!(
        (of(&more_near).origin, of(&more_near).unresolved),
        (DVec3::ZERO, Some(2))
    );
    let scene = scene(&more_near);
    assert_eq!(
        StorageOrigin::from_scene::<f64>(&scene, &SceneLookup::new(&scene)).unresolved,
        None
    );
}

/// Protects: resolution is judged by the transformed size of an object: enlarged far objects are
/// resolved, shrunk ones are not.
#[test]
fn sizes_are_those_of_shown_objects() {
    let far = |radius: f64, scale: f64| {
        let mut ball = ball([0.0; 3], radius);
        ball["transform"] =
            json!([{ "scale": [scale, scale, scale] }, { "translate": [3e6, 0, 0] }]);
        ball
    };
    let near = [ball([0.0; 3], 1.0), ball([0.0; 3], 0.5)];
    let unresolved = |far: Value| of(&[near.to_vec(), vec![far]].concat()).unresolved;
    assert_eq!(unresolved(far(1.0, 1000.0)), None);
    assert_eq!(unresolved(far(1000.0, 1e-3)), Some(2));
}
