//! Shading normals side by side against those of single hits.

use serde_json::json;

use super::*;
use crate::effects::EffectSet;
use crate::integrator::PathSegment;
use crate::scene::Scene;
use crate::settings::Settings;

const SIZE: [u32; 2] = [48, 32];

/// A wall of meshes, each of which takes a path of its own through the code: with tilted normals,
/// without normals, with normals of length zero, mirrored and scaled, turning during the shutter, with
/// normals that point outwards on both sides, and a ball.
fn wall() -> Scene {
    let mesh = |name: &str, normals: serde_json::Value| {
        let mut data = json!({ "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0.2], [-1, 1, 0]],
            "indices": [[0, 1, 2], [0, 2, 3]] });
        if !normals.is_null() {
            data["normals"] = normals;
        }
        json!({ "name": name, "source": { "inline": data } })
    };
    let object = |mesh: &str, x: f64, y: f64, more: serde_json::Value| {
        let mut object = json!({ "shape": { "mesh": mesh }, "material": "paint",
            "transform": [{ "translate": [x, y, 0] }] });
        for (key, value) in more.as_object().expect("keys") {
            object[key] = value.clone();
        }
        object
    };
    serde_json::from_value(json!({
        "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": [1, 1, 9], "target": [0, 0, 0] } },
            "projection": { "pinhole": { "vertical_fov": 50 } }, "shutter": [0, 1] }],
        "lights": [{ "kind": { "point": { "position": [0, 0, 5] } }, "colour": 10 }],
        "materials": [{ "name": "paint", "model": { "physical": {} } }],
        "meshes": [
            mesh("tilted", json!([[-0.9, 0, 0.3], [0.9, 0.2, 0.3], [0.9, 0.9, 0.1], [-0.9, 0.9, 0.1]])),
            mesh("flat", json!(null)),
            mesh("absent", json!([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]])),
        ],
        "objects": [
            object("tilted", -3.0, 2.0, json!({})),
            object("flat", 0.0, 2.0, json!({})),
            object("absent", 3.0, 2.0, json!({})),
            object("tilted", -3.0, -2.0, json!({ "transform":
                [{ "scale": [-1, 0.7, 2] }, { "translate": [-3, -2, 0] }] })),
            object("tilted", 0.0, -2.0, json!({ "transform": [{ "translate": [0, -2, 0] }],
                "transform_end": [{ "rotate": { "axis": [0, 1, 0], "degrees": 40 } }, { "translate": [0, -2, 0] }] })),
            object("tilted", 3.0, -2.0, json!({ "face_viewer": false, "transform":
                [{ "rotate": { "axis": [0, 1, 0], "degrees": 180 } }, { "translate": [3, -2, 0] }] })),
            object("tilted", -3.0, 0.0, json!({ "transform": [{ "scale": [0.7, 0.7, 1] },
                { "rotate": { "axis": [0, 1, 0], "degrees": 170 } }, { "translate": [-3, 0, 0] }] })),
            { "shape": { "sphere": { "centre": [0, 0, 0], "radius": 0.8 } }, "material": "paint" },
        ],
    }))
    .expect("a scene")
}

/// Compares the normals of all pixels' hits, and returns how many differ from the geometric normal.
fn compare_with_single_hits<R: Real>() -> usize {
    let scene = wall();
    let settings = Settings {
        size: SIZE,
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    let prepared = PreparedScene::<R>::new(&scene, &settings, EffectSet::ALL, &())
        .expect("it can be prepared");
    let at = |x: u32| R::from_f64(f64::from(x) + 0.5);
    let mut hits = Vec::new();
    for i in 0..SIZE[0] * SIZE[1] {
        let mut ray = prepared
            .camera
            .generate_ray(at(i % SIZE[0]), at(i / SIZE[0]), [0.5; 2]);
        ray.time = R::from_f64(f64::from(i % 7) / 6.0);
        let segment = PathSegment::from_ray(ray);
        if let Some(hit) =
            prepared
                .geometry
                .closest(&ray, raywright_bvh::Interval::positive(), &mut ())
        {
            hits.push((segment, hit));
        }
    }
    let objects: std::collections::BTreeSet<_> =
        hits.iter().map(|(_, hit)| hit.outermost_id()).collect();
    assert_eq!(objects.len(), 8, "{objects:?}");
    let mut interactions = vec![Interaction::<R>::PLACEHOLDER; hits.len()];
    let mut normals = ShadingNormalLanes::new();
    for (k, (segment, hit)) in hits.iter().enumerate() {
        interactions[k] = Interaction::with_hit_geometry(&prepared, segment, hit);
        normals.push_hit(&prepared, (&mut interactions, k), (&segment.ray, hit));
    }
    normals.flush(&mut interactions);
    let mut bent = 0;
    for ((segment, hit), found) in hits.iter().zip(&interactions) {
        let alone = Interaction::from_hit_without_normal_map(&prepared, segment, hit);
        let bits = |v: R::Vec3| v.to_f64().to_array().map(f64::to_bits);
        assert_eq!(
            bits(found.normal),
            bits(alone.normal),
            "object {}",
            hit.outermost_id()
        );
        bent += usize::from(found.normal != found.surface.normal);
    }
    bent
}

/// Protects: normals computed side by side have the bits of those of single hits, whatever the
/// object: smooth, flat, mirrored, turning, seen from behind, or no mesh; in both precisions.
#[test]
fn normals_side_by_side_are_those_alone() {
    assert!(compare_with_single_hits::<f32>() > 200);
    assert!(compare_with_single_hits::<f64>() > 200);
}

/// Protects: a normal that reflects the view below the surface is bent, and is said not to be kept.
#[test]
fn bent_normals_are_not_kept() {
    let (up, down) = (glam::DVec3::Z, glam::DVec3::new(0.6, 0.0, -0.8));
    assert!(reflects_above::<f64>(up, up, true, down));
    let steep = glam::DVec3::new(-0.9, 0.0, 0.436);
    assert!(!reflects_above::<f64>(steep, up, true, down));
    assert_eq!(ensure_reflection_above::<f64>(up, up, true, down), up);
    assert_ne!(ensure_reflection_above::<f64>(steep, up, true, down), steep);
}
