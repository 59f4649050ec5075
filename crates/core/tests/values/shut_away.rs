//! Lights without any contribution are reported, and no others.

use raywright_core::Settings;
use raywright_core::prepare::{LampRef, LightRays};
use raywright_core::scene::{Integrator, Scene};
use raywright_core::settings::{LightSampling, Sampling};
use raywright_core::{ReadyScene, prepare};
use serde_json::json;

use crate::support::{DOWN, ball, classic, floor, settings};

/// A floor under an open lamp and an open light, and a lamp and a light that are each inside a box
/// if `closed`.
fn scene(closed: bool) -> Scene {
    let mut objects = vec![
        ball([3.0, 3.0, 0.0], 0.5, "lamp"),
        ball([-3.0, 3.0, 0.0], 0.5, "lamp"),
    ];
    if closed {
        objects.extend([
            ball([-3.0, 3.0, 0.0], 1.0, "wall"),
            ball([0.0, 3.0, 3.0], 1.0, "wall"),
        ]);
    }
    let light = |at: [f64; 3]| json!({ "kind": { "point": { "position": at } }, "colour": 4 });
    floor(
        classic(json!({ "colour": 0.5 })),
        json!({
            "lights": [light([0.0, 3.0, -3.0]), light([0.0, 3.0, 3.0])],
            "materials": [{ "name": "lamp", "model": classic(json!({ "local": 0, "emission": 4 })) }, { "name": "wall", "model": classic(json!({})) }],
            "objects": objects,
        }),
    )
}

fn told(
    scene: &Scene,
    samples: u32,
    light_sampling: LightSampling,
    tile_size: u32,
) -> Vec<LightRays> {
    let settings = Settings {
        size: [24, 16],
        sampling: Sampling::General(samples),
        integrator: Integrator::Path,
        light_sampling,
        tile_size,
        ..settings(scene, DOWN)
    };
    let ready = prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
    let unreached = |ready: &ReadyScene| {
        let mut film = ready.new_film("");
        ready
            .render_part(&mut film, &ready.new_film("").full_part(), &())
            .expect("its own film");
        assert_eq!(film.unfinished_pixels(), 0);
        let rays = ready.light_rays(&film).into_iter();
        rays.filter(LightRays::is_unreached).collect::<Vec<_>>()
    };
    let first = unreached(&ready);
    assert_eq!(unreached(&ready), first, "a render counts its own rays");
    first
}

/// Protects: of two lamps and two lights, those in boxes are reported, with their numbers of shadow
/// rays, which do not depend on the tiles; none is reported if the boxes are open, or with few or
/// no shadow rays.
#[test]
fn what_lights_nothing_is_told() {
    let unreached = told(&scene(true), 64, LightSampling::Both, 32);
    let [
        LightRays {
            lamp: LampRef::Light(1),
            blocked: to_light,
            ..
        },
        LightRays {
            lamp: LampRef::Object(2),
            blocked: to_lamp,
            ..
        },
    ] = unreached[..]
    else {
        panic!("{unreached:?}")
    };
    // Each vertex samples one light, nearer and brighter ones more often.
    assert!(
        [to_light, to_lamp]
            .iter()
            .all(|rays| (200..24 * 16 * 64).contains(rays)),
        "{unreached:?}"
    );
    assert_eq!(told(&scene(true), 64, LightSampling::Both, 5), unreached);
    assert_eq!(told(&scene(false), 64, LightSampling::Both, 32), []);
    assert_eq!(
        told(&scene(true), 64, LightSampling::Scattering, 32).len(),
        1,
        "lamps are not asked then"
    );
    let few = Settings {
        size: [4, 4],
        ..settings(&scene(true), DOWN)
    };
    let ready = prepare(
        &scene(true),
        &Settings {
            integrator: Integrator::Path,
            sampling: Sampling::General(1),
            ..few
        },
        &(),
    );
    let ready = ready.unwrap_or_else(|e| panic!("{e}"));
    let mut film = ready.new_film("");
    ready
        .render_part(&mut film, &ready.new_film("").full_part(), &())
        .expect("its own film");
    let rays = ready.light_rays(&film);
    assert!(!rays.iter().any(LightRays::is_unreached), "{rays:?}");
}
