//! Scenes for the benches that render, and how they get ready.

use raywright::core::{Ready, Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

/// A built-in scene; none where the program does not carry it.
pub fn preset(name: &str) -> Option<Scene> {
    let options = LoadOptions::default();
    load(&Input::Preset(name.to_owned()), &options)
        .ok()
        .map(|loaded| loaded.scene)
}

/// A scene prepared on its own terms but for size and what `adjust` changes.
pub fn ready(scene: &Scene, size: [u32; 2], adjust: impl Fn(&mut Settings)) -> Ready {
    let mut settings = Settings::of(scene);
    settings.size = size;
    adjust(&mut settings);
    prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"))
}
