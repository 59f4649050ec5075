//! Whole collections: every file loads or has an error message, and keeps the invariants of a
//! scene.

use std::path::PathBuf;

use crate::shared::{assets, check_sound, files_below, load, triangle_count};

fn models(folder: &str, endings: &[&str]) -> Vec<PathBuf> {
    let all = assets(folder)
        .map(|folder| files_below(&folder))
        .unwrap_or_default();
    all.into_iter()
        .filter(|p| {
            p.extension()
                .is_some_and(|e| endings.iter().any(|x| e == *x))
        })
        .collect()
}

/// Protects: every shared glTF file outside `compressed` loads, and shows an object unless it
/// consists of points and lines.
#[test]
fn gltf_files_load() {
    for path in models("gltf", &["gltf", "glb"]) {
        let text = path.to_string_lossy();
        if text.contains("/compressed/") || text.contains("AssetGenerator-Negative") {
            continue;
        }
        let loaded = load(&path);
        check_sound(&loaded, &path);
        let lines = loaded
            .warnings
            .iter()
            .any(|warning| warning.message.contains("points and lines are ignored"));
        assert!(
            triangle_count(&loaded) > 0 || lines,
            "{text}: {:?}",
            loaded.warnings
        );
    }
}

/// Protects: files that the asset generator marks as invalid are refused or shown without the
/// invalid part.
#[test]
fn negative_gltf_files_do_no_harm() {
    for path in models("gltf/AssetGenerator-Negative", &["gltf", "glb"]) {
        match crate::shared::try_load(&path) {
            Ok(loaded) => check_sound(&loaded, &path),
            Err(error) => assert!(
                error
                    .to_string()
                    .contains(path.file_name().unwrap().to_str().unwrap()),
                "{error}"
            ),
        }
    }
}
