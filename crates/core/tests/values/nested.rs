//! Nested dielectrics: the effective medium of overlapping bodies, refraction at boundaries between
//! two, and transmission of sampled lights through thin walls. By Fresnel's and Snell's formulas
//! and lengths by hand.

use core::f64::consts::PI;

use raywright_core::Settings;
use raywright_core::bvh::AcceleratorKind;
use raywright_core::scene::Scene;
use raywright_core::settings::{LightSampling, PrecisionChoice};
use serde_json::{Value, json};

use crate::paths::{AT, expect_pixels, lamp, mean_radiance, paths};
use crate::support::{EyeAndTarget, ball, classic, floor, physical, render_scene, scene};

/// A view straight down through all objects.
const DOWN: EyeAndTarget = [[0.3, 5.0, 0.2], [0.3, 0.0, 0.2]];

/// Glass of an index and a priority, with further terms.
fn glass(name: &str, ior: f64, priority: u32, terms: Value) -> Value {
    let mut model = json!({ "transmission": 1, "roughness": 0, "ior": ior, "priority": priority });
    terms
        .as_object()
        .into_iter()
        .flatten()
        .for_each(|(key, value)| model[key] = value.clone());
    json!({ "name": name, "model": physical(model) })
}

fn slab(from: f64, to: f64, material: &str) -> Value {
    json!({ "shape": { "box": { "min": [-9, from, -9], "max": [9, to, 9] } }, "material": material })
}

/// A lamp below everything, of radiance 3.
fn plate(height: f64) -> Value {
    json!({ "shape": { "quad": { "corner": [-9, height, -9], "edge_u": [18, 0, 0], "edge_v": [0, 0, 18] } }, "material": "lamp" })
}

/// Slabs over a lamp of radiance 3.
fn stack(materials: &[Value], slabs: &[Value]) -> Scene {
    let mut all = vec![lamp(3.0)];
    all.extend_from_slice(materials);
    let mut objects = vec![plate(-1.0)];
    objects.extend_from_slice(slabs);
    scene(json!({ "materials": all, "objects": objects }))
}

/// Transmittance of a boundary from index a to b at normal incidence.
fn border_transmittance(a: f64, b: f64) -> f64 {
    1.0 - ((a - b) / (a + b)).powi(2)
}

/// Unpolarised reflectance of a boundary at an angle of incidence (Fresnel).
fn fresnel(cosine: f64, a: f64, b: f64) -> f64 {
    let sine = (1.0 - cosine * cosine).sqrt() * a / b;
    if sine >= 1.0 {
        return 1.0;
    }
    let other = (1.0 - sine * sine).sqrt();
    let s = (a * cosine - b * other) / (a * cosine + b * other);
    let p = (a * other - b * cosine) / (a * other + b * cosine);
    0.5 * (s * s + p * p)
}

/// Protects: where liquid reaches into glass, each real boundary refracts by the ratio of the media
/// on both sides, the hidden one does nothing and takes no segment, and each metre is absorbed by
/// the effective medium, whichever of the two has the greater priority and whichever comes first in
/// the file.
#[test]
fn liquid_in_glass() {
    let tint =
        |colour: [f64; 3]| json!({ "attenuation_colour": colour, "attenuation_distance": 1 });
    let (red, blue) = ([0.8, 0.4, 0.3], [0.3, 0.5, 0.9]);
    for (of_glass, of_liquid, glass_ends) in [(2, 1, 1.0), (1, 2, 0.9)] {
        let materials = [
            glass("glass", 1.5, of_glass, tint(red)),
            glass("liquid", 1.33, of_liquid, tint(blue)),
        ];
        let mut slabs = [slab(0.0, 1.0, "glass"), slab(0.9, 2.0, "liquid")];
        let through = border_transmittance(1.0, 1.33)
            * border_transmittance(1.33, 1.5)
            * border_transmittance(1.5, 1.0);
        let expected =
            |k: usize| 3.0 * through * red[k].powf(glass_ends) * blue[k].powf(2.0 - glass_ends);
        for _ in 0..2 {
            let found = stack(&materials, &slabs);
            expect_pixels(
                &found,
                DOWN,
                4,
                [0, 1, 2].map(expected),
                &format!("priorities {of_glass} and {of_liquid}"),
            );
            // One segment fewer does not reach the lamp.
            expect_pixels(&found, DOWN, 3, [0.0; 3], "too few segments");
            slabs.reverse();
        }
    }
}

/// Protects: a camera inside two bodies at once, inside one of them, and inside three detects them.
#[test]
fn a_camera_in_bodies() {
    let tint =
        |colour: [f64; 3]| json!({ "attenuation_colour": colour, "attenuation_distance": 1 });
    let (red, blue, green) = ([0.8, 0.4, 0.3], [0.3, 0.5, 0.9], [0.5, 0.9, 0.4]);
    let materials = [
        glass("glass", 1.5, 2, tint(red)),
        glass("liquid", 1.33, 1, tint(blue)),
        glass("ice", 1.31, 3, tint(green)),
    ];
    let down = |y: f64| -> EyeAndTarget { [[0.3, y, 0.2], [0.3, -5.0, 0.2]] };
    let both = stack(
        &materials[..2],
        &[slab(0.0, 1.0, "glass"), slab(0.9, 2.0, "liquid")],
    );
    let left = |lengths: [f64; 3], through: f64| {
        core::array::from_fn(|k| {
            3.0 * through
                * red[k].powf(lengths[0])
                * blue[k].powf(lengths[1])
                * green[k].powf(lengths[2])
        })
    };
    expect_pixels(
        &both,
        down(0.95),
        2,
        left([0.95, 0.0, 0.0], border_transmittance(1.5, 1.0)),
        "in both",
    );
    expect_pixels(
        &both,
        down(1.6),
        3,
        left(
            [1.0, 0.6, 0.0],
            border_transmittance(1.33, 1.5) * border_transmittance(1.5, 1.0),
        ),
        "in the liquid",
    );
    let slabs = [
        slab(0.0, 3.0, "glass"),
        slab(-0.5, 4.0, "liquid"),
        slab(1.0, 5.0, "ice"),
    ];
    let three = stack(&materials, &slabs);
    let through = border_transmittance(1.31, 1.5)
        * border_transmittance(1.5, 1.33)
        * border_transmittance(1.33, 1.0);
    expect_pixels(
        &three,
        down(2.0),
        4,
        left([1.0, 0.5, 1.0], through),
        "in three",
    );
}

/// Protects: glass whose surface is absent by alpha neither absorbs nor hides another body, with the
/// camera before it and inside it, alone and around a slab of ice.
#[test]
fn absent_bodies_do_nothing() {
    for alpha in [json!("blend"), json!({ "mask": { "cutoff": 0.5 } })] {
        let ghost = json!({ "opacity": 0, "alpha": alpha, "attenuation_colour": [0.8, 0.4, 0.3], "attenuation_distance": 1 });
        let materials = [
            glass("ghost", 1.5, 2, ghost),
            glass("ice", 1.31, 1, json!({})),
        ];
        let slabs = [slab(0.0, 3.0, "ghost"), slab(1.0, 2.0, "ice")];
        let through = border_transmittance(1.0, 1.31).powi(2);
        for (slabs, depth, expected) in [(&slabs[..1], 1, 3.0), (&slabs, 3, 3.0 * through)] {
            for height in [2.5, 4.0] {
                expect_pixels(
                    &stack(&materials, slabs),
                    [[0.3, height, 0.2], [0.3, -5.0, 0.2]],
                    depth,
                    [expected; 3],
                    &format!("{alpha}, {} bodies from {height}", slabs.len()),
                );
            }
        }
    }
}

/// Protects: a boundary between bodies of equal index reflects nothing at any angle, even where air
/// would cause total reflection; between two indices it has the Fresnel reflectance of their ratio;
/// a plastic in liquid reflects by its index over the liquid's.
#[test]
fn slanted_boundaries() {
    // A view in the liquid above y = 0, towards glass below it with a lamp inside, at this angle to
    // the normal.
    let view = |cosine: f64| -> EyeAndTarget {
        let sine = (1.0 - cosine * cosine).sqrt();
        [[0.0, 1.0, 0.0], [sine / cosine, 0.0, 0.0]]
    };
    for (liquid, solid) in [(1.5, 1.5), (1.33, 1.5), (1.6, 1.4), (1.0, 1.5)] {
        for cosine in [0.9, 0.6, 0.4] {
            let materials = [
                lamp(3.0),
                glass("liquid", liquid, 1, json!({})),
                glass("glass", solid, 2, json!({})),
            ];
            let slabs = [
                slab(-0.1, 20.0, "liquid"),
                slab(-5.0, 0.0, "glass"),
                plate(-1.0),
            ];
            let scene = scene(json!({ "materials": materials, "objects": slabs }));
            let expected = 3.0 * (1.0 - fresnel(cosine, liquid, solid));
            expect_pixels(
                &scene,
                view(cosine),
                2,
                [expected; 3],
                &format!("{liquid} to {solid} at {cosine}"),
            );
        }
    }
}

/// Protects: a single body has the same bits with a priority as without, and overlapping bodies
/// have the same bits by scan and tree.
#[test]
fn the_same_bits() {
    let alone = |priority: u32, terms: Value| {
        let parts = json!({ "sky": { "gradient": { "bottom": 0.2, "top": [0.5, 0.7, 1] } }, "objects": [ball([0.0; 3], 1.0, "glass")],
            "materials": [glass("glass", 1.45, priority, terms)] });
        scene(parts)
    };
    let view: EyeAndTarget = [[0.2, 0.5, 4.0], [0.1, 0.3, 0.0]];
    let wide = |scene: &Scene, depth: u32| {
        let mut settings = paths(scene, view, depth);
        settings.camera = crate::support::settings(scene, view).camera;
        settings
    };
    for terms in [
        json!({}),
        json!({ "roughness": 0.4 }),
        json!({ "dispersion": 2, "attenuation_colour": 0.4, "attenuation_distance": 1 }),
    ] {
        for precision in [PrecisionChoice::Robust, PrecisionChoice::Reference] {
            let value_of = |scene: &Scene| {
                render_scene(
                    scene,
                    &Settings {
                        precision,
                        ..wide(scene, 8)
                    },
                )
                .picture
                .rgb
            };
            assert_eq!(
                value_of(&alone(0, terms.clone())),
                value_of(&alone(3, terms.clone())),
                "{terms} {precision:?}"
            );
        }
    }
    let materials = [
        glass("a", 1.5, 2, json!({})),
        glass("b", 1.33, 1, json!({ "roughness": 0.3 })),
        lamp(3.0),
    ];
    let many: Vec<Value> = (0..20_u8)
        .map(|i| {
            ball(
                [0.2 * f64::from(i) - 2.0, 0.1 * f64::from(i % 3), 0.0],
                0.5,
                ["a", "b"][usize::from(i % 2)],
            )
        })
        .collect();
    let parts = json!({ "sky": { "gradient": { "bottom": 0.2, "top": [0.5, 0.7, 1] } }, "objects": many, "materials": materials });
    let found = scene(parts);
    let tree = wide(&found, 12);
    let scan = Settings {
        accelerator: AcceleratorKind::Linear,
        ..tree.clone()
    };
    assert_eq!(
        render_scene(&found, &tree).picture.rgb,
        render_scene(&found, &scan).picture.rgb
    );
}

/// Protects: glass in glass conserves energy, one body or seven nested ones, the same one twice,
/// and at any size.
#[test]
fn bodies_keep_all_light() {
    for scale in [1e-6, 1.0, 1e6] {
        for (count, same) in [(1, false), (2, false), (2, true), (6, false), (6, true)] {
            let name = |i: u32| {
                if same {
                    "body 0".to_owned()
                } else {
                    format!("body {i}")
                }
            };
            let bodies: Vec<Value> = (0..count)
                .map(|i| {
                    ball(
                        [0.05 * f64::from(i) * scale, 0.0, 0.0],
                        (1.0 - 0.1 * f64::from(i)) * scale,
                        &name(i),
                    )
                })
                .collect();
            let materials: Vec<Value> = (0..count)
                .map(|i| {
                    glass(
                        &format!("body {i}"),
                        1.3 + 0.1 * f64::from(i % 4),
                        i % 3 + 1,
                        json!({}),
                    )
                })
                .collect();
            let found = scene(
                json!({ "sky": { "constant": [1, 0.5, 0.25] }, "materials": materials, "objects": bodies }),
            );
            let view = [[0.2, 0.5, 4.0], [0.1, 0.3, 0.0]].map(|p: [f64; 3]| p.map(|x| x * scale));
            expect_pixels(
                &found,
                view,
                64,
                [1.0, 0.5, 0.25],
                &format!("{count} bodies, {scale}, the same: {same}"),
            );
        }
    }
}

/// Protects: every strategy of light sampling finds a light across hidden boundaries, with the
/// absorption along the ray; shadow rays and delta lights too.
#[test]
fn lights_over_hidden_boundaries() {
    let water = glass(
        "water",
        1.0,
        2,
        json!({ "attenuation_colour": [0.5, 0.9, 0.3], "attenuation_distance": 2 }),
    );
    let block = glass(
        "block",
        1.7,
        1,
        json!({ "attenuation_colour": 0.1, "attenuation_distance": 1 }),
    );
    let left = |metres: f64| [0.5, 0.9, 0.3].map(|colour: f64| colour.powf(metres / 2.0));
    let parts = |more: Value| {
        let mut parts = json!({ "materials": [lamp(12.0), water, block],
            "objects": [slab(-1.0, 9.0, "water"), slab(0.3, 0.8, "block")] });
        for (key, value) in more.as_object().into_iter().flatten() {
            match (parts[key].as_array_mut(), value.as_array()) {
                (Some(list), Some(more)) => list.extend(more.iter().cloned()),
                _ => parts[key] = value.clone(),
            }
        }
        parts
    };
    let matte = || classic(json!({ "colour": 0.6 }));
    // The ball's light by its form factor; its points are closer than its centre by two thirds of
    // its radius in the mean.
    let found = floor(
        matte(),
        parts(json!({ "objects": [ball([0.0, 1.5, 0.0], 0.05, "lamp")] })),
    );
    let distance = 1.5 + 0.26_f64.sqrt();
    let expected = left(distance - 0.05 * 2.0 / 3.0).map(|x| x * 0.6 * 12.0 * 0.0025 / 2.25);
    for light_sampling in [LightSampling::Lights, LightSampling::Both] {
        let (actual, error) = mean_radiance(
            &found,
            &Settings {
                light_sampling,
                ..paths(&found, AT, 2)
            },
        );
        for k in 0..3 {
            let off = (actual[k] - expected[k]).abs();
            assert!(
                off <= 3.0 * error[k] + 0.003 * expected[k],
                "{light_sampling:?}: {actual:?} instead of {expected:?}"
            );
        }
    }
    // A wide lamp: all three strategies agree.
    let found = floor(
        matte(),
        parts(json!({ "objects": [ball([0.0, 2.5, 0.0], 1.2, "lamp")] })),
    );
    let [(a, sa), (b, sb), (both, sc)] = [
        LightSampling::Scattering,
        LightSampling::Lights,
        LightSampling::Both,
    ]
    .map(|light_sampling| {
        mean_radiance(
            &found,
            &Settings {
                light_sampling,
                ..paths(&found, AT, 2)
            },
        )
    });
    for k in 0..3 {
        for (one, error) in [(a[k], sa[k]), (b[k], sb[k])] {
            assert!(
                (one - both[k]).abs() <= 3.5 * (error * error + sc[k] * sc[k]).sqrt(),
                "{a:?} {b:?} {both:?}"
            );
        }
    }
    let point =
        json!({ "lights": [{ "kind": { "point": { "position": [0, 1.5, 0] } }, "colour": 2 }] });
    let found = floor(matte(), parts(point));
    expect_pixels(
        &found,
        AT,
        1 + 1,
        left(distance).map(|x| x * 0.6 * 2.0 / 2.25),
        "a point",
    );
}

/// Protects: light of every kind passes straight through smooth thin walls, attenuated and tinted
/// by each at its angle of incidence, up to the depth limit; through rough walls it arrives by
/// scattering on them.
#[test]
fn through_thin_walls() {
    let pane = |roughness: f64| {
        json!({ "name": "pane", "model": physical(json!({ "transmission": 0.9, "roughness": roughness, "ior": 1.5,
        "thin_walled": true, "base_colour": [1, 0.8, 0.5] })) })
    };
    let sheet = |height: f64| json!({ "shape": { "quad": { "corner": [-90, height, -90], "edge_u": [180, 0, 0], "edge_v": [0, 0, 180] } }, "material": "pane" });
    let matte = || classic(json!({ "colour": 0.6 }));
    let reflected = |cosine: f64| {
        let r = fresnel(cosine, 1.0, 1.5);
        2.0 * r / (1.0 + r)
    };
    let transmittance = |cosine: f64, walls: i32| {
        [1.0, 0.8, 0.5].map(|tint: f64| (0.9 * tint * (1.0 - reflected(cosine))).powi(walls))
    };
    let centre: [f64; 3] = [1.5, 2.0, 0.0];
    let squared: f64 = centre.iter().map(|x| x * x).sum();
    let cosine = centre[1] / squared.sqrt();
    for walls in 0..3 {
        let panes: Vec<Value> = (0..walls)
            .map(|i| sheet(0.6 + 0.3 * f64::from(i)))
            .collect();
        let with = |roughness: f64, parts: Value| {
            let mut parts = parts;
            parts["materials"] = json!([lamp(7.0), pane(roughness)]);
            let mut objects = panes.clone();
            objects.extend(parts["objects"].as_array().cloned().unwrap_or_default());
            parts["objects"] = json!(objects);
            floor(matte(), parts)
        };
        let depth = 2 + walls as u32;
        let point =
            || json!({ "lights": [{ "kind": { "point": { "position": centre } }, "colour": 2 }] });
        let expected =
            |walls: i32| transmittance(cosine, walls).map(|x| x * 0.6 * 2.0 * cosine / squared);
        expect_pixels(
            &with(0.0, point()),
            AT,
            depth,
            expected(walls),
            &format!("a point behind {walls}"),
        );
        let sun = json!({ "lights": [crate::support::sun([3.0, 4.0, 0.0])] });
        expect_pixels(
            &with(0.0, sun),
            AT,
            depth,
            transmittance(0.8, walls).map(|x| x * 0.6 * 0.8),
            &format!("a sun behind {walls}"),
        );
        if walls > 0 {
            expect_pixels(
                &with(0.0, point()),
                AT,
                depth - 1,
                [0.0; 3],
                "too few segments",
            );
            // Light passes a rough wall by scattering there: each wall takes a vertex.
            let rough = with(0.5, point());
            assert!(
                mean_radiance(&rough, &paths(&rough, AT, depth + 1)).0[0] > 0.0,
                "a point behind {walls} rough ones"
            );
        }
        // A small lamp by shadow rays, so that all of its light passes at about one angle; and a
        // wide lamp by all strategies.
        let small = with(0.0, json!({ "objects": [ball(centre, 0.05, "lamp")] }));
        let (actual, error) = mean_radiance(
            &small,
            &Settings {
                light_sampling: LightSampling::Both,
                ..paths(&small, AT, depth)
            },
        );
        for k in 0..3 {
            let expected =
                transmittance(cosine, walls)[k] * 0.6 / PI * PI * 7.0 * 0.0025 / squared * cosine;
            assert!(
                (actual[k] - expected).abs() <= 3.0 * error[k] + 0.01 * expected,
                "{walls}: {actual:?} instead of {expected}"
            );
            assert!(
                error[k] <= 0.01 * expected,
                "{walls}: too noisy to have been asked: {error:?}"
            );
        }
        let wide = with(0.0, json!({ "objects": [ball(centre, 0.9, "lamp")] }));
        for depth in [depth, 6] {
            let [(a, sa), (b, sb), (both, sc)] = [
                LightSampling::Scattering,
                LightSampling::Lights,
                LightSampling::Both,
            ]
            .map(|light_sampling| {
                mean_radiance(
                    &wide,
                    &Settings {
                        light_sampling,
                        ..paths(&wide, AT, depth)
                    },
                )
            });
            for k in 0..3 {
                for (one, error) in [(a[k], sa[k]), (b[k], sb[k])] {
                    let allowed = 3.5 * (error * error + sc[k] * sc[k]).sqrt();
                    assert!(
                        (one - both[k]).abs() <= allowed,
                        "{walls} walls, {depth}: {a:?} {b:?} {both:?}"
                    );
                }
            }
        }
    }
}
