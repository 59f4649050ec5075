//! White furnaces: pictures of white objects under a white sky, in which a surface that loses and
//! gains no energy is invisible.

use crate::scene::Integrator;
use crate::settings::{Sampling, Settings};
use crate::{Scene, prepare};

const BALL: &str = r#"{ "sphere": { "centre": [0, 0, 0], "radius": 1 } }"#;
const BLOCK: &str = r#"{ "box": { "min": [-1, -1, -1], "max": [1, 1, 1] } }"#;
const PLANE: &str = r#"{ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }"#;

/// Fields of a white physical material besides its colour and its roughness.
const MATERIALS: [(&str, &str); 14] = [
    ("opaque", ""),
    ("half clear", r#", "transmission": 0.5"#),
    ("clear", r#", "transmission": 1"#),
    (
        "half clear, thin",
        r#", "transmission": 0.5, "thin_walled": true"#,
    ),
    ("half metal", r#", "metallic": 0.5"#),
    (
        "half metal, half clear",
        r#", "metallic": 0.5, "transmission": 0.5"#,
    ),
    ("coated", r#", "clearcoat": { "factor": 1 }"#),
    (
        "coated, half clear",
        r#", "clearcoat": { "factor": 1, "roughness": 0.3 }, "transmission": 0.5"#,
    ),
    ("velvet", r#", "sheen": { "roughness": 0.4 }"#),
    (
        "oily",
        r#", "iridescence": { "ior": 1.8, "thickness": 420 }"#,
    ),
    (
        "oily, half clear",
        r#", "iridescence": { "ior": 1.8, "thickness": 420 }, "transmission": 0.5"#,
    ),
    ("combed", r#", "anisotropy": { "strength": 0.8 }"#),
    ("leaf", r#", "diffuse_transmission": { "factor": 0.5 }"#),
    (
        "leaf, half clear",
        r#", "diffuse_transmission": { "factor": 0.5 }, "transmission": 0.5"#,
    ),
];

/// Mean of a picture of a white object under a white sky, viewed at `degrees` from the vertical.
fn mean(shape: &str, material: &str, degrees: f64, integrator: Integrator, depth: u32) -> f64 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let text = format!(
        r#"{{ "format": 1, "sky": {{ "constant": 1 }},
        "cameras": [{{ "pose": {{ "look_at": {{ "eye": [{}, {}, 0.1], "target": [0, 0, 0.1], "up": [0, 0, 1] }} }},
                       "projection": {{ "orthographic": {{ "height": 1.3 }} }} }}],
        "materials": [{{ "name": "white", "model": {{ "physical": {{ "base_colour": 1{material} }} }} }}],
        "objects": [{{ "shape": {shape}, "material": "white" }}] }}"#,
        9.0 * sine,
        9.0 * cosine
    );
    let scene: Scene = serde_json::from_str(&text).expect("a scene");
    let sampling = Sampling::General(32);
    let settings = Settings {
        size: [8, 8],
        integrator,
        sampling,
        max_depth: depth,
        ..Settings::from_scene(&scene)
    };
    let picture = prepare(&scene, &settings, &())
        .expect("it can be prepared")
        .render(&())
        .picture;
    let all = (0..64).flat_map(|i| picture.pixel(i % 8, i / 8).expect("a pixel").map(f64::from));
    all.sum::<f64>() / 192.0
}

/// Protects: no material gains energy in a picture, from head-on to grazing views, however many
/// bounces stay inside it. A partly clear body once grew a hundredfold with each doubling of the
/// depth.
#[test]
fn furnaces_do_not_glow() {
    let mut most = (0.0, String::new());
    for (name, made) in MATERIALS {
        for roughness in [0.0, 0.5] {
            let material = format!(r#"{made}, "roughness": {roughness}"#);
            for (shape, label, degrees) in [
                (BALL, "ball", 30.0),
                (PLANE, "plane", 45.0),
                (PLANE, "plane", 87.0),
            ] {
                for depth in [2, 4, 8, 16, 64] {
                    let mean = mean(shape, &material, degrees, Integrator::Path, depth);
                    if mean > most.0 {
                        most = (
                            mean,
                            format!(
                                "{name}, roughness {roughness}, {label} at {degrees}°, depth {depth}: {mean}"
                            ),
                        );
                    }
                }
            }
        }
    }
    // Noise of 2,048 samples.
    assert!(most.0 <= 1.02, "{}", most.1);
}

/// Protects: closed forms of white balls. Smooth white balls, opaque, clear, half clear or half
/// metal, return all light once paths are long enough, so they are invisible under a white sky.
#[test]
fn white_balls_are_not_seen() {
    for (name, made) in [
        MATERIALS[0],
        MATERIALS[1],
        MATERIALS[2],
        MATERIALS[4],
        MATERIALS[5],
    ] {
        let mean = mean(
            BALL,
            &format!(r#"{made}, "roughness": 0"#),
            30.0,
            Integrator::Path,
            256,
        );
        assert!((mean - 1.0).abs() < 0.01, "{name}: {mean}");
    }
}

/// Protects: in Whitted's integrator too, a partly clear body grows no brighter with the depth.
#[test]
fn furnaces_of_whitted_do_not_glow() {
    // In a block, light reaches sides beyond the critical angle.
    for depth in [2, 4, 8, 16] {
        let mean = mean(
            BLOCK,
            r#", "transmission": 0.5, "roughness": 0"#,
            30.0,
            Integrator::Whitted,
            depth,
        );
        assert!(mean <= 1.0, "depth {depth}: {mean}");
    }
}
