//! Entries of the scene graph: scenes, nodes with their cameras and lights, skins, animations, and
//! extensions of the whole file.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

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

entries! {
    /// A light of KHR_lights_punctual, in its node's space.
    LightEntry {
        name: Option<String>,
        /// `directional`, `point` or `spot`.
        #[serde(rename = "type")]
        kind: String,
        color: [f32; 3] = [1.0; 3],
        /// Intensity in candela, or in lux for a directional light.
        intensity: f32 = 1.0,
        /// Cut-off distance in metres; `None`: unbounded.
        range: Option<f32>,
        spot: Option<SpotCone>,
    }

    /// Cone of a spotlight; angles in radians from the axis.
    #[derive(Clone)]
    SpotCone { inner_cone_angle: f32, outer_cone_angle: f32 = core::f32::consts::FRAC_PI_4 }

    /// A camera in its node's space.
    CameraEntry {
        name: Option<String>,
        /// `perspective` or `orthographic`.
        #[serde(rename = "type")]
        kind: String,
        perspective: Option<ProjectionEntry>,
        orthographic: Option<ProjectionEntry>,
    }

    /// A perspective or orthographic projection.
    ProjectionEntry {
        /// Vertical field of view in radians.
        yfov: f32,
        /// Width over height.
        aspect_ratio: Option<f32>,
        /// Half the width.
        xmag: f32,
        /// Half the height.
        ymag: f32,
        znear: f32,
        zfar: Option<f32>,
    }

    /// An animation: channels that are played together.
    AnimationEntry {
        name: Option<String>,
        channels: Vec<AnimationChannel>,
        samplers: Vec<AnimationSampler>,
    }

    /// An animation channel: a sampler, and the property that the channel animates.
    AnimationChannel {
        sampler: u32,
        target: ChannelTarget,
    }

    /// Target of an animation channel: a property of a node, or any property of the file if `path` is
    /// `pointer`.
    ChannelTarget {
        extensions: TargetExtensions,
        node: Option<u32>,
        path: String,
    }

    /// Supported extensions of a channel's target.
    TargetExtensions {
        #[serde(rename = "KHR_animation_pointer")]
        pointer: Option<AnimationPointer>,
    }
}

required_entries! {
    /// JSON pointer to a property of the file (RFC 6901).
    AnimationPointer {
        pointer: String,
    }
}

entries! {
    /// Sampler of an animation: accessor indices of the keyframe times (`input`) and values (`output`),
    /// and the interpolation between keyframes.
    AnimationSampler {
        input: u32,
        output: u32,
        interpolation: Interpolation,
    }
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

entries! {
    /// A scene of the file.
    SceneEntry {
        name: Option<String>,
        nodes: Vec<u32>,
    }

    /// A node of the hierarchy.
    NodeEntry {
        camera: Option<u32>,
        children: Vec<u32>,
        extensions: NodeExtensions,
        matrix: Option<Box<[f64; 16]>>,
        mesh: Option<u32>,
        name: Option<String>,
        rotation: Option<[f64; 4]>,
        scale: Option<[f64; 3]>,
        skin: Option<u32>,
        translation: Option<[f64; 3]>,
        /// Weights of the mesh's morph targets; `None`: the default weights of the mesh.
        weights: Option<Vec<f64>>,
    }

    /// A skin: the nodes that are the joints of deformed meshes.
    SkinEntry {
        /// Accessor of the inverse bind matrices, which map mesh space to each joint's space; `None`:
        /// identity matrices.
        inverse_bind_matrices: Option<u32>,
        joints: Vec<u32>,
    }

    /// Visibility of a node and its descendants.
    NodeVisibility { visible: bool = true }

    /// Reference from a node to a light of KHR_lights_punctual, by index.
    LightRef {
        light: Option<u32>,
    }

    /// Instances of a node's mesh (EXT_mesh_gpu_instancing): accessor indices of translations,
    /// rotations and scales.
    MeshInstancing {
        attributes: BTreeMap<String, u32>,
    }

    /// Lights of the file (KHR_lights_punctual), to which nodes refer by index.
    LightList {
        lights: Vec<LightEntry>,
    }

    /// Material variants of the file (KHR_materials_variants), to which primitives refer by index.
    VariantList {
        variants: Vec<VariantEntry>,
    }

    /// A material variant.
    VariantEntry {
        name: Option<String>,
    }
}
