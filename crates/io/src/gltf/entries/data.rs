//! Entries of a glTF file for geometry: buffers, views and accessors, meshes and their primitives,
//! with the extensions for compression.

use std::collections::BTreeMap;

use serde::Deserialize;

/// A buffer: data in another file, embedded in the JSON, or in the GLB container.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct BufferEntry {
    pub byte_length: u64,
    pub uri: Option<String>,
}

/// A buffer view: a range of a buffer's bytes.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct BufferViewEntry {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<usize>,
    #[serde(default)]
    pub extensions: ViewExtensions,
}

/// Supported extensions of a buffer view: meshoptimizer's compression under its two names.
/// KHR_meshopt_compression also allows a later version of the codecs.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub ext_meshopt: Option<MeshoptEntry>,
    #[serde(rename = "KHR_meshopt_compression")]
    pub khr_meshopt: Option<MeshoptEntry>,
}

/// Description of a buffer view that meshoptimizer compressed.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct MeshoptEntry {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: u64,
    pub count: u64,
    pub mode: String,
    pub filter: Option<String>,
}

/// An accessor: typed elements in a buffer view, with the codes and type names of the
/// specification.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct AccessorEntry {
    pub buffer_view: Option<u32>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
    pub count: u64,
    #[serde(default)]
    pub normalized: bool,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<SparseEntry>,
}

/// Elements that a sparse accessor replaces: their indices and new values.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct SparseEntry {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

/// Indices of the replaced elements.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct SparseIndices {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

/// Values of the replaced elements.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct SparseValues {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
}

/// A mesh: a list of primitives.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct MeshEntry {
    pub name: Option<String>,
    pub primitives: Vec<PrimitiveEntry>,
    /// Default weights of the mesh's morph targets.
    #[serde(default)]
    pub weights: Vec<f64>,
}

/// A primitive: vertices and indices with a single material.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct PrimitiveEntry {
    /// Accessor indices by attribute name.
    pub attributes: BTreeMap<String, u32>,
    #[serde(default)]
    pub extensions: PrimitiveExtensions,
    pub indices: Option<u32>,
    pub material: Option<u32>,
    /// Topology code of the specification; `None`: triangles.
    pub mode: Option<u32>,
    /// Morph targets: for each target, the accessor indices of offsets by attribute name.
    #[serde(default)]
    pub targets: Vec<BTreeMap<String, u32>>,
}

/// Supported extensions of a primitive: Draco compression and material variants.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<DracoEntry>,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: VariantMappings,
}

/// Description of a Draco-compressed primitive.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct DracoEntry {
    pub buffer_view: u32,
    /// Identifiers of the attributes in the Draco data, by attribute name.
    pub attributes: BTreeMap<String, u32>,
}

/// Materials that a primitive has in the variants of the file (KHR_materials_variants).
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct VariantMappings {
    pub mappings: Vec<VariantMapping>,
}

/// Index of a material, and the variants in which the primitive has this material.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct VariantMapping {
    pub material: u32,
    pub variants: Vec<u32>,
}
