//! Rules for every number of the format, whatever its meaning: found by walking a scene, not by
//! listing keys.

use serde_json::{Value, json};

use super::everything::EVERYTHING;
use super::read_scene;
use crate::native::{ParameterOverrides, SceneNotation, parse};

/// Numbers where [`EVERYTHING`] has another kind of value, or none.
const OTHERS: &str = r#"
format = 1
sky.map = { image = "grain", rotation = 10, strength = 2 }
images = [{ name = "grain", path = "grain.png" }]
textures = [{ name = "wood", image = "grain" }]
cameras = [{ name = "lens", pose.look_at = { eye = [0, 1, 5], target = [0, 0, 0] }, projection.thin_lens = {
    pinhole = { focal_length = 1 }, aperture_radius = 0, focus_distance = 3
} }]
lights = [{ kind.point = { position = [0, 3, 0], falloff = "inverse_square" }, colour = 3 }]
objects = [{ shape.sphere = { centre = [0, 0, 0], radius = 1 }, material = "terms" }]

[[materials]]
name = "terms"
[materials.model.classic]
colour = 0.5
local = 0.5
diffuse = 0.5
shadow = 0.5
specular = { model = "blinn", exponent = 3, strength = 0.5 }
rim = { strength = 0.5, exponent = 3 }
reflection = { weight = 0.5 }
emission = 0.5

[[materials]]
name = "oak"
[materials.model.physical]
base_colour = 0.5
metallic = 0.5
roughness = 0.5
opacity = 0.5
emission = { texture = { name = "wood", uv = [0.5, 0.5], factor = 0.5 } }
"#;

/// Collects the JSON pointers to all numbers of a value.
fn numbers(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(at.to_owned()),
        Value::Array(items) => items
            .iter()
            .enumerate()
            .for_each(|(i, item)| numbers(item, &format!("{at}/{i}"), found)),
        Value::Object(members) => members
            .iter()
            .for_each(|(key, member)| numbers(member, &format!("{at}/{key}"), found)),
        _ => {}
    }
}

fn refused(scene: &Value) -> bool {
    parse(
        "x.scene.json",
        &scene.to_string(),
        SceneNotation::Json,
        &ParameterOverrides::default(),
    )
    .is_err()
}

/// Protects: every number of a scene is range-checked: 1e300 is out of range for every key, with
/// either sign. A missing check for a shape, a term or a light would let infinities into a picture.
#[test]
fn every_number_has_bounds_on_both_sides() {
    for text in [EVERYTHING, OTHERS, "format = 1\nsky.constant = [1, 2, 3]"] {
        let scene = serde_json::to_value(read_scene(text)).expect("a scene is plain data");
        let mut places = Vec::new();
        numbers(&scene, "", &mut places);
        assert!(!refused(&scene) && places.len() > 3);
        for (place, far) in places
            .iter()
            .flat_map(|place| [(place, 1e300), (place, -1e300)])
        {
            let mut wrong = scene.clone();
            *wrong.pointer_mut(place).expect("the place of a number") = json!(far);
            assert!(refused(&wrong), "{place} may be {far}");
        }
    }
}

/// Protects: defaults of omitted keys are those on the page of the format: each default, written
/// out, changes nothing.
#[test]
fn what_is_left_out_is_what_the_page_says() {
    const SHORT: &str = r#"
format = 1
cameras = [{ pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0] }, projection.pinhole.vertical_fov = 40 }]
images = [{ name = "a", path = "a.png" }]
textures = [{ name = "a", image = "a" }]
lights = [
    { kind.point = { position = [0, 0, 0] }, colour = 1 },
    { kind.spot = { position = [0, 0, 0], direction = [0, 0, 1], inner_angle = 1, outer_angle = 2 }, colour = 1 },
]
materials = [
    { name = "plain", model.classic = {} },
    { name = "terms", model.classic = {
        specular = { model = "phong", exponent = 2, strength = 1 },
        reflection = { weight = 1 },
        emission = { checker = { even = 0, odd = 1 } },
    } },
    { name = "glass", model.classic.transmission.ior = 1.5 },
    { name = "oak", model.physical = {} },
    { name = "image", model.physical.base_colour_texture.name = "a" },
]
objects = [
    { shape.cylinder = { base = [0, 0, 0], axis = [0, 1, 0], radius = 1, height = 1 }, material = "plain" },
    { shape.cone = { base = [0, 0, 0], axis = [0, 1, 0], radius = 1, height = 1 }, material = "plain" },
]
generators = [{ kind.scatter = { count = 1, min = [0, 0, 0], max = [1, 1, 1] }, object = {
    shape.sphere = { centre = [0, 0, 0], radius = 1 }, material = "plain",
} }]
classic.spawn.constant.offset = 0.5
sky.gradient = { bottom = 0, top = 1 }
"#;
    const LONG: &str = r#"
format = 1
title = ""
t = 0
parameters = {}
render = { size = [1280, 720], samples = 64, max_depth = 8, integrator = "auto", seed = 0, tone_map = "khronos-neutral",
    gamma = "srgb", exposure = 0, veil = 0 }
classic = { ambient = 0, shadow = "product", depth_limit = "drop", spawn.constant = {
    offset = 0.5, along = "normal", camera_min = 0, secondary_min = 0, shadow_min = 0,
} }
cameras = [{ name = "", pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0], up = [0, 1, 0] },
    projection.pinhole.vertical_fov = 40 }]
images = [{ name = "a", path = "a.png" }]
textures = [{ name = "a", image = "a", colour_space = "srgb", filter = "bilinear", wrap_u = "repeat", wrap_v = "repeat" }]
lights = [
    { name = "", kind.point = { position = [0, 0, 0], falloff = "inverse_square" }, colour = 1, shadows = true, specular = true },
    { kind.spot = { position = [0, 0, 0], direction = [0, 0, 1], inner_angle = 1, outer_angle = 2, falloff = "inverse_square" },
        colour = 1 },
]
materials = [
    { name = "plain", model.classic = { colour = 1, local = 1, diffuse = 1, shadow_transmittance = 0 } },
    { name = "terms", model.classic = {
        specular = { model = "phong", exponent = 2, strength = 1, lit = true, shadowed = true, on_reflection = false },
        reflection = { weight = 1, tinted = true },
        emission = { checker = { even = 0, odd = 1, size = 1 } },
    } },
    { name = "glass", model.classic.transmission = { ior = 1.5, choice = "split", reflected_tint = 1, refracted_tint = 1 } },
    { name = "oak", model.physical = { base_colour = 1, vertex_colours = false, metallic = 0, roughness = 1, ior = 1.5,
        transmission = 0, emission = 0, alpha = "opaque", opacity = 1, unlit = false } },
    { name = "image", model.physical.base_colour_texture = { name = "a", uv_set = 0, factor = 1 } },
]
meshes = []
objects = [
    { name = "", shape.cylinder = { base = [0, 0, 0], axis = [0, 1, 0], radius = 1, height = 1, caps = true },
        material = "plain", side = "both", face_viewer = true, casts_shadow = true, transform = [] },
    { shape.cone = { base = [0, 0, 0], axis = [0, 1, 0], radius = 1, top_radius = 0, height = 1 }, material = "plain" },
]
generators = [{ kind.scatter = { count = 1, min = [0, 0, 0], max = [1, 1, 1], seed = 0 }, object = {
    shape.sphere = { centre = [0, 0, 0], radius = 1 }, material = "plain", face_viewer = true, casts_shadow = true,
} }]
sky.gradient = { bottom = 0, top = 1, suns = [] }
"#;
    assert_eq!(read_scene(SHORT), read_scene(LONG));
    let sky = |more: &str| {
        read_scene(&format!(
            "format = 1\nimages = [{{ name = \"a\", path = \"a\" }}]\nsky.map = {{ image = \"a\"{more} }}"
        ))
    };
    assert_eq!(sky(""), sky(", rotation = 0, strength = 1"));
    assert_eq!(
        read_scene("format = 1"),
        read_scene("format = 1\nclassic.spawn = \"error_bound\"")
    );
}
