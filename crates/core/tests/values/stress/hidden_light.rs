//! Light that few samples find or that none lets out: lamps in glass and lamps behind covers.

use super::light::{point, with_lamp};
use super::*;

fn floor() -> Value {
    let plane = json!({ "plane": { "point": [0, -1, 0], "normal": [0, 1, 0] } });
    object("floor", plane, "paint")
}

/// Protects: a small lamp in glass is reported even if no path of the small picture hits it, and
/// whatever number of samples the scene has. In frosted glass, it is too. In thin glass, it is not.
#[test]
fn lamps_in_glass_that_no_path_hits() {
    let of = |glass: Value, radius: f64, samples: u32| {
        let mut materials = with_lamp(3000.0);
        materials[1] = paint("glass", glass);
        scene(&json!({
            "sky": null, "materials": materials,
            "render": { "size": [128, 80], "samples": samples, "integrator": "path" },
            "objects": [floor(), object("ball", ball([1.5, -0.3, 0.0], 0.7), "paint"),
                        object("bulb", ball([0.0, 1.5, 0.0], 6.0 * radius), "glass"),
                        object("wire", ball([0.0, 1.5, 0.0], radius), "lamp")],
        }))
    };
    let clear = || json!({ "transmission": 1, "roughness": 0 });
    for (radius, samples) in [(0.05, 32), (0.05, 4)] {
        let finding = alone(
            &of(clear(), radius, samples),
            FaultKind::LightByChance,
            SlowOrNoisy,
        );
        assert!(finding.message.contains("`bulb`"), "{finding:?}");
    }
    // So small that the picture is black.
    let black = of(clear(), 1e-4, 4);
    let finding = expect_finding(&black, FaultKind::BlackPicture, PictureWrong, &[]);
    assert!(
        finding.message.contains("`bulb`") && finding.remedy.contains("thin_walled"),
        "{finding:?}"
    );
    let frosted = json!({ "transmission": 1, "roughness": 0.5 });
    alone(
        &of(frosted, 0.05, 32),
        FaultKind::LightByChance,
        SlowOrNoisy,
    );
    let thin = json!({ "transmission": 1, "roughness": 0, "thin_walled": true });
    assert_eq!(
        listed(&summarise_findings(&of(thin, 0.05, 32)).findings),
        []
    );
}

/// Protects: lights in closed bodies are reported, above an infinite floor too, whose most distant
/// points rounding lets see them. Lights in open covers are not, and neither is a light in another
/// part of the camera's own room.
#[test]
fn lights_behind_covers() {
    let of = |lights: Value, mut parts: Vec<Value>| {
        let ground = json!({ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } });
        parts.extend([
            object("ground", ground, "paint"),
            object("ball", ball([0.0, 1.0, 0.0], 1.0), "paint"),
        ]);
        scene(&json!({
            "lights": lights, "materials": with_lamp(30.0), "objects": parts,
            "render": { "size": [128, 80], "samples": 16, "integrator": "path" },
            "cameras": [{ "pose": { "look_at": { "eye": [0, 2, 6], "target": [0, 0.8, 0] } },
                          "projection": { "pinhole": { "vertical_fov": 40 } } }],
        }))
    };
    let light = || json!([point([0.0, 3.8, 0.0], json!({}))]);
    let safe = || {
        let shape = json!({ "box": { "min": [-0.3, 3.5, -0.3], "max": [0.3, 4.1, 0.3] } });
        object("safe", shape, "paint")
    };
    let bulb = || object("bulb", ball([0.0, 3.8, 0.0], 0.1), "lamp");
    let code = FaultKind::UnreachedLight;
    alone(&of(light(), vec![safe()]), code, SlowOrNoisy);
    alone(&of(json!([]), vec![bulb(), safe()]), code, SlowOrNoisy);
    let shell = object("shell", ball([0.0, 3.8, 0.0], 0.5), "paint");
    alone(&of(json!([]), vec![bulb(), shell]), code, SlowOrNoisy);
    let shade = |caps: bool| {
        let shape = json!({ "cylinder": { "base": [0, 3.5, 0], "axis": [0, 1, 0], "radius": 0.3, "height": 0.6, "caps": caps } });
        object("shade", shape, "paint")
    };
    alone(&of(json!([]), vec![bulb(), shade(true)]), code, SlowOrNoisy);
    assert_eq!(
        listed(&summarise_findings(&of(json!([]), vec![bulb(), shade(false)])).findings),
        []
    );
    assert_eq!(
        listed(&summarise_findings(&of(light(), vec![shade(false)])).findings),
        []
    );
    let room = json!({ "box": { "min": [-9, -1, -9], "max": [9, 9, 9] } });
    let room = of(light(), vec![object("room", room, "paint")]);
    assert_eq!(listed(&summarise_findings(&room).findings), []);
}

/// Protects: a light is not reported if its light arrives only after reflections, or
/// through a shade of paper.
#[test]
fn light_that_arrives_by_reflections() {
    let corridor = |open: bool| {
        let room = json!({ "box": { "min": [-1, 0, 0], "max": [6, 1, 1] } });
        let wall = |name: &str, x: f64, from: f64, to: f64| {
            let shape = json!({ "box": { "min": [x, from, 0], "max": [x + 0.02, to, 1] } });
            object(name, shape, "white")
        };
        let top = if open { 0.7 } else { 1.0 };
        scene(&json!({
            "sky": null, "lights": [point([-0.5, 0.4, 0.5], json!({}))],
            "materials": [paint("white", json!({ "base_colour": 0.9 })), paint("lamp", json!({ "base_colour": 0, "emission": 2 }))],
            "objects": [object("corridor", room, "white"), wall("upper", 0.2, 0.3, 1.0), wall("lower", 0.4, 0.0, top),
                        object("panel", quad([5.0, 0.99, 0.3], [0.4, 0.0, 0.0], [0.0, 0.0, 0.4]), "lamp")],
            "cameras": [{ "pose": { "look_at": { "eye": [4, 0.5, 0.5], "target": [6, 0.5, 0.5] } },
                          "projection": { "pinhole": { "vertical_fov": 40 } } }],
        }))
    };
    let unreached = |lit: &Scene| {
        let found = summarise_findings(lit).findings;
        let mut codes = found.iter().map(|finding| finding.kind);
        codes.any(|code| code == FaultKind::UnreachedLight)
    };
    assert!(!unreached(&corridor(true)));
    assert!(unreached(&corridor(false)));
    let lantern = |paper: Value| {
        let mut materials = with_lamp(30.0);
        materials[1] = paint("paper", paper);
        scene(&json!({
            "sky": { "constant": 0.1 }, "materials": materials,
            "objects": [floor(), object("ball", ball([0.0, 0.0, 0.0], 1.0), "paint"),
                        object("lantern", ball([0.0, 2.5, 0.0], 0.5), "paper"),
                        object("bulb", ball([0.0, 2.5, 0.0], 0.1), "lamp")],
        }))
    };
    assert!(!unreached(&lantern(
        json!({ "diffuse_transmission": { "factor": 0.8 } })
    )));
    assert!(unreached(&lantern(json!({}))));
}

/// Protects: rough glass around a lamp scatters light samples to it, so that it is not found by
/// chance.
#[test]
fn lamps_in_rough_glass() {
    let by_chance = |roughness: f64| {
        let mut materials = with_lamp(30.0);
        materials[1] = paint(
            "glass",
            json!({ "transmission": 1, "roughness": roughness }),
        );
        let lit = scene(&json!({
            "sky": null, "materials": materials,
            "render": { "size": [96, 54], "samples": 64, "integrator": "path" },
            "objects": [floor(), object("ball", ball([1.5, -0.3, 0.0], 0.7), "paint"),
                        object("globe", ball([0.0, 2.2, 0.0], 1.5), "glass"),
                        object("bulb", ball([0.0, 2.2, 0.0], 0.1), "lamp")],
        }));
        let found = summarise_findings(&lit).findings;
        found
            .iter()
            .any(|found| found.kind == FaultKind::LightByChance)
    };
    assert!(by_chance(0.0));
    assert!(!by_chance(0.9));
}
