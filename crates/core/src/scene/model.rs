//! Models in files of their own, with all that they bring.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::TransformStep;

/// A glTF, GLB or OBJ file whose objects, materials and lights become the scene's. The loader puts
/// them there, under names that begin with the model's; models of one file, scene, variant and time
/// share what they are made of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// What names of its things begin with; empty: the file's name without its ending.
    #[serde(default)]
    pub name: String,
    /// Path relative to the scene's folder.
    pub file: String,
    /// Of a glTF or GLB file: name of one of its scenes or, where no name fits, its index; none:
    /// the file's default.
    #[serde(default)]
    pub scene: Option<String>,
    /// Of a glTF or GLB file: name of a variant of its materials; none: the default look.
    #[serde(default)]
    pub variant: Option<String>,
    /// Of a glTF or GLB file: seconds after the beginning of its animations; none: at rest.
    #[serde(default)]
    pub time: Option<f64>,
    /// Where it is put: steps in the order in which they are applied; empty: where it is in its
    /// file.
    #[serde(default)]
    pub transform: Vec<TransformStep>,
    /// Materials of the scene in place of the file's, by the names that the file gives its own.
    #[serde(default)]
    pub materials: BTreeMap<String, String>,
}
