//! A room of 34,000 triangles with one-sided materials, under six lamps: in the file's own view the
//! camera looks through some backs.

use raywright::core::picture::Picture;
use raywright::core::scene::{Colour, Sky};
use raywright::core::settings::{Crop, Sampling};
use raywright::core::{Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

use crate::support::shared;

/// Mean of these pixels in a picture by Mitsuba 3.9 (`path`, `twosided`, nine segments, 1500
/// samples a pixel) whose camera rays were continued through back faces. Its error is .3 %.
const MEAN: f64 = 0.0731;

/// The same for three pixels seen through a back face, with an error of .001.
const SPOTS: f64 = 0.0377;

/// Protects: light does not pass the back of a one-sided surface, and the back of a lamp emits
/// none, although the camera looks through both. Otherwise three pixels here would be three times
/// as bright, and their mean larger by a thirteenth.
#[test]
fn light_stops_at_backs_that_the_camera_looks_through() {
    let Some(path) = shared("cases/room/room.gltf") else {
        return;
    };
    let mut scene = load(&Input::Path(path), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
    scene.sky = Some(Sky::Constant(Colour::BLACK));
    let settings = Settings {
        size: [128, 128],
        crop: Some(Crop {
            x: 80,
            y: 90,
            width: 12,
            height: 12,
        }),
        sampling: Sampling::General(256),
        max_depth: 9,
        ..Settings::from_scene(&scene)
    };
    let picture: Picture = prepare(&scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture;
    let mean = |pixels: &[[f32; 3]]| {
        pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / pixels.len() as f64
    };
    let (all, spots) = (mean(&picture.rgb), mean(&picture.rgb[5 * 12 + 5..][..3]));
    assert!((all / MEAN - 1.0).abs() < 0.03, "{all} instead of {MEAN}");
    assert!((spots - SPOTS).abs() < 0.008, "{spots} instead of {SPOTS}");
}
