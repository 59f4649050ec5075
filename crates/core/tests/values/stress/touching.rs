//! Bodies of glass that overlap or touch, and small holes in them.

use super::strays::ball_scene;
use super::*;

fn priority(name: &str, ior: f64, priority: u32) -> Value {
    let terms = json!({ "transmission": 1, "roughness": 0, "ior": ior, "priority": priority });
    paint(name, terms)
}

/// Protects: a hole in glass makes the picture wrong if a few rays pass through it, however large
/// the body is.
#[test]
fn a_small_hole_in_glass() {
    let hole = ball_scene("glass", |positions, indices| {
        let depth = |t: &[u32; 3]| t.iter().map(|&c| positions[c as usize][2]).sum::<f64>();
        let near =
            (0..indices.len()).max_by(|&a, &b| depth(&indices[a]).total_cmp(&depth(&indices[b])));
        indices.remove(near.expect("a triangle"));
    });
    alone(&hole, FindingCode::OpenEdges, PictureWrong);
}

/// Protects: two glass cubes that touch are not reported, as few rays cross the common face. Many
/// cubes in contact are.
#[test]
fn glass_cubes_that_touch() {
    let of = |count: u32| {
        let cube = json!({ "box": { "min": [0, 0, 0], "max": [0.6, 0.6, 0.6] } });
        let depth = if count > 2 { count } else { 1 };
        let grid = json!({ "counts": [count, depth, depth], "origin": [-1, 0.1, -1], "step": [0.6, 0.6, 0.6] });
        let floor = json!({ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } });
        scene(&json!({
            "render": { "size": [128, 80], "samples": 8, "integrator": "path" },
            "cameras": [{ "pose": { "look_at": { "eye": [0, 2, 6], "target": [0, 0.8, 0] } },
                          "projection": { "pinhole": { "vertical_fov": 40 } } }],
            "objects": [object("floor", floor, "paint")],
            "generators": [{ "kind": { "grid": grid }, "object": object("cube", cube, "glass") }],
        }))
    };
    assert_eq!(listed(&summarise_findings(&of(2)).findings), []);
    alone(&of(3), FindingCode::OpenBody, PictureWrong);
}

/// Protects: the remedy for glass inside glass depends on the materials. Two bodies of one material
/// become one body by a `priority`, and a bubble does not.
#[test]
fn glass_in_glass_of_one_material_may_be_hollow() {
    let of = |inner: &str| {
        let mut parts = json!({
            "objects": [object("outer", ball([0.0; 3], 1.2), "glass"), object("inner", ball([0.0; 3], 1.0), inner)],
        });
        parts["materials"] = json!([
            paint("glass", json!({ "transmission": 1, "roughness": 0 })),
            paint(
                "water",
                json!({ "transmission": 1, "roughness": 0, "ior": 1.33 })
            ),
        ]);
        alone(&scene(&parts), FindingCode::NestedGlass, PictureWrong)
    };
    let (same, other) = (of("glass"), of("water"));
    assert!(same.remedy.contains("hollow"), "{same:?}");
    assert!(
        other.remedy.contains("`priority`") && !other.remedy.contains("hollow"),
        "{other:?}"
    );
}

/// Protects: water with the same walls as its glass should reach into the glass, as in the format's
/// page. No finding advises a gap, which would be a film of air.
#[test]
fn water_that_touches_its_glass() {
    let block = |y: f64| json!({ "box": { "min": [-0.8, -1, -0.8], "max": [0.8, y, 0.8] } });
    let of = scene(&json!({
        "materials": [priority("beaker", 1.5, 2), priority("water", 1.33, 1)],
        "objects": [object("beaker", block(0.7), "beaker"), object("water", block(0.0), "water")],
    }));
    let findings = summarise_findings(&of).findings;
    let codes: Vec<FindingCode> = findings.iter().map(|finding| finding.code).collect();
    assert_eq!(
        codes,
        [FindingCode::OpenBody, FindingCode::CoplanarSurfaces],
        "{findings:?}"
    );
    for finding in findings {
        assert!(
            finding.remedy.contains("reach into the other"),
            "{finding:?}"
        );
    }
}
