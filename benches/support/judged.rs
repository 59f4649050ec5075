//! Scenes for judging error estimates: presets, two hard scenes, and those of
//! `benches/calibration/`.

use std::path::{Path, PathBuf};

use raywright::core::Scene;
use raywright::io::{Input, LoadOptions, load};

const PRESETS: [&str; 7] = [
    "cornell",
    "glossy-box",
    "many-lights",
    "product",
    "absorption",
    "layers",
    "depth-of-field",
];

/// A floor lit only through a glass sphere: every light path is a caustic that random sampling must
/// find.
const CAUSTIC: &str = r#"{ "format": 1,
    "cameras": [{ "pose": { "look_at": { "eye": [0, 3, 4], "target": [0, 0.4, 0] } }, "projection": { "pinhole": { "vertical_fov": 40 } } }],
    "materials": [{ "name": "floor", "model": { "physical": { "base_colour": 0.7 } } },
                  { "name": "lamp", "model": { "physical": { "base_colour": 0, "emission": 40 } } },
                  { "name": "glass", "model": { "physical": { "transmission": 1, "roughness": 0 } } }],
    "objects": [{ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "floor" },
                { "shape": { "sphere": { "centre": [0, 0.7, 0], "radius": 0.6 } }, "material": "glass" },
                { "shape": { "sphere": { "centre": [1, 4, -1], "radius": 0.5 } }, "material": "lamp" }] }"#;

/// A dim room with a tiny, very bright lamp inside a glass sphere, which no shadow ray reaches: few
/// paths find the lamp.
const RARE: &str = r#"{ "format": 1, "sky": { "constant": 0.1 },
    "cameras": [{ "pose": { "look_at": { "eye": [0, 2, 5], "target": [0, 0.5, 0] } }, "projection": { "pinhole": { "vertical_fov": 40 } } }],
    "materials": [{ "name": "floor", "model": { "physical": { "base_colour": 0.7 } } },
                  { "name": "lamp", "model": { "physical": { "base_colour": 0, "emission": 40000 } } },
                  { "name": "glass", "model": { "physical": { "transmission": 1, "roughness": 0 } } }],
    "objects": [{ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "floor" },
                { "shape": { "sphere": { "centre": [0, 1, 0], "radius": 0.3 } }, "material": "glass" },
                { "shape": { "sphere": { "centre": [0, 1, 0], "radius": 0.01 } }, "material": "lamp" }] }"#;

/// The scenes: existing presets, two hard scenes, and those of the folder.
pub fn scenes() -> Vec<(String, Scene)> {
    let preset = |name: &str| {
        load(&Input::Preset(name.to_owned()), &LoadOptions::default())
            .ok()
            .map(|l| (name.to_owned(), l.scene))
    };
    let mut all: Vec<(String, Scene)> = PRESETS.into_iter().filter_map(preset).collect();
    for (name, text) in [("caustic", CAUSTIC), ("rare light", RARE)] {
        all.push((
            name.to_owned(),
            serde_json::from_str(text).unwrap_or_else(|e| panic!("{name} is right: {e}")),
        ));
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/calibration");
    let files = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<PathBuf> = files.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    for file in files {
        let name = file
            .file_name()
            .map(|name| name.to_string_lossy().replace(".scene.toml", ""))
            .unwrap_or_default();
        let scene = load(&Input::Path(file), &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{name}: {e}"))
            .scene;
        all.push((name, scene));
    }
    let chosen: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| all.iter().any(|(name, _)| name == word))
        .collect();
    all.retain(|(name, _)| chosen.is_empty() || chosen.contains(name));
    all
}
