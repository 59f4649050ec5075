//! Layered surfaces in pictures against closed forms, and as effects: detected, absent by a factor
//! of zero, switched off, and without cost if absent.

use raywright_core::effects::EffectStatus::{self, Absent, LeftOut, Simulated};
use raywright_core::effects::{Effect, EffectSet, assess_effects};
use raywright_core::material::FresnelRule;
use raywright_core::scene::{Integrator, Scene};
use raywright_core::{Settings, prepare};
use serde_json::{Value, json};

use crate::paths::{expect_pixels, lamp, mean_radiance, paths};
use crate::support::{EyeAndTarget, ball, floor, physical, render_scene, scene, settings};

/// A wide pane of a physical material at height 1, over a lamp below.
fn pane(terms: Value, rest: Value) -> Scene {
    let quad = |height: f64, material: &str| json!({ "shape": { "quad": { "corner": [-9, height, -9], "edge_u": [18, 0, 0], "edge_v": [0, 0, 18] } }, "material": material });
    let mut parts = json!({ "materials": [{ "name": "pane", "model": physical(terms) }, lamp(3.0)], "objects": [quad(1.0, "pane"), quad(0.0, "lamp")] });
    rest.as_object()
        .into_iter()
        .flatten()
        .for_each(|(key, value)| parts[key] = value.clone());
    scene(parts)
}

const DOWN: EyeAndTarget = [[0.1, 3.0, 0.2], [0.1, 1.0, 0.2]];
/// A view onto the pane at 60° from the normal.
const ASLANT: EyeAndTarget = [[1.732_050_807_568_877_2, 2.0, 0.0], [0.0, 1.0, 0.0]];

/// Fresnel's reflectance of a dielectric of index n at a cosine of incidence.
fn fresnel(cosine: f64, n: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / (n * n)).sqrt();
    let across = (cosine - n * inside) / (cosine + n * inside);
    let along = (n * cosine - inside) / (n * cosine + inside);
    0.5 * (across * across + along * along)
}

/// Protects: a thin wall transmits (1 − R)/(1 + R) times its colour, head-on and slanted, without
/// refraction, and conserves the energy of a uniform sky, smooth or rough, from either side.
#[test]
fn thin_walls() {
    let wall = |terms: Value| {
        let mut all = json!({ "transmission": 1, "roughness": 0, "ior": 1.5, "thin_walled": true });
        terms
            .as_object()
            .into_iter()
            .flatten()
            .for_each(|(key, value)| all[key] = value.clone());
        all
    };
    for (view, cosine) in [(DOWN, 1.0), (ASLANT, 0.5)] {
        let r = fresnel(cosine, 1.5);
        let through = 3.0 * (1.0 - r) / (1.0 + r);
        expect_pixels(
            &pane(wall(json!({ "base_colour": [1, 0.5, 0.25] })), json!({})),
            view,
            4,
            [through, through / 2.0, through / 4.0],
            "a tinted pane",
        );
    }
    let sky = json!({ "sky": { "constant": 1 } });
    for (eye, label) in [
        ([0.3, 4.0, 0.4], "from above"),
        ([0.3, 0.5, 0.4], "from below"),
    ] {
        let bubble = scene(
            json!({ "sky": { "constant": 1 }, "materials": [{ "name": "b", "model": physical(wall(json!({}))) }], "objects": [ball([0.0, 0.0, 0.0], 1.0, "b")] }),
        );
        expect_pixels(&bubble, [eye, [0.1, 0.0, 0.0]], 64, [1.0; 3], label);
    }
    // A channel that a pane absorbs passes through none of its microfacets, with any multiple
    // scattering.
    for roughness in [0.0, 0.5, 1.0] {
        let yellow = pane(
            wall(json!({ "base_colour": [1, 1, 0], "roughness": roughness })),
            json!({}),
        );
        let ([red, _, blue], _) = mean_radiance(&yellow, &paths(&yellow, DOWN, 4));
        assert!(
            red > 1.0 && blue == 0.0,
            "roughness {roughness}: {red} {blue}"
        );
    }
    // Multiple scattering among rough microfacets returns the lost light.
    for roughness in [0.5, 0.9, 1.0] {
        let rough = pane(
            wall(json!({ "roughness": roughness })),
            json!({ "objects": [{ "shape": { "plane": { "point": [0, 1, 0], "normal": [0, 1, 0] } }, "material": "pane" }], "sky": sky["sky"] }),
        );
        let (found, error) = mean_radiance(&rough, &paths(&rough, DOWN, 8));
        assert!(
            (found[0] - 1.0).abs() <= 3.5 * error[0] + 5e-3,
            "roughness {roughness}: {found:?} ± {error:?}"
        );
    }
    // Objects behind a pane are not displaced: a small lamp straight behind the pane, slanted.
    let mut behind = pane(wall(json!({})), json!({}));
    behind.objects.truncate(1);
    behind.objects.push(
        serde_json::from_value(ball([-1.732_050_8, 0.0, 0.0], 0.01, "lamp")).expect("an object"),
    );
    let r = fresnel(0.5, 1.5);
    expect_pixels(
        &behind,
        ASLANT,
        4,
        [3.0 * (1.0 - r) / (1.0 + r); 3],
        "a lamp straight behind",
    );
}

/// Protects: a leaf of share f and colour c under a uniform sky reflects (1 − f)·albedo and
/// transmits f·c; over a lamp it transmits its share alone.
#[test]
fn leaves() {
    let leaf = json!({ "base_colour": [0.5, 0.8, 0.2], "specular": 0, "diffuse_transmission": { "factor": 0.25, "colour": [0.9, 0.4, 1] } });
    let even = pane(
        leaf.clone(),
        json!({ "sky": { "constant": 1 }, "objects": [{ "shape": { "plane": { "point": [0, 1, 0], "normal": [0, 1, 0] } }, "material": "pane" }] }),
    );
    expect_pixels(
        &even,
        DOWN,
        2,
        [0.375 + 0.225, 0.6 + 0.1, 0.15 + 0.25],
        "a leaf under an even sky",
    );
    // The lamp below is so wide that it fills the lower hemisphere but for its edges.
    let lit = pane(
        leaf,
        json!({ "objects": [{ "shape": { "plane": { "point": [0, 1, 0], "normal": [0, 1, 0] } }, "material": "pane" },
        { "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "lamp" }] }),
    );
    let (found, error) = mean_radiance(&lit, &paths(&lit, DOWN, 2));
    for (k, expected) in [0.675, 0.3, 0.75].into_iter().enumerate() {
        assert!(
            (found[k] - expected).abs() <= 3.0 * error[k] + 2e-3,
            "{found:?} ± {error:?}"
        );
    }
}

/// Protects: dispersion refracts blue more than red, with each channel between the extremes of
/// Snell's law by hand, and green as at the d line; without dispersion all channels are alike.
#[test]
fn glass_disperses() {
    let terms = |dispersion: f64| json!({ "transmission": 1, "roughness": 0, "ior": 1.6, "dispersion": dispersion });
    // A half-space of glass; the sky encodes how far the refracted ray goes sideways, and reflected
    // rays see zero.
    let scene = |dispersion: f64| {
        floor(
            physical(terms(dispersion)),
            json!({ "sky": { "expression": "clamp(-1e9*d.y, 0, 1)*abs(d.x)" } }),
        )
    };
    let actual = |n: f64| (1.0 - fresnel(0.5, n)) * 0.75_f64.sqrt() / n;
    let view: EyeAndTarget = [[1.732_050_807_568_877_2, 1.0, 0.0], [0.0, 0.0, 0.0]];
    let value_of =
        |dispersion: f64| mean_radiance(&scene(dispersion), &paths(&scene(dispersion), view, 2));
    let (plain, error) = value_of(0.0);
    assert!(
        (0..3).all(|k| (plain[k] - actual(1.6)).abs() <= 3.0 * error[k] + 1e-5),
        "{plain:?} ± {error:?}"
    );
    let ([red, green, blue], error) = value_of(10.0);
    // Cauchy's n(λ) = A + B/λ² with n_d = 1.6 and (n_d − 1)/(n_F − n_C) = 2, in μm.
    let per = |wavelength: f64| 1.0 / (wavelength * wavelength);
    let index = |wavelength: f64| {
        1.6 + 0.6 * 10.0 / 20.0 * (per(wavelength) - per(0.58756)) / (per(0.48613) - per(0.65627))
    };
    let (minimum, maximum) = (
        actual(index(0.73)).min(actual(index(0.38))),
        actual(index(0.73)).max(actual(index(0.38))),
    );
    for found in [red, green, blue] {
        assert!(
            (minimum..=maximum).contains(&found),
            "{found} is not from {minimum} to {maximum}"
        );
    }
    let noise = 5.0 * error.into_iter().fold(0.0, f64::max);
    assert!(
        blue < green - noise && green < red - noise,
        "{red} {green} {blue} ± {error:?}"
    );
    let narrow = |wavelength: f64| actual(index(wavelength));
    assert!(
        (red - narrow(0.61)).abs() < 0.015 + noise && (blue - narrow(0.45)).abs() < 0.02 + noise,
        "{red} {blue}"
    );
}

/// Each layer in a file's form, with its effect, and the form that disables it.
fn each() -> Vec<(&'static str, Value, Value)> {
    vec![
        (
            "clearcoat",
            json!({ "clearcoat": { "factor": 1 } }),
            json!({ "clearcoat": { "factor": 0 } }),
        ),
        (
            "sheen",
            json!({ "sheen": { "colour": 0.5 } }),
            json!({ "sheen": { "colour": 0 } }),
        ),
        (
            "anisotropy",
            json!({ "roughness": 0.3, "anisotropy": { "strength": 0.5 } }),
            json!({ "roughness": 0.3, "anisotropy": { "strength": 0 } }),
        ),
        (
            "iridescence",
            json!({ "iridescence": { "thickness": 400 } }),
            json!({ "iridescence": { "factor": 0 } }),
        ),
        (
            "diffuse transmission",
            json!({ "diffuse_transmission": { "factor": 0.5 } }),
            json!({ "diffuse_transmission": { "factor": 0 } }),
        ),
        (
            "tinted reflection",
            json!({ "specular": 0.5 }),
            json!({ "specular": 1 }),
        ),
        (
            "tinted reflection",
            json!({ "specular_colour": [1, 0.5, 0.2] }),
            json!({ "specular_colour": 1 }),
        ),
        (
            "conductors",
            json!({ "metallic": 1, "conductor": { "n": 0.2, "k": 3 } }),
            json!({ "metallic": 0, "conductor": { "n": 0.2, "k": 3 } }),
        ),
        (
            "dispersion",
            json!({ "transmission": 1, "roughness": 0, "dispersion": 1 }),
            json!({ "transmission": 1, "roughness": 0, "dispersion": 0 }),
        ),
        (
            "thin walls",
            json!({ "transmission": 1, "roughness": 0, "thin_walled": true }),
            json!({ "transmission": 0, "thin_walled": true }),
        ),
    ]
}

fn ball_of(terms: &Value) -> Scene {
    scene(
        json!({ "sky": { "gradient": { "bottom": 0.2, "top": [0.5, 0.7, 1] } }, "objects": [ball([0.0; 3], 1.0, "m")],
        "materials": [{ "name": "m", "model": physical(terms.clone()) }] }),
    )
}

/// Protects: each layer is detected and selects path tracing, is left out with a hint in Whitted's
/// integrator (except thin walls), and absent by a factor of zero, to the bit and with an empty
/// table; switched off, the picture equals that without it.
#[test]
fn layers_are_effects() {
    for (name, terms, nothing) in each() {
        let effect = Effect::from_name(name).unwrap_or_else(|| panic!("{name}"));
        let status = |scene: &Scene, integrator: Integrator, without: EffectSet| -> EffectStatus {
            assess_effects(
                scene,
                &Settings {
                    integrator,
                    without,
                    ..Settings::from_scene(scene)
                },
            )
            .status(effect)
        };
        let (with, none) = (ball_of(&terms), ball_of(&nothing));
        assert_eq!(
            status(&with, Integrator::Path, EffectSet::EMPTY),
            Simulated,
            "{name}"
        );
        assert_eq!(
            status(&none, Integrator::Path, EffectSet::EMPTY),
            Absent,
            "{name}"
        );
        let whitted = if name == "thin walls" {
            Simulated
        } else {
            LeftOut
        };
        assert_eq!(
            status(&with, Integrator::Whitted, EffectSet::EMPTY),
            whitted,
            "{name}"
        );
        let auto = assess_effects(&with, &Settings::from_scene(&with)).integrator;
        assert_eq!(
            auto,
            if name == "thin walls" {
                "whitted"
            } else {
                "path"
            },
            "{name}"
        );
        let off = EffectSet::from_effects(&[effect]);
        assert_eq!(status(&with, Integrator::Path, off), LeftOut, "{name}");
        let view: EyeAndTarget = [[0.5, 1.0, 4.0], [0.0; 3]];
        let value_of = |scene: &Scene, without: EffectSet| Settings {
            integrator: Integrator::Path,
            sampling: raywright_core::settings::Sampling::General(4),
            size: [12, 12],
            max_depth: 8,
            without,
            ..settings(scene, view)
        };
        let picture = |scene: &Scene, without: EffectSet| {
            render_scene(scene, &value_of(scene, without)).picture.rgb
        };
        let tables = |scene: &Scene| {
            prepare(scene, &value_of(scene, EffectSet::EMPTY), &())
                .expect("it can be prepared")
                .table_sizes()
                .layered
        };
        // A factor alone belongs to the model without layers.
        let layered = usize::from(terms != json!({ "specular": 0.5 }));
        assert_eq!((tables(&with), tables(&none)), (layered, 0), "{name}");
        let mut bare = terms.clone();
        let layer = [
            "clearcoat",
            "sheen",
            "anisotropy",
            "iridescence",
            "diffuse_transmission",
            "specular",
            "specular_colour",
            "conductor",
            "dispersion",
            "thin_walled",
        ];
        bare.as_object_mut()
            .expect("a table")
            .retain(|key, _| !layer.contains(&key.as_str()));
        assert_eq!(
            picture(&with, off),
            picture(&ball_of(&bare), EffectSet::EMPTY),
            "{name} switched off"
        );
        assert_ne!(
            picture(&with, EffectSet::EMPTY),
            picture(&with, off),
            "{name} changes the picture"
        );
    }
}

/// Protects: layers give the same picture in every precision and for every tree.
#[test]
fn layers_in_every_precision() {
    use raywright_core::settings::{PrecisionChoice, Sampling};
    let everything = json!({ "base_colour": [0.6, 0.3, 0.2], "roughness": 0.4, "metallic": 0.3, "clearcoat": { "roughness": 0.1 },
        "sheen": { "colour": 0.3 }, "anisotropy": { "strength": 0.6, "rotation": 30 }, "iridescence": { "thickness": "300 + 100*p.y" } });
    let scene = ball_of(&everything);
    let view: EyeAndTarget = [[0.5, 1.0, 4.0], [0.0; 3]];
    let actual = |precision: PrecisionChoice| {
        let settings = Settings {
            integrator: Integrator::Path,
            sampling: Sampling::General(64),
            size: [16, 16],
            precision,
            max_depth: 3,
            ..settings(&scene, view)
        };
        let picture = render_scene(&scene, &settings).picture.rgb;
        let count = picture.len() as f64;
        [0, 1, 2].map(|k| picture.iter().map(|pixel| f64::from(pixel[k])).sum::<f64>() / count)
    };
    let [robust, reference] = [PrecisionChoice::Robust, PrecisionChoice::Reference].map(actual);
    for k in 0..3 {
        assert!(
            (robust[k] / reference[k] - 1.0).abs() < 2e-3,
            "{robust:?} {reference:?}"
        );
    }
}

/// Protects: an index of 0 reflects all light at every angle, under every rule, unless `specular`
/// or its colour reduce it: a black base then adds nothing, a white base the rest. It transmits
/// nothing, whatever the transmission.
#[test]
fn an_index_of_zero_reflects_all() {
    let sky = json!({ "sky": { "constant": 1 } });
    for fresnel in FresnelRule::ALL {
        let sees = |terms: Value, view: EyeAndTarget, expected: f64, label: &str| {
            let mut all = json!({ "ior": 0, "base_colour": 0 });
            terms
                .as_object()
                .into_iter()
                .flatten()
                .for_each(|(key, value)| all[key] = value.clone());
            let floor = floor(physical(all), sky.clone());
            let (found, error) = mean_radiance(
                &floor,
                &Settings {
                    fresnel,
                    ..paths(&floor, view, 8)
                },
            );
            let off = (0..3)
                .map(|k| (found[k] - expected).abs() - 3.5 * error[k])
                .fold(0.0, f64::max);
            assert!(
                off <= 4e-3,
                "{label}, {fresnel:?}: {found:?} ± {error:?}, not {expected}"
            );
        };
        for (view, name) in [(DOWN, "head-on"), (ASLANT, "aslant")] {
            for roughness in [0.0, 0.4, 1.0] {
                let label = format!("{name}, roughness {roughness}");
                sees(json!({ "roughness": roughness }), view, 1.0, &label);
                sees(
                    json!({ "roughness": roughness, "transmission": 1, "thin_walled": true }),
                    view,
                    1.0,
                    &format!("{label}, wall"),
                );
                sees(
                    json!({ "roughness": roughness, "transmission": 1, "base_colour": 1 }),
                    view,
                    1.0,
                    &format!("{label}, body"),
                );
            }
            sees(
                json!({ "roughness": 0, "specular": 0.5 }),
                view,
                0.5,
                &format!("half, {name}"),
            );
        }
        sees(
            json!({ "roughness": 0, "specular_colour": 0.5 }),
            DOWN,
            0.5,
            "a colour of half",
        );
        sees(
            json!({ "roughness": 0, "specular": 0.25, "base_colour": 1 }),
            DOWN,
            1.0,
            "a quarter over white",
        );
    }
}

/// Share of emission that crosses a coat at a cosine: 1 − factor·(0.04 + 0.96·(1 − cos)⁵), as in
/// KHR_materials_clearcoat.
fn crosses(factor: f64, cosine: f64) -> f64 {
    1.0 - factor * (0.04 + 0.96 * (1.0 - cosine).powi(5))
}

/// A black coated surface that emits.
fn coated_lamp(radiance: f64, factor: f64, roughness: f64) -> Value {
    physical(
        json!({ "base_colour": 0, "specular": 0, "emission": radiance,
        "clearcoat": { "factor": factor, "roughness": roughness } }),
    )
}

/// Protects: a coat dims the emission below it by what it reflects towards the viewer, whole and in
/// part, smooth and rough, from both sides of the surface, and by Fresnel's equations under
/// `exact`; fibres dim no emission. The coat once left all of it.
#[test]
fn coats_dim_the_emission_below() {
    for degrees in [0.0_f64, 60.0, 75.0, 85.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        for (factor, roughness) in [(1.0, 0.0), (0.8, 0.0), (1.0, 0.6), (0.0, 0.0)] {
            for side in [1.0, -1.0] {
                let scene = floor(coated_lamp(2.0, factor, roughness), json!({}));
                let view = [[3.0 * sine, 3.0 * side * cosine, 0.0], [0.0; 3]];
                expect_pixels(
                    &scene,
                    view,
                    2,
                    [2.0 * crosses(factor, cosine); 3],
                    &format!("factor {factor}, roughness {roughness} at {degrees}°"),
                );
            }
        }
        let scene = floor(coated_lamp(2.0, 1.0, 0.0), json!({}));
        let view = [[3.0 * sine, 3.0 * cosine, 0.0], [0.0; 3]];
        let settings = Settings {
            fresnel: FresnelRule::Exact,
            ..paths(&scene, view, 2)
        };
        let expected = 2.0 * (1.0 - fresnel(cosine, 1.5));
        let (found, _) = mean_radiance(&scene, &settings);
        assert!(
            (found[0] - expected).abs() < 1e-4,
            "{found:?}, not {expected}"
        );
        let velvet = json!({ "base_colour": 0, "specular": 0, "emission": 2, "sheen": {} });
        expect_pixels(
            &floor(physical(velvet), json!({})),
            view,
            2,
            [2.0; 3],
            "velvet",
        );
    }
}

/// Protects: light of a coated lamp is the same by samples of lamps, by scattered rays and by both:
/// the sum over the lamp, a quad or a mesh, of what crosses its coat.
#[test]
fn coated_lamps_shine_alike_by_every_strategy() {
    const CELLS: usize = 200;
    let at = |i: usize| (i as f64 + 0.5) / CELLS as f64 * 4.0 - 2.0;
    let mut expected = 0.0;
    for (x, z) in (0..CELLS * CELLS).map(|i| (at(i % CELLS), at(i / CELLS))) {
        let square = x * x + z * z + 0.25;
        let cosine = 0.5 / square.sqrt();
        expected += crosses(1.0, cosine) * cosine * cosine / square;
    }
    expected *= 3.0 * 0.8 / core::f64::consts::PI * (4.0 / CELLS as f64).powi(2);
    let quad =
        json!({ "quad": { "corner": [-2, 0.5, -2], "edge_u": [4, 0, 0], "edge_v": [0, 0, 4] } });
    let mesh = json!({ "name": "m", "source": { "inline": {
        "positions": [[-2, 0.5, -2], [2, 0.5, -2], [2, 0.5, 2], [-2, 0.5, 2]],
        "indices": [[0, 1, 2], [0, 2, 3]] } } });
    for (label, shape, meshes) in [
        ("quad", quad, json!([])),
        ("mesh", json!({ "mesh": "m" }), json!([mesh])),
    ] {
        let scene = floor(
            physical(json!({ "base_colour": 0.8, "specular": 0 })),
            json!({ "materials": [{ "name": "lamp", "model": coated_lamp(3.0, 1.0, 0.0) }],
                "objects": [{ "shape": shape, "material": "lamp" }], "meshes": meshes }),
        );
        expect_pixels(&scene, crate::paths::AT, 2, [expected; 3], label);
    }
}
