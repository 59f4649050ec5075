//! Noise of small pictures, expected with the scene's own number of samples.

use super::light::with_lamp;
use super::*;

/// A room whose lamp shines at the ceiling alone, which is a mirror of a roughness.
fn indirect_room(roughness: f64) -> Scene {
    let mut materials = with_lamp(10.0);
    let mirror = json!({ "base_colour": 0.8, "metallic": 1, "roughness": roughness });
    materials
        .as_array_mut()
        .expect("materials")
        .push(paint("mirror", mirror));
    let mut panel = object(
        "panel",
        quad([-0.5, 2.5, -0.5], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
        "lamp",
    );
    panel["side"] = json!("outside");
    let room = json!({ "box": { "min": [-3, 0, -3], "max": [3, 3, 5] } });
    let ceiling = quad([-2.0, 2.9, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
    let shade = quad([-0.6, 2.3, -0.6], [1.2, 0.0, 0.0], [0.0, 0.0, 1.2]);
    scene(&json!({
        "sky": null, "materials": materials,
        "render": { "size": [96, 54], "samples": 16, "integrator": "path" },
        "objects": [object("room", room, "paint"), object("ball", ball([1.2, 0.6, 0.0], 0.6), "paint"),
                    object("ceiling", ceiling, "mirror"), object("shade", shade, "paint"), panel],
        "cameras": [{ "pose": { "look_at": { "eye": [0, 1.4, 4.5], "target": [0, 1.2, 0] } },
                      "projection": { "pinhole": { "vertical_fov": 50 } } }],
    }))
}

/// Protects: a smooth mirror that shows a lamp is noise by chance; a rougher one is not.
#[test]
fn a_lamp_by_way_of_a_mirror() {
    let rough = indirect_room(0.1);
    assert_eq!(listed(&summarise_findings(&rough).findings), []);
    let smooth = indirect_room(0.02);
    alone(&smooth, FaultKind::LightByChance, SlowOrNoisy);
}

/// Protects: a bright lamp that shines at a floor makes no noise by chance if a mirror shows another,
/// dim lamp alone: the error of the small picture counts, and not that of the brightest lamp.
#[test]
fn a_mirror_that_shows_a_dim_lamp_alone() {
    let mut materials = with_lamp(1.0);
    let spot = json!({ "base_colour": 0, "specular": 0, "emission": 1000 });
    let mirror = json!({ "metallic": 1, "roughness": 0 });
    materials
        .as_array_mut()
        .expect("materials")
        .extend([paint("spot", spot), paint("mirror", mirror)]);
    let floor = json!({ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } });
    let mut panel = object(
        "panel",
        quad([-3.0, 4.0, -3.0], [6.0, 0.0, 0.0], [0.0, 0.0, 6.0]),
        "lamp",
    );
    let mut spot = object(
        "spot",
        quad([-0.1, 0.5, -2.1], [0.2, 0.0, 0.0], [0.0, 0.0, 0.2]),
        "spot",
    );
    for lamp in [&mut panel, &mut spot] {
        lamp["side"] = json!("outside");
    }
    let clean = scene(&json!({
        "sky": null, "materials": materials,
        "render": { "size": [96, 54], "samples": 64, "integrator": "path" },
        "objects": [object("floor", floor, "paint"), object("ball", ball([1.2, 0.6, 0.0], 0.6), "mirror"), panel, spot],
        "cameras": [{ "pose": { "look_at": { "eye": [0, 1.2, 5], "target": [0, 0.8, 0] } },
                      "projection": { "pinhole": { "vertical_fov": 40 } } }],
    }));
    assert_eq!(listed(&summarise_findings(&clean).findings), []);
}

/// Protects: a bulb in glass is reported with few samples, and not with the number of samples that
/// the remedy gives.
#[test]
fn noise_of_a_bulb_ends_with_samples() {
    let of = |samples: u32| {
        let floor = json!({ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } });
        scene(&json!({
            "sky": null, "materials": with_lamp(10.0),
            "render": { "size": [96, 54], "samples": samples, "integrator": "path", "max_depth": 12 },
            "objects": [object("floor", floor, "paint"), object("ball", ball([1.2, 0.6, 0.0], 0.6), "paint"),
                        object("globe", ball([0.0, 2.0, 0.0], 0.3), "glass"), object("bulb", ball([0.0, 2.0, 0.0], 0.1), "lamp")],
            "cameras": [{ "pose": { "look_at": { "eye": [0, 1.2, 5], "target": [0, 0.8, 0] } },
                          "projection": { "pinhole": { "vertical_fov": 40 } } }],
        }))
    };
    let finding = alone(&of(16), FaultKind::LightByChance, SlowOrNoisy);
    assert!(finding.remedy.contains("--spp (about "), "{finding:?}");
    for samples in [256, 4096] {
        assert_eq!(listed(&summarise_findings(&of(samples)).findings), []);
    }
}
