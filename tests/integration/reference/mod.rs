//! Pictures compared with other programs' pictures of the same scenes.

mod gltf;
mod kinderpainter;
mod noise;
mod path;
mod swing;
mod whitted;

use std::path::{Path, PathBuf};

use raywright::core::display::Display;
use raywright::core::picture::Picture;
use raywright::core::scene::{ClassicMaterial, MaterialModel, ToneMap, TransferCurve};
use raywright::core::{RenderOutput, Scene, Settings, prepare};
use raywright::io::output::{PictureMetadata, read_picture, write_picture};
use raywright::io::{Input, Limits, LoadOptions, ParameterOverrides, load};

/// Reads a reference picture.
pub fn read(path: &Path) -> Picture {
    read_picture(path, &Limits::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .picture
}

/// Loads a preset at a time with parameters.
pub fn scene(preset: &str, at: f64, set: &[(&str, f64)]) -> Scene {
    let overrides = ParameterOverrides {
        time: Some(at),
        set: set.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect(),
    };
    let options = LoadOptions {
        overrides,
        ..LoadOptions::default()
    };
    load(&Input::Preset(preset.to_owned()), &options)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// Renders a preset at a time with parameters, through the library.
pub fn render(
    preset: &str,
    at: f64,
    set: &[(&str, f64)],
    adjust: impl Fn(&mut Settings),
) -> RenderOutput {
    render_scene(&scene(preset, at, set), adjust)
}

/// Renders a scene through the library.
pub fn render_scene(scene: &Scene, adjust: impl Fn(&mut Settings)) -> RenderOutput {
    let mut settings = Settings::from_scene(scene);
    adjust(&mut settings);
    prepare(scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
}

/// Display transform of most references.
pub const ACES_22: Display = Display {
    tone_map: ToneMap::Aces,
    curve: TransferCurve::Gamma22,
    exposure_stops: 0.0,
    ..Display::PLAIN
};

/// Share of the pixels in `mask` where some channel differs by more than `threshold`.
pub fn share_beyond(a: &Picture, b: &Picture, threshold: f32, mask: impl Fn(usize) -> bool) -> f64 {
    let chosen = (0..a.rgb.len()).filter(|&i| mask(i));
    let (mut off, mut all) = (0_u32, 0_u32);
    for i in chosen {
        all += 1;
        // A NaN counts as a difference.
        off += u32::from(!(0..3).all(|k| (a.rgb[i][k] - b.rgb[i][k]).abs() <= threshold));
    }
    f64::from(off) / f64::from(all.max(1))
}

/// Pixels of a reference that rounding cannot change: white in its `stable.png`.
pub fn stable_mask(folder: &Path) -> Vec<bool> {
    read(&folder.join("stable.png"))
        .rgb
        .iter()
        .map(|pixel| pixel[0] > 0.5)
        .collect()
}

/// Asserts that at most this share of the stable pixels differs by more than 1/255; prints the
/// share.
#[track_caller]
pub fn hold_stable(label: &str, ours: &Picture, theirs: &Picture, stable: &[bool], allowed: f64) {
    let share = share_beyond(ours, theirs, 1.0 / 255.0, |i| stable[i]);
    let all = share_beyond(ours, theirs, 1.0 / 255.0, |_| true);
    eprintln!(
        "{label}: {:.4} % of stable pixels off by > 1/255, {:.4} % of all",
        share * 100.0,
        all * 100.0
    );
    if share > allowed {
        let kept = keep(label, ours, theirs);
        panic!(
            "{label}: {:.4} % of the stable pixels are off by more than 1/255; see {}",
            share * 100.0,
            kept.display()
        );
    }
}

/// Saves the pictures of a failed comparison, and their difference enlarged 50 times.
pub fn keep(label: &str, ours: &Picture, theirs: &Picture) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("reference")
        .join(label.replace([' ', '/'], "-"));
    std::fs::create_dir_all(&folder).expect("a folder for the pictures");
    let mut difference = ours.clone();
    for (pixel, other) in difference.rgb.iter_mut().zip(&theirs.rgb) {
        *pixel = std::array::from_fn(|k| 50.0 * (pixel[k] - other[k]).abs());
    }
    for (name, picture) in [
        ("ours", ours),
        ("theirs", theirs),
        ("difference", &difference),
    ] {
        let plain = Picture {
            layers: Vec::new(),
            ..picture.clone()
        };
        write_picture(
            &folder.join(format!("{name}.png")),
            &plain,
            Display::PLAIN,
            &PictureMetadata::default(),
        )
        .expect("a picture");
    }
    folder
}

/// Samples of a layer.
pub fn object_ids(picture: &Picture, layer: &str) -> Vec<f32> {
    picture
        .layer(layer)
        .unwrap_or_else(|| panic!("no layer {layer}"))
        .samples
        .clone()
}

/// Terms of a classic material in the preset.
pub fn classic<'a>(scene: &'a mut Scene, name: &str) -> &'a mut ClassicMaterial {
    let material = scene
        .materials
        .iter_mut()
        .find(|m| m.name == name)
        .expect("the preset has the material");
    match &mut material.model {
        MaterialModel::Classic(m) => m,
        MaterialModel::Physical(_) => panic!("{name} is classic"),
    }
}
