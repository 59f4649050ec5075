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
    alone(&hole, FaultKind::OpenEdges, PictureWrong);
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
    alone(&of(3), FaultKind::OpenBody, PictureWrong);
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
        alone(&scene(&parts), FaultKind::NestedGlass, PictureWrong)
    };
    let (same, other) = (of("glass"), of("water"));
    assert!(same.remedy.contains("hollow"), "{same:?}");
    assert!(
        other.remedy.contains("`priority`") && !other.remedy.contains("hollow"),
        "{other:?}"
    );
}

/// Protects: a narrow gap between two bodies of glass, which rays find from either side, is one
/// finding.
#[test]
fn a_gap_between_two_bodies_of_glass_is_one_finding() {
    let block =
        |low: f64, high: f64| json!({ "box": { "min": [-1, -1, low], "max": [1, 1, high] } });
    let gap = f64::from(f32::EPSILON);
    let blocks = scene(&json!({
        "objects": [object("front", block(1.0 + gap, 1.5), "glass"), object("back", block(0.0, 1.0), "glass")],
    }));
    let findings = summarise_findings(&blocks).findings;
    let codes: Vec<FaultKind> = findings.iter().map(|finding| finding.kind).collect();
    assert_eq!(
        codes,
        [FaultKind::OpenBody, FaultKind::ClosedGap],
        "{findings:?}"
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
    let codes: Vec<FaultKind> = findings.iter().map(|finding| finding.kind).collect();
    assert_eq!(
        codes,
        [FaultKind::OpenBody, FaultKind::CoplanarSurfaces],
        "{findings:?}"
    );
    for finding in findings {
        assert!(
            finding.remedy.contains("reach into the other"),
            "{finding:?}"
        );
    }
}

/// Protects: copies of one generator of glass that overlap are reported. Copies that touch or are
/// apart are not.
#[test]
fn copies_of_glass_that_overlap() {
    let of = |step: f64| {
        let grid = json!({ "counts": [3, 1, 1], "origin": [-1, 0, 0], "step": [step, 0, 0] });
        scene(&json!({
            "objects": [object("block", json!({ "box": { "min": [-2, -1, -4], "max": [2, 1, -3] } }), "paint")],
            "generators": [{ "kind": { "grid": grid }, "object": object("ball", ball([0.0; 3], 0.5), "glass") }],
            "render": { "size": [96, 54], "samples": 8, "integrator": "path", "max_depth": 32 },
        }))
    };
    let finding = alone(&of(0.7), FaultKind::NestedGlass, PictureWrong);
    assert!(
        finding.message.contains("copies of this generator"),
        "{finding:?}"
    );
    for step in [1.0, 1.1] {
        assert_eq!(
            listed(&summarise_findings(&of(step)).findings),
            [],
            "{step}"
        );
    }
}

/// Protects: curved meshes of two materials that lie less than the rounding of a distance apart are
/// reported. The same meshes a millimetre apart are not.
#[test]
fn meshes_closer_than_rounding() {
    let of = |apart: f64| {
        let mut scene = ball_scene("paint", |_, _| {});
        let mut other = scene.objects[0].clone();
        other.material = "other".to_owned();
        other.transform =
            vec![serde_json::from_value(json!({ "translate": [0, 0, apart] })).expect("a step")];
        scene.objects.push(other);
        scene
    };
    alone(&of(1e-7), FaultKind::FlickeringSurfaces, PictureWrong);
    assert_eq!(listed(&summarise_findings(&of(1e-3)).findings), []);
}

/// Protects: a moving sheet that lies in the plane of a floor when the shutter opens is reported,
/// wherever its motion begins.
#[test]
fn a_sheet_that_reaches_the_floor() {
    let of = |opening: f64| {
        let mut sheet = object(
            "sheet",
            quad([-1.0, 0.0, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0]),
            "other",
        );
        sheet["transform_end"] = json!([{ "translate": [0, -1, 0] }]);
        let floor = object(
            "floor",
            quad([-4.0, -1.0, -4.0], [0.0, 0.0, 8.0], [8.0, 0.0, 0.0]),
            "paint",
        );
        let mut scene = scene(&json!({ "objects": [floor, sheet] }));
        scene.cameras[0].shutter = Some([opening, opening]);
        summarise_findings(&scene).findings
    };
    let codes: Vec<_> = of(1.0).iter().map(|finding| finding.kind).collect();
    assert_eq!(codes, [FaultKind::CoplanarSurfaces]);
    assert_eq!(listed(&of(0.0)), []);
}

/// Protects: glass inside other glass that also touches its surface is one finding of glass, whose
/// remedy holds for both: the body is not called open.
#[test]
fn nested_glass_that_touches() {
    let cube = |name: &str, half: f64, material: &str| {
        let min = [-half, -half, -half];
        object(
            name,
            json!({ "box": { "min": min, "max": [half, half, 1] } }),
            material,
        )
    };
    let water = json!({ "transmission": 1, "roughness": 0, "ior": 1.33 });
    let vessel = scene(&json!({
        "materials": [paint("glass", json!({ "transmission": 1, "roughness": 0 })), paint("water", water)],
        "objects": [cube("vessel", 1.0, "glass"), cube("drink", 0.8, "water")],
    }));
    let follows = [FaultKind::CoplanarSurfaces];
    let finding = expect_finding(&vessel, FaultKind::NestedGlass, PictureWrong, &follows);
    assert!(finding.remedy.contains("reach into"), "{finding:?}");
}
