//! Models with known pictures: twins, and a test card that marks its own faults.

use std::path::PathBuf;

use super::{looking, picture, scene};
use crate::support::shared;

/// All files below a folder, in order.
pub(super) fn files_below(folder: PathBuf) -> Vec<PathBuf> {
    let (mut found, mut open) = (Vec::new(), vec![folder]);
    while let Some(next) = open.pop() {
        for path in std::fs::read_dir(&next)
            .expect("a folder")
            .map(|entry| entry.expect("readable").path())
        {
            if path.is_dir() {
                open.push(path)
            } else {
                found.push(path)
            }
        }
    }
    found.sort();
    found
}

/// Protects: each file with an equivalent twin shows the twin's picture; rounding may move an edge.
#[test]
fn twins_look_alike() {
    let Some(folder) = shared("assets/gltf") else {
        return;
    };
    let stem = |path: &PathBuf| {
        path.file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned()
    };
    let files = files_below(folder);
    let mut compared = 0;
    for twin in files.iter().filter(|path| stem(path).ends_with("_twin")) {
        let other = |path: &&PathBuf| {
            let own = stem(path);
            *path != twin && path.parent() == twin.parent() && stem(twin).starts_with(&own)
        };
        let file = files
            .iter()
            .find(other)
            .unwrap_or_else(|| panic!("{} is nobody's twin", twin.display()));
        let of = |path: &PathBuf| picture(&scene(path), None, [256, 192], 4);
        let (a, b) = (of(file), of(twin));
        let far = |i: &usize| (0..3).any(|c| (a.rgb[*i][c] - b.rgb[*i][c]).abs() > 2e-3);
        let (off, seen) = (
            (0..a.rgb.len()).filter(far).count(),
            a.alpha.iter().flatten().filter(|x| **x > 0.0).count(),
        );
        eprintln!("{}: {off} of {seen} pixels are not its twin's", stem(file));
        assert!(
            seen > 1000 && off * 1000 <= seen,
            "{}: {off} of {seen}",
            file.display()
        );
        compared += 1;
    }
    assert!(compared >= 2, "{compared} twins");
}

/// Protects: in Khronos' card of texture settings (culling, clamping, repeating, mirroring, each
/// direction), every left tick, which depends on the setting, equals the right one, which does not;
/// a fault is a red cross.
#[test]
fn ticks_of_the_texture_settings_agree() {
    let Some(file) = shared("assets/gltf/TextureSettingsTest/TextureSettingsTest.gltf") else {
        return;
    };
    let card = picture(
        &scene(&file),
        Some(looking([0.0, 0.0, 15.0], [0.0; 3], 45.0)),
        [512, 512],
        16,
    );
    // In pixels of this view: eight rows of ticks 37 pixels high, 42.6 apart; the right column is
    // 88 pixels from the left.
    for row in 0..8 {
        let top = 137 + (f64::from(row) * 42.6) as usize;
        let mean = |left: usize, top: usize, x: usize, y: usize| {
            let block =
                (0..16).map(|k| card.rgb[(top + 4 * y + k / 4) * 512 + left + 4 * x + k % 4]);
            block.fold([0.0_f32; 3], |sum, p| {
                core::array::from_fn(|c| sum[c] + p[c] / 16.0)
            })
        };
        let blocks = || (0..7).flat_map(|y| (0..7).map(move |x| (x, y)));
        let difference = |shift: (usize, usize)| {
            let apart = |(x, y)| {
                let (a, b) = (
                    mean(261, top, x, y),
                    mean(348 + shift.0, top - 1 + shift.1, x, y),
                );
                (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f32>() / 3.0
            };
            blocks().map(apart).sum::<f32>() / 49.0
        };
        // The distance of the columns is not a whole number of pixels.
        let difference = (0..9)
            .map(|k| difference((k % 3, k / 3)))
            .fold(f32::INFINITY, f32::min);
        let (green, red) = blocks()
            .map(|(x, y)| mean(261, top, x, y))
            .fold((0.0_f32, 0.0_f32), |(green, red), p| {
                (green.max(p[1] - p[0]), red.max(p[0] - p[1]))
            });
        eprintln!(
            "row {row}: mean difference {difference:.4}, greenest {green:.2}, reddest {red:.2}"
        );
        assert!(difference < 0.03, "row {row}: {difference}");
        assert!(
            green > 0.2 && red < 0.05,
            "row {row}: green {green}, red {red}"
        );
    }
}
