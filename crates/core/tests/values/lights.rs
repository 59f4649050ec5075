//! Delta lights: their irradiance by position.

use glam::DVec3;
use serde_json::{Value, json};

use crate::support::{EyeAndTarget, Surface, classic, expect_pixel, floor, physical, sun};

/// A white floor under one light.
fn under(light: Value) -> raywright_core::Scene {
    floor(classic(json!({})), json!({ "lights": [light] }))
}

fn at(x: f64) -> EyeAndTarget {
    [[x, 1.0, 0.0], [x, 0.0, 0.0]]
}

/// Protects: point lights give intensity · cosine / distance², the same without falloff, and fade
/// by the window (1 − (d/range)⁴). At (1.5, 0, 0) under a light at height 2 the distance is 2.5 and
/// the cosine 0.8.
#[test]
fn point_lights_weaken_with_distance() {
    let point = |rest: Value| {
        let mut fields = json!({ "position": [0, 2, 0] });
        fields
            .as_object_mut()
            .expect("a table")
            .extend(rest.as_object().expect("a table").clone());
        under(json!({ "kind": { "point": fields }, "colour": [10, 5, 0] }))
    };
    expect_pixel(&point(json!({})), at(1.5), [1.28, 0.64, 0.0]);
    expect_pixel(
        &point(json!({ "falloff": "none" })),
        at(1.5),
        [8.0, 4.0, 0.0],
    );
    // 1 − (2.5/5)⁴ = 0.9375.
    expect_pixel(&point(json!({ "range": 5 })), at(1.5), [1.2, 0.6, 0.0]);
    expect_pixel(
        &point(json!({ "range": 5, "falloff": "none" })),
        at(1.5),
        [7.5, 3.75, 0.0],
    );
    expect_pixel(&point(json!({ "range": 2.4 })), at(1.5), [0.0; 3]);
}

/// Protects: a spot has full strength inside its inner angle, none outside its outer one, and in
/// between the square of the linear position between their cosines; it points along `direction` of
/// any length.
#[test]
fn spots_fade_between_their_angles() {
    let spot = |direction: [f64; 3]| {
        under(json!({ "colour": 10, "kind": { "spot":
            { "position": [0, 2, 0], "direction": direction, "inner_angle": 30, "outer_angle": 60, "falloff": "none" } } }))
    };
    let down = spot([0.0, -3.0, 0.0]);
    let (inner, outer) = (f64::sqrt(0.75), 0.5);
    for (cosine, share) in [
        (0.9, 1.0),
        (inner - 1e-3, 0.9946),
        (0.5 * (inner + outer), 0.25),
        (0.75 * outer + 0.25 * inner, 0.0625),
        (0.49, 0.0),
    ] {
        let x = 2.0 * f64::sqrt(1.0 - cosine * cosine) / cosine;
        crate::support::expect_pixel_within(&down, at(x), [10.0 * cosine * share; 3], 1e-4);
        crate::support::expect_pixel_within(&down, at(-x), [10.0 * cosine * share; 3], 1e-4);
    }
    expect_pixel(&spot([3.0, -4.0, 0.0]), at(1.5), [8.0; 3]);
    expect_pixel(&spot([3.0, -4.0, 0.0]), at(-1.5), [0.0; 3]);
}

/// Protects: a spot falls off with distance like a point light, with and without a range.
#[test]
fn spots_weaken_with_distance() {
    let spot = |range: Value| {
        under(json!({ "colour": 10, "kind": { "spot":
            { "position": [0, 2, 0], "direction": [0, -1, 0], "inner_angle": 60, "outer_angle": 80, "range": range } } }))
    };
    expect_pixel(&spot(Value::Null), at(1.5), [1.28; 3]);
    expect_pixel(&spot(json!(5)), at(1.5), [1.2; 3]);
}

/// Protects: only the direction of `to_light` matters, and the light is the same everywhere.
#[test]
fn directional_light_is_the_same_everywhere() {
    let far = under(sun([6.0, 8.0, 0.0]));
    for x in [0.0, 100.0] {
        expect_pixel(&far, at(x), [0.8; 3]);
    }
}

/// Protects: a physical surface reflects the same irradiance by its colour over π; at ior 1 without
/// a specular reflection. The light may omit highlights.
#[test]
fn physical_surfaces_divide_by_pi() {
    let light =
        json!({ "kind": { "point": { "position": [0, 2, 0] } }, "colour": 10, "specular": false });
    let scene = floor(
        physical(json!({ "base_colour": [1, 0.5, 0], "ior": 1 })),
        json!({ "lights": [light] }),
    );
    let lit = Surface::dielectric(1.0, 1.0, 0.0)
        .sends([DVec3::Y, DVec3::new(-0.6, 0.8, 0.0), DVec3::Y], false)[0];
    // At a distance of 2.5; the cosine is included in `lit`.
    let value = lit * 10.0 / (2.5 * 2.5) / core::f64::consts::PI;
    expect_pixel(&scene, at(1.5), [value, 0.5 * value, 0.0]);
}

/// Protects: delta lights at a map's coordinates far away light surfaces there as near zero.
#[test]
fn lights_stand_where_a_map_puts_them() {
    use raywright_core::Settings;
    use raywright_core::settings::PrecisionChoice;
    let white = json!([{ "name": "white", "model": classic(json!({})) }]);
    let at = |[x, y, z]: [f64; 3], kind: &str| {
        let tile = json!({ "shape": { "quad": { "corner": [x - 1.0, y, z + 1.0], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2] } }, "material": "white" });
        let mut fields = json!({ "position": [x, y + 2.0, z] });
        if kind == "spot" {
            fields.as_object_mut().expect("a table").extend([
                ("direction".to_owned(), json!([0, -1, 0])),
                ("inner_angle".to_owned(), json!(30)),
                ("outer_angle".to_owned(), json!(60)),
            ]);
        }
        let light = json!({ "kind": { kind: fields }, "colour": 8 });
        let scene = crate::support::scene(
            json!({ "materials": white, "objects": [tile], "lights": [light] }),
        );
        let view = crate::support::settings(&scene, [[x, y + 1.0, z], [x, y, z]]);
        crate::support::pixel(
            &scene,
            &Settings {
                precision: PrecisionChoice::Robust,
                ..view
            },
        )
    };
    for kind in ["point", "spot"] {
        let far = at([448_200.25, 20.0, 4_865_499.5], kind);
        crate::support::expect_near(far, at([0.0; 3], kind), 1e-4, kind);
    }
}
