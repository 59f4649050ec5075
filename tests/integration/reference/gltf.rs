//! Models under an environment against pictures that Cycles made of them, in codes of the display.

use std::path::Path;

use raywright::core::display::Display;
use raywright::core::scene::{Camera, Integrator, Pinhole, Pose, Projection, ToneMap, TransferCurve};
use raywright::core::settings::{Background, Sampling};
use raywright::core::{Settings, prepare};
use raywright::io::{Environment, EnvironmentSource, Input, LoadOptions, load};

use super::reference;

/// Mean difference of codes to the picture of a renderer, over what both show whole, two pixels from any edge of that.
fn difference(scenario: &str, renderer: &str, model: &str, camera: ([f64; 3], [f64; 3]), integrator: Integrator) -> Option<f64> {
    let folder = reference("gltf")?;
    let theirs = image::open(folder.join(scenario).join(format!("{renderer}.webp"))).expect("a picture").to_rgba8();
    let size = [theirs.width(), theirs.height()];
    let file = EnvironmentSource::File(folder.join("lightroom_14b_1k_reconstructed.hdr"));
    let environment = Environment { source: Some(file), ..Environment::default() };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(model);
    let options = LoadOptions { environment, ..LoadOptions::default() };
    let scene = load(&Input::Path(path), &options).unwrap_or_else(|e| panic!("{e}")).scene;
    let (eye, target) = camera;
    let camera = Camera {
        name: String::new(),
        pose: Pose::LookAt { eye, target, up: [0.0, 1.0, 0.0] },
        projection: Projection::Pinhole(Pinhole { vertical_fov: Some(45.0), ..Pinhole::default() }),
        aspect: None,
        pose_end: None,
        shutter: None,
    };
    let settings = Settings {
        size,
        camera: Some(camera),
        integrator,
        sampling: Sampling::General(16),
        max_depth: 12,
        background: Background::Transparent,
        ..Settings::of(&scene)
    };
    let picture = prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{e}")).render(&()).picture;
    let display = Display { tone_map: ToneMap::AcesHill, curve: TransferCurve::Gamma22, exposure_stops: 0.0 };
    let ours = display.to_codes(&picture);
    let channels = ours.len() / (size[0] * size[1]) as usize;
    let alpha = picture.alpha.as_ref().expect("a transparent background");
    let (width, height) = (size[0] as usize, size[1] as usize);
    let whole = |x: usize, y: usize| theirs.get_pixel(x as u32, y as u32).0[3] == 255 && alpha[y * width + x] == 1.0;
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 2..height - 2 {
        for x in 2..width - 2 {
            if (0..25).all(|k| whole(x + k % 5 - 2, y + k / 5 - 2)) {
                let (place, other) = ((y * width + x) * channels, theirs.get_pixel(x as u32, y as u32).0);
                sum += (0..3).map(|k| f64::from(ours[place + k].abs_diff(other[k]))).sum::<f64>() / 3.0;
                count += 1.0;
            }
        }
    }
    assert!(count > 10_000.0, "{scenario}: only {count} pixels are shown whole by both");
    Some(sum / count)
}

/// Protects: a textured dielectric under an environment, by paths, is what Cycles shows, noise of 16 samples included.
#[test]
fn duck() {
    let camera = ([0.0, 0.86, 2.7], [0.0, 0.86, 0.0]);
    let of = |integrator| difference("khronos-Duck", "blender-cycles", "assets/gltf/Duck/Duck.glb", camera, integrator);
    let (Some(paths), Some(whitted)) = (of(Integrator::Path), of(Integrator::Whitted)) else { return };
    eprintln!("Duck: {paths:.2} codes from Cycles, by Whitted's rules {whitted:.2}");
    assert!(paths <= 3.0, "{paths:.2} codes");
}

/// Protects: coats, their roughness and their normal maps over paint, metal and what is seen through, as Cycles shows them.
#[test]
fn coats() {
    let camera = ([0.0, 0.0, 20.0], [0.0; 3]);
    let of = |integrator| {
        difference("khronos-ClearCoatTest", "blender-cycles", "assets/gltf/ClearCoatTest/ClearCoatTest.glb", camera, integrator)
    };
    let (Some(paths), Some(whitted)) = (of(Integrator::Path), of(Integrator::Whitted)) else { return };
    eprintln!("ClearCoatTest: {paths:.2} codes from Cycles, by Whitted's rules {whitted:.2}");
    assert!(paths <= 8.0, "{paths:.2} codes");
}
