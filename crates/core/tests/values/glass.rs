//! Varying glass: at each point, varying index and transmission act like constant ones of the same
//! value.

use raywright_core::Scene;
use serde_json::{Value, json};

use crate::support::{
    EyeAndTarget, PRECISIONS, classic, expect_near, expect_pixel_within, floor, physical, pixel,
    settings, sun,
};

/// Slanted views of two neighbouring cells of a checker, at x = 0.5 and x = 1.5.
const FIRST: EyeAndTarget = [[4.5, 3.0, 0.5], [0.5, 0.0, 0.5]];
const SECOND: EyeAndTarget = [[5.5, 3.0, 0.5], [1.5, 0.0, 0.5]];

fn terms(rest: &Value) -> Value {
    let mut terms = json!({ "base_colour": [1, 0.5, 0.25], "roughness": 0.2 });
    terms
        .as_object_mut()
        .expect("a table")
        .extend(rest.as_object().expect("a table").clone());
    physical(terms)
}

/// A floor of these terms under a sun and a sky that encodes directions as colours.
fn lit(rest: &Value) -> Scene {
    floor(
        terms(rest),
        json!({ "sky": { "expression": "2 + d" }, "lights": [sun([-0.6, 0.8, 0.0])] }),
    )
}

/// Asserts that both floors look alike in every precision.
#[track_caller]
fn alike(varying: &Value, even: &Value, view: EyeAndTarget) {
    let [varying_scene, even_scene] = [varying, even].map(lit);
    for (precision, tolerance) in PRECISIONS {
        let at = |scene| {
            pixel(
                scene,
                &raywright_core::Settings {
                    precision,
                    ..settings(scene, view)
                },
            )
        };
        expect_near(
            at(&varying_scene),
            at(&even_scene),
            4.0 * tolerance,
            &format!("{varying} and {even}, {precision:?}"),
        );
    }
}

fn checker(even: f64, odd: f64) -> Value {
    json!({ "checker": { "even": even, "odd": odd } })
}

/// Protects: a transmission by an expression or a checker has its value at the point: the
/// transmitted share, and the rest for diffuse reflection; at zero the surface is opaque. Values
/// outside [0, 1] are clamped.
#[test]
fn transmission_is_that_of_the_point() {
    let value_of = |value: Value| json!({ "transmission": value });
    for (value, first, second) in [
        (json!("p.x - 0.25"), 0.25, 1.0),
        (json!("0.5 - p.x + 0.25"), 0.25, 0.0),
        (json!("3 * p.x - 3"), 0.0, 1.0),
        (checker(0.75, 0.0), 0.75, 0.0),
        (checker(0.0, 0.5), 0.0, 0.5),
    ] {
        alike(&value_of(value.clone()), &value_of(first.into()), FIRST);
        alike(&value_of(value), &value_of(second.into()), SECOND);
    }
    let looks = [0.0, 0.25, 1.0].map(|share| {
        pixel(
            &lit(&value_of(share.into())),
            &settings(&lit(&value_of(share.into())), FIRST),
        )
    });
    assert!(
        looks[0] != looks[1] && looks[1] != looks[2],
        "what is compared above differs: {looks:?}"
    );
}

/// Protects: a varying index of refraction has its value at the point, for the highlight and for
/// refraction alike, and is at least 1.
#[test]
fn index_is_that_of_the_point() {
    for transmission in [0.0, 1.0] {
        let value_of = |value: Value| json!({ "ior": value, "transmission": transmission });
        for (value, first, second) in [
            (json!("1 + p.x"), 1.5, 2.5),
            (checker(1.25, 2.0), 1.25, 2.0),
            (json!("p.x"), 1.0, 1.5),
            (json!("exp(400 * (p.x - 1))"), 1.0, 1000.0),
        ] {
            alike(&value_of(value.clone()), &value_of(first.into()), FIRST);
            alike(&value_of(value), &value_of(second.into()), SECOND);
        }
        let looks = [1.0, 1.5, 2.5].map(|ior| {
            pixel(
                &lit(&value_of(ior.into())),
                &settings(&lit(&value_of(ior.into())), FIRST),
            )
        });
        assert!(
            looks[0] != looks[1] && looks[1] != looks[2],
            "what is compared above differs: {looks:?}"
        );
    }
}

/// Protects: an occluder of varying transmission has its value at the shadow ray's hit: a floor
/// below two disks is lit through one and not through the other, and by the alpha's share.
#[test]
fn shadows_of_varying_glass() {
    let seen = |rest: Value, share: [f64; 2]| {
        let mut glass = terms(&json!({ "transmission": checker(0.5, 0.0) }));
        glass["physical"]
            .as_object_mut()
            .expect("a table")
            .extend(rest.as_object().expect("a table").clone());
        let disks = [0.5, 1.5].map(|x| {
            let disk = json!({ "centre": [x, 3, 0.5], "normal": [0, 1, 0], "radius": 0.4 });
            json!({ "shape": { "disk": disk }, "material": "glass" })
        });
        let parts = json!({ "lights": [sun([0.0, 1.0, 0.0])], "objects": disks,
            "materials": [{ "name": "glass", "model": glass }] });
        let scene = floor(classic(json!({})), parts);
        for (view, share) in [FIRST, SECOND].into_iter().zip(share) {
            expect_pixel_within(&scene, view, [share; 3], 1e-6);
        }
    };
    let tint = 0.5 * (1.0 + 0.5 + 0.25) / 3.0;
    seen(json!({}), [tint, 0.0]);
    seen(
        json!({ "opacity": 0.5, "alpha": "blend" }),
        [1.0 - 0.5 * (1.0 - tint), 0.5],
    );
}

/// Protects: glass of zero transmission, of either family, reflects as glass, once: in Whitted's
/// integrator the path without a continuation still waits for the reflection.
#[test]
fn glass_that_lets_nothing_through() {
    for model in [
        physical(json!({ "base_colour": 0, "transmission": 1, "roughness": 0, "ior": 1.5 })),
        classic(json!({ "local": 0, "transmission": { "ior": 1.5, "refracted_tint": 0 } })),
    ] {
        let scene = floor(model, json!({ "sky": { "constant": 1 } }));
        crate::support::expect_pixel(&scene, crate::support::DOWN, [0.04; 3]);
    }
}
