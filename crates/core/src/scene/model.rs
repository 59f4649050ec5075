//! Models in their own files, with their objects, materials and lights.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::TransformStep;

/// A glTF, GLB or OBJ file whose objects, materials and lights become part of the scene. The loader
/// adds them under names that begin with the model's name. Models with the same file, scene,
/// variant and time share their meshes, materials and images.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Prefix of the names of the model's items; empty: the file's name without its extension.
    #[serde(default)]
    pub name: String,
    /// Path relative to the scene's folder.
    pub file: String,
    /// Of a glTF or GLB file: name of a scene of the file or, where no name fits, its index; none:
    /// the file's default.
    #[serde(default)]
    pub scene: Option<String>,
    /// Of a glTF or GLB file: name of a material variant; none: the default materials.
    #[serde(default)]
    pub variant: Option<String>,
    /// Of a glTF or GLB file: seconds after the start of its animations; none: at rest.
    #[serde(default)]
    pub time: Option<f64>,
    /// Placement: transform steps in the order of their application; empty: as in the file.
    #[serde(default)]
    pub transform: Vec<TransformStep>,
    /// Materials of the scene in place of the file's, by the names of the file's materials.
    #[serde(default)]
    pub materials: BTreeMap<String, String>,
}
