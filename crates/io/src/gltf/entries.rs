//! What the lists of a glTF file hold, as types: fields are what the specification and the extensions that are read call them.

use std::collections::{BTreeMap, HashMap};

use gltf::json::extensions::scene::khr_lights_punctual::Light;
use serde::Deserialize;
use serde::de::IgnoredAny;

/// Extensions of the whole file that are read.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights: Lights,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: Variants,
    #[serde(flatten)]
    pub others: HashMap<String, IgnoredAny>,
}

/// The lights that nodes refer to.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Lights {
    pub lights: Vec<Light>,
}

/// The variants that primitives refer to.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Variants {
    pub variants: Vec<Variant>,
}

/// A look that the file's materials may have together.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Variant {
    pub name: Option<String>,
}

/// Channels that are played together.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Animation {
    pub name: Option<String>,
    pub channels: Vec<Channel>,
    pub samplers: Vec<AnimationSampler>,
}

/// What a sampler moves.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Channel {
    pub sampler: u32,
    pub target: Target,
}

/// A property of a node.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Target {
    pub node: Option<u32>,
    pub path: String,
}

/// Keys, and how to go from one to the next.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct AnimationSampler {
    pub input: u32,
    pub output: u32,
    pub interpolation: Interpolation,
}

/// What lies between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Interpolation {
    /// The straight way, or the shorter turn.
    #[default]
    Linear,
    /// The earlier key.
    Step,
    /// A spline with a tangent before and after each key.
    CubicSpline,
}

/// One of the file's scenes.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct SceneEntry {
    pub name: Option<String>,
    pub nodes: Vec<u32>,
}

/// A node of the hierarchy.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub camera: Option<u32>,
    pub children: Vec<u32>,
    pub extensions: NodeExtensions,
    pub matrix: Option<Box<[f64; 16]>>,
    pub mesh: Option<u32>,
    pub name: Option<String>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub skin: Option<u32>,
    pub translation: Option<[f64; 3]>,
    /// Of the morph targets of its mesh; none: the mesh's own.
    pub weights: Option<Vec<f64>>,
}

/// An image with how it is read.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Texture {
    pub name: Option<String>,
    pub sampler: Option<u32>,
    pub source: Option<u32>,
    pub extensions: TextureExtensions,
}

impl Texture {
    /// Its images, the best first: an extension's in place of the one for readers that do not know it.
    pub fn sources(&self) -> impl Iterator<Item = u32> {
        let TextureExtensions { webp, basis } = &self.extensions;
        [webp.source, basis.source, self.source].into_iter().flatten()
    }
}

/// Images of a texture in other formats than PNG and JPEG.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    pub webp: TextureSource,
    #[serde(rename = "KHR_texture_basisu")]
    pub basis: TextureSource,
}

/// An image.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureSource {
    pub source: Option<u32>,
}

/// Joints that move the vertices of meshes.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Skin {
    /// Accessor of matrices from the mesh's space to that of each joint; none: they are the identity.
    pub inverse_bind_matrices: Option<u32>,
    pub joints: Vec<u32>,
}

/// Extensions of a node that are read.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub light: LightUse,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
    #[serde(flatten)]
    pub others: HashMap<String, IgnoredAny>,
}

/// A node's light.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct LightUse {
    pub light: Option<u32>,
}

/// Places at which a node shows its mesh, by accessors of translations, rotations and scales.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Instancing {
    pub attributes: BTreeMap<String, u32>,
}

/// Bytes beside the file, inside it, or in the container.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub byte_length: u64,
    pub uri: Option<String>,
}

/// A part of a buffer.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<usize>,
    #[serde(default)]
    pub extensions: ViewExtensions,
}

/// Extensions of a buffer view that are read: two names for the codecs of meshoptimizer, of which the second allows a later version.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub ext_meshopt: Option<Meshopt>,
    #[serde(rename = "KHR_meshopt_compression")]
    pub khr_meshopt: Option<Meshopt>,
}

/// What a compressed buffer view says of its data.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Meshopt {
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
pub(super) struct Accessor {
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
pub(super) struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

/// Which elements.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

/// What they are.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
}

/// A picture in a file, in the JSON or in a buffer view.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Image {
    pub buffer_view: Option<u32>,
    pub name: Option<String>,
    pub uri: Option<String>,
}

/// Primitives that are shown together.
#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    /// Of its morph targets where no node says otherwise.
    #[serde(default)]
    pub weights: Vec<f64>,
}

/// Vertices and what is made of them, in one material.
#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
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
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<Draco>,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: Mappings,
}

/// What a compressed primitive says of its data.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Draco {
    pub buffer_view: u32,
    /// Attributes of the compressed data by name.
    pub attributes: BTreeMap<String, u32>,
}

/// The materials that a primitive shows in variants.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Mappings {
    pub mappings: Vec<Mapping>,
}

/// One material and its variants.
#[derive(Debug, Deserialize)]
pub(super) struct Mapping {
    pub material: u32,
    pub variants: Vec<u32>,
}
