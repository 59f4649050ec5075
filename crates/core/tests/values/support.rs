//! Helpers from the parts of a scene to the radiance of one ray, in every precision.

use core::f64::consts::PI;

use glam::DVec3;
use raywright_core::material::MetallicRoughness;
use raywright_core::scene::{Camera, Integrator, Pinhole, Pose, Projection, SamplePattern, Scene};
use raywright_core::settings::{PrecisionChoice, Sampling};
use raywright_core::{RenderOutput, Settings, prepare, validate};
use serde_json::{Value, json};

/// An eye and its target.
pub type EyeAndTarget = [[f64; 3]; 2];

/// A view straight down onto the origin.
pub const DOWN: EyeAndTarget = [[0.0, 2.0, 0.0], [0.0; 3]];
/// A view onto the origin along (−0.6, −0.8, 0): on a floor n·v = 0.8, and the mirror direction is
/// (−0.6, 0.8, 0).
pub const SLANTED: EyeAndTarget = [[3.0, 4.0, 0.0], [0.0; 3]];
/// A view onto the origin from below along (−0.6, 0.8, 0).
pub const FROM_BELOW: EyeAndTarget = [[3.0, -4.0, 0.0], [0.0; 3]];

/// Each precision, with the relative tolerance for a value of a few operations.
pub const PRECISIONS: [(PrecisionChoice, f64); 2] = [
    (PrecisionChoice::Reference, 2e-7),
    (PrecisionChoice::Robust, 1e-5),
];

/// A valid scene of these parts.
#[track_caller]
pub fn scene(mut parts: Value) -> Scene {
    parts["format"] = json!(1);
    let scene = serde_json::from_value(parts).unwrap_or_else(|e| panic!("{e}"));
    let problems = validate::validate(&scene);
    assert!(problems.is_empty(), "{problems:?}");
    scene
}

/// A floor at height 0 of one material, `model`, and further parts; their objects and materials
/// come after the floor's.
#[track_caller]
pub fn floor(model: Value, mut parts: Value) -> Scene {
    let plane = json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "floor" });
    prepend(&mut parts, "objects", plane);
    prepend(
        &mut parts,
        "materials",
        json!({ "name": "floor", "model": model }),
    );
    scene(parts)
}

fn prepend(parts: &mut Value, key: &str, first: Value) {
    let rest = parts
        .get(key)
        .and_then(Value::as_array)
        .cloned()
        .unwrap_or_default();
    parts[key] = [vec![first], rest].concat().into();
}

/// A classic material.
pub fn classic(terms: Value) -> Value {
    json!({ "classic": terms })
}

/// A physical material.
pub fn physical(terms: Value) -> Value {
    json!({ "physical": terms })
}

/// A white directional light.
pub fn sun(to_light: [f64; 3]) -> Value {
    json!({ "kind": { "directional": { "to_light": to_light } }, "colour": 1 })
}

/// A ball.
pub fn ball(centre: [f64; 3], radius: f64, material: &str) -> Value {
    json!({ "shape": { "sphere": { "centre": centre, "radius": radius } }, "material": material })
}

/// A metallic-roughness surface, evaluated by its lobes alone, which other tests check against
/// closed forms and furnaces. It gives the expected result of an integrator for a base colour,
/// metalness, roughness and reflectance at normal incidence.
pub struct Surface {
    pub base: [f64; 3],
    pub metallic: f64,
    pub roughness: f64,
    pub f0: f64,
}

impl Surface {
    /// A grey dielectric.
    pub fn dielectric(base: f64, roughness: f64, f0: f64) -> Self {
        Self {
            base: [base; 3],
            metallic: 0.0,
            roughness,
            f0,
        }
    }

    /// π times its reflection of light from `l` towards `v`, including the cosine; optionally
    /// without highlights.
    pub fn sends(&self, [normal, l, v]: [DVec3; 3], highlights: bool) -> [f64; 3] {
        let &Self {
            base,
            metallic,
            roughness,
            f0,
        } = self;
        let model = MetallicRoughness::<f64> {
            base: base.into(),
            metallic,
            roughness,
            dielectric: f0,
            grazing: 1.0,
            glass: None,
        };
        let lobes = model.local_bsdf(normal, v);
        let value = if highlights {
            lobes.eval(v, l)
        } else {
            lobes.eval_diffuse(v, l)
        };
        (value * (PI * normal.dot(l).max(0.0))).to_array()
    }
}

/// Settings for one ray, with Whitted's integrator if the scene names none: its results for
/// physical materials have closed forms.
pub fn settings(scene: &Scene, [eye, target]: EyeAndTarget) -> Settings {
    let upright = (eye[0] - target[0]).abs() + (eye[2] - target[2]).abs() > 1e-9;
    let up = if upright {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, -1.0]
    };
    let pinhole = Pinhole {
        vertical_fov: Some(40.0),
        ..Pinhole::default()
    };
    let pose = Pose::LookAt { eye, target, up };
    let camera = Camera {
        name: String::new(),
        pose,
        projection: Projection::Pinhole(pinhole),
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    };
    Settings {
        size: [1, 1],
        camera: Some(camera),
        sampling: Sampling::Pattern(SamplePattern::Centre),
        precision: PrecisionChoice::Reference,
        integrator: match scene.render.integrator {
            Integrator::Auto => Integrator::Whitted,
            requested => requested,
        },
        ..Settings::from_scene(scene)
    }
}

/// Renders the scene with these settings.
#[track_caller]
pub fn render_scene(scene: &Scene, settings: &Settings) -> RenderOutput {
    prepare(scene, settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
}

/// Colour of the first pixel.
#[track_caller]
pub fn pixel(scene: &Scene, settings: &Settings) -> [f64; 3] {
    render_scene(scene, settings).picture.rgb[0].map(f64::from)
}

/// Asserts the ray's radiance in every precision.
#[track_caller]
pub fn expect_pixel(scene: &Scene, view: EyeAndTarget, expected: [f64; 3]) {
    expect_pixel_within(scene, view, expected, 0.0);
}

/// Asserts the ray's radiance in every precision, within a relative error.
#[track_caller]
pub fn expect_pixel_within(scene: &Scene, view: EyeAndTarget, expected: [f64; 3], error: f64) {
    for (precision, tolerance) in PRECISIONS {
        let found = pixel(
            scene,
            &Settings {
                precision,
                ..settings(scene, view)
            },
        );
        expect_near(
            found,
            expected,
            tolerance + error,
            &format!("{precision:?}"),
        );
    }
}

/// Asserts that numbers agree within a relative error, absolute below one.
#[track_caller]
pub fn expect_near(found: [f64; 3], expected: [f64; 3], tolerance: f64, label: &str) {
    let close = |a: f64, b: f64| (a - b).abs() <= tolerance * b.abs().max(1.0);
    assert!(
        found.iter().zip(expected).all(|(&a, b)| close(a, b)),
        "{label}: {found:?} instead of {expected:?}"
    );
}
