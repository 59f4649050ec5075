//! Supported glTF extensions, and warnings about unsupported extensions.

use std::collections::BTreeMap;

use serde_json::Value;

use super::material_table::find_material_object;
use crate::import::{ImportResult, Warnings, sanitise_text};

/// Supported extensions other than those of materials. Extensions that cannot change a picture,
/// such as metadata, are included.
const SUPPORTED: [&str; 14] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    // Metadata.
    "KHR_xmp_json_ld",
    "KHR_xmp",
];

/// Whether an extension is supported.
pub(super) fn is_supported(name: &str) -> bool {
    SUPPORTED.contains(&name) || find_material_object(name).is_some()
}

/// Refuses a file with an unsupported required extension.
///
/// # Errors
/// A fault of kind input that names the extensions.
pub(super) fn check_required_extensions(required: &[String]) -> ImportResult<()> {
    let missing: Vec<&str> = required
        .iter()
        .filter(|name| !is_supported(name))
        .map(String::as_str)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let list: Vec<String> = missing
        .iter()
        .take(8)
        .map(|name| format!("`{}`", sanitise_text(name)))
        .collect();
    Err(fault!(
        "requires the extension {}, which is not supported",
        list.join(", ")
    ))
}

/// Warns about unsupported extensions among `named`. Unsupported extensions of materials are not
/// included: they are reported for each material that they change.
pub(super) fn warn_unsupported_extensions<'a>(
    named: impl Iterator<Item = &'a String>,
    warnings: &mut Warnings,
) {
    let of_materials =
        |name: &str| name.starts_with("KHR_materials_") || name.starts_with("EXT_materials_");
    for name in named.filter(|name| !is_supported(name) && !of_materials(name)) {
        warn!(
            warnings,
            Unsupported,
            "the extension {} is not supported and is ignored",
            sanitise_text(name)
        );
    }
}

/// Unsupported material extensions that some programs write for all materials, each with a key. An
/// extension has no effect if the value of its key is 0.
const DISABLED_BY_ZERO: [(&str, &str); 1] = [("KHR_materials_subsurface", "scatterDistance")];

/// Returns the names of the unsupported extensions of a material that would change its appearance.
pub(super) fn unsupported_extensions(
    extensions: &BTreeMap<String, Value>,
) -> impl Iterator<Item = &String> {
    let counts = |(name, value): &(&String, &Value)| {
        let idle = DISABLED_BY_ZERO
            .iter()
            .any(|(known, key)| known == name && value[key].as_f64().unwrap_or(0.0) == 0.0);
        !is_supported(name) && !idle
    };
    extensions.iter().filter(counts).map(|(name, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: an extension without effect is not reported, and one with an effect is.
    #[test]
    fn idle_extensions_are_told() {
        let counts = |text: &str| {
            let extensions: BTreeMap<String, Value> = serde_json::from_str(text).expect(text);
            unsupported_extensions(&extensions)
                .cloned()
                .collect::<Vec<_>>()
        };
        for idle in [
            r#"{"KHR_materials_subsurface":{}}"#,
            r#"{"KHR_materials_subsurface":{"scatterDistance":0}}"#,
            r#"{"KHR_materials_sheen":{"sheenColorFactor":[0,0,0.1]}}"#,
            r#"{"KHR_materials_unlit":{}}"#,
        ] {
            assert!(counts(idle).is_empty(), "{idle}");
        }
        for counted in [
            r#"{"KHR_materials_subsurface":{"scatterDistance":0.5}}"#,
            r#"{"EXT_of_someone":{}}"#,
        ] {
            assert_eq!(counts(counted).len(), 1, "{counted}");
        }
    }
}
