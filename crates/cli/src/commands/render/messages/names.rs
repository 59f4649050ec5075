//! Names of lights and objects in messages.

use raywright_io::LoadedScene;

use crate::console::mask_to_one_line;

/// Formats the name of a light without size for a message, or its number in the scene, counted from
/// one.
pub fn light_name(loaded: &LoadedScene, index: usize) -> String {
    match loaded.scene.lights.get(index) {
        Some(light) if !light.name.is_empty() => {
            format!("light `{}`", mask_to_one_line(&light.name))
        }
        _ => format!("light {}", index + 1),
    }
}

/// Formats the name of an object for a message, or its number in the scene, counted from one.
/// Generated objects are numbered after the listed objects.
pub fn object_name(loaded: &LoadedScene, index: usize) -> String {
    match loaded.scene.objects.get(index) {
        Some(object) if !object.name.is_empty() => {
            format!("object `{}`", mask_to_one_line(&object.name))
        }
        _ => format!("object {}", index + 1),
    }
}
