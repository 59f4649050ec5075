//! Glass on opaque surfaces, glass that is hidden from one side, and thin glass.

use raywright_core::settings::PrecisionChoice;

use super::*;

fn glass_on(floor: Value, glass_first: bool, lowest: f64) -> Scene {
    let block = json!({ "box": { "min": [-0.5, lowest, -0.5], "max": [0.5, 0.6, 0.5] } });
    let mut objects = [
        object("floor", floor, "paint"),
        object("glass", block, "glass"),
    ];
    if glass_first {
        objects.reverse();
    }
    scene(&json!({
        "render": { "size": [96, 54], "samples": 8, "integrator": "path", "max_depth": 32 },
        "objects": objects,
    }))
}

/// Protects: glass that touches an opaque floor is no fault if rays hit the floor: the picture is
/// the same as of glass that reaches into the floor, which is no fault either. If rays hit the
/// glass, which is the first in the file, the floor is lost below it.
#[test]
fn glass_on_an_opaque_floor() {
    let floors = [
        json!({ "plane": { "point": [0, -0.3, 0], "normal": [0, 1, 0] } }),
        quad([-4.0, -0.3, -4.0], [0.0, 0.0, 8.0], [8.0, 0.0, 0.0]),
        json!({ "box": { "min": [-4, -0.6, -4], "max": [4, -0.3, 4] } }),
    ];
    for floor in floors {
        for (glass_first, lowest) in [(false, -0.3), (false, -0.301), (true, -0.301)] {
            let clean = glass_on(floor.clone(), glass_first, lowest);
            let findings = summarise_findings(&clean).findings;
            assert_eq!(listed(&findings), [], "{floor} {glass_first} {lowest}");
        }
        let touching = glass_on(floor.clone(), true, -0.3);
        let finding = alone(&touching, FaultKind::ClosedGap, PictureWrong);
        assert!(
            finding.remedy.starts_with("let the glass reach into"),
            "{finding:?}"
        );
    }
}

/// Protects: the legs of a glass table that touch its top from below do not make the picture wrong,
/// although the top is the first in the file: few of the rays through the glass find the contact.
#[test]
fn legs_below_a_glass_top() {
    let block = |name: &str, min: [f64; 3], max: [f64; 3], material: &str| {
        object(name, json!({ "box": { "min": min, "max": max } }), material)
    };
    let leg = |x: f64, z: f64| block("leg", [x, 0.0, z], [x + 0.06, 0.7, z + 0.06], "paint");
    let mut table = scene(&json!({
        "objects": [block("top", [-0.6, 0.7, -0.4], [0.6, 0.72, 0.4], "glass"),
                    leg(-0.55, -0.35), leg(0.49, -0.35), leg(-0.55, 0.29), leg(0.49, 0.29),
                    object("floor", json!({ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }), "other")],
    }));
    let pose = json!({ "look_at": { "eye": [1.6, 1.9, 2.2], "target": [0, 0.35, 0] } });
    table.cameras[0].pose = serde_json::from_value(pose).expect("a pose");
    let all = summarise_findings(&table).findings;
    assert!(
        all.iter().all(|found| found.severity != PictureWrong),
        "{all:?}"
    );
}

/// Half the edge of the floor of `many_blocks_with`, which is longer on the right by nine metres.
const HALF: f64 = 66.0;

/// A floor with more blocks of glass on it than the table of other overlaps may have, and more
/// objects.
fn many_blocks_with(more: impl IntoIterator<Item = Value>) -> Scene {
    let along = HALF as i32;
    let floor = json!({ "box": { "min": [-HALF, -1, -HALF], "max": [HALF + 9.0, 0, HALF] } });
    let mut objects = vec![object("floor", floor, "paint")];
    objects.extend((0..along * along).map(|index| {
        let [x, z] = [index % along, index / along].map(|i| f64::from(2 * i) - HALF);
        let shape = json!({ "box": { "min": [x, 0, z], "max": [x + 1.0, 1, z + 1.0] } });
        object("block", shape, "glass")
    }));
    objects.extend(more);
    scene(&json!({
        "render": { "size": [96, 54], "samples": 8, "integrator": "path", "max_depth": 64 },
        "objects": objects,
        "cameras": [{ "pose": { "look_at": { "eye": [0, 90, 130], "target": [0, 0, 0] } },
                      "projection": { "pinhole": { "vertical_fov": 50 } } }],
    }))
}

/// Protects: more blocks of glass on a floor than the table of other overlaps may have are no fault
/// either, and a rug in the plane of the floor is found beside them.
#[test]
fn many_blocks_of_glass_on_a_floor() {
    let clean = many_blocks_with([]);
    assert_eq!(listed(&summarise_findings(&clean).findings), []);
    let rug = quad(
        [HALF + 1.0, 0.0, -HALF],
        [0.0, 0.0, 2.0 * HALF],
        [7.0, 0.0, 0.0],
    );
    let rug = many_blocks_with([object("rug", rug, "other")]);
    let finding = alone(&rug, FaultKind::CoplanarSurfaces, PictureWrong);
    assert!(finding.message.contains("`floor`"), "{finding:?}");
}

/// Protects: beside many blocks of glass on a floor, two other blocks that touch each other are
/// found: the many contacts with the floor are all known.
#[test]
fn two_blocks_that_touch_beside_many_on_a_floor() {
    let above = |name: &str, y: f64| {
        let shape = json!({ "box": { "min": [-20, y, -20], "max": [20, y + 10.0, 20] } });
        object(name, shape, "glass")
    };
    let touching = many_blocks_with([above("lower", 20.0), above("upper", 30.0)]);
    let follows = [FaultKind::NestedGlass];
    let finding = expect_finding(&touching, FaultKind::OpenBody, PictureWrong, &follows);
    assert!(finding.message.contains("touches"), "{finding:?}");
}

/// Protects: glass with a hidden side is reported, as rays enter it and never leave it. Culled
/// glass, of which only camera rays pass through the back, is not.
#[test]
fn glass_with_a_hidden_side() {
    let of = |side: &str| {
        let mut globe = object("globe", ball([0.0; 3], 1.0), "glass");
        globe["side"] = json!(side);
        scene(&json!({ "objects": [globe] }))
    };
    for side in ["outside", "inside"] {
        let finding = alone(&of(side), FaultKind::OpenBody, PictureWrong);
        assert!(finding.message.contains("`side`"), "{finding:?}");
    }
    for side in ["both", "culled"] {
        assert_eq!(
            listed(&summarise_findings(&of(side)).findings),
            [],
            "{side}"
        );
    }
}

/// Protects: a pane of solid glass that is thinner than rounding is reported, and one that is
/// resolved is not.
#[test]
fn glass_thinner_than_rounding() {
    let of = |thickness: f64| {
        let pane = json!({ "box": { "min": [-1, -1, 0.5], "max": [1, 1, 0.5 + thickness] } });
        scene(&json!({ "objects": [object("pane", pane, "glass")] }))
    };
    let finding = alone(&of(1e-7), FaultKind::ClosedGap, PictureWrong);
    assert!(finding.remedy.contains("`thin_walled`"), "{finding:?}");
    assert_eq!(listed(&summarise_findings(&of(1e-5)).findings), []);
}

/// Protects: two balls of one material less than the rounding errors apart shadow each other in
/// single precision and are reported; not in double precision, and not further apart.
#[test]
fn twins_of_one_material() {
    let of = |radius: f64| {
        scene(&json!({
            "objects": [object("one", ball([0.0; 3], 1.0), "paint"), object("twin", ball([0.0; 3], radius), "paint")],
        }))
    };
    let finding = alone(
        &of(1.000_000_1),
        FaultKind::FlickeringSurfaces,
        PictureWrong,
    );
    assert!(finding.message.contains("speckles"), "{finding:?}");
    assert_eq!(listed(&summarise_findings(&of(1.001)).findings), []);
    let exact = of(1.000_000_1);
    let settings = Settings {
        precision: PrecisionChoice::Reference,
        ..Settings::from_scene(&exact)
    };
    let report = stress(&exact, &settings, &StressEffort::default(), &());
    assert_eq!(listed(&report.expect("a summary").findings), []);
}

/// Protects: a lamp in the plane of a ceiling is said to be in one plane with it, not behind it, and
/// double precision is no remedy.
#[test]
fn a_lamp_in_the_plane_of_a_ceiling() {
    let sheet = |r: f64| quad([-r, 1.0, -r], [2.0 * r, 0.0, 0.0], [0.0, 0.0, 2.0 * r]);
    let mut room = scene(&json!({
        "materials": light::with_lamp(4.0),
        "objects": [object("ceiling", sheet(4.0), "paint"), object("lamp", sheet(0.5), "lamp"),
                    object("floor", quad([-4.0, -1.0, -4.0], [8.0, 0.0, 0.0], [0.0, 0.0, 8.0]), "paint")],
    }));
    let pose = json!({ "look_at": { "eye": [0, 0, 3], "target": [0, 0.3, 0] } });
    room.cameras[0].pose = serde_json::from_value(pose).expect("a pose");
    let finding = alone(&room, FaultKind::CoplanarSurfaces, PictureWrong);
    assert!(
        finding.place.is_some() && !finding.remedy.contains("reference"),
        "{finding:?}"
    );
}

/// Protects: in a tilted ceiling, where rounding parts the planes of the lamp and the ceiling, the
/// lamp is not said to be behind the ceiling either.
#[test]
fn a_lamp_in_the_plane_of_a_tilted_ceiling() {
    let sheet = |r: f64, slope: f64| {
        let rise = slope * r;
        quad(
            [-r, 1.0 + rise, -r],
            [2.0 * r, 0.0, 0.0],
            [0.0, -2.0 * rise, 2.0 * r],
        )
    };
    for slope in [0.2, 0.3] {
        for lamp_first in [false, true] {
            let mut objects = vec![
                object("ceiling", sheet(4.0, slope), "paint"),
                object("lamp", sheet(0.5, slope), "lamp"),
            ];
            if lamp_first {
                objects.reverse();
            }
            let floor = quad([-4.0, -1.0, -4.0], [8.0, 0.0, 0.0], [0.0, 0.0, 8.0]);
            objects.push(object("floor", floor, "paint"));
            let mut room =
                scene(&json!({ "materials": light::with_lamp(4.0), "objects": objects }));
            let pose = json!({ "look_at": { "eye": [0, 0, 3], "target": [0, 0.3, 0] } });
            room.cameras[0].pose = serde_json::from_value(pose).expect("a pose");
            let all = summarise_findings(&room).findings;
            let codes = [FaultKind::CoplanarSurfaces, FaultKind::FlickeringSurfaces];
            assert!(
                all.len() == 1 && codes.contains(&all[0].kind),
                "{slope} {lamp_first}: {all:?}"
            );
        }
    }
}
