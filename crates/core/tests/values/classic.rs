//! Terms of a classic surface without further rays.

use serde_json::json;

use crate::support::{DOWN, EyeAndTarget, SLANTED, ball, classic, expect_pixel, floor, sun};

/// Protects: ambient light is colour · ambient, the scene's or the material's own.
#[test]
fn ambient_light_is_tinted() {
    let with = |model| floor(model, json!({ "classic": { "ambient": [0.1, 0.2, 0.4] } }));
    expect_pixel(
        &with(classic(json!({ "colour": [0.5, 0.25, 1] }))),
        DOWN,
        [0.05, 0.05, 0.4],
    );
    expect_pixel(
        &with(classic(
            json!({ "colour": [0.5, 0.25, 1], "ambient": [1, 0.5, 0] }),
        )),
        DOWN,
        [0.5, 0.125, 0.0],
    );
}

/// Protects: diffuse light is colour · diffuse · (n·l) · light, and zero for a light behind the
/// surface.
#[test]
fn diffuse_light_follows_the_cosine() {
    let model = || classic(json!({ "colour": [0.5, 1, 1], "diffuse": 0.5 }));
    let light = |to_light: [f64; 3]| json!({ "lights": [{ "kind": { "directional": { "to_light": to_light } }, "colour": [2, 1, 0.5], "shadows": false }] });
    expect_pixel(
        &floor(model(), light([3.0, 4.0, 0.0])),
        DOWN,
        [0.4, 0.4, 0.2],
    );
    expect_pixel(
        &floor(model(), light([0.0, 1.0, 0.0])),
        SLANTED,
        [0.5, 0.5, 0.25],
    );
    expect_pixel(&floor(model(), light([3.0, -4.0, 0.0])), DOWN, [0.0; 3]);
}

/// Protects: lights add up, and an expression of `l` gets each light's direction.
#[test]
fn diffuse_is_evaluated_for_each_light() {
    let lights = json!({ "lights": [sun([3.0, 4.0, 0.0]), sun([0.0, 3.0, 4.0])] });
    // 0.8² + 0.6².
    expect_pixel(
        &floor(classic(json!({ "diffuse": "l.y" })), lights),
        DOWN,
        [1.0; 3],
    );
}

/// Protects: rim light is strength · (1 − (n·d)²)^exponent, untinted: 0.36² = 0.1296.
#[test]
fn rim_light_grows_towards_grazing() {
    let model = |exponent| {
        classic(json!({ "colour": 0, "rim": { "strength": 0.5, "exponent": exponent } }))
    };
    expect_pixel(&floor(model(2), json!({})), SLANTED, [0.0648; 3]);
    expect_pixel(&floor(model(1), json!({})), SLANTED, [0.18; 3]);
    expect_pixel(&floor(model(2), json!({})), DOWN, [0.0; 3]);
}

/// Protects: `local` scales ambient light, highlight and rim, and not the emission.
#[test]
fn local_weighs_all_but_the_emission() {
    let model = classic(json!({
        "local": "0.25 + p.x", "colour": [0.5, 0.5, 1], "ambient": 1, "diffuse": 0, "emission": [3, 2, 1],
        "rim": { "strength": 1, "exponent": 1 },
        "specular": { "model": "phong", "exponent": 1, "strength": 1 } }));
    let scene = floor(model, json!({ "lights": [sun([0.0, 1.0, 0.0])] }));
    let view: EyeAndTarget = [[3.25, 4.0, 0.0], [0.25, 0.0, 0.0]];
    // Half of (ambient + r·l + rim), and the emission.
    let local = |colour: f64| 0.5 * (colour + 0.8 + 0.36);
    expect_pixel(
        &scene,
        view,
        [local(0.5) + 3.0, local(0.5) + 2.0, local(1.0) + 1.0],
    );
}

/// Protects: a checker alternates in cells of the world's x and z, with negative coordinates and by
/// the size of a cell.
#[test]
fn a_checker_alternates_in_its_cells() {
    let checker = json!({ "checker": { "even": [1, 0, 0], "odd": [0, 1, 0], "size": 0.5 } });
    let scene = floor(
        classic(json!({ "colour": checker, "ambient": 1 })),
        json!({}),
    );
    let even = [1.0, 0.0, 0.0];
    let odd = [0.0, 1.0, 0.0];
    for (x, z, expected) in [
        (0.3, 0.2, even),
        (0.7, 0.2, odd),
        (0.2, 0.7, odd),
        (-0.3, 0.2, odd),
        (-0.3, -0.2, even),
        (0.9, 0.9, even),
    ] {
        expect_pixel(&scene, [[x, 2.0, z], [x, 0.0, z]], expected);
    }
}

/// Protects: colours, emissions and weights may be expressions, each of its own variables, of time
/// and of parameters, evaluated at the hit.
#[test]
fn inputs_are_evaluated_at_the_hit() {
    let terms =
        json!({ "colour": "[p.x, distance, k*t]", "ambient": 1, "emission": "[0, 0, n.y - d.y]" });
    let scene = floor(
        classic(terms),
        json!({ "t": 3, "parameters": { "k": 0.5 } }),
    );
    expect_pixel(
        &scene,
        [[0.25, 2.0, 0.0], [0.25, 0.0, 0.0]],
        [0.25, 2.0, 1.5 + 2.0],
    );
}

/// Protects: a material's own shadow rule replaces the transmittance; it may read that
/// transmittance and the distance of the nearest occluder, infinite without one.
#[test]
fn a_shadow_rule_of_its_own() {
    let blockers = |clear: f64| {
        json!({ "lights": [sun([0.0, 1.0, 0.0])],
            "materials": [{ "name": "veil", "model": { "classic": { "shadow_transmittance": clear } } }],
            "objects": [ball([0.0, 9.0, 0.0], 0.5, "veil"), ball([0.0, 3.0, 0.0], 0.5, "veil")] })
    };
    let seen = |rule: &str, clear: f64, expected: f64| {
        expect_pixel(
            &floor(classic(json!({ "shadow": rule })), blockers(clear)),
            SLANTED,
            [expected; 3],
        );
    };
    seen("0.5*shadow + 0.25", 0.5, 0.375);
    seen("occluder_distance/10", 0.0, 0.25);
    seen("occluder_distance/10", 1.0, 0.25);
    seen("0.125", 0.0, 0.125);
    let free = json!({ "lights": [sun([0.0, 1.0, 0.0])] });
    expect_pixel(
        &floor(
            classic(json!({ "shadow": "1/occluder_distance + 0.5" })),
            free,
        ),
        SLANTED,
        [0.5; 3],
    );
    let mut undimmed = blockers(0.0);
    undimmed["lights"][0]["shadows"] = json!(false);
    expect_pixel(
        &floor(classic(json!({ "shadow": "0.125" })), undimmed),
        SLANTED,
        [1.0; 3],
    );
}

/// Protects: the veil is added once to every ray's radiance, untinted.
#[test]
fn the_veil_lies_over_everything() {
    let parts = json!({ "render": { "veil": [0.1, 0.2, 0.3] }, "sky": { "constant": 0.5 } });
    let scene = floor(
        classic(json!({ "local": 0, "reflection": { "weight": 0.5 } })),
        parts,
    );
    expect_pixel(&scene, DOWN, [0.35, 0.45, 0.55]);
    expect_pixel(&scene, [[0.0, 2.0, 0.0], [0.0, 3.0, 0.0]], [0.6, 0.7, 0.8]);
}
