//! Causes that findings name, and counts of faults with a common cause.

use raywright_core::fault::Subject;

use super::meshes::cube;
use super::*;

fn found(scene: &Scene, code: FaultKind) -> Vec<Fault> {
    let all = summarise_findings(scene).findings;
    all.into_iter()
        .filter(|finding| finding.kind == code)
        .collect()
}

/// Protects: a distant ball is harmless if it looks the same in double precision. The number of
/// rays that hit it differently is reported.
#[test]
fn a_far_ball_that_is_seen_as_in_doubles_is_harmless() {
    let far = scene(&json!({
        "cameras": [{ "pose": { "look_at": { "eye": [1e6, 1, 6], "target": [1e6, 0, 0] } },
                      "projection": { "pinhole": { "vertical_fov": 40 } } }],
        "objects": [object("far", ball([1e6, 0.0, 0.0], 1.0), "paint"), object("near", ball([0.0; 3], 1.0), "other")],
    }));
    let findings = found(&far, FaultKind::UnresolvedObject);
    let finding = findings.first().expect("a finding");
    assert_eq!(finding.severity, Harmless, "{finding:?}");
    assert!(finding.message.contains("0 of "), "{finding:?}");
    assert!(finding.message.contains("steps of"), "{finding:?}");
}

/// Protects: distant balls are judged alike, whether few or more than 32 of them. They are harmless
/// if they look the same in double precision, and wrong otherwise.
#[test]
fn many_far_balls_are_judged_as_few_are() {
    for (distance, severity) in [(1e6, Harmless), (1e9, PictureWrong)] {
        for count in [3, 40] {
            let far = (0..count).map(|i| {
                let place = [
                    distance + f64::from(i % 8) - 3.5,
                    f64::from(i / 8) - 2.0,
                    0.0,
                ];
                object(&format!("far {i}"), ball(place, 0.4), "paint")
            });
            let near = (0..100).map(|i| {
                object(
                    &format!("near {i}"),
                    ball([f64::from(i), 0.0, 0.0], 0.4),
                    "other",
                )
            });
            let balls = scene(&json!({
                "cameras": [{ "pose": { "look_at": { "eye": [distance, 1, 14], "target": [distance, 0, 0] } },
                              "projection": { "pinhole": { "vertical_fov": 40 } } }],
                "objects": far.chain(near).collect::<Vec<_>>(),
            }));
            let findings = found(&balls, FaultKind::UnresolvedObject);
            assert!(
                !findings.is_empty()
                    && findings.iter().all(|finding| finding.severity == severity
                        && !finding.message.contains("no ray of the cameras")),
                "{count} at {distance}: {findings:?}"
            );
        }
    }
}

/// Protects: if a distant object causes coarse coordinates of the objects in view, the distant
/// object is named as the subject.
#[test]
fn the_far_object_is_blamed_and_not_the_ground() {
    let mut far = cube([1e7, 0.0, 0.0], |_, _| {});
    far["name"] = json!("far");
    let ground = quad([-5.0, -1.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0]);
    let shapes = scene(&json!({
        "meshes": [far],
        "objects": [object("ground", ground, "paint"), object("ball", ball([0.0; 3], 1.0), "other"),
                    object("far", json!({ "mesh": "far" }), "other")],
    }));
    let findings = found(&shapes, FaultKind::UnresolvedObject);
    for finding in &findings {
        assert_eq!(finding.subject, Subject::Object(2), "{finding:?}");
    }
    assert!(!findings.is_empty());
    assert!(
        findings[0].message.contains("object `ground`"),
        "{findings:?}"
    );
}

/// Protects: glass bodies inside each other are a single finding with their number.
#[test]
fn nested_bodies_are_one_finding() {
    let nested = |i: u32| object("shell", ball([0.0; 3], 0.2 * f64::from(i)), "glass");
    let objects: Vec<Value> = (1..=6).map(nested).collect();
    let findings = found(
        &scene(&json!({ "objects": objects })),
        FaultKind::NestedGlass,
    );
    let [finding] = &findings[..] else {
        panic!("{findings:?}");
    };
    assert_eq!(
        (finding.count, finding.of, finding.others.len()),
        (5, 6, 4),
        "{finding:?}"
    );
}

/// Protects: coinciding copies of a generator, or of two generators, are found. The severity
/// depends on the material and the number. Copies beside each other are not reported.
#[test]
fn copies_of_generators_in_one_place() {
    let copies = |material: &str, count: u32, step: f64| {
        json!({ "kind": { "grid": { "counts": [count, 1, 1], "origin": [-1, 0, 0], "step": [step, 0, 0] } },
                "object": object("copy", ball([0.0; 3], 0.3), material) })
    };
    let of = |generators: Value| {
        let scene = scene(&json!({ "generators": generators, "objects": [] }));
        found(&scene, FaultKind::DuplicateObject)
    };
    assert!(of(json!([copies("paint", 5, 0.7)])).is_empty());
    for (material, count, severity) in [
        ("paint", 5, Harmless),
        ("paint", 100, SlowOrNoisy),
        ("glass", 2, Harmless),
        ("veil", 2, PictureWrong),
    ] {
        let findings = of(json!([copies(material, count, 0.0)]));
        let [finding] = &findings[..] else {
            panic!("{material}: {findings:?}");
        };
        assert_eq!(
            (finding.severity, finding.count, finding.of),
            (severity, u64::from(count) - 1, count.into())
        );
    }
    let twins = of(json!([copies("paint", 3, 0.7), copies("other", 3, 0.7)]));
    assert_eq!(twins.len(), 1, "{twins:?}");
    assert_eq!(twins[0].severity, PictureWrong, "{twins:?}");
}

/// Protects: a black picture names the object that blocks the light of a lamp or of the sky.
#[test]
fn a_black_picture_names_its_cover() {
    let cover = json!({ "box": { "min": [-9, -9, -9], "max": [9, 9, 9] } });
    let room = scene(&json!({
        "objects": [object("ball", ball([0.0; 3], 1.0), "paint"), object("walls", cover, "other")],
    }));
    let lamp = paint("lamp", json!({ "emission": 5 }));
    let mut shut = json!({
        "sky": { "constant": 0 },
        "objects": [object("ground", quad([-5.0, -1.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0]), "paint"),
                    object("lamp", ball([0.0, 1.0, 0.0], 0.2), "lamp"), object("shade", ball([0.0, 1.0, 0.0], 0.5), "other")],
    });
    shut["materials"] = json!([
        paint("paint", json!({ "base_colour": 0.6 })),
        paint("other", json!({ "base_colour": 0.2 })),
        lamp
    ]);
    for (of, name) in [(room, "object `walls`"), (scene(&shut), "object `shade`")] {
        let findings = found(&of, FaultKind::BlackPicture);
        let [finding] = &findings[..] else {
            panic!("{name}: {:?}", summarise_findings(&of).findings);
        };
        assert!(
            finding.message.contains(name) && finding.remedy.contains(name),
            "{finding:?}"
        );
    }
}

/// Protects: if a sky by an expression leaves the picture black, the sky is the cause: samples may
/// miss a small bright place. The remedy is not to add a sky.
#[test]
fn a_black_picture_under_a_sky_with_a_tiny_sun() {
    let dark = scene(
        &json!({ "sky": { "expression": "1e9 * step(0.9999999, dot(d, normalize([1, 2, 1])))" } }),
    );
    let finding = alone(&dark, FaultKind::BlackPicture, PictureWrong);
    assert!(
        finding.message.contains("`expression`") && finding.remedy.contains("`suns`"),
        "{finding:?}"
    );
}

/// Protects: if no triangle of the only mesh has an area, this is reported as the cause, with a
/// remedy.
#[test]
fn a_mesh_without_area_is_the_cause() {
    let mut flat = cube([0.0; 3], |positions, _| {
        positions.iter_mut().for_each(|p| (p[1], p[2]) = (0.0, 0.0));
    });
    flat["name"] = json!("flat");
    let mut parts = json!({ "meshes": [flat], "objects": [object("flat", json!({ "mesh": "flat" }), "paint")] });
    let finding = alone(&scene(&parts), FaultKind::DegenerateTriangles, PictureWrong);
    assert!(
        finding.message.contains("scale of 0") && finding.remedy.contains("scale of 0"),
        "{finding:?}"
    );
    parts["objects"] = json!([
        object("flat", json!({ "mesh": "flat" }), "paint"),
        object("ball", ball([0.0; 3], 1.0), "paint")
    ]);
    let findings = found(&scene(&parts), FaultKind::DegenerateTriangles);
    assert_eq!(findings[0].severity, Harmless);
}

/// Protects: coplanar surfaces that are visible everywhere are harmless. The finding counts the
/// rays that hit them. For a hidden surface it counts the rays that hit another one in its place.
#[test]
fn coplanar_surfaces_give_the_number_that_decides() {
    let sheet = |half: f64, y: f64| {
        let edge = 2.0 * half;
        quad([-half, y, half], [edge, 0.0, 0.0], [0.0, 0.0, -edge])
    };
    let of = |floor: f64, y: f64| {
        scene(&json!({
            "objects": [object("floor", sheet(floor, 0.0), "paint"), object("rug", sheet(1.0, y), "other")],
        }))
    };
    let harmless = found(&of(5.0, 1e-6), FaultKind::CoplanarSurfaces);
    assert_eq!(harmless[0].severity, Harmless, "{harmless:?}");
    let reason = &harmless[0].message;
    assert!(
        !reason.contains("decides")
            && reason.contains("rays in the overlap hit this object")
            && reason.contains("outside the overlap"),
        "{reason}"
    );
    assert!(harmless[0].remedy.starts_with("nothing"), "{harmless:?}");
    let wrong = found(&of(5.0, 0.0), FaultKind::CoplanarSurfaces);
    assert_eq!(wrong[0].severity, PictureWrong, "{wrong:?}");
    assert!(
        wrong[0]
            .message
            .contains("rays in the overlap hit the other surface"),
        "{wrong:?}"
    );
}
