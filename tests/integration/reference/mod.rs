//! Pictures against pictures that other programs computed from the same scenes.

mod whitted;

use std::path::{Path, PathBuf};

use raywright::core::display::Display;
use raywright::core::picture::Picture;
use raywright::core::scene::{ToneMap, TransferCurve};
use raywright::core::{Rendered, Scene, Settings, prepare};
use raywright::io::output::read_picture;
use raywright::io::{Input, Limits, LoadOptions, Overrides, load};

/// The folder of reference data beside the checkout; none, with a line that says so, where it is missing.
pub fn reference(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/reference").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: shared data not found ({})", folder.display());
    None
}

/// A picture of the reference.
pub fn read(path: &Path) -> Picture {
    read_picture(path, &Limits::default()).unwrap_or_else(|e| panic!("{e}")).picture
}

/// A preset at a time with parameters.
pub fn scene(preset: &str, at: f64, set: &[(&str, f64)]) -> Scene {
    let overrides = Overrides { at: Some(at), set: set.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect() };
    let options = LoadOptions { overrides, limits: Limits::default() };
    load(&Input::Preset(preset.to_owned()), &options).unwrap_or_else(|e| panic!("{e}")).scene
}

/// Renders a preset at a time with parameters, through the library.
pub fn render(preset: &str, at: f64, set: &[(&str, f64)], adjust: impl Fn(&mut Settings)) -> Rendered {
    let scene = scene(preset, at, set);
    let mut settings = Settings::of(&scene);
    adjust(&mut settings);
    prepare(&scene, &settings).unwrap_or_else(|e| panic!("{e}")).render(&())
}

/// The display transform that most references use.
pub const ACES_22: Display = Display { tone_map: ToneMap::Aces, curve: TransferCurve::Gamma22, exposure_stops: 0.0 };

/// Share of the pixels chosen by `mask` in which some channel differs by more than `threshold`.
pub fn share_beyond(a: &Picture, b: &Picture, threshold: f32, mask: impl Fn(usize) -> bool) -> f64 {
    let chosen = (0..a.rgb.len()).filter(|&i| mask(i));
    let (mut off, mut all) = (0_u32, 0_u32);
    for i in chosen {
        all += 1;
        // Written so that NaN counts as off.
        off += u32::from(!(0..3).all(|k| (a.rgb[i][k] - b.rgb[i][k]).abs() <= threshold));
    }
    f64::from(off) / f64::from(all.max(1))
}
