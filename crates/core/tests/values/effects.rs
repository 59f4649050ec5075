//! Statuses of effects in the report: for the smallest scene with an effect, and for scenes that
//! almost have it.

use raywright_core::effects::EffectStatus::{self, Absent, LeftOut, Simulated};
use raywright_core::effects::{Effect, EffectReport, assess_effects};
use raywright_core::scene::Integrator;
use raywright_core::{Settings, prepare};
use serde_json::{Value, json};

use crate::support::{ball, classic, floor, physical, sun};

fn status_of(report: &EffectReport, name: &str) -> EffectStatus {
    report.status(
        Effect::from_name(name).unwrap_or_else(|| panic!("there is no effect named {name}")),
    )
}

/// Asserts statuses under Whitted's integrator, which reports on each term.
#[track_caller]
fn reports(model: Value, parts: Value, statuses: &[(&str, EffectStatus)]) {
    let scene = floor(model.clone(), parts);
    let report = assess_effects(
        &scene,
        &Settings {
            integrator: Integrator::Whitted,
            ..Settings::from_scene(&scene)
        },
    );
    for &(name, expected) in statuses {
        assert_eq!(status_of(&report, name), expected, "{name} of {model}");
    }
    for finding in &report.effects {
        assert_eq!(
            finding.hint.is_some(),
            finding.status == LeftOut,
            "{:?}",
            finding.effect
        );
        assert_eq!(
            finding.source.is_none(),
            finding.status == Absent,
            "{:?}",
            finding.effect
        );
    }
}

/// Protects: the terms of a classic material are effects, each alone, and absent by a zero.
#[test]
fn classic_terms() {
    let lit = || json!({ "lights": [sun([0.0, 1.0, 0.0])] });
    let specular = |strength: f64, on_reflection: bool| json!({ "model": "phong", "exponent": 1, "strength": strength, "on_reflection": on_reflection });
    for (terms, parts, statuses) in [
        (
            json!({}),
            json!({}),
            &[
                ("ambient light", Absent),
                ("direct light", Absent),
                ("shadows", Absent),
                ("sky", Absent),
            ][..],
        ),
        (
            json!({ "ambient": 0.1 }),
            json!({}),
            &[("ambient light", Simulated)],
        ),
        (
            json!({ "ambient": 0.1, "local": 0 }),
            json!({}),
            &[("ambient light", Absent)],
        ),
        (
            json!({}),
            json!({ "classic": { "ambient": 0.1 } }),
            &[("ambient light", Simulated)],
        ),
        (
            json!({ "ambient": 0 }),
            json!({ "classic": { "ambient": 0.1 } }),
            &[("ambient light", Absent)],
        ),
        (
            json!({}),
            lit(),
            &[
                ("direct light", Simulated),
                ("shadows", Simulated),
                ("highlights", Absent),
                ("sky light", Absent),
            ],
        ),
        (
            json!({ "diffuse": 0 }),
            lit(),
            &[("direct light", Absent), ("shadows", Absent)],
        ),
        (
            json!({ "diffuse": 0, "specular": specular(1.0, false) }),
            lit(),
            &[
                ("direct light", Absent),
                ("highlights", Simulated),
                ("shadows", Simulated),
            ],
        ),
        (json!({ "local": 0 }), lit(), &[("direct light", Absent)]),
        (
            json!({ "specular": specular(1.0, false) }),
            lit(),
            &[("highlights", Simulated)],
        ),
        (
            json!({ "specular": specular(0.0, false) }),
            lit(),
            &[("highlights", Absent)],
        ),
        (
            json!({ "specular": specular(1.0, false) }),
            json!({}),
            &[("highlights", Absent)],
        ),
        (
            json!({ "local": 0, "specular": specular(1.0, false) }),
            lit(),
            &[("highlights", Absent)],
        ),
        (
            json!({ "local": 0, "specular": specular(1.0, true), "reflection": { "weight": 1 } }),
            lit(),
            &[("highlights", Simulated)],
        ),
        (
            json!({ "rim": { "strength": 1, "exponent": 1 } }),
            json!({}),
            &[("rim light", Simulated)],
        ),
        (
            json!({ "rim": { "strength": 0, "exponent": 1 } }),
            json!({}),
            &[("rim light", Absent)],
        ),
        (
            json!({ "rim": { "strength": 1, "exponent": 1 }, "local": 0 }),
            json!({}),
            &[("rim light", Absent)],
        ),
        (
            json!({ "reflection": { "weight": 1 } }),
            json!({}),
            &[
                ("mirror reflection", Simulated),
                ("fuzzy reflection", Absent),
                ("refraction", Absent),
            ],
        ),
        (
            json!({ "reflection": { "weight": 0 } }),
            json!({}),
            &[("mirror reflection", Absent)],
        ),
        (
            json!({ "transmission": { "ior": 1.5 } }),
            json!({}),
            &[("refraction", Simulated), ("rough refraction", Absent)],
        ),
        (
            json!({ "emission": 1 }),
            json!({}),
            &[
                ("emission", Simulated),
                ("soft shadows", Simulated),
                ("textured emitters", Absent),
            ],
        ),
        (
            json!({ "emission": 0 }),
            json!({}),
            &[("emission", Absent), ("soft shadows", Absent)],
        ),
        (
            json!({ "emission": 1, "local": 0 }),
            json!({}),
            &[("emission", Simulated), ("soft shadows", Absent)],
        ),
        (
            json!({ "emission": "p.x" }),
            json!({}),
            &[
                ("emission", Simulated),
                ("textured emitters", LeftOut),
                ("procedural textures", Simulated),
            ],
        ),
        // At the last segment a reflective surface shows its local term in full, whatever its
        // weight.
        (
            json!({ "local": 0, "reflection": { "weight": 1 } }),
            json!({ "lights": [sun([0.0, 1.0, 0.0])], "classic": { "depth_limit": "local_only" } }),
            &[("direct light", Simulated)],
        ),
        (
            json!({}),
            json!({ "sky": { "constant": 1 } }),
            &[("sky", Simulated), ("sky light", Absent)],
        ),
        (
            json!({ "colour": { "checker": { "even": 0, "odd": 1 } } }),
            json!({}),
            &[("checkerboard", Simulated)],
        ),
        (
            json!({ "colour": { "checker": { "even": 1, "odd": 1 } } }),
            json!({}),
            &[("checkerboard", Absent)],
        ),
    ] {
        reports(classic(terms), parts, statuses);
    }
    let fuzz = |amount: f64| json!({ "reflection": { "weight": 1, "fuzz": { "amount": amount, "frequencies": [[1, 0, 0], [0, 1, 0], [0, 0, 1]] } } });
    reports(
        classic(fuzz(0.1)),
        json!({}),
        &[
            ("fuzzy reflection", Simulated),
            ("mirror reflection", Simulated),
        ],
    );
    reports(
        classic(fuzz(0.0)),
        json!({}),
        &[
            ("fuzzy reflection", Absent),
            ("mirror reflection", Simulated),
        ],
    );
}

/// Protects: effects of a physical material: smooth glass is not rough, only a dielectric
/// transmits, a metal has no diffuse reflection.
#[test]
fn physical_terms() {
    let sky = || json!({ "sky": { "constant": 1 } });
    for (terms, statuses) in [
        (
            json!({}),
            &[
                ("sky light", Simulated),
                ("sky", Simulated),
                ("indirect light", LeftOut),
                ("glossy reflection", LeftOut),
                ("mirror reflection", Absent),
                ("caustics", Absent),
                ("refraction", Absent),
                ("transparency", Absent),
            ][..],
        ),
        (
            json!({ "roughness": 0.05 }),
            &[
                ("mirror reflection", Simulated),
                ("glossy reflection", Absent),
                ("caustics", LeftOut),
            ],
        ),
        (
            json!({ "roughness": 0.051 }),
            &[
                ("mirror reflection", Absent),
                ("glossy reflection", LeftOut),
                ("caustics", Absent),
            ],
        ),
        (
            json!({ "roughness": 0, "metallic": 1 }),
            &[
                ("mirror reflection", Simulated),
                ("indirect light", Absent),
                ("caustics", Absent),
            ],
        ),
        (
            json!({ "roughness": 0, "transmission": 1 }),
            &[
                ("refraction", Simulated),
                ("rough refraction", Absent),
                ("indirect light", Absent),
            ],
        ),
        (
            json!({ "roughness": 0.3, "transmission": 1 }),
            &[
                ("refraction", Simulated),
                ("rough refraction", LeftOut),
                ("mirror reflection", Simulated),
            ],
        ),
        (
            json!({ "roughness": 0.3, "transmission": 1, "metallic": 1 }),
            &[("refraction", Absent), ("rough refraction", Absent)],
        ),
        (
            json!({ "roughness": 0, "transmission": 0.5 }),
            &[
                ("refraction", Simulated),
                ("indirect light", LeftOut),
                ("caustics", LeftOut),
            ],
        ),
        // A varying transmission may transmit somewhere, and reflect diffusely elsewhere.
        (
            json!({ "roughness": 0, "transmission": "p.x" }),
            &[
                ("refraction", Simulated),
                ("indirect light", LeftOut),
                ("procedural textures", Simulated),
            ],
        ),
        (
            json!({ "roughness": 0, "transmission": { "checker": { "even": 1, "odd": 1 } } }),
            &[
                ("refraction", Simulated),
                ("indirect light", LeftOut),
                ("checkerboard", Absent),
            ],
        ),
        (
            json!({ "ior": { "checker": { "even": 1, "odd": 2 } } }),
            &[("refraction", Absent), ("checkerboard", Simulated)],
        ),
        (json!({ "alpha": "blend" }), &[("transparency", Simulated)]),
        (json!({ "opacity": 0.5 }), &[("transparency", Absent)]),
        (
            json!({ "emission": 1 }),
            &[("emission", Simulated), ("soft shadows", Simulated)],
        ),
        (
            json!({ "unlit": true }),
            &[
                ("unlit surfaces", Simulated),
                ("sky light", Absent),
                ("indirect light", Absent),
                ("glossy reflection", Absent),
            ],
        ),
        (
            json!({ "unlit": true, "emission": 1 }),
            &[("emission", Absent), ("soft shadows", Absent)],
        ),
        (
            json!({ "vertex_colours": true }),
            &[("vertex colours", Simulated)],
        ),
        (
            json!({ "base_colour": "p" }),
            &[("procedural textures", Simulated)],
        ),
    ] {
        reports(physical(terms), sky(), statuses);
    }
    reports(
        physical(json!({})),
        json!({}),
        &[("sky light", Absent), ("sky", Absent)],
    );
}

/// Protects: conditions on lights and objects for shadows and highlights.
#[test]
fn lights_and_casters() {
    let light = |rest: Value| {
        let mut light = sun([0.0, 1.0, 0.0]);
        light
            .as_object_mut()
            .expect("a table")
            .extend(rest.as_object().expect("a table").clone());
        json!({ "lights": [light] })
    };
    let shiny = || physical(json!({ "roughness": 0.5 }));
    reports(
        shiny(),
        light(json!({})),
        &[
            ("direct light", Simulated),
            ("shadows", Simulated),
            ("highlights", Simulated),
        ],
    );
    reports(
        shiny(),
        light(json!({ "shadows": false })),
        &[
            ("direct light", Simulated),
            ("shadows", Absent),
            ("highlights", Simulated),
        ],
    );
    reports(
        shiny(),
        light(json!({ "specular": false })),
        &[
            ("direct light", Simulated),
            ("shadows", Simulated),
            ("highlights", Absent),
        ],
    );
    reports(
        shiny(),
        light(json!({ "colour": 0 })),
        &[
            ("direct light", Absent),
            ("shadows", Absent),
            ("highlights", Absent),
        ],
    );
    let mut scene = floor(shiny(), light(json!({})));
    scene.objects[0].casts_shadow = false;
    assert_eq!(
        assess_effects(&scene, &Settings::from_scene(&scene)).status(Effect::Shadows),
        Absent
    );
}

/// Protects: effects of geometry, and that only materials in use count.
#[test]
fn geometry_and_what_is_shown() {
    let glow = json!({ "name": "glow", "model": { "classic": { "emission": 1 } } });
    reports(
        classic(json!({})),
        json!({ "materials": [glow] }),
        &[
            ("emission", Absent),
            ("soft shadows", Absent),
            ("unbounded shapes", Simulated),
        ],
    );
    let with = json!({ "materials": [glow], "objects": [ball([0.0, 3.0, 0.0], 1.0, "glow")] });
    reports(
        classic(json!({})),
        with,
        &[("emission", Simulated), ("soft shadows", Simulated)],
    );
    let leaf = |normals: Value| json!({ "name": "leaf", "source": { "inline": { "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]], "normals": normals } } });
    let shows =
        |side: &str| json!({ "shape": { "mesh": "leaf" }, "material": "floor", "side": side });
    let meshes = |normals: Value, sides: &[&str]| {
        let objects: Vec<Value> = sides.iter().map(|side| shows(side)).collect();
        json!({ "meshes": [leaf(normals)], "objects": objects })
    };
    let up = json!([[0, 0, 1], [0, 0, 1], [0, 0, 1]]);
    reports(
        classic(json!({})),
        meshes(json!([]), &["both"]),
        &[("instances", Absent), ("smooth shading", Absent)],
    );
    reports(
        classic(json!({})),
        meshes(up, &["both", "both"]),
        &[("instances", Simulated), ("smooth shading", Simulated)],
    );
    reports(
        classic(json!({})),
        meshes(json!([]), &["both", "outside"]),
        &[("instances", Absent)],
    );
    let generator = |count: u32| {
        let mut parts = meshes(json!([]), &[]);
        parts["generators"] = json!([{ "kind": { "grid": { "counts": [count, 1, 1], "origin": [0, 0, 0], "step": [1, 0, 0] } }, "object": shows("both") }]);
        parts
    };
    reports(
        classic(json!({})),
        generator(2),
        &[("instances", Simulated)],
    );
    reports(classic(json!({})), generator(1), &[("instances", Absent)]);
    let mut shown = floor(classic(json!({})), json!({}));
    let tube = |height: Value| json!({ "shape": { "cylinder": { "base": [0, 0, 0], "axis": [0, 1, 0], "radius": 1, "height": height } }, "material": "floor" });
    for (object, status) in [
        (ball([0.0; 3], 1.0, "floor"), Absent),
        (tube(json!(1)), Absent),
        (tube(Value::Null), Simulated),
    ] {
        shown.objects[0] = serde_json::from_value(object).expect("an object");
        assert_eq!(
            assess_effects(&shown, &Settings::from_scene(&shown)).status(Effect::UnboundedShapes),
            status
        );
    }
}

/// Protects: a lens of zero radius is no effect, and a fixed pattern leaves depth of field out.
#[test]
fn lenses() {
    let status = |radius: f64, pattern: Value| {
        let lens = json!({ "pinhole": { "vertical_fov": 40 }, "aperture_radius": radius, "focus_distance": 3 });
        let camera = json!({ "pose": { "look_at": { "eye": [0, 1, 3], "target": [0, 0, 0] } }, "projection": { "thin_lens": lens } });
        let scene = floor(
            classic(json!({})),
            json!({ "cameras": [camera], "render": { "pattern": pattern } }),
        );
        assess_effects(&scene, &Settings::from_scene(&scene)).status(Effect::DepthOfField)
    };
    assert_eq!(status(0.1, Value::Null), Simulated);
    assert_eq!(status(0.1, json!("centre")), LeftOut);
    assert_eq!(status(0.0, json!("centre")), Absent);
}

/// Protects: `auto` selects Whitted's integrator if it leaves nothing out, and path tracing
/// otherwise: classic materials under lights and lamps, and physical ones without diffuse light or
/// blur, against physical ones that light each other, blur reflections, or have effects of path
/// tracing alone.
#[test]
fn auto_goes_by_what_is_left_out() {
    let takes = |model: Value| {
        let scene = floor(model, json!({ "lights": [sun([0.0, 1.0, 0.0])] }));
        let settings = Settings::from_scene(&scene);
        (
            assess_effects(&scene, &settings).integrator,
            prepare(&scene, &settings, &())
                .expect("prepares")
                .is_path_traced(),
        )
    };
    let whitted = [
        classic(json!({ "reflection": { "weight": 0.5 } })),
        classic(json!({ "local": 0, "emission": 1 })),
        physical(json!({ "unlit": true })),
        physical(json!({ "metallic": 1, "roughness": 0 })),
    ];
    let paths = [
        physical(json!({})),
        physical(json!({ "metallic": 1, "roughness": 0.5 })),
        physical(json!({ "transmission": 1, "roughness": 0.5 })),
        physical(json!({ "metallic": 1, "roughness": 0, "clearcoat": { "factor": 1 } })),
    ];
    for model in whitted {
        assert_eq!(takes(model.clone()), ("whitted", false), "{model}");
    }
    for model in paths {
        assert_eq!(takes(model.clone()), ("path", true), "{model}");
    }
}

/// Protects: in path tracing a sky lights diffuse surfaces, and surfaces with only a highlight,
/// which is a rough lobe there.
#[test]
fn a_sky_lights_highlights_along_paths() {
    let gloss = |strength: f64| {
        let specular = json!({ "model": "blinn", "exponent": 20, "strength": strength });
        floor(
            classic(json!({ "diffuse": 0, "specular": specular })),
            json!({ "sky": { "constant": 1 } }),
        )
    };
    for (strength, expected) in [(0.5, Simulated), (0.0, Absent)] {
        let scene = gloss(strength);
        let report = assess_effects(
            &scene,
            &Settings {
                integrator: Integrator::Path,
                ..Settings::from_scene(&scene)
            },
        );
        assert_eq!(status_of(&report, "sky light"), expected, "{strength}");
    }
}
