//! Which glTF extensions are read, and what is said about the others.

use crate::import::{Fault, Outcome, Warnings, shown};

/// Extensions that are read, or whose absence changes nothing in the picture of the default state.
const READ: [&str; 12] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    // Converted, with a warning at each material.
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    // Metadata.
    "KHR_xmp_json_ld",
    "KHR_xmp",
];

/// Refuses a file that can't be shown without an extension that is not read.
///
/// # Errors
/// A fault of kind input naming the extensions.
pub(super) fn check_required(required: &[String]) -> Outcome<()> {
    let able = |name: &&String| READ.contains(&name.as_str());
    let missing: Vec<&str> = required.iter().filter(|name| !able(name)).map(String::as_str).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let list: Vec<String> = missing.iter().take(8).map(|name| format!("`{}`", shown(name))).collect();
    Err(Fault::input(format!("requires the extension {}, which is not supported", list.join(", "))))
}

/// Warns about extensions that are named and ignored.
pub(super) fn warn_ignored<'a>(named: impl Iterator<Item = &'a String>, warnings: &mut Warnings) {
    for name in named.filter(|name| !READ.contains(&name.as_str())) {
        warnings.add(format!("extension {} is ignored", shown(name)));
    }
}
