//! What shapes are made of: buffers, views and accessors, meshes and their primitives, compressed
//! or not.

use std::collections::BTreeMap;

use serde::Deserialize;

/// Bytes beside the file, inside it, or in the container.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct Buffer {
    pub byte_length: u64,
    pub uri: Option<String>,
}

/// A part of a buffer.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct View {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<usize>,
    #[serde(default)]
    pub extensions: ViewExtensions,
}

/// Extensions of a buffer view that are read: two names for the codecs of meshoptimizer, of which
/// the second allows a later version.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub ext_meshopt: Option<Meshopt>,
    #[serde(rename = "KHR_meshopt_compression")]
    pub khr_meshopt: Option<Meshopt>,
}

/// What a compressed buffer view says of its data.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct Meshopt {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: u64,
    pub count: u64,
    pub mode: String,
    pub filter: Option<String>,
}

/// Typed elements in a buffer view. Codes and names of types are the specification's.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct Accessor {
    pub buffer_view: Option<u32>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
    pub count: u64,
    #[serde(default)]
    pub normalized: bool,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<Sparse>,
}

/// Elements of an accessor that are stored one by one.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

/// Which elements.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct SparseIndices {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

/// What they are.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct SparseValues {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
}

/// Primitives that are shown together.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    /// Of its morph targets where no node says otherwise.
    #[serde(default)]
    pub weights: Vec<f64>,
}

/// Vertices and what is made of them, in one material.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Primitive {
    /// Accessors by name.
    pub attributes: BTreeMap<String, u32>,
    #[serde(default)]
    pub extensions: PrimitiveExtensions,
    pub indices: Option<u32>,
    pub material: Option<u32>,
    /// A code of the specification; none: triangles.
    pub mode: Option<u32>,
    /// Morph targets: what they add to attributes, by name.
    #[serde(default)]
    pub targets: Vec<BTreeMap<String, u32>>,
}

/// Extensions of a primitive that are read.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<Draco>,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: Mappings,
}

/// What a compressed primitive says of its data.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::gltf) struct Draco {
    pub buffer_view: u32,
    /// Attributes of the compressed data by name.
    pub attributes: BTreeMap<String, u32>,
}

/// The materials that a primitive shows in variants.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Mappings {
    pub mappings: Vec<Mapping>,
}

/// One material and its variants.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Mapping {
    pub material: u32,
    pub variants: Vec<u32>,
}
