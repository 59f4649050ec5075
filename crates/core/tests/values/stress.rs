//! Scenes with a single fault each. The fault is found, with the right name and severity, and
//! nothing else is reported to make the picture wrong.

mod causes;
mod data;
mod depth;
mod glass_walls;
mod hidden_light;
mod lamps;
mod light;
mod meshes;
mod noise;
mod places;
mod shells;
mod sides;
mod strays;
mod touching;

use raywright_core::fault::{Fault, FaultKind, Severity};
use raywright_core::scene::Scene;
use raywright_core::stress::{StressEffort, StressSummary, stress};
use raywright_core::{Settings, validate};
use serde_json::{Value, json};

use Severity::{Harmless, PictureWrong, SlowOrNoisy};

/// Returns a faultless scene (a ball and a block under a grey sky) in which `parts` replaces the
/// entries of the same keys.
#[track_caller]
fn scene(parts: &Value) -> Scene {
    let mut all = json!({
        "format": 1,
        "render": { "size": [96, 54], "samples": 8, "integrator": "path" },
        "cameras": [{ "pose": { "look_at": { "eye": [0.5, 1.5, 6], "target": [0, 0, 0] } },
                      "projection": { "pinhole": { "vertical_fov": 40 } } }],
        "sky": { "constant": 0.5 },
        "materials": [paint("paint", json!({ "base_colour": 0.6 })), paint("other", json!({ "base_colour": [0.2, 0.5, 0.6] })),
                      paint("glass", json!({ "transmission": 1, "roughness": 0 })),
                      paint("veil", json!({ "alpha": "blend", "opacity": 0.5 }))],
        "objects": [object("ball", ball([-1.2, 0.0, 0.0], 1.0), "paint"),
                    object("block", json!({ "box": { "min": [0.3, -1, -0.5], "max": [1.3, 0.4, 0.5] } }), "other")],
    });
    for (key, value) in parts.as_object().expect("parts") {
        all[key] = value.clone();
    }
    let scene = serde_json::from_value(all).unwrap_or_else(|e| panic!("{e}\n{parts}"));
    let problems = validate::validate(&scene);
    assert!(problems.is_empty(), "{problems:?}");
    scene
}

fn paint(name: &str, terms: Value) -> Value {
    json!({ "name": name, "model": { "physical": terms } })
}

fn object(name: &str, shape: Value, material: &str) -> Value {
    json!({ "name": name, "shape": shape, "material": material })
}

fn ball(centre: [f64; 3], radius: f64) -> Value {
    json!({ "sphere": { "centre": centre, "radius": radius } })
}

fn quad(corner: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3]) -> Value {
    json!({ "quad": { "corner": corner, "edge_u": edge_u, "edge_v": edge_v } })
}

#[track_caller]
fn summarise_findings(scene: &Scene) -> StressSummary {
    let effort = StressEffort {
        budget: core::time::Duration::from_secs(3600),
    };
    stress(scene, &Settings::from_scene(scene), &effort, &()).unwrap_or_else(|e| panic!("{e}"))
}

fn listed(findings: &[Fault]) -> Vec<(&'static str, Severity, u64)> {
    findings
        .iter()
        .map(|finding| (finding.kind.name(), finding.severity, finding.count))
        .collect()
}

/// Asserts that the fault is found with the right severity. Apart from it, only the codes in
/// `follows` may make the picture wrong.
#[track_caller]
fn expect_finding(
    scene: &Scene,
    code: FaultKind,
    severity: Severity,
    follows: &[FaultKind],
) -> Fault {
    let report = summarise_findings(scene);
    let all = listed(&report.findings);
    let finding = report.findings.iter().find(|finding| finding.kind == code);
    let finding = finding
        .unwrap_or_else(|| panic!("{} is not found: {all:?}", code.name()))
        .clone();
    assert_eq!(finding.severity, severity, "{all:?}");
    let others = report
        .findings
        .iter()
        .filter(|other| other.kind != code && other.severity == PictureWrong);
    let strange: Vec<_> = others
        .filter(|other| !follows.contains(&other.kind))
        .map(|other| other.kind)
        .collect();
    assert!(strange.is_empty(), "{}: {all:?}", code.name());
    assert!(!finding.message.is_empty() && !finding.remedy.is_empty() && !report.is_cut_short());
    finding
}

/// Asserts that the fault is the only finding.
#[track_caller]
fn alone(scene: &Scene, code: FaultKind, severity: Severity) -> Fault {
    let finding = expect_finding(scene, code, severity, &[]);
    let all = summarise_findings(scene).findings;
    assert_eq!(all.len(), 1, "{:?}", listed(&all));
    finding
}

/// Protects: a faultless scene has no findings, all planned checks are complete, and the same seed
/// gives the same result.
#[test]
fn a_scene_without_fault_has_no_findings() {
    let clean = scene(&json!({}));
    let first = summarise_findings(&clean);
    assert_eq!(listed(&first.findings), []);
    assert!(
        first.checks.iter().all(|run| !run.is_cut_short()),
        "{:?}",
        first.checks
    );
    assert_eq!(summarise_findings(&clean), first);
}

/// Protects: a scene without objects is reported as showing nothing.
#[test]
fn a_scene_without_objects() {
    alone(
        &scene(&json!({ "objects": [] })),
        FaultKind::NothingSeen,
        PictureWrong,
    );
}

/// Protects: each kind of finding has a unique name in lower case.
#[test]
fn names_are_names() {
    let mut names: Vec<&str> = FaultKind::ALL.iter().map(|code| code.name()).collect();
    assert!(
        names
            .iter()
            .all(|name| name.chars().all(|c| c.is_ascii_lowercase() || c == '-'))
    );
    assert!(
        names
            .iter()
            .zip(FaultKind::ALL)
            .all(|(name, kind)| FaultKind::from_name(name) == Some(*kind))
    );
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), FaultKind::ALL.len());
}

/// Protects: eight faults of one scene are all found, worst first.
#[test]
fn eight_faults_of_one_scene() {
    let mut many = scene(&json!({
        "lights": [{ "kind": { "point": { "position": [0, 50, 0], "range": 10 } }, "colour": 5 },
                   { "kind": { "directional": { "to_light": [0, 1, 0] } }, "colour": 0.1 },
                   { "kind": { "directional": { "to_light": [0, 1, 0] } }, "colour": 0.1 }],
        "materials": [paint("paint", json!({ "base_colour": 1.4 })), paint("glass", json!({ "transmission": 1, "roughness": 0 })),
                      paint("rough", json!({ "roughness": 1 })), paint("lamp", json!({ "emission": 3 }))],
        "objects": [object("ball", ball([-1.2, 0.0, 0.0], 1.0), "paint"),
                    object("pane", quad([0.2, -1.0, 1.0], [1.5, 0.0, 0.0], [0.0, 2.0, 0.3]), "glass"),
                    object("dull", ball([1.2, 0.0, -0.5], 0.6), "rough"), object("dull again", ball([1.2, 0.0, -0.5], 0.6), "rough"),
                    object("mote", ball([0.0, 0.5, 1.0], 1e-5), "lamp"), object("cube", json!({ "mesh": "cube" }), "rough")],
        "meshes": [meshes::cube([0.0, -1.5, 0.0], |_, indices| indices.push([0, 0, 1]))],
    }));
    many.cameras[0].aspect = Some(3.0);
    let findings = summarise_findings(&many).findings;
    let expected = [
        FaultKind::EnergyMade,
        FaultKind::OpenBody,
        FaultKind::LightMissesScene,
        FaultKind::LampBelowPixel,
        FaultKind::DuplicateLight,
        FaultKind::DuplicateObject,
        FaultKind::DegenerateTriangles,
        FaultKind::StretchedPicture,
    ];
    for code in expected {
        assert!(
            findings.iter().any(|finding| finding.kind == code),
            "{}: {:?}",
            code.name(),
            listed(&findings)
        );
    }
    assert!(findings.is_sorted_by_key(|finding| finding.severity));
}
