//! Models in their own files, as in a scene file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::TransformStep;

/// A glTF, GLB or OBJ file. Its objects, materials and lights become part of the scene, under names
/// that begin with the model's name. Models with the same file, scene, variant and time share their
/// meshes, materials and images.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Prefix of the names of the model's items. Empty: the file's name without its extension.
    #[serde(default)]
    pub name: String,
    /// Path relative to the scene's folder.
    pub file: String,
    /// Name of a scene of a glTF or GLB file; if no scene has this name, its index. None: the
    /// file's default scene.
    #[serde(default)]
    pub scene: Option<String>,
    /// Name of a material variant of a glTF or GLB file. None: the default materials.
    #[serde(default)]
    pub variant: Option<String>,
    /// Seconds after the start of the animations of a glTF or GLB file. None: at rest.
    #[serde(default)]
    pub time: Option<f64>,
    /// Transform of the model: steps in the order of their application. Empty: the model stays
    /// where its file places it.
    #[serde(default)]
    pub transform: Vec<TransformStep>,
    /// Materials of the scene that replace materials of the file. The keys are the names of the
    /// replaced materials.
    #[serde(default)]
    pub materials: BTreeMap<String, String>,
}
