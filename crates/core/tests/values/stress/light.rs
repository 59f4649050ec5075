//! Faults of rays, samples, lights and cameras.

use raywright_core::fault::Subject;

use super::*;

pub(super) fn point(position: [f64; 3], terms: Value) -> Value {
    let mut kind = json!({ "position": position });
    terms
        .as_object()
        .into_iter()
        .flatten()
        .for_each(|(key, value)| kind[key] = value.clone());
    json!({ "kind": { "point": kind }, "colour": 4 })
}

pub(super) fn lamp(emission: f64) -> Value {
    paint(
        "lamp",
        json!({ "base_colour": 0, "specular": 0, "emission": emission }),
    )
}

/// Materials of a faultless scene, with a lamp.
pub(super) fn with_lamp(emission: f64) -> Value {
    json!([
        paint("paint", json!({ "base_colour": 0.6 })),
        paint("glass", json!({ "transmission": 1, "roughness": 0 })),
        lamp(emission)
    ])
}

/// Protects: rays that hit their own surface again, or start behind another surface, are found in
/// scenes with a constant ray offset.
#[test]
fn constant_offsets() {
    let constant = |offset: f64, objects: Value| {
        scene(&json!({
            "classic": { "spawn": { "constant": { "offset": offset, "along": "normal" } } },
            "render": { "size": [96, 54], "samples": 4, "integrator": "whitted" },
            "cameras": [{ "pose": { "look_at": { "eye": [0.3, 0.2, 4], "target": [0, 0, 0] } }, "projection": { "pinhole": { "vertical_fov": 40 } } }],
            "lights": [{ "kind": { "directional": { "to_light": [0, 1, 0.5] } }, "colour": 1 }],
            "objects": objects,
        }))
    };
    let one = json!([object("ball", ball([0.1, 0.2, 0.3], 0.7), "paint")]);
    expect_finding(
        &constant(0.0, one.clone()),
        FaultKind::SelfHit,
        PictureWrong,
        &[],
    );
    assert_eq!(
        listed(&summarise_findings(&constant(1e-3, one)).findings),
        []
    );
    let sheets = json!([
        object(
            "floor",
            quad([-1.0, -0.1, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]),
            "paint"
        ),
        object(
            "roof",
            quad([-1.0, 0.1, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]),
            "paint"
        )
    ]);
    expect_finding(
        &constant(0.5, sheets),
        FaultKind::StartBeyondSurface,
        PictureWrong,
        &[],
    );
}

/// Protects: a gap that single precision closes is found, and so is a lamp that shines through its
/// cover for the same reason.
#[test]
fn gaps_that_storing_closes() {
    let shell = json!([
        object("shell", ball([0.0; 3], 1.000_000_12), "glass"),
        object("ball", ball([0.0; 3], 1.0), "paint")
    ]);
    expect_finding(
        &scene(&json!({ "objects": shell })),
        FaultKind::ClosedGap,
        PictureWrong,
        &[],
    );
    let sheet = |y: f64, r: f64| quad([-r, y, -r], [2.0 * r, 0.0, 0.0], [0.0, 0.0, 2.0 * r]);
    let objects = json!([
        object(
            "cover",
            sheet(1.0 - 1.0 / f64::from(1 << 23), 0.75),
            "paint"
        ),
        object("lamp", sheet(1.0, 0.25), "lamp"),
        object("floor", sheet(0.0, 5.0), "paint")
    ]);
    let mut below = scene(&json!({ "objects": objects, "materials": with_lamp(4.0), "sky": null }));
    below.cameras[0].pose = serde_json::from_value(
        json!({ "look_at": { "eye": [0.5, 0.5, 0.4], "target": [0, 0, 0] } }),
    )
    .expect("a pose");
    expect_finding(
        &below,
        FaultKind::LightThroughCover,
        PictureWrong,
        &[FaultKind::BlackPicture],
    );
}

/// Protects: samples that are not finite, rays cut short, a camera that faces away and a black
/// picture are found.
#[test]
fn samples_that_are_lost() {
    let half = json!({ "sky": { "expression": "d.x < 0 ? sqrt(d.x) : 1" } });
    let finding = expect_finding(
        &scene(&half),
        FaultKind::SamplesNotFinite,
        PictureWrong,
        &[],
    );
    assert!(finding.pixel.is_some());
    let sheet = object(
        "veil",
        quad([-9.0, -9.0, 0.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]),
        "veil",
    );
    let veils = json!({
        "materials": [paint("veil", json!({ "alpha": "blend", "opacity": 1e-7 }))],
        "objects": [],
        "generators": [{ "kind": { "grid": { "counts": [1, 1, 9000], "origin": [0, 0, -9], "step": [0, 0, 0.001] } }, "object": sheet }],
        "render": { "size": [6, 4], "samples": 1, "integrator": "path" },
    });
    expect_finding(&scene(&veils), FaultKind::RaysCutShort, PictureWrong, &[]);
    let mut away = scene(&json!({}));
    away.cameras[0].pose =
        serde_json::from_value(json!({ "look_at": { "eye": [0, 0, 6], "target": [0, 0, 9] } }))
            .expect("a pose");
    expect_finding(&away, FaultKind::NothingSeen, PictureWrong, &[]);
    let boxed = json!({
        "objects": [object("ball", ball([0.0; 3], 1.0), "paint"), object("lamp", ball([0.0, 4.0, 0.0], 0.5), "lamp"),
                    object("box", ball([0.0, 4.0, 0.0], 0.8), "paint")],
        "materials": with_lamp(4.0), "sky": null,
    });
    expect_finding(&scene(&boxed), FaultKind::BlackPicture, PictureWrong, &[]);
}

/// Protects: these lights are found: unreached, missing the scene, hit by chance, smaller than a
/// pixel, or repeated.
#[test]
fn lamps_that_light_nothing() {
    let boxed = json!({
        "objects": [object("ball", ball([0.0; 3], 1.0), "paint"), object("lamp", ball([0.0, 4.0, 0.0], 0.5), "lamp"),
                    object("box", ball([0.0, 4.0, 0.0], 0.8), "paint")],
        "materials": with_lamp(4.0),
    });
    expect_finding(&scene(&boxed), FaultKind::UnreachedLight, SlowOrNoisy, &[]);
    expect_finding(
        &scene(&json!({ "lights": [point([0.0, 50.0, 0.0], json!({ "range": 10 }))] })),
        FaultKind::LightMissesScene,
        SlowOrNoisy,
        &[],
    );
    let spot = json!({ "spot": { "position": [0, 20, 0], "direction": [1, 0, 0], "inner_angle": 10, "outer_angle": 20 } });
    let finding = expect_finding(
        &scene(&json!({ "lights": [{ "kind": spot, "colour": 9 }] })),
        FaultKind::LightMissesScene,
        SlowOrNoisy,
        &[],
    );
    assert!(!finding.remedy.contains("range"), "{}", finding.remedy);
    let mut turned = object(
        "lamp",
        quad([-1.0, 3.0, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0]),
        "lamp",
    );
    turned["side"] = json!("outside");
    let ball_and = |other: Value| json!({ "objects": [object("ball", ball([0.0; 3], 1.0), "paint"), other], "materials": with_lamp(9.0) });
    expect_finding(
        &scene(&ball_and(turned)),
        FaultKind::LightMissesScene,
        SlowOrNoisy,
        &[],
    );
    expect_finding(
        &scene(&ball_and(object(
            "mote",
            ball([0.0, 1.5, 0.5], 1e-4),
            "lamp",
        ))),
        FaultKind::LampBelowPixel,
        SlowOrNoisy,
        &[],
    );
    let twice =
        json!({ "lights": [point([0.0, 5.0, 0.0], json!({})), point([0.0, 5.0, 0.0], json!({}))] });
    expect_finding(&scene(&twice), FaultKind::DuplicateLight, PictureWrong, &[]);
    let mut other = scene(&twice);
    other.lights[1].colour = raywright_core::scene::Colour::WHITE;
    expect_finding(&other, FaultKind::DuplicateLight, Harmless, &[]);
    let bulb = json!({
        "objects": [object("floor", quad([-4.0, -1.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]), "paint"),
                    object("bulb", ball([0.0, 1.0, 0.0], 0.5), "glass"), object("wire", ball([0.0, 1.0, 0.0], 0.003), "lamp")],
        "materials": with_lamp(1000.0), "render": { "size": [160, 90], "samples": 16, "integrator": "path" },
    });
    let finding = alone(&scene(&bulb), FaultKind::LightByChance, SlowOrNoisy);
    assert_eq!(finding.subject, Subject::Object(2));
    assert!(finding.message.contains("`bulb`"), "{}", finding.message);
}

/// Protects: the remedy does not suggest thin walls for glass that is thin-walled already. It names
/// the lamp to enlarge.
#[test]
fn thin_glass_is_not_to_be_made_thin() {
    let mut materials = with_lamp(1000.0);
    let thin = json!({ "transmission": 1, "roughness": 0, "thin_walled": true });
    let mirror = json!({ "metallic": 1, "roughness": 0 });
    materials
        .as_array_mut()
        .expect("materials")
        .extend([paint("thin", thin), paint("mirror", mirror)]);
    let bulb = json!({
        "objects": [object("floor", quad([-4.0, -1.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]), "paint"),
                    object("wall", quad([-4.0, -1.0, -2.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0]), "mirror"),
                    object("bulb", ball([0.0, 1.0, 0.0], 0.5), "thin"), object("wire", ball([0.0, 1.0, 0.0], 0.003), "lamp")],
        "materials": materials, "render": { "size": [160, 90], "samples": 16, "integrator": "path" },
    });
    let finding = expect_finding(&scene(&bulb), FaultKind::LightByChance, SlowOrNoisy, &[]);
    assert!(
        !finding.remedy.contains("thin_walled") && finding.remedy.contains("`wire` larger"),
        "{finding:?}"
    );
}

/// Protects: in a scene without lamps, the sky is reported as the light hit by chance. The remedy
/// suggests no larger lamp.
#[test]
fn a_sky_that_is_met_by_chance() {
    let under_sun = json!({
        "objects": [object("floor", quad([-4.0, -1.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]), "paint"),
                    object("jar", ball([0.0, 0.0, 0.0], 1.0), "glass")],
        "sky": { "gradient": { "bottom": 0.1, "top": 0.2, "suns": [{ "direction": [0.2, 1, 0.1], "weight": 1e4, "exponent": 65536, "colour": 1 }] } },
        "render": { "size": [160, 90], "samples": 16, "integrator": "path" },
    });
    let finding = expect_finding(
        &scene(&under_sun),
        FaultKind::LightByChance,
        SlowOrNoisy,
        &[],
    );
    assert_eq!(finding.subject, Subject::Sky);
    assert!(!finding.remedy.contains("make them"), "{}", finding.remedy);
}

/// Protects: these cameras are found: inside a body, focused on nothing, with the scene smaller
/// than a pixel, or with a stretched picture.
#[test]
fn cameras() {
    let from = |eye: [f64; 3], parts: Value| {
        let mut scene = scene(&parts);
        scene.cameras[0].pose =
            serde_json::from_value(json!({ "look_at": { "eye": eye, "target": [0, 0, 0] } }))
                .expect("a pose");
        scene
    };
    let glass = json!({ "objects": [object("pond", ball([0.0; 3], 9.0), "glass"), object("fish", ball([0.0; 3], 0.5), "paint")] });
    expect_finding(
        &from([0.5, 1.5, 6.0], glass),
        FaultKind::CameraInBody,
        Harmless,
        &[],
    );
    expect_finding(
        &from([-1.2, 0.1, 0.3], json!({})),
        FaultKind::CameraInBody,
        PictureWrong,
        &[],
    );
    expect_finding(
        &from([3e4, 2e4, 6e4], json!({})),
        FaultKind::SceneBelowPixel,
        PictureWrong,
        &[],
    );
    let mut lens = scene(&json!({}));
    lens.cameras[0].projection = serde_json::from_value(json!({
        "thin_lens": { "pinhole": { "vertical_fov": 40 }, "aperture_radius": 0.1, "focus_distance": 0.05 }
    }))
    .expect("a lens");
    expect_finding(&lens, FaultKind::FocusNowhere, PictureWrong, &[]);
    // A lens of a pixel's width blurs nothing, wherever it is sharp.
    lens.cameras[0].projection = serde_json::from_value(json!({
        "thin_lens": { "pinhole": { "vertical_fov": 40 }, "aperture_radius": 1e-5, "focus_distance": 0.05 }
    }))
    .expect("a lens");
    assert_eq!(listed(&summarise_findings(&lens).findings), []);
    // A floor that reaches to the camera and behind it is in view from farther away only.
    let floor =
        json!({ "quad": { "corner": [-9, -1.2, 9], "edge_u": [18, 0, 0], "edge_v": [0, 0, -18] } });
    let ball = json!({ "sphere": { "centre": [0, 0, 0], "radius": 1 } });
    let mut floored = scene(&json!({
        "objects": [object("ball", ball, "paint"), object("floor", floor, "other")],
    }));
    floored.cameras[0].projection = serde_json::from_value(json!({
        "thin_lens": { "pinhole": { "vertical_fov": 40 }, "aperture_radius": 0.1, "focus_distance": 0.5 }
    }))
    .expect("a lens");
    expect_finding(&floored, FaultKind::FocusNowhere, PictureWrong, &[]);
    let mut wide = scene(&json!({}));
    wide.cameras[0].aspect = Some(3.0);
    expect_finding(&wide, FaultKind::StretchedPicture, PictureWrong, &[]);
}

/// Protects: a lens that is focused on a near object before a wall is focused on something.
#[test]
fn a_lens_focused_before_a_wall() {
    let wall = quad([-20.0, -20.0, -20.0], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0]);
    let mut lens = scene(&json!({
        "objects": [object("ball", ball([0.0; 3], 0.8), "paint"), object("wall", wall, "other")],
    }));
    lens.cameras[0].projection = serde_json::from_value(json!({
        "thin_lens": { "pinhole": { "vertical_fov": 40 }, "aperture_radius": 0.2, "focus_distance": 5.5 }
    }))
    .expect("a lens");
    let findings = summarise_findings(&lens).findings;
    assert!(
        findings
            .iter()
            .all(|finding| finding.kind != FaultKind::FocusNowhere),
        "{:?}",
        listed(&findings)
    );
}
