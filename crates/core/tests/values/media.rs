//! Media and light through a rough boundary: absorption of light sampled on the other side of a
//! surface. All else equals the clear body's picture, with the same random numbers.

use raywright_core::settings::{LightSampling, PrecisionChoice};
use raywright_core::{Scene, Settings};
use serde_json::{Value, json};

use crate::paths::{AT, lamp, mean_radiance, paths};
use crate::support::{EyeAndTarget, ball, classic, physical, scene};

/// Transmittance of a metre, by channel.
const LEFT: [f64; 3] = [0.8, 0.5, 0.3];

/// Frosted glass, clear or absorbing, with further terms.
fn frosted(absorbs: bool, terms: &Value) -> Value {
    let mut model = json!({ "transmission": 1, "roughness": 0.5, "ior": 1.5 });
    if absorbs {
        model["attenuation_colour"] = json!(LEFT);
        model["attenuation_distance"] = json!(1);
    }
    model
        .as_object_mut()
        .expect("a table")
        .extend(terms.as_object().expect("a table").clone());
    physical(model)
}

/// A body of frosted glass that fills the half-space below height 0, with lights and further
/// objects.
fn pond(absorbs: bool, terms: &Value, parts: &Value) -> Scene {
    let mut parts = parts.clone();
    parts["materials"] = json!([{ "name": "glass", "model": frosted(absorbs, terms) }, lamp(40.0)]);
    let body = json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "glass" });
    let further = parts["objects"].as_array().cloned().unwrap_or_default();
    parts["objects"] = json!([vec![body], further].concat());
    scene(parts)
}

/// Asserts that the absorbing pond shows the clear one's light times the transmittance of `metres`,
/// within a relative error.
#[track_caller]
fn dims(terms: &Value, parts: &Value, view: EyeAndTarget, metres: f64, error: f64) {
    for precision in [PrecisionChoice::Robust, PrecisionChoice::Reference] {
        for light_sampling in [LightSampling::Lights, LightSampling::Both] {
            let seen = [true, false].map(|absorbs| {
                let found = pond(absorbs, terms, parts);
                mean_radiance(
                    &found,
                    &Settings {
                        precision,
                        light_sampling,
                        ..paths(&found, view, 2)
                    },
                )
                .0
            });
            let [dimmed, clear] = seen;
            for k in 0..3 {
                let expected = clear[k] * LEFT[k].powf(metres);
                let label = format!(
                    "{terms}, {parts}, {precision:?}, {light_sampling:?}: {dimmed:?} of {clear:?}"
                );
                assert!(
                    clear[k] > 0.0 && (dimmed[k] - expected).abs() <= error * expected,
                    "{label}, not {expected}"
                );
            }
        }
    }
}

/// A view onto the origin from inside the pond.
const WITHIN: EyeAndTarget = [[0.3, -0.4, 0.1], [0.0; 3]];

fn point(height: f64) -> Value {
    json!({ "lights": [{ "kind": { "point": { "position": [0, height, 0] } }, "colour": 5 }] })
}

/// Bodies with and without a priority use different shadow-ray code.
fn with_and_without_priority(check: impl Fn(&Value)) {
    [json!({}), json!({ "priority": 1 })].iter().for_each(check);
}

/// Protects: light sampled through a frosted surface is attenuated by the medium on its side,
/// e^(−σd), and not by the medium around the eye; from inside, by the distance to the eye alone.
#[test]
fn light_is_absorbed_beyond_the_boundary() {
    with_and_without_priority(|terms| {
        dims(terms, &point(-0.7), AT, 0.7, 1e-3);
        // The distance from the eye is √0.26 m; the lamp is in clear air.
        dims(terms, &point(0.7), WITHIN, 0.26_f64.sqrt(), 1e-3);
        // Reflected light stays in the pond, both to the lamp and to the eye.
        dims(terms, &point(-0.7), WITHIN, 0.7 + 0.26_f64.sqrt(), 1e-3);
        dims(terms, &point(0.7), AT, 0.0, 1e-3);
    });
}

/// Protects: an area light in a body is attenuated to its sampled points, which are closer than its
/// centre by two thirds of its radius in the mean.
#[test]
fn a_lamp_in_a_body_is_dimmed() {
    with_and_without_priority(|terms| {
        let parts = json!({ "objects": [ball([0.0, -0.7, 0.0], 0.02, "lamp")] });
        dims(terms, &parts, AT, 0.7 - 0.02 * 2.0 / 3.0, 5e-3);
    });
}

/// Protects: an infinite body absorbs a sun entirely; from inside, the sun in clear air is
/// attenuated by the distance to the eye alone.
#[test]
fn a_sun_through_a_boundary() {
    let up = json!({ "lights": [crate::support::sun([0.1, 1.0, 0.2])] });
    let down = json!({ "lights": [crate::support::sun([0.1, -1.0, 0.2])] });
    with_and_without_priority(|terms| {
        dims(terms, &up, WITHIN, 0.26_f64.sqrt(), 1e-3);
        let [dimmed, clear] = [true, false].map(|absorbs| {
            let found = pond(absorbs, terms, &down);
            mean_radiance(&found, &paths(&found, AT, 2)).0
        });
        assert!(
            dimmed == [0.0; 3] && clear[0] > 0.0,
            "{terms}: {dimmed:?} of {clear:?}"
        );
    });
}

/// Protects: a channel without absorption passes a sun's light in full, though other channels lose
/// all, and no sample is dropped.
#[test]
fn a_channel_that_is_not_absorbed() {
    let down = json!({ "lights": [crate::support::sun([0.1, -1.0, 0.2])] });
    with_and_without_priority(|terms| {
        let mut terms = terms.clone();
        terms["attenuation_colour"] = json!([1, 0.5, 0]);
        for precision in [PrecisionChoice::Robust, PrecisionChoice::Reference] {
            let [dimmed, clear] = [true, false].map(|absorbs| {
                let terms = if absorbs {
                    terms.clone()
                } else {
                    json!({ "priority": terms.get("priority").map_or(0, |_| 1) })
                };
                let found = pond(absorbs, &terms, &down);
                let settings = Settings {
                    precision,
                    size: [4, 4],
                    ..paths(&found, AT, 2)
                };
                let counters = crate::support::render_scene(&found, &settings).counters;
                assert_eq!(
                    (counters.dropped, counters.samples),
                    (0, 4 * 4 * 64),
                    "{terms}, {precision:?}"
                );
                mean_radiance(&found, &settings).0
            });
            assert!(
                clear[0] > 0.0 && dimmed == [clear[0], 0.0, 0.0],
                "{terms}, {precision:?}: {dimmed:?} of {clear:?}"
            );
        }
    });
}

/// Protects: a thin wall bounds no medium, so no absorption takes place behind it, whatever its
/// material.
#[test]
fn a_thin_wall_absorbs_nothing_behind_it() {
    dims(&json!({ "thin_walled": true }), &point(-0.7), AT, 0.0, 1e-3);
}

/// Protects: a matte floor in a glass body is attenuated by the lengths inside the body to the eye
/// and to the lamp.
#[test]
fn a_floor_in_a_body() {
    let parts = |absorbs: bool| {
        let bottom = json!({ "shape": { "quad": { "corner": [-80, -0.5, -80], "edge_u": [0, 0, 160], "edge_v": [160, 0, 0] } },
            "material": "floor" });
        let materials = json!([{ "name": "glass", "model": frosted(absorbs, &json!({ "roughness": 0 })) },
            { "name": "floor", "model": classic(json!({ "colour": 0.5 })) }]);
        let body = json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "glass" });
        let mut all = point(-0.2);
        (all["materials"], all["objects"]) = (materials, json!([body, bottom]));
        scene(all)
    };
    // Half a metre straight down, and 0.3 m up to the lamp.
    let down: EyeAndTarget = [[0.0, 1.0, 0.0], [0.0; 3]];
    let [dimmed, clear] = [true, false].map(|absorbs| {
        let found = parts(absorbs);
        mean_radiance(&found, &paths(&found, down, 3)).0
    });
    for k in 0..3 {
        let expected = clear[k] * LEFT[k].powf(0.8);
        assert!(
            clear[k] > 0.0 && (dimmed[k] - expected).abs() <= 1e-3 * expected,
            "{dimmed:?} of {clear:?}"
        );
    }
}
