//! Entries of a glTF file for geometry: buffers, views and accessors, meshes and their primitives,
//! with the extensions for compression.

use std::collections::BTreeMap;

use serde::Deserialize;

required_entries! {
    /// A buffer: data in another file, embedded in the JSON, or in the GLB container.
    BufferEntry {
        byte_length: u64,
        uri: Option<String>,
    }

    /// A buffer view: a range of a buffer's bytes.
    BufferViewEntry {
        buffer: u32,
        #[serde(default)]
        byte_offset: u64,
        byte_length: u64,
        byte_stride: Option<usize>,
        #[serde(default)]
        extensions: ViewExtensions,
    }
}

entries! {
    /// Supported extensions of a buffer view: meshoptimizer's compression under its two names.
    /// KHR_meshopt_compression also allows a later version of the codecs.
    ViewExtensions {
        #[serde(rename = "EXT_meshopt_compression")]
        ext_meshopt: Option<MeshoptEntry>,
        #[serde(rename = "KHR_meshopt_compression")]
        khr_meshopt: Option<MeshoptEntry>,
    }
}

required_entries! {
    /// Description of a buffer view that meshoptimizer compressed.
    MeshoptEntry {
        buffer: u32,
        #[serde(default)]
        byte_offset: u64,
        byte_length: u64,
        byte_stride: u64,
        count: u64,
        mode: String,
        filter: Option<String>,
    }

    /// An accessor: typed elements in a buffer view, with the codes and type names of the
    /// specification.
    AccessorEntry {
        buffer_view: Option<u32>,
        #[serde(default)]
        byte_offset: u64,
        component_type: u32,
        count: u64,
        #[serde(default)]
        normalized: bool,
        #[serde(rename = "type")]
        kind: String,
        sparse: Option<SparseEntry>,
    }

    /// Elements that a sparse accessor replaces: their indices and new values.
    SparseEntry {
        count: u64,
        indices: SparseIndices,
        values: SparseValues,
    }

    /// Indices of the replaced elements.
    SparseIndices {
        buffer_view: u32,
        #[serde(default)]
        byte_offset: u64,
        component_type: u32,
    }

    /// Values of the replaced elements.
    SparseValues {
        buffer_view: u32,
        #[serde(default)]
        byte_offset: u64,
    }

    /// A mesh: a list of primitives.
    MeshEntry {
        name: Option<String>,
        primitives: Vec<PrimitiveEntry>,
        /// Default weights of the mesh's morph targets.
        #[serde(default)]
        weights: Vec<f64>,
    }

    /// A primitive: vertices and indices with a single material.
    PrimitiveEntry {
        /// Accessor indices by attribute name.
        attributes: BTreeMap<String, u32>,
        #[serde(default)]
        extensions: PrimitiveExtensions,
        indices: Option<u32>,
        material: Option<u32>,
        /// Topology code of the specification; `None`: triangles.
        mode: Option<u32>,
        /// Morph targets: for each target, the accessor indices of offsets by attribute name.
        #[serde(default)]
        targets: Vec<BTreeMap<String, u32>>,
    }
}

entries! {
    /// Supported extensions of a primitive: Draco compression and material variants.
    PrimitiveExtensions {
        #[serde(rename = "KHR_draco_mesh_compression")]
        draco: Option<DracoEntry>,
        #[serde(rename = "KHR_materials_variants")]
        variants: VariantMappings,
    }
}

required_entries! {
    /// Description of a Draco-compressed primitive.
    DracoEntry {
        buffer_view: u32,
        /// Identifiers of the attributes in the Draco data, by attribute name.
        attributes: BTreeMap<String, u32>,
    }
}

entries! {
    /// Materials that a primitive has in the variants of the file (KHR_materials_variants).
    VariantMappings {
        mappings: Vec<VariantMapping>,
    }
}

required_entries! {
    /// Index of a material, and the variants in which the primitive has this material.
    VariantMapping {
        material: u32,
        variants: Vec<u32>,
    }
}
