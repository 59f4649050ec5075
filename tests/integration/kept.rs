//! Pictures keep their bits during refactoring: `kept.txt` has a hash of each.
//!
//! A change that is meant to affect pictures writes the hashes anew (`RAYWRIGHT_TAKE_HASHES=1`),
//! and its commit message names the changed lines with the reason.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use raywright::core::picture::Picture;
use raywright::core::settings::{Aov, PrecisionChoice, Sampling};
use raywright::core::{Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load, presets};
use sha2::{Digest, Sha256};

use crate::support::shared;

const PRECISIONS: [PrecisionChoice; 2] = [PrecisionChoice::Robust, PrecisionChoice::Reference];

/// Files below the shared assets that `raywright render` accepts, in order.
fn imports() -> Vec<(String, PathBuf)> {
    let Some(folder) = shared("assets") else {
        return Vec::new();
    };
    let mut found = Vec::new();
    let mut open = vec![folder.join("gltf"), folder.join("obj")];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next)
            .expect("a folder")
            .map(|entry| entry.expect("readable").path())
        {
            let kind = entry
                .extension()
                .map(|e| e.to_string_lossy().to_lowercase());
            if entry.is_dir() {
                open.push(entry);
            } else if kind.is_some_and(|kind| matches!(kind.as_str(), "gltf" | "glb" | "obj")) {
                let name = entry
                    .strip_prefix(&folder)
                    .expect("below the folder")
                    .to_string_lossy()
                    .replace('\\', "/");
                found.push((name.replace(' ', "%20"), entry));
            }
        }
    }
    found.sort();
    found
}

/// Hashes the bits of colour, coverage and layers.
fn hash(picture: &Picture) -> String {
    let mut hash = Sha256::new();
    for pixel in &picture.rgb {
        pixel
            .iter()
            .for_each(|x| hash.update(x.to_bits().to_le_bytes()));
    }
    for samples in picture
        .alpha
        .iter()
        .chain(picture.layers.iter().map(|layer| &layer.samples))
    {
        samples
            .iter()
            .for_each(|x| hash.update(x.to_bits().to_le_bytes()));
    }
    hash.finalize()
        .iter()
        .take(8)
        .fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        })
}

/// Hashes of a scene in both precisions, on one line.
fn hashes(name: &str, scene: Scene, size: [u32; 2]) -> String {
    let spp = if scene.render.pattern.is_none() {
        Some(2)
    } else {
        None
    };
    let of = |precision| {
        let mut settings = Settings::from_scene(&scene);
        settings.size = size;
        settings.sampling = Sampling::from_spp(&scene, spp);
        settings.precision = precision;
        settings.aovs = vec![
            Aov::Albedo,
            Aov::Normal,
            Aov::Position,
            Aov::Depth,
            Aov::Object,
            Aov::Material,
        ];
        hash(
            &prepare(&scene, &settings, &())
                .unwrap_or_else(|e| panic!("{name}: {e}"))
                .render(&())
                .picture,
        )
    };
    PRECISIONS.map(of).join(" ")
}

/// Protects: refactoring keeps each bit of picture and layers for every preset and every loadable
/// model of the shared assets, in both precisions.
#[test]
fn pictures_keep_their_bits() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/integration/kept.txt");
    let mut found = BTreeMap::new();
    for preset in presets::list() {
        let scene = load(
            &Input::Preset(preset.name.to_owned()),
            &LoadOptions::default(),
        )
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
        found.insert(
            format!("preset:{}", preset.name),
            hashes(preset.name, scene, [64, 48]),
        );
    }
    for (name, path) in imports() {
        // Other tests cover files that do not load.
        let Ok(loaded) = load(&Input::Path(path), &LoadOptions::default()) else {
            continue;
        };
        let line = hashes(&name, loaded.scene, [32, 24]);
        found.insert(name, line);
    }
    if std::env::var_os("RAYWRIGHT_TAKE_HASHES").is_some() {
        let text: String = found
            .iter()
            .map(|(name, hashes)| format!("{name} {hashes}\n"))
            .collect();
        std::fs::write(&file, text).expect("the file can be written");
        return;
    }
    let text = std::fs::read_to_string(&file).expect("tests/integration/kept.txt");
    let kept: BTreeMap<&str, &str> = text
        .lines()
        .filter_map(|line| line.split_once(' '))
        .collect();
    let moved: Vec<&String> = found
        .iter()
        .filter(|(name, hashes)| match kept.get(name.as_str()) {
            Some(kept) => kept != hashes,
            None => {
                eprintln!("no hash was kept of {name}");
                false
            }
        })
        .map(|(name, _)| name)
        .collect();
    assert!(
        moved.is_empty(),
        "{} of {} pictures changed: {moved:?}",
        moved.len(),
        found.len()
    );
}
