//! Delta lights and lamps of almost no area: what they light, and how noisy they are.

use raywright_core::fault::Subject;

use super::light::{lamp, point, with_lamp};
use super::*;

fn floor() -> Value {
    object(
        "floor",
        json!({ "plane": { "point": [0, -1, 0], "normal": [0, 1, 0] } }),
        "paint",
    )
}

fn spot(position: [f64; 3], direction: [f64; 3], outer: f64) -> Value {
    json!({ "colour": 9, "kind": { "spot": {
        "position": position, "direction": direction, "inner_angle": 5, "outer_angle": outer } } })
}

/// Protects: a point light in the plane of a floor is the cause of a black picture. It is not
/// reported if it lights another object, or slightly above the floor.
#[test]
fn a_light_in_a_surface() {
    let of = |y: f64, objects: Value| {
        scene(
            &json!({ "sky": null, "lights": [point([0.0, y, 0.0], json!({}))], "objects": objects }),
        )
    };
    let finding = alone(
        &of(-1.0, json!([floor()])),
        FaultKind::BlackPicture,
        PictureWrong,
    );
    assert!(
        finding.message.contains("lights[0] is without effect")
            && finding.remedy.contains("move the light"),
        "{finding:?}"
    );
    let with_ball = json!([floor(), object("ball", ball([1.0, 0.0, 0.0], 0.5), "other")]);
    assert_eq!(
        listed(&summarise_findings(&of(-1.0, with_ball)).findings),
        []
    );
    assert_eq!(
        listed(&summarise_findings(&of(-0.9, json!([floor()]))).findings),
        []
    );
}

/// Protects: a spot light whose cone holds only the sky or only a lamp is reported to miss the
/// scene. The remedy suggests no cone wider than 90 degrees. The suggested range reaches the
/// surface, not only its bounding box.
#[test]
fn lights_that_miss() {
    let with_spot = |light: Value| {
        let high = json!({ "box": { "min": [-0.5, 4, -0.5], "max": [0.5, 5, 0.5] } });
        scene(&json!({
            "lights": [light], "materials": with_lamp(4.0),
            "objects": [floor(), object("ball", ball([0.0; 3], 1.0), "paint"), object("lamp", high, "lamp")],
        }))
    };
    let of = |light: Value| {
        expect_finding(
            &with_spot(light),
            FaultKind::LightMissesScene,
            SlowOrNoisy,
            &[],
        )
    };
    let sky = of(spot([2.0, 1.0, 0.0], [1.0, 1.0, 0.0], 20.0));
    assert!(
        sky.message.contains("none of") && !sky.remedy.contains("widen"),
        "{sky:?}"
    );
    let only_lamp = of(spot([0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 10.0));
    assert!(only_lamp.message.contains("`lamp`"), "{only_lamp:?}");
    let behind = of(spot([0.0, 30.0, 0.0], [0.0, 1.0, 0.1], 20.0));
    assert!(!behind.remedy.contains("widen"), "{behind:?}");
    let beside = of(spot([0.0, 30.0, 0.0], [1.0, -0.9, 0.0], 20.0));
    assert!(
        beside.remedy.contains("to 48 degrees") || beside.remedy.contains("to 49 degrees"),
        "{beside:?}"
    );
    let lit = with_spot(spot([2.0, 1.0, 0.0], [-1.0, -0.5, 0.0], 20.0));
    assert_eq!(listed(&summarise_findings(&lit).findings), []);
    // The corner of the ball's box is nearer than the ball, at 2.46 metres.
    let corner = scene(&json!({
        "lights": [point([2.0, 2.0, 2.0], json!({ "range": 1.8 }))],
        "objects": [object("ball", ball([0.0; 3], 1.0), "paint")],
    }));
    let finding = alone(&corner, FaultKind::LightMissesScene, SlowOrNoisy);
    assert!(finding.remedy.contains("above 2.4"), "{finding:?}");
}

/// Protects: a lamp of no or almost no area is reported for its area, not as shut away. A small
/// bright lamp is not reported.
#[test]
fn lamps_without_area() {
    let of = |edge: f64, emission: f64| {
        scene(&json!({
            "materials": with_lamp(emission),
            "objects": [floor(), object("ball", ball([0.0; 3], 1.0), "paint"),
                        object("strip", quad([8.0, 3.0, 0.0], [1e-2, 0.0, 0.0], [0.0, 0.0, edge]), "lamp")],
        }))
    };
    for edge in [1e-25, 1e-10] {
        let finding = alone(&of(edge, 9.0), FaultKind::UnreachedLight, SlowOrNoisy);
        assert!(
            finding.message.contains("area") && !finding.message.contains("blocked"),
            "{finding:?}"
        );
        assert!(finding.place.is_some(), "{finding:?}");
    }
    assert_eq!(listed(&summarise_findings(&of(1e-2, 9e4)).findings), []);
    // A moon far away makes no lamp smaller.
    let mut with_moon = of(1e-2, 9.0);
    let moon = object("moon", ball([0.0, 0.0, -1e9], 1e6), "paint");
    with_moon
        .objects
        .push(serde_json::from_value(moon).expect("an object"));
    let all = summarise_findings(&with_moon).findings;
    let is_unreached = |found: &Fault| found.kind == FaultKind::UnreachedLight;
    assert!(!all.iter().any(is_unreached), "{all:?}");
}

/// Protects: the lamps of a generator are counted singly.
#[test]
fn lamps_of_generators_are_counted() {
    let motes = scene(&json!({
        "materials": with_lamp(9.0),
        "objects": [object("ball", ball([0.0; 3], 1.0), "paint"), object("mote", ball([0.0, 1.2, 0.0], 1e-4), "lamp")],
        "generators": [{
            "kind": { "grid": { "counts": [5, 1, 1], "origin": [-1, 1.5, 0], "step": [0.5, 0, 0] } },
            "object": object("copy", ball([0.0; 3], 1e-4), "lamp"),
        }],
    }));
    let finding = expect_finding(&motes, FaultKind::LampBelowPixel, SlowOrNoisy, &[]);
    assert_eq!((finding.count, finding.of), (6, 6), "{finding:?}");
}

/// Protects: the remedy for a lamp below a pixel is no entry in `lights` if the lamp is inside
/// glass, where no path can hit such a light.
#[test]
fn a_mote_in_glass_is_not_to_be_a_light() {
    let of = |material: &str| {
        let motes = scene(&json!({
            "materials": with_lamp(0.01),
            "objects": [floor(), object("mote", ball([0.0, 0.7, 0.0], 1e-3), "lamp"), object("globe", ball([0.0, 0.7, 0.0], 0.3), material)],
        }));
        expect_finding(&motes, FaultKind::LampBelowPixel, SlowOrNoisy, &[])
    };
    let count_text = of("glass").count_text();
    assert_eq!(
        count_text.as_deref(),
        Some("1 of 1 lamp is smaller than a pixel")
    );
    let [in_glass, in_paint] = ["glass", "paint"].map(|material| of(material).remedy);
    assert!(!in_glass.contains("`lights`"), "{in_glass}");
    assert!(in_paint.contains("`lights`"), "{in_paint}");
}

/// Protects: a bulb in a glass globe is noisy if it lights the scene. It is not reported if it adds
/// next to nothing to the sky's light, even though no path hits it.
#[test]
fn chance_is_judged_by_the_light_that_it_brings() {
    let of = |emission: f64, sky: f64| {
        scene(&json!({
            "materials": with_lamp(emission), "sky": { "constant": sky },
            "render": { "size": [160, 90], "samples": 64, "integrator": "path" },
            "objects": [floor(), object("globe", ball([0.0, 0.7, 0.0], 0.6), "glass"),
                        object("bulb", ball([0.0, 0.7, 0.0], 0.1), "lamp")],
        }))
    };
    let finding = alone(&of(60.0, 0.01), FaultKind::LightByChance, SlowOrNoisy);
    assert_eq!(finding.subject, Subject::Object(2));
    assert!(
        finding.remedy.contains("render with more --spp"),
        "{finding:?}"
    );
    assert_eq!(listed(&summarise_findings(&of(1e-3, 1.0)).findings), []);
    // A spark whose noise is strong in the few samples, but whose light is no part of the picture,
    // and a lamp that is large in its globe.
    let by_chance = |radius: f64, emission: f64, samples: u32| {
        let mut lit = of(emission, 1.0);
        lit.render.samples = samples;
        lit.objects[2] =
            serde_json::from_value(object("bulb", ball([0.0, 0.7, 0.0], radius), "lamp"))
                .expect("an object");
        let all = summarise_findings(&lit).findings;
        all.iter()
            .any(|found| found.kind == FaultKind::LightByChance)
    };
    assert!(!by_chance(3e-3, 25.0, 1));
    assert!(!by_chance(0.55, 5.0, 64));
}

/// Protects: a lamp in the box of a ball of glass and not in the ball is not within glass; the place
/// of the lamp to be made larger is told.
#[test]
fn a_lamp_beside_glass_is_not_within_it() {
    let lit = scene(&json!({
        "materials": with_lamp(3000.0), "sky": { "constant": 0.01 },
        "render": { "size": [160, 90], "samples": 16, "integrator": "path" },
        "objects": [floor(), object("globe", ball([0.0, 0.7, 0.0], 0.6), "glass"),
                    object("spark", ball([0.5, 1.2, 0.5], 0.003), "lamp")],
    }));
    let finding = expect_finding(&lit, FaultKind::LightByChance, SlowOrNoisy, &[]);
    assert!(!finding.message.contains("glass around"), "{finding:?}");
    assert!(
        finding.remedy.contains("make object `spark` larger") && !finding.remedy.contains("rough"),
        "{finding:?}"
    );
    assert_eq!(finding.place, Some([0.5, 1.2, 0.5]), "{finding:?}");
}

/// Protects: noise is judged against the light of the surfaces in view. A bright sky around them
/// does not count.
#[test]
fn a_bright_sky_hides_no_noise_of_surfaces() {
    let table = quad([-1.0, -1.0, 1.0], [2.5, 0.0, 0.0], [0.0, 0.0, -2.5]);
    let mut lit = scene(&json!({
        "materials": with_lamp(6000.0), "sky": { "constant": 3 },
        "render": { "size": [160, 90], "samples": 16, "integrator": "path" },
        "objects": [object("table", table, "paint"), object("globe", ball([0.0, 0.2, 0.0], 1.1), "glass"),
                    object("spark", ball([1.3, 1.2, 0.5], 0.003), "lamp")],
    }));
    let pose = json!({ "look_at": { "eye": [0.5, 1.5, 9], "target": [0, 0, 0] } });
    lit.cameras[0].pose = serde_json::from_value(pose).expect("a pose");
    expect_finding(&lit, FaultKind::LightByChance, SlowOrNoisy, &[]);
}

/// Protects: the budget ends the rays of the lights, and the lights that were left out are counted.
#[test]
fn lights_end_with_the_budget() {
    let lit = scene(
        &json!({ "lights": [point([0.0, 3.0, 0.0], json!({})), point([1.0, 3.0, 0.0], json!({}))] }),
    );
    let surveyed_lights = |seconds: u64| {
        let effort = StressEffort {
            budget: core::time::Duration::from_secs(seconds),
        };
        let report = stress(&lit, &Settings::from_scene(&lit), &effort, &())
            .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(listed(&report.findings), []);
        let run = report.checks.iter().find(|run| run.unit == "lights");
        let run = run.expect("rays of the lights");
        [run.looked_at, run.planned]
    };
    assert_eq!(surveyed_lights(0), [0, 2]);
    assert_eq!(surveyed_lights(3600), [2, 2]);
}

/// Protects: a directional light behind a glass pane makes the picture wrong, as its light never
/// arrives. It does not if the pane is thin-walled, or if a glass ball shades only a part.
#[test]
fn a_sun_behind_a_pane() {
    let wall = |name: &str, min: [f64; 3], max: [f64; 3], material: &str| {
        object(name, json!({ "box": { "min": min, "max": max } }), material)
    };
    let of = |pane: Value, thin: bool| {
        let mut scene = scene(&json!({
            "sky": null,
            "lights": [{ "kind": { "directional": { "to_light": [0, 1, 0.2] } }, "colour": 3 }],
            "materials": [paint("paint", json!({ "base_colour": 0.6 })),
                          paint("glass", json!({ "transmission": 1, "roughness": 0, "thin_walled": thin }))],
            "objects": [wall("floor", [-5.0, -1.2, -5.0], [5.0, -1.0, 5.0], "paint"), pane],
        }));
        scene.cameras[0].pose = serde_json::from_value(
            json!({ "look_at": { "eye": [0.5, 0.5, 4.5], "target": [0, -1, 0] } }),
        )
        .expect("a pose");
        scene
    };
    let pane = || wall("pane", [-9.0, 2.0, -9.0], [9.0, 2.1, 9.0], "glass");
    let finding = alone(
        &of(pane(), false),
        FaultKind::LightBehindGlass,
        PictureWrong,
    );
    assert!(
        finding.message.contains("`pane`") && finding.remedy.contains("thin_walled"),
        "{finding:?}"
    );
    assert_eq!(listed(&summarise_findings(&of(pane(), true)).findings), []);
    let globe = || object("globe", ball([0.0, 0.0, 0.0], 0.5), "glass");
    assert_eq!(
        listed(&summarise_findings(&of(globe(), false)).findings),
        []
    );
}

/// Protects: a black picture names the only panel, which faces away, and the remedy is to turn it
/// over.
#[test]
fn a_black_picture_by_a_panel_that_is_turned() {
    let mut panel = object(
        "panel",
        json!({ "disk": { "centre": [0, 4, 0], "normal": [0, 1, 0], "radius": 1 } }),
        "lamp",
    );
    panel["side"] = json!("outside");
    let dark = scene(&json!({
        "sky": { "constant": 0 }, "materials": [paint("paint", json!({})), lamp(9.0)],
        "objects": [object("ball", ball([0.0; 3], 1.0), "paint"), panel],
    }));
    let finding = alone(&dark, FaultKind::BlackPicture, PictureWrong);
    assert!(
        finding
            .message
            .contains("`panel` is without effect; this lamp emits from one side only")
            && finding.remedy.contains("turn it over"),
        "{finding:?}"
    );
}

/// Protects: coplanar surfaces make the picture wrong if one emits light, in either order in the
/// file. A rug a millimetre above a floor is not reported when seen from 20 km.
#[test]
fn glow_in_one_plane_and_a_rug_from_afar() {
    let sheet = |y: f64, half: f64| {
        quad(
            [-half, y, half],
            [2.0 * half, 0.0, 0.0],
            [0.0, 0.0, -2.0 * half],
        )
    };
    let rug = |y: f64| object("rug", sheet(y, 1.0), "lamp");
    let ground = || object("ground", sheet(-1.0, 5.0), "paint");
    for objects in [json!([rug(-1.0), ground()]), json!([ground(), rug(-1.0)])] {
        let glow = scene(&json!({ "materials": with_lamp(2.0), "objects": objects }));
        let all = summarise_findings(&glow).findings;
        let found = all
            .iter()
            .find(|found| found.kind == FaultKind::CoplanarSurfaces);
        assert_eq!(
            found.map(|found| found.severity),
            Some(PictureWrong),
            "{all:?}"
        );
    }
    for (gap, is_silent) in [(1e-3, true), (1e-5, true), (1e-8, false)] {
        let mut far = scene(
            &json!({ "objects": [object("ground", sheet(0.0, 5.0), "paint"), object("rug", sheet(gap, 1.0), "other")] }),
        );
        far.cameras[0] = serde_json::from_value(json!({
            "pose": { "look_at": { "eye": [3000, 9000, 18000], "target": [0, 0, 0] } },
            "projection": { "pinhole": { "vertical_fov": 0.02 } },
        }))
        .expect("a camera");
        let all = summarise_findings(&far).findings;
        assert_eq!(all.is_empty(), is_silent, "{gap}: {all:?}");
    }
}
