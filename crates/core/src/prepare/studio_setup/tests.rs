use serde_json::{Value, json};

use super::*;
use crate::framing::{Silhouette, ViewAngles};
use crate::picture::Picture;
use crate::scene::{Integrator, Projection};
use crate::settings::Sampling;
use crate::{Scene, prepare};

/// A box of one colour, on the ground at the origin, in a studio.
fn scene(colour: f64, studio: Value) -> Scene {
    let material = json!({ "name": "only", "model": { "physical": { "base_colour": colour, "roughness": 0.9 } } });
    let object =
        json!({ "shape": { "box": { "min": [-1, 0, -1], "max": [1, 2, 1] } }, "material": "only" });
    let scene = json!({ "format": 1, "materials": [material], "objects": [object], "sky": { "studio": studio } });
    serde_json::from_value(scene).expect("a scene")
}

fn settings(scene: &Scene, view: ViewAngles, fov: f64) -> Settings {
    let camera = Some(Silhouette::from_scene(scene).frame_camera(view, fov, 1.0));
    Settings {
        size: [32, 32],
        sampling: Sampling::General(16),
        camera,
        ..Settings::from_scene(scene)
    }
}

fn picture(scene: &Scene, settings: &Settings) -> Picture {
    prepare(scene, settings, &())
        .expect("a small scene")
        .render(&())
        .picture
}

/// Protects: objects in a studio contrast with its backdrop, bright or dark, and a backdrop set by
/// the file is kept.
#[test]
fn the_backdrop_sets_off_what_stands_before_it() {
    let corner = |colour: f64, studio: Value| {
        let scene = scene(colour, studio);
        let picture = picture(&scene, &settings(&scene, ViewAngles::DEFAULT, 30.0));
        let [middle, corner] =
            [16, 0].map(|index| picture.pixel(index, index).expect("in the picture")[0]);
        (f64::from(middle), f64::from(corner))
    };
    for colour in [0.0, 0.04, 0.9, 1.0] {
        let (middle, corner) = corner(colour, json!({}));
        assert!(
            (middle > 3.0 * corner) == (colour > 0.5) && (corner > 3.0 * middle) == (colour < 0.5),
            "{colour}: {middle} {corner}"
        );
    }
    let (_, corner) = corner(1.0, json!({ "backdrop": 3.0 }));
    assert!((2.0..3.0).contains(&corner), "{corner}");
}

/// Protects: surfaces cut out by alpha do not count for brightness, and emissive surfaces are
/// bright.
#[test]
fn what_is_seen_decides_how_bright_things_are() {
    let corner = |materials: Value, objects: Value| {
        let scene = json!({ "format": 1, "materials": materials, "objects": objects, "sky": { "studio": {} } });
        let scene: Scene = serde_json::from_value(scene).expect("a scene");
        picture(&scene, &settings(&scene, ViewAngles::DEFAULT, 30.0))
            .pixel(0, 0)
            .expect("in the picture")[0]
    };
    let cube = |edge: i32, material: &str| json!({ "shape": { "box": { "min": [-edge, -edge, -edge], "max": [edge, edge, edge] } }, "material": material });
    let physical =
        |name: &str, values: Value| json!({ "name": name, "model": { "physical": values } });
    let hull = physical(
        "hull",
        json!({ "base_colour": 0, "opacity": 0.2, "alpha": { "mask": { "cutoff": 0.5 } } }),
    );
    let white = physical("white", json!({ "base_colour": 0.9 }));
    let dark = corner(
        json!([hull, white]),
        json!([cube(2, "hull"), cube(1, "white")]),
    );
    let behind_glow = corner(
        json!([physical("glow", json!({ "base_colour": 0, "emission": 2 }))]),
        json!([cube(1, "glow")]),
    );
    let bright = corner(
        json!([physical("black", json!({ "base_colour": 0 }))]),
        json!([cube(1, "black")]),
    );
    // A pane that hides little is all that there is.
    let pane = corner(
        json!([physical(
            "pane",
            json!({ "base_colour": 0, "opacity": 0.2 })
        )]),
        json!([cube(1, "pane")]),
    );
    assert!(
        5.0 * dark < bright && 5.0 * behind_glow < bright && pane == bright,
        "{dark} {behind_glow} {bright} {pane}"
    );
}

/// Protects: a backdrop is brightest along the camera's axis, falls with the cosine, and keeps at
/// least half of its radiance on every side.
#[test]
fn backdrops_fall_with_the_cosine() {
    let camera = Silhouette::from_scene(&scene(1.0, json!({}))).frame_camera(
        ViewAngles {
            azimuth: 0.0,
            elevation: 0.0,
        },
        40.0,
        1.0,
    );
    let backdrop = Backdrop::<f64>::from_studio(0.4, &camera);
    for (direction, share) in [
        ([0.0, 0.0, -1.0], 1.0),
        ([0.6, 0.0, -0.8], 0.8),
        ([1.0, 0.0, 0.0], 0.5),
        ([0.0, 0.6, 0.8], 0.5),
    ] {
        let actual = backdrop.radiance(direction.into());
        assert!(
            (actual.x - 0.4 * share).abs() < 1e-12,
            "{direction:?}: {actual}"
        );
    }
}

/// Protects: an object that blocks all light from above leaves the ground black: no light counts
/// from below.
#[test]
fn ground_below_a_roof_is_dark() {
    let only = json!({ "name": "only", "model": { "physical": { "base_colour": 1 } } });
    let block = |min: [f64; 3], max: [f64; 3]| json!({ "shape": { "box": { "min": min, "max": max } }, "material": "only" });
    let objects = json!([
        block([-50.0, 1.0, -50.0], [50.0, 1.1, 50.0]),
        block([20.0, 0.0, 20.0], [20.1, 1.0, 20.1])
    ]);
    let scene = |ground: bool| -> Scene {
        let studio = json!({ "studio": { "ground": ground, "backdrop": 0.5 } });
        serde_json::from_value(
            json!({ "format": 1, "materials": [only], "objects": objects, "sky": studio }),
        )
        .expect("a scene")
    };
    let pose = crate::scene::Pose::LookAt {
        eye: [0.0, 0.5, 0.0],
        target: [0.5, 0.0, 0.5],
        up: [0.0, 1.0, 0.0],
    };
    let [without, with] = [false, true].map(|ground| {
        let scene = scene(ground);
        let mut settings = settings(&scene, ViewAngles::DEFAULT, 20.0);
        settings.camera.as_mut().expect("framed").pose = pose.clone();
        picture(&scene, &settings)
            .rgb
            .iter()
            .map(|rgb| f64::from(rgb[0]))
            .sum::<f64>()
    });
    assert!(
        without > 100.0 && with < 0.02 * without,
        "{with} of {without}"
    );
}

/// Protects: the ground shows only blocked light: beside the box it is darker than the backdrop,
/// above it and far away it equals the backdrop; from below, and if disabled, it is absent. Under a
/// transparent background it is black with the blocked share of light as alpha, and the objects on
/// it keep their colours.
#[test]
fn the_ground_catches_shadows_alone() {
    let low = ViewAngles {
        azimuth: 0.0,
        elevation: 30.0,
    };
    let bare = scene(1.0, json!({ "ground": false, "backdrop": 0.5 }));
    let on_ground = scene(1.0, json!({ "backdrop": 0.5 }));
    let [without, with] =
        [&bare, &on_ground].map(|scene| picture(scene, &settings(scene, low, 60.0)));
    let at = |picture: &Picture, x: u32, y: u32| picture.pixel(x, y).expect("in the picture")[0];
    assert_eq!(
        (0..32).map(|x| at(&without, x, 0)).collect::<Vec<_>>(),
        (0..32).map(|x| at(&with, x, 0)).collect::<Vec<_>>(),
        "the top"
    );
    assert_eq!(at(&without, 16, 16), at(&with, 16, 16), "the box");
    // The key light is at the camera's left, the rim light behind: the ground right before the box
    // is dark.
    let ratio = at(&with, 18, 29) / at(&without, 18, 29);
    assert!((0.05..0.95).contains(&ratio), "{ratio}");
    assert!(
        (0..32).all(|i| (0..32).all(|j| at(&with, i, j) <= at(&without, i, j))),
        "no light is added"
    );
    let below = ViewAngles {
        azimuth: 0.0,
        elevation: -40.0,
    };
    let [without, with] =
        [&bare, &on_ground].map(|scene| picture(scene, &settings(scene, below, 60.0)));
    assert_eq!(without.rgb, with.rgb);
    let [[without, with], [bare, grounded]] = [Background::Environment, Background::Transparent]
        .map(|background| {
            [&bare, &on_ground].map(|scene| {
                picture(
                    scene,
                    &Settings {
                        background,
                        ..settings(scene, low, 60.0)
                    },
                )
            })
        });
    assert_eq!(bare.shadow, None);
    for pixel in 0..32 * 32 {
        let [[alone, _], [covered, shadow]] =
            [&bare, &grounded].map(|picture| picture.coverage(pixel));
        assert!((alone - covered).abs() < 1e-6, "{pixel}: {alone} {covered}");
        let apart = bare.rgb[pixel]
            .iter()
            .zip(grounded.rgb[pixel])
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        assert!(apart < 3e-5, "{pixel}: {apart}");
        if covered == 0.0 {
            let left = with.rgb[pixel][0] / without.rgb[pixel][0];
            assert!(
                (1.0 - shadow - left).abs() < 0.02,
                "{pixel}: {shadow} of {left}"
            );
            assert_eq!(grounded.rgb[pixel], [0.0; 3]);
        }
    }
    let maximum = grounded
        .shadow
        .iter()
        .flatten()
        .copied()
        .fold(0.0, f32::max);
    assert!(maximum > 0.3, "{maximum}");
}

/// Protects: switching a prepared scene to another camera and size gives the bits of a scene
/// prepared for them, there and back, with each integrator; a camera that needs other effects, and
/// a size beyond the memory limit, are rejected.
#[test]
fn turning_is_preparing_anew() {
    let scene = scene(0.5, json!({}));
    let mut all = ViewAngles::NAMED.map(|(_, view)| settings(&scene, view, 30.0));
    for (settings, more) in all.iter_mut().zip(0..) {
        settings.size[0] += 5 * more;
        settings.max_memory = Some(1 << 30);
    }
    let [mut ready, _] = [Integrator::Path, Integrator::Whitted].map(|integrator| {
        let all = all.clone().map(|settings| Settings {
            integrator,
            ..settings
        });
        let mut ready = prepare(&scene, &all[0], &()).expect("a small scene");
        for settings in all.iter().rev().chain(&all) {
            let camera = settings.camera.as_ref().expect("a view");
            assert!(ready.replace_view(&scene, camera, settings.size));
            assert_eq!(
                ready.render(&()).picture,
                picture(&scene, settings),
                "{integrator:?}: {camera:?}"
            );
        }
        ready
    });
    let own_camera = all[0].camera.clone().expect("a view");
    let Projection::Pinhole(pinhole) = own_camera.projection.clone() else {
        panic!("a pinhole")
    };
    let lens = Camera {
        projection: Projection::ThinLens {
            pinhole,
            aperture_radius: 0.1,
            focus_distance: 3.0,
        },
        ..own_camera.clone()
    };
    assert!(
        !ready.replace_camera(&scene, &lens)
            && !ready.replace_view(&scene, &own_camera, [60_000; 2])
            && !ready.replace_camera(
                &scene,
                &Camera {
                    shutter: Some([0.0, 1.0]),
                    ..own_camera
                }
            )
    );
}
