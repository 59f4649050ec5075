//! Entries of the scene graph: scenes, nodes with their cameras and lights, skins, animations, and
//! extensions of the whole file.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::{defaulted, extended};

extended! {
    /// Supported extensions of the whole file.
    RootExtensions: IgnoredAny {
        lights: LightList = "KHR_lights_punctual",
        variants: VariantList = "KHR_materials_variants",
    }
}

extended! {
    /// Supported extensions of a node.
    NodeExtensions: IgnoredAny {
        light: LightRef = "KHR_lights_punctual",
        instancing: Option<MeshInstancing> = "EXT_mesh_gpu_instancing",
        visibility: NodeVisibility = "KHR_node_visibility",
    }
}

/// A light of KHR_lights_punctual, in its node's space.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct LightEntry {
    pub name: Option<String>,
    /// `directional`, `point` or `spot`.
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default = "default_colour")]
    pub color: [f32; 3],
    /// Intensity in candela, or in lux for a directional light.
    #[serde(default = "default_intensity")]
    pub intensity: f32,
    /// Cut-off distance in metres; `None`: unbounded.
    pub range: Option<f32>,
    pub spot: Option<SpotCone>,
}

defaulted!(
    /// Cone of a spotlight; angles in radians from the axis.
    #[derive(Clone)]
    SpotCone { inner_cone_angle: f32 = 0.0, outer_cone_angle: f32 = core::f32::consts::FRAC_PI_4 }
);

fn default_colour() -> [f32; 3] {
    [1.0; 3]
}

fn default_intensity() -> f32 {
    1.0
}

/// A camera in its node's space.
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct CameraEntry {
    pub name: Option<String>,
    /// `perspective` or `orthographic`.
    #[serde(rename = "type")]
    pub kind: String,
    pub perspective: Option<ProjectionEntry>,
    pub orthographic: Option<ProjectionEntry>,
}

/// A perspective or orthographic projection.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(in crate::gltf) struct ProjectionEntry {
    /// Vertical field of view in radians.
    pub yfov: f32,
    /// Width over height.
    pub aspect_ratio: Option<f32>,
    /// Half the width.
    pub xmag: f32,
    /// Half the height.
    pub ymag: f32,
    pub znear: f32,
    pub zfar: Option<f32>,
}

/// An animation: channels that are played together.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct AnimationEntry {
    pub name: Option<String>,
    pub channels: Vec<AnimationChannel>,
    pub samplers: Vec<AnimationSampler>,
}

/// An animation channel: a sampler, and the property that the channel animates.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct AnimationChannel {
    pub sampler: u32,
    pub target: ChannelTarget,
}

/// Target of an animation channel: a property of a node, or any property of the file if `path` is
/// `pointer`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct ChannelTarget {
    pub extensions: TargetExtensions,
    pub node: Option<u32>,
    pub path: String,
}

/// Supported extensions of a channel's target.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct TargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub pointer: Option<AnimationPointer>,
}

/// JSON pointer to a property of the file (RFC 6901).
#[derive(Debug, Deserialize)]
pub(in crate::gltf) struct AnimationPointer {
    pub pointer: String,
}

/// Sampler of an animation: accessor indices of the keyframe times (`input`) and values (`output`),
/// and the interpolation between keyframes.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct AnimationSampler {
    pub input: u32,
    pub output: u32,
    pub interpolation: Interpolation,
}

/// Interpolation between two keyframes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(in crate::gltf) enum Interpolation {
    /// Linear, along the shorter arc for rotations.
    #[default]
    Linear,
    /// The value of the earlier keyframe, until the later keyframe.
    Step,
    /// A cubic spline with an in-tangent and an out-tangent at each keyframe.
    CubicSpline,
}

/// A scene of the file.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct SceneEntry {
    pub name: Option<String>,
    pub nodes: Vec<u32>,
}

/// A node of the hierarchy.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct NodeEntry {
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
    /// Weights of the mesh's morph targets; `None`: the default weights of the mesh.
    pub weights: Option<Vec<f64>>,
}

/// A skin: the nodes that are the joints of deformed meshes.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(in crate::gltf) struct SkinEntry {
    /// Accessor of the inverse bind matrices, which map mesh space to each joint's space; `None`:
    /// identity matrices.
    pub inverse_bind_matrices: Option<u32>,
    pub joints: Vec<u32>,
}

defaulted!(
    /// Visibility of a node and its descendants.
    NodeVisibility { visible: bool = true }
);

/// Reference from a node to a light of KHR_lights_punctual, by index.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct LightRef {
    pub light: Option<u32>,
}

/// Instances of a node's mesh (EXT_mesh_gpu_instancing): accessor indices of translations,
/// rotations and scales.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct MeshInstancing {
    pub attributes: BTreeMap<String, u32>,
}

/// Lights of the file (KHR_lights_punctual), to which nodes refer by index.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct LightList {
    pub lights: Vec<LightEntry>,
}

/// Material variants of the file (KHR_materials_variants), to which primitives refer by index.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct VariantList {
    pub variants: Vec<VariantEntry>,
}

/// A material variant.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::gltf) struct VariantEntry {
    pub name: Option<String>,
}
