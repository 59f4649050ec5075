//! What stands where and how it moves: scenes, nodes with their cameras and lights, skins,
//! animations; and what the whole file is extended by.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::extended;

extended! {
    /// Extensions of the whole file that are read.
    RootExtensions: IgnoredAny {
        lights: Lights = "KHR_lights_punctual",
        variants: Variants = "KHR_materials_variants",
    }
}

extended! {
    /// Extensions of a node that are read.
    NodeExtensions: IgnoredAny {
        light: LightUse = "KHR_lights_punctual",
        instancing: Option<Instancing> = "EXT_mesh_gpu_instancing",
        visibility: Visibility = "KHR_node_visibility",
    }
}

/// A light of KHR_lights_punctual, in its node's space.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Light {
    pub name: Option<String>,
    /// `directional`, `point` or `spot`.
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default = "white")]
    pub color: [f32; 3],
    /// Candela, or lux of a directional light.
    #[serde(default = "one")]
    pub intensity: f32,
    /// Metres beyond which nothing arrives; none: no such bound.
    pub range: Option<f32>,
    pub spot: Option<Spot>,
}

/// The cone of a spot, in radians from its axis.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(in crate::gltf) struct Spot {
    pub inner_cone_angle: f32,
    pub outer_cone_angle: f32,
}

impl Default for Spot {
    fn default() -> Self {
        Self {
            inner_cone_angle: 0.0,
            outer_cone_angle: core::f32::consts::FRAC_PI_4,
        }
    }
}

fn white() -> [f32; 3] {
    [1.0; 3]
}

fn one() -> f32 {
    1.0
}

/// A view, in its node's space.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Camera {
    pub name: Option<String>,
    /// `perspective` or `orthographic`.
    #[serde(rename = "type")]
    pub kind: String,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

/// The opening of a perspective view; what lies nearer or farther than its planes is seen all the
/// same.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Perspective {
    /// Radians from bottom to top.
    pub yfov: f32,
    /// Width over height.
    #[serde(default, rename = "aspectRatio")]
    pub aspect_ratio: Option<f32>,
}

/// The size of an orthographic view.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Orthographic {
    /// Half the width.
    #[serde(default)]
    pub xmag: f32,
    /// Half the height.
    pub ymag: f32,
}

/// Channels that are played together.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Animation {
    pub name: Option<String>,
    pub channels: Vec<Channel>,
    pub samplers: Vec<AnimationSampler>,
}

/// What a sampler moves.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Channel {
    pub sampler: u32,
    pub target: Target,
}

/// A property of a node, or of anything where `path` is `pointer`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Target {
    pub extensions: TargetExtensions,
    pub node: Option<u32>,
    pub path: String,
}

/// Extensions of a channel's target that are read.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct TargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub pointer: Option<Pointer>,
}

/// The path of a property in the file's JSON (RFC 6901).
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct Pointer {
    pub pointer: String,
}

/// Keys, and how to go from one to the next.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct AnimationSampler {
    pub input: u32,
    pub output: u32,
    pub interpolation: Interpolation,
}

/// What lies between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(in crate::gltf) enum Interpolation {
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
pub(in crate::gltf) struct SceneEntry {
    pub name: Option<String>,
    pub nodes: Vec<u32>,
}

/// A node of the hierarchy.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Node {
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

/// Joints that move the vertices of meshes.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(in crate::gltf) struct Skin {
    /// Accessor of matrices from the mesh's space to that of each joint; none: they are the
    /// identity.
    pub inverse_bind_matrices: Option<u32>,
    pub joints: Vec<u32>,
}

/// Whether a node and what hangs on it is seen.
#[derive(Debug, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Visibility {
    pub visible: bool,
}

impl Default for Visibility {
    fn default() -> Self {
        Self { visible: true }
    }
}

/// A node's light.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct LightUse {
    pub light: Option<u32>,
}

/// Places at which a node shows its mesh, by accessors of translations, rotations and scales.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Instancing {
    pub attributes: BTreeMap<String, u32>,
}

/// The lights that nodes refer to.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Lights {
    pub lights: Vec<Light>,
}

/// The variants that primitives refer to.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Variants {
    pub variants: Vec<Variant>,
}

/// A look that the file's materials may have together.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct Variant {
    pub name: Option<String>,
}
