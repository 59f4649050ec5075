//! Scenes for benches that render, and their preparation.

use raywright::core::{ReadyScene, Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

/// A built-in scene; `None` if the program does not include it.
pub fn preset(name: &str) -> Option<Scene> {
    let options = LoadOptions::default();
    load(&Input::Preset(name.to_owned()), &options)
        .ok()
        .map(|loaded| loaded.scene)
}

/// A scene prepared with its own settings, except for the size and the changes of `adjust`.
pub fn ready(scene: &Scene, size: [u32; 2], adjust: impl Fn(&mut Settings)) -> ReadyScene {
    let mut settings = Settings::from_scene(scene);
    settings.size = size;
    adjust(&mut settings);
    prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"))
}
