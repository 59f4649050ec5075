//! The JSON of a glTF file as typed data, read without trust in any of its numbers.
//!
//! The types are those of `gltf::json` except where they refuse or misread valid files: its `Root` has no animation without
//! a target node (KHR_animation_pointer), no scene without nodes, and node transforms in single precision only, which
//! moves a city in geocentric coordinates by half a metre. Its indices take 64-bit numbers modulo 2³²; [`census`] refuses
//! those before they get there.

use std::collections::{BTreeMap, HashMap};

use gltf::json;
use gltf::json::extensions::scene::khr_lights_punctual::Light;
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::census;
use crate::Limits;
use crate::import::{Fault, Outcome, Warnings};

/// What of a glTF file is read.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Document {
    pub accessors: Vec<json::Accessor>,
    pub animations: Vec<Animation>,
    pub buffers: Vec<json::Buffer>,
    pub buffer_views: Vec<json::buffer::View>,
    pub cameras: Vec<json::Camera>,
    pub extensions: RootExtensions,
    pub extensions_required: Vec<String>,
    pub extensions_used: Vec<String>,
    pub images: Vec<json::Image>,
    pub materials: Vec<json::Material>,
    pub meshes: Vec<json::Mesh>,
    pub nodes: Vec<Node>,
    pub samplers: Vec<json::texture::Sampler>,
    pub scene: Option<u32>,
    pub scenes: Vec<SceneEntry>,
    pub skins: Vec<Skin>,
    pub textures: Vec<Texture>,
}

impl Document {
    /// Names of the extensions that the file uses, declared or not, apart from those that its types read.
    pub fn extensions(&self) -> impl Iterator<Item = &String> {
        let of_nodes = self.nodes.iter().flat_map(|node| node.extensions.others.keys());
        let extended = self.materials.iter().filter_map(|material| material.extensions.as_ref());
        let of_materials = extended.flat_map(|extensions| extensions.others.keys());
        self.extensions_used.iter().chain(self.extensions.others.keys()).chain(of_nodes).chain(of_materials)
    }
}

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

/// What must be known before the rest may be read.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Head {
    asset: Asset,
    extensions_required: Vec<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Asset {
    version: Option<String>,
    min_version: Option<String>,
}

/// Reads the JSON of a glTF file.
///
/// # Errors
/// A fault of kind input for broken JSON (with line and column), another version of glTF, or a required extension that is
/// not read here (by name); of kind limit for more values than the limits allow.
pub(super) fn parse(text: &[u8], limits: &Limits, warnings: &mut Warnings) -> Outcome<Document> {
    // RFC 8259, section 8.1: a reader may ignore a byte order mark.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let broken = |e: serde_json::Error| Fault::input(format!("is no valid glTF: {e}"));
    census::check(text, limits)?;
    let head: Head = serde_json::from_slice(text).map_err(broken)?;
    check_version(&head.asset, warnings)?;
    super::extensions::check_required(&head.extensions_required)?;
    serde_json::from_slice(text).map_err(broken)
}

fn check_version(asset: &Asset, warnings: &mut Warnings) -> Outcome<()> {
    let version = asset.version.as_deref().ok_or_else(|| Fault::input("is no glTF 2.0: asset.version is missing"))?;
    if version.split('.').next() != Some("2") {
        return Err(Fault::input(format!("is glTF {version}; version 2 is read")));
    }
    match asset.min_version.as_deref() {
        Some(least) if least.split('.').next() != Some("2") => {
            Err(Fault::input(format!("needs glTF {least}; version 2.0 is read")))
        }
        Some(least) if least != "2.0" => {
            warnings.add(format!("asset.minVersion asks for glTF {least}; it was read as 2.0"));
            Ok(())
        }
        _ => Ok(()),
    }
}
