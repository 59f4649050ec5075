//! Models under an environment, compared with pictures by Cycles, in display codes.

use raywright::core::display::Display;
use raywright::core::scene::{
    Camera, Integrator, Pinhole, Pose, Projection, ToneMap, TransferCurve,
};
use raywright::core::settings::{Background, Sampling};
use raywright::core::{Settings, prepare};
use raywright::io::{EnvironmentOptions, EnvironmentSource, Input, LoadOptions, load};

use crate::support::shared;

/// Edge in pixels of the blocks whose means are compared: noise counts less, and so do edges moved
/// by half a pixel.
const BLOCK: usize = 4;

/// Mean difference of codes from the other renderer's picture, over blocks entirely covered in
/// both.
fn difference(
    scenario: &str,
    renderer: &str,
    model: &str,
    camera: ([f64; 3], [f64; 3]),
    integrator: Integrator,
) -> Option<f64> {
    let folder = shared("reference/gltf")?;
    let theirs = image::open(folder.join(scenario).join(format!("{renderer}.webp")))
        .expect("a picture")
        .to_rgba8();
    // Each pixel of the test covers two by two of the reference.
    let size = [theirs.width() / 2, theirs.height() / 2];
    let file = EnvironmentSource::File(folder.join("lightroom_14b_1k_reconstructed.hdr"));
    let environment = EnvironmentOptions {
        source: Some(file),
        ..EnvironmentOptions::default()
    };
    let path = shared(model)?;
    let options = LoadOptions {
        environment,
        ..LoadOptions::default()
    };
    let scene = load(&Input::Path(path), &options)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
    let (eye, target) = camera;
    let camera = Camera {
        name: String::new(),
        pose: Pose::LookAt {
            eye,
            target,
            up: [0.0, 1.0, 0.0],
        },
        projection: Projection::Pinhole(Pinhole {
            vertical_fov: Some(45.0),
            ..Pinhole::default()
        }),
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    };
    let settings = Settings {
        size,
        camera: Some(camera),
        integrator,
        sampling: Sampling::General(64),
        max_depth: 12,
        background: Background::Transparent,
        ..Settings::from_scene(&scene)
    };
    let picture = prepare(&scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture;
    let display = Display {
        tone_map: ToneMap::AcesHill,
        curve: TransferCurve::Gamma22,
        exposure_stops: 0.0,
        ..Display::PLAIN
    };
    let ours = display.to_codes(&picture);
    let channels = ours.len() / (size[0] * size[1]) as usize;
    let alpha = picture.alpha.as_ref().expect("a transparent background");
    let (width, height) = (size[0] as usize, size[1] as usize);
    let (mut sum, mut count) = (0.0, 0.0);
    for row in 0..height * 2 / BLOCK {
        for column in 0..width * 2 / BLOCK {
            let (x, y) = (column * BLOCK, row * BLOCK);
            let cells = (0..BLOCK * BLOCK).map(|k| (x + k % BLOCK, y + k / BLOCK));
            let whole = |(x, y): (usize, usize)| {
                theirs.get_pixel(x as u32, y as u32).0[3] == 255
                    && alpha[y / 2 * width + x / 2] == 1.0
            };
            if !cells.clone().all(whole) {
                continue;
            }
            for k in 0..3 {
                let of_cell = |(x, y): (usize, usize)| {
                    let ours = f64::from(ours[(y / 2 * width + x / 2) * channels + k]);
                    ours - f64::from(theirs.get_pixel(x as u32, y as u32).0[k])
                };
                sum +=
                    (cells.clone().map(of_cell).sum::<f64>() / (BLOCK * BLOCK) as f64).abs() / 3.0;
            }
            count += 1.0;
        }
    }
    assert!(
        count > 1000.0,
        "{scenario}: only {count} blocks are shown whole by both"
    );
    Some(sum / count)
}

/// Protects: a textured dielectric under an environment, path traced, agrees with Cycles, up to the
/// noise of 64 samples.
#[test]
fn duck() {
    let camera = ([0.0, 0.86, 2.7], [0.0, 0.86, 0.0]);
    let of = |integrator| {
        difference(
            "khronos-Duck",
            "blender-cycles",
            "assets/gltf/Duck/Duck.glb",
            camera,
            integrator,
        )
    };
    let (Some(paths), Some(whitted)) = (of(Integrator::Path), of(Integrator::Whitted)) else {
        return;
    };
    eprintln!("Duck: {paths:.2} codes from Cycles, by Whitted's rules {whitted:.2}");
    assert!(paths <= 3.0, "{paths:.2} codes");
}

/// Protects: clearcoats, their roughness and their normal maps over paint, metal and transparent
/// materials agree with Cycles.
#[test]
fn coats() {
    let camera = ([0.0, 0.0, 20.0], [0.0; 3]);
    let of = |integrator| {
        difference(
            "khronos-ClearCoatTest",
            "blender-cycles",
            "assets/gltf/ClearCoatTest/ClearCoatTest.glb",
            camera,
            integrator,
        )
    };
    let (Some(paths), Some(whitted)) = (of(Integrator::Path), of(Integrator::Whitted)) else {
        return;
    };
    eprintln!("ClearCoatTest: {paths:.2} codes from Cycles, by Whitted's rules {whitted:.2}");
    assert!(paths <= 8.0, "{paths:.2} codes");
}
