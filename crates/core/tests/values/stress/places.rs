//! Positions and subjects of findings.

use raywright_core::settings::PrecisionChoice;

use super::meshes::cube;
use super::*;

/// Returns the only finding of a kind; panics if there are several or none.
#[track_caller]
fn one(scene: &Scene, code: FaultKind) -> Fault {
    let all = summarise_findings(scene).findings;
    let mut found = all.iter().filter(|finding| finding.kind == code);
    match (found.next(), found.next()) {
        (Some(finding), None) => finding.clone(),
        _ => panic!("{}: {all:?}", code.name()),
    }
}

fn with_cubes(meshes: &[Value], material: &str) -> Scene {
    let named = |(i, mesh): (usize, &Value)| {
        let mut mesh = mesh.clone();
        mesh["name"] = json!(format!("mesh{i}"));
        mesh
    };
    let meshes: Vec<Value> = meshes.iter().enumerate().map(named).collect();
    let object = |i: usize| {
        object(
            &format!("cube {i}"),
            json!({ "mesh": format!("mesh{i}") }),
            material,
        )
    };
    let objects: Vec<Value> = (0..meshes.len()).map(object).collect();
    scene(&json!({ "meshes": meshes, "objects": objects }))
}

/// Protects: a flipped triangle is named itself, not its neighbour. A hole has a position on its
/// edge.
#[test]
fn the_fault_is_marked_and_no_neighbour() {
    // The two triangles of the front, which is at z = 0.8.
    let turned = cube([0.0; 3], |_, i| i[11].swap(1, 2));
    let finding = one(&with_cubes(&[turned], "glass"), FaultKind::FlippedTriangles);
    assert_eq!(
        (finding.primitive, finding.count, finding.of),
        (Some(11), 1, 12)
    );
    let hole = cube([0.0; 3], |_, i| i.truncate(10));
    let finding = one(&with_cubes(&[hole], "glass"), FaultKind::OpenEdges);
    let [_, _, z] = finding.place.expect("a place");
    assert!((z - 0.8).abs() < 1e-6, "{finding:?}");
}

/// Protects: of several positions, the one nearest to the camera is reported. A position behind an
/// opaque object has no pixel.
#[test]
fn the_nearest_place_is_told_and_hidden_ones_have_no_pixel() {
    let flat = |corners: &'static [[u32; 3]]| {
        cube([0.0; 3], move |_, i| i.extend(corners.iter().copied()))
    };
    // Corner 0 is at the back, and corner 7 in front.
    let both = one(
        &with_cubes(&[flat(&[[0, 0, 0], [7, 7, 7]])], "paint"),
        FaultKind::DegenerateTriangles,
    );
    assert_eq!((both.primitive, both.count), (Some(13), 2));
    assert!(both.pixel.is_some(), "{both:?}");
    let back = one(
        &with_cubes(&[flat(&[[0, 0, 0]])], "paint"),
        FaultKind::DegenerateTriangles,
    );
    assert!(back.place.is_some() && back.pixel.is_none(), "{back:?}");
}

/// Protects: edges of glass opened by rounding are a harmless seam. Two objects with such a seam
/// are one finding.
#[test]
fn seams_of_rounding_are_told_once() {
    let seam = |x: f64| {
        cube([x, 0.0, 0.0], |positions, indices| {
            let front = [4, 5, 6, 7].map(|corner| positions[corner].map(|x| x + 1e-7));
            positions.extend(front);
            for corner in indices[10..].iter_mut().flatten() {
                *corner += 4;
            }
        })
    };
    let finding = one(
        &with_cubes(&[seam(-1.5), seam(0.5)], "glass"),
        FaultKind::OpenEdges,
    );
    assert_eq!((finding.severity, finding.count), (Harmless, 16));
    assert!(
        finding.message.contains("seam") && finding.remedy.contains("merge"),
        "{finding:?}"
    );
}

/// Protects: a rug is reported, with its distance from the floor, if rounding cannot separate the
/// two. Shapes and meshes behave alike. In double precision nothing is reported.
#[test]
fn a_rug_that_is_too_near() {
    let sheet = |half: f64, y: f64, is_mesh: bool, name: &str| {
        let corners = [
            [-half, y, half],
            [half, y, half],
            [half, y, -half],
            [-half, y, -half],
        ];
        if is_mesh {
            let inline = json!({ "positions": corners, "indices": [[0, 1, 2], [0, 2, 3]] });
            let mesh = json!({ "name": name, "source": { "inline": inline } });
            return (json!({ "mesh": name }), Some(mesh));
        }
        let edge = 2.0 * half;
        (quad(corners[0], [edge, 0.0, 0.0], [0.0, 0.0, -edge]), None)
    };
    for (y, is_mesh, words) in [
        (1e-8, false, "1e-8 metres"),
        (1e-7, false, "1e-7 metres"),
        (0.0, false, "one place"),
        (1e-8, true, "1e-8 metres"),
        (0.0, true, "one place"),
    ] {
        let (floor, floor_mesh) = sheet(5.0, 0.0, is_mesh, "floor");
        let (rug, rug_mesh) = sheet(1.0, y, is_mesh, "rug");
        let meshes: Vec<Value> = floor_mesh.into_iter().chain(rug_mesh).collect();
        let of = scene(&json!({
            "meshes": meshes,
            "objects": [object("floor", floor, "paint"), object("rug", rug, "other")],
        }));
        let findings = summarise_findings(&of).findings;
        let codes = [FaultKind::CoplanarSurfaces, FaultKind::FlickeringSurfaces];
        assert!(
            findings.len() == 1
                && codes.contains(&findings[0].kind)
                && findings[0].severity == PictureWrong
                && findings[0].message.contains(words),
            "{y}: {findings:?}"
        );
        assert!(
            findings[0].remedy.contains("metres")
                && findings[0]
                    .remedy
                    .contains("to the side from which it should be seen"),
            "{}",
            findings[0].remedy
        );
        if y > 0.0 {
            let settings = Settings {
                precision: PrecisionChoice::Reference,
                ..Settings::from_scene(&of)
            };
            let exact = stress(&of, &settings, &StressEffort::default(), &());
            let exact = exact.unwrap_or_else(|e| panic!("{e}")).findings;
            assert_eq!(listed(&exact), [], "{y}");
        }
    }
}

/// Protects: a label of the radius of its bottle, which the bottle hides as the first in the file, is
/// lost; as the first itself it is seen, which is harmless.
#[test]
fn a_label_of_the_radius_of_its_bottle() {
    let cylinder = |base: f64, height: f64| {
        let axis = [0, 1, 0];
        json!({ "cylinder": { "base": [0, base, 0], "axis": axis, "radius": 0.8, "height": height } })
    };
    let mut objects = [
        object("bottle", cylinder(-1.0, 2.0), "paint"),
        object("label", cylinder(-0.4, 0.8), "other"),
    ];
    let hidden = alone(
        &scene(&json!({ "objects": objects })),
        FaultKind::CoplanarSurfaces,
        PictureWrong,
    );
    assert!(
        hidden
            .message
            .starts_with("it lies in one place with object `bottle`"),
        "{hidden:?}"
    );
    objects.reverse();
    let seen = scene(&json!({ "objects": objects }));
    alone(&seen, FaultKind::CoplanarSurfaces, Harmless);
}

/// Protects: a copy in view stands for its generator, whose first copy is behind the camera: the
/// fault has the pixel of that copy.
#[test]
fn a_copy_in_view_stands_for_its_generator() {
    let flat = cube([0.0; 3], |_, i| i.push([7, 7, 7]));
    let grid = json!({ "counts": [1, 1, 2], "origin": [0, 0, 20], "step": [0, 0, -20] });
    let cube = object("cube", json!({ "mesh": "cube" }), "paint");
    let finding = one(
        &scene(&json!({
            "meshes": [flat], "objects": [], "generators": [{ "kind": { "grid": grid }, "object": cube }],
        })),
        FaultKind::DegenerateTriangles,
    );
    assert!(finding.pixel.is_some(), "{finding:?}");
}

/// Protects: of two objects in one place, the reason says that the first in the file is seen.
#[test]
fn the_first_of_two_is_seen() {
    let twins = scene(&json!({
        "objects": [object("one", ball([0.0; 3], 1.0), "paint"), object("twin", ball([0.0; 3], 1.0), "other")],
    }));
    let finding = one(&twins, FaultKind::DuplicateObject);
    assert!(
        finding.severity == PictureWrong
            && finding
                .message
                .ends_with("only the first of the two in the file is seen"),
        "{finding:?}"
    );
}
