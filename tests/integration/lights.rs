//! Lights without a surface, and their shadow rays.

use raywright::core::prepare;
use raywright::core::scene::Scene;
use raywright::core::settings::{Sampling, Settings};

/// A floor at height `y`, a light of colour 0.5 at 2 above it, and a ceiling directly above the
/// light.
fn scene(y: f64, light: &str) -> Scene {
    let text = format!(
        r#"{{ "format": 1,
        "cameras": [{{ "pose": {{ "look_at": {{ "eye": [0, {eye}, 1], "target": [0, {y}, 0] }} }},
                      "projection": {{ "pinhole": {{ "vertical_fov": 40 }} }} }}],
        "classic": {{ "ambient": 0 }},
        "lights": [{{ "kind": {light}, "colour": 0.5 }}],
        "materials": [{{ "name": "matte", "model": {{ "classic": {{ "diffuse": 1 }} }} }}],
        "objects": [{{ "shape": {{ "quad": {{ "corner": [-4, {y}, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] }} }}, "material": "matte" }},
                    {{ "shape": {{ "quad": {{ "corner": [-4, {ceiling}, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] }} }}, "material": "matte" }}] }}"#,
        eye = y + 1.0,
        ceiling = (y as f32 + 2.0).next_up(),
    );
    serde_json::from_str(&text).expect("the scene is right")
}

/// Protects: a shadow ray ends at its light, wherever it starts. Far from zero a ray starts visibly
/// off its surface; with the surface's own distance it would pass its light and hit the ceiling.
#[test]
fn what_is_behind_a_light_casts_no_shadow() {
    for (name, position) in [
        ("point", ""),
        (
            "spot",
            r#""direction": [0, -1, 0], "inner_angle": 80, "outer_angle": 89,"#,
        ),
    ] {
        for y in [0.0, 100.0, 10_000.0] {
            let light = format!(
                r#"{{ "{name}": {{ {position} "position": [0, {}, 0], "falloff": "none" }} }}"#,
                y + 2.0
            );
            let scene = scene(y, &light);
            let settings = Settings {
                size: [32, 18],
                sampling: Sampling::General(1),
                ..Settings::from_scene(&scene)
            };
            let picture = prepare(&scene, &settings, &())
                .unwrap_or_else(|e| panic!("{e}"))
                .render(&())
                .picture;
            let dark = picture.rgb.iter().filter(|p| p[1] < 0.2).count();
            assert_eq!(
                dark,
                0,
                "{name} at {y}: {dark} of {} pixels lie in a shadow",
                picture.rgb.len()
            );
        }
    }
}

/// Protects: a light without falloff shines on an endless plane alone, a scene without extent, as
/// it does on a part of the plane.
#[test]
fn endless_planes_alone_are_lit() {
    let lit = |shape: &str| {
        let text = format!(
            r#"{{ "format": 1, "render": {{ "integrator": "path" }},
            "cameras": [{{ "pose": {{ "look_at": {{ "eye": [0, 1, 1], "target": [0, 0, 0] }} }},
                          "projection": {{ "pinhole": {{ "vertical_fov": 40 }} }} }}],
            "lights": [{{ "kind": {{ "point": {{ "position": [0, 2, 0], "falloff": "none" }} }}, "colour": 0.5 }}],
            "materials": [{{ "name": "matte", "model": {{ "classic": {{ "diffuse": 1 }} }} }}],
            "objects": [{{ "shape": {shape}, "material": "matte" }}] }}"#
        );
        let scene: Scene = serde_json::from_str(&text).expect("the scene is right");
        let settings = Settings {
            size: [4, 4],
            sampling: Sampling::General(4),
            ..Settings::from_scene(&scene)
        };
        let ready = prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
        ready.render(&()).picture.rgb
    };
    let plane = lit(r#"{ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }"#);
    let part =
        lit(r#"{ "quad": { "corner": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] } }"#);
    for (a, b) in plane.iter().zip(&part) {
        assert!(a[0] > 0.1 && (a[0] - b[0]).abs() < 1e-3, "{a:?}, {b:?}");
    }
}
