//! Highlights of classic surfaces: each model's cosine, tint and shadow.

use serde_json::{Value, json};

use crate::support::{EyeAndTarget, SLANTED, ball, classic, expect_pixel, floor, sun};

/// A floor that shows only a light's highlight.
fn shiny(specular: Value, light: Value) -> raywright_core::Scene {
    floor(
        classic(json!({ "colour": 0, "diffuse": 0, "specular": specular })),
        json!({ "lights": [light] }),
    )
}

/// Protects: each model's highlight has its direction and exponent, viewed along (−0.6, −0.8, 0)
/// under l = (0, 1, 0).
#[test]
fn each_model_by_its_cosine() {
    let grazing: EyeAndTarget = [[4.0, 3.0, 0.0], [0.0; 3]];
    for (model, exponent, view, expected) in [
        // n·h = 1.8/√3.6 = √0.9.
        ("blinn", 4, SLANTED, 0.81),
        ("blinn", 2, SLANTED, 0.9),
        // l − r = (0.6, 0.2, 0), n·h = 0.2/√0.4 = √0.1.
        ("blinn_reflected", 2, SLANTED, 0.1),
        // r·l = 0.8.
        ("phong", 3, SLANTED, 0.512),
        // d·r = 0.64 − 0.36, and below zero for the steeper view.
        ("grazing", 2, grazing, 0.0784),
        ("grazing", 2, SLANTED, 0.0),
    ] {
        let specular = json!({ "model": model, "exponent": exponent, "strength": 0.5 });
        expect_pixel(
            &shiny(specular, sun([0.0, 1.0, 0.0])),
            view,
            [0.5 * expected; 3],
        );
    }
}

/// Protects: the light's colour tints a highlight unless it is not `lit`, and a light may have no
/// highlights.
#[test]
fn the_light_tints_its_highlight() {
    let light = |specular: bool| json!({ "kind": { "directional": { "to_light": [0, 1, 0] } }, "colour": [2, 1, 0.5], "specular": specular });
    let specular =
        |lit: bool| json!({ "model": "phong", "exponent": 1, "strength": "1.5*l.y", "lit": lit });
    expect_pixel(
        &shiny(specular(true), light(true)),
        SLANTED,
        [2.4, 1.2, 0.6],
    );
    expect_pixel(&shiny(specular(false), light(true)), SLANTED, [1.2; 3]);
    expect_pixel(&shiny(specular(true), light(false)), SLANTED, [0.0; 3]);
}

/// A veil of transmittance 0.25 between the origin and the light above it.
fn veiled(terms: Value, shadows: bool) -> raywright_core::Scene {
    let mut light = sun([0.0, 1.0, 0.0]);
    light["shadows"] = json!(shadows);
    let veil = json!({ "name": "veil", "model": { "classic": { "shadow_transmittance": 0.25 } } });
    floor(
        classic(terms),
        json!({ "lights": [light], "materials": [veil], "objects": [ball([0.0, 3.0, 0.0], 0.5, "veil")] }),
    )
}

/// Protects: a shadow dims a highlight if it is `shadowed` and the light casts shadows.
#[test]
fn shadows_dim_highlights() {
    let terms = |shadowed: bool| json!({ "colour": 0, "diffuse": 0, "specular": { "model": "phong", "exponent": 1, "strength": 1, "shadowed": shadowed } });
    expect_pixel(&veiled(terms(true), true), SLANTED, [0.2; 3]);
    expect_pixel(&veiled(terms(false), true), SLANTED, [0.8; 3]);
    expect_pixel(&veiled(terms(true), false), SLANTED, [0.8; 3]);
}

/// Protects: a highlight of the reflection is outside `local`, is weighted and tinted like the
/// reflection, and is dimmed if it is `shadowed` and the light casts shadows.
#[test]
fn highlights_of_a_reflection() {
    let terms = |shadowed: bool| {
        json!({ "local": 0, "colour": [1, 0.5, 0.25], "reflection": { "weight": 0.5 }, "specular":
            { "model": "phong", "exponent": 1, "strength": 2, "shadowed": shadowed, "on_reflection": true } })
    };
    expect_pixel(&veiled(terms(true), true), SLANTED, [0.2, 0.1, 0.05]);
    expect_pixel(&veiled(terms(false), true), SLANTED, [0.8, 0.4, 0.2]);
    expect_pixel(&veiled(terms(true), false), SLANTED, [0.8, 0.4, 0.2]);
    let mut dull = veiled(terms(false), true);
    dull.lights[0].specular = false;
    expect_pixel(&dull, SLANTED, [0.0; 3]);
}

/// Protects: the light's colour tints a highlight of the reflection only if it is `lit`.
#[test]
fn the_light_tints_a_highlight_of_the_reflection() {
    for (lit, expected) in [(true, [1.6, 0.8, 0.0]), (false, [0.8; 3])] {
        let specular = json!({ "model": "phong", "exponent": 1, "strength": 1, "on_reflection": true, "lit": lit });
        let light =
            json!({ "kind": { "directional": { "to_light": [0, 1, 0] } }, "colour": [2, 1, 0] });
        let terms = json!({ "local": 0, "reflection": { "weight": 1 }, "specular": specular });
        expect_pixel(
            &floor(classic(terms), json!({ "lights": [light] })),
            SLANTED,
            expected,
        );
    }
}
