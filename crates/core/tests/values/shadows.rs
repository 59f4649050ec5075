//! Occluders between a surface and a light.

use raywright_core::Scene;
use serde_json::{Value, json};

use crate::support::{
    SLANTED, ball, classic, expect_near, expect_pixel, floor, physical, render_scene, settings, sun,
};

/// A white floor under the sun, with balls above the origin at these heights.
fn under(rules: Value, materials: Value, heights: &[(f64, &str)]) -> Scene {
    let objects: Vec<Value> = heights
        .iter()
        .map(|&(y, material)| ball([0.0, y, 0.0], 0.5, material))
        .collect();
    floor(
        classic(json!({})),
        json!({ "classic": rules, "lights": [sun([0.0, 1.0, 0.0])], "materials": materials, "objects": objects }),
    )
}

fn veils() -> Value {
    let veil = |name: &str, share: f64| json!({ "name": name, "model": { "classic": { "shadow_transmittance": share } } });
    json!([veil("half", 0.5), veil("quarter", 0.25), veil("solid", 0.0)])
}

/// Protects: transmittances are multiplied, or the first occluder in the file's order decides alone
/// at any position.
#[test]
fn occluders_multiply_or_the_first_decides() {
    let first = || json!({ "shadow": "first_in_order" });
    expect_pixel(
        &under(json!({}), veils(), &[(9.0, "half"), (3.0, "quarter")]),
        SLANTED,
        [0.125; 3],
    );
    expect_pixel(
        &under(first(), veils(), &[(9.0, "half"), (3.0, "quarter")]),
        SLANTED,
        [0.5; 3],
    );
    expect_pixel(
        &under(first(), veils(), &[(3.0, "quarter"), (9.0, "half")]),
        SLANTED,
        [0.25; 3],
    );
    expect_pixel(
        &under(json!({}), veils(), &[(9.0, "half"), (3.0, "solid")]),
        SLANTED,
        [0.0; 3],
    );
    expect_pixel(
        &under(first(), veils(), &[(9.0, "half"), (3.0, "solid")]),
        SLANTED,
        [0.5; 3],
    );
}

/// Protects: objects and lights may be set to cast no shadows.
#[test]
fn shadows_may_be_left_out() {
    let mut scene = under(json!({}), veils(), &[(3.0, "solid"), (6.0, "half")]);
    scene.objects[1].casts_shadow = false;
    expect_pixel(&scene, SLANTED, [0.5; 3]);
    scene.objects[2].casts_shadow = false;
    scene.objects[0].casts_shadow = false;
    expect_pixel(&scene, SLANTED, [1.0; 3]);
    let mut scene = under(json!({}), veils(), &[(3.0, "solid")]);
    scene.lights[0].shadows = false;
    expect_pixel(&scene, SLANTED, [1.0; 3]);
    assert_eq!(
        render_scene(&scene, &settings(&scene, SLANTED))
            .counters
            .shadow,
        0
    );
}

/// Protects: the greatest distance of occluders of a directional light, under both rules of ray
/// origins; for other lights it is the light's distance.
#[test]
fn occluders_count_up_to_a_distance() {
    // The ball's lower end is 2.5 above the floor.
    for spawn in [
        json!("error_bound"),
        json!({ "constant": { "offset": 0.001 } }),
    ] {
        for (distance, expected) in [(2.4, 1.0), (2.6, 0.0)] {
            let rules = json!({ "shadow_max_distance": distance, "spawn": spawn });
            expect_pixel(
                &under(rules.clone(), veils(), &[(3.0, "solid")]),
                SLANTED,
                [expected; 3],
            );
            let mut lamp = under(rules, veils(), &[(3.0, "solid")]);
            lamp.lights[0].kind = raywright_core::scene::LightKind::Point {
                position: [0.0, 9.0, 0.0],
                falloff: raywright_core::scene::Falloff::None,
                range: None,
            };
            expect_pixel(&lamp, SLANTED, [0.0; 3]);
        }
    }
}

/// Protects: a physical occluder transmits the mean of its tint times its transmission: 0.5 · (1 +
/// 0.5 + 0.3)/3 = 0.3; and with alpha, 1 − alpha · (1 − 0.3). The same from both sides.
#[test]
fn physical_occluders_transmit() {
    let base = |rest: Value| {
        let mut terms = json!({ "base_colour": [1, 0.5, 0.3], "transmission": 0.5 });
        terms
            .as_object_mut()
            .expect("a table")
            .extend(rest.as_object().expect("a table").clone());
        json!([{ "name": "glass", "model": physical(terms) }])
    };
    for (rest, share) in [
        (json!({}), 0.3),
        (json!({ "opacity": 0.5 }), 0.3),
        (json!({ "opacity": 0.5, "alpha": "blend" }), 0.65),
        (
            json!({ "opacity": 0.25, "alpha": "blend", "transmission": 0 }),
            0.75,
        ),
        (
            json!({ "opacity": 0.5, "alpha": { "mask": { "cutoff": 0.6 } } }),
            1.0,
        ),
        (
            json!({ "opacity": 0.5, "alpha": { "mask": { "cutoff": 0.5 } } }),
            0.3,
        ),
    ] {
        for up in [1, -1] {
            let disk = json!({ "shape": { "disk": { "centre": [0, 3, 0], "normal": [0, up, 0], "radius": 0.5 } }, "material": "glass" });
            let parts = json!({ "lights": [sun([0.0, 1.0, 0.0])], "materials": base(rest.clone()), "objects": [disk] });
            let scene = floor(classic(json!({})), parts);
            let found =
                render_scene(&scene, &settings(&scene, SLANTED)).picture.rgb[0].map(f64::from);
            expect_near(
                found,
                [share; 3],
                1e-6,
                &format!("{rest}, its outside {up}"),
            );
        }
    }
}

/// Protects: one shadow ray for each light that a surface faces and that casts shadows, none for
/// other lights.
#[test]
fn shadow_rays_are_asked_where_they_matter() {
    let mut scene = under(json!({}), veils(), &[(3.0, "solid")]);
    let light = scene.lights[0].clone();
    let towards = |to_light: [f64; 3], shadows: bool| raywright_core::scene::Light {
        kind: raywright_core::scene::LightKind::Directional { to_light },
        shadows,
        ..light.clone()
    };
    scene.lights.extend([
        towards([1.0, 1.0, 0.0], true),
        towards([0.0, -1.0, 0.0], true),
        towards([1.0, 2.0, 0.0], false),
    ]);
    assert_eq!(
        render_scene(&scene, &settings(&scene, SLANTED))
            .counters
            .shadow,
        2
    );
    // A shadow rule that reads no occluder needs no shadow ray, nor does a scene without shadow
    // casters.
    let count = |scene: &Scene| {
        render_scene(scene, &settings(scene, SLANTED))
            .counters
            .shadow
    };
    let lit = || json!({ "lights": [sun([0.0, 1.0, 0.0])] });
    assert_eq!(count(&floor(classic(json!({ "shadow": "n.y" })), lit())), 0);
    assert_eq!(
        count(&floor(classic(json!({ "shadow": "shadow" })), lit())),
        1
    );
    let mut bare = floor(classic(json!({})), lit());
    assert_eq!(count(&bare), 1);
    bare.objects[0].casts_shadow = false;
    assert_eq!(count(&bare), 0);
}

/// Protects: every weight that reads the distance of the nearest occluder gets it, not that of the
/// first opaque one that a ray visited.
#[test]
fn distances_are_of_the_nearest_occluder() {
    for heights in [
        [(9.0, "solid"), (3.0, "solid")],
        [(3.0, "solid"), (9.0, "solid")],
    ] {
        let mut scene = under(json!({}), veils(), &heights);
        let specular = json!({ "model": "phong", "exponent": 0, "strength": "occluder_distance / 10", "shadowed": false });
        let raywright_core::scene::MaterialModel::Classic(floor) = &mut scene.materials[0].model
        else {
            panic!("a classic floor")
        };
        floor.specular = Some(serde_json::from_value(specular).expect("a highlight"));
        // The ball's lower end is 2.5 above the floor, which is in its shadow.
        expect_pixel(&scene, SLANTED, [0.25; 3]);
    }
}

/// Protects: a material's own `shadow` applies to every light that casts shadows, also without an
/// occluder, and to no other light.
#[test]
fn a_materials_own_shadow_needs_no_occluder() {
    for (shadows, expected) in [(true, 0.25), (false, 1.0)] {
        let mut light = sun([0.0, 1.0, 0.0]);
        light["shadows"] = json!(shadows);
        let mut scene = floor(
            classic(json!({ "shadow": 0.25 })),
            json!({ "lights": [light] }),
        );
        scene.objects[0].casts_shadow = false;
        expect_pixel(&scene, SLANTED, [expected; 3]);
    }
}

/// Protects: in path tracing the scene's limit on shadow distance applies to delta lights alone:
/// occluders hide the sky or a lamp at any distance, for every strategy of light sampling, and also
/// if thin walls make shadow rays visit surfaces in order.
#[test]
fn a_sky_is_hidden_beyond_the_limit_of_shadows() {
    use crate::paths::{expect_pixels, lamp};
    use crate::support::{ball, floor};
    // Inside a closed black ball of radius 50, and under a lamp hidden by a black disk.
    let black = json!({ "name": "black", "model": classic(json!({ "colour": 0 })) });
    let clear = json!({ "name": "clear", "model": physical(json!({ "transmission": 1, "roughness": 0, "thin_walled": true })) });
    for (limit, walls) in [(1.0, false), (40.0, false), (1.0, true), (40.0, true)] {
        let rules = json!({ "shadow_max_distance": limit });
        let with_walls = |mut objects: Vec<serde_json::Value>| {
            objects.extend(walls.then(|| ball([3.0, 4.0, 0.0], 0.5, "clear")));
            objects
        };
        let shut = json!({ "classic": rules, "sky": { "constant": 2 }, "materials": [black, clear],
            "objects": with_walls(vec![ball([0.0; 3], 50.0, "black")]) });
        let found = floor(classic(json!({ "colour": 0.5 })), shut);
        expect_pixels(
            &found,
            crate::paths::AT,
            2,
            [0.0; 3],
            &format!("a sky, {limit}, {walls}"),
        );
        let disk = json!({ "shape": { "disk": { "centre": [0, 45, 0], "normal": [0, 1, 0], "radius": 40 } }, "material": "black" });
        let hidden = json!({ "classic": rules, "materials": [black, clear, lamp(5.0)],
            "objects": with_walls(vec![disk, ball([0.0, 80.0, 0.0], 10.0, "lamp")]) });
        let found = floor(classic(json!({ "colour": 0.5 })), hidden);
        expect_pixels(
            &found,
            crate::paths::AT,
            2,
            [0.0; 3],
            &format!("a lamp, {limit}, {walls}"),
        );
    }
}
