//! Types of the entries in a glTF file. Fields are named as in the specification and in the
//! supported extensions.

use std::collections::BTreeMap;

use serde::de::{DeserializeSeed, Error, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::extensions::{CORE, MaterialObject, find_material_object, find_property};

/// Declares structs of optional JSON keys with their types. A key that is missing has the stated
/// value or the default of its type.
macro_rules! entries {
    ($($(#[$meta:meta])* $name:ident {
        $($(#[$of:meta])* $key:ident: $type:ty $(= $default:expr)?),* $(,)?
    })*) => {$(
        $(#[$meta])*
        #[derive(Debug, Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        pub(in crate::gltf) struct $name {
            $($(#[$of])* pub $key: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: default_value!($($default)?),)* }
            }
        }
    )*};
}

/// Declares structs of JSON keys with their types. A key is required unless its type is an `Option`
/// or it has the attribute `serde(default)`.
macro_rules! required_entries {
    ($($(#[$meta:meta])* $name:ident {
        $($(#[$of:meta])* $key:ident: $type:ty),* $(,)?
    })*) => {$(
        $(#[$meta])*
        #[derive(Debug, Deserialize)]
        #[serde(rename_all = "camelCase")]
        pub(in crate::gltf) struct $name {
            $($(#[$of])* pub $key: $type,)*
        }
    )*};
}

macro_rules! default_value {
    () => {
        Default::default()
    };
    ($value:expr) => {
        $value
    };
}

/// Declares a struct for the extensions of a glTF entry, with a typed field for each supported
/// extension and a map of the unsupported extensions. The deserializer is written by hand, because
/// `serde(flatten)` would lose the path of a fault inside an extension.
macro_rules! extended {
    ($(#[$doc:meta])* $name:ident: $other:ty { $($field:ident: $type:ty = $key:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Default)]
        pub(in crate::gltf) struct $name {
            $(pub $field: $type,)*
            /// Data of unsupported extensions, by name.
            pub others: std::collections::BTreeMap<String, $other>,
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct ByName;
                impl<'de> serde::de::Visitor<'de> for ByName {
                    type Value = $name;
                    fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                        f.write_str("an object with the data of each extension by the extension's name")
                    }
                    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<$name, A::Error> {
                        let mut out = $name::default();
                        while let Some(name) = map.next_key::<String>()? {
                            match name.as_str() {
                                $($key => out.$field = map.next_value()?,)*
                                _ => drop(out.others.insert(name, map.next_value()?)),
                            }
                        }
                        Ok(out)
                    }
                }
                deserializer.deserialize_map(ByName)
            }
        }
    };
}

// Entries of a glTF file for geometry: buffers, views and accessors, meshes and their primitives,
// with the extensions for compression.

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

// Entries of the scene graph: scenes, nodes with their cameras and lights, skins, animations, and
// extensions of the whole file.

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

// Entries of a glTF file for appearance: materials with their extensions, textures, samplers,
// images.

required_entries! {
    /// Reference of a material to a texture.
    TextureInfo {
        index: u32,
        #[serde(default)]
        tex_coord: u32,
        /// Scale of a normal map's x and y.
        #[serde(default = "default_scale")]
        scale: f32,
        #[serde(default)]
        extensions: TextureInfoExtensions,
    }
}

fn default_scale() -> f32 {
    1.0
}

entries! {
    /// Supported extensions of a texture reference.
    TextureInfoExtensions {
        #[serde(rename = "KHR_texture_transform")]
        transform: Option<TextureTransform>,
    }

    /// Transform of texture coordinates; the rotation is in radians.
    TextureTransform {
        offset: [f32; 2],
        rotation: f32,
        scale: [f32; 2] = [1.0; 2],
        tex_coord: Option<u32>,
    }
}

/// A material: the numbers and textures that the file states, by names of object and property in
/// the [table](super::extensions).
#[derive(Debug, Default)]
pub(in crate::gltf) struct MaterialEntry {
    pub name: Option<String>,
    pub alpha_mode: Option<String>,
    pub double_sided: bool,
    pub has_occlusion_map: bool,
    pub numbers: BTreeMap<PropertyName, [f64; 4]>,
    pub textures: BTreeMap<PropertyName, TextureInfo>,
    /// Names of the extensions in the table.
    pub extensions: Vec<&'static str>,
    /// Data of unsupported extensions, by name.
    pub others: BTreeMap<String, Value>,
}

/// Names of an object of a material and of a property of this object.
type PropertyName = (&'static str, &'static str);

impl<'de> Deserialize<'de> for MaterialEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut entry = Self::default();
        ObjectReader("", &mut entry).deserialize(deserializer)?;
        Ok(entry)
    }
}

/// Key of the object that contains a material's extensions.
const EXTENSIONS: &str = "extensions";

/// Reads the object with this name into a material, because `serde(flatten)` would lose the path of
/// a fault.
struct ObjectReader<'m>(&'static str, &'m mut MaterialEntry);

impl<'de> DeserializeSeed<'de> for ObjectReader<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for ObjectReader<'_> {
    type Value = ();

    fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("an object of a material")
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let Self(object, out) = self;
        while let Some(key) = map.next_key::<String>()? {
            if let Some((key, property)) = find_property(object, &key) {
                let name = (object, *key);
                let is_repeated = match property.length() {
                    0 => (map.next_value::<Option<_>>()?)
                        .and_then(|texture| out.textures.insert(name, texture))
                        .is_some(),
                    length => read_numbers(&mut map, length)?
                        .and_then(|numbers| out.numbers.insert(name, numbers))
                        .is_some(),
                };
                if is_repeated {
                    return Err(A::Error::duplicate_field(key));
                }
                continue;
            }
            match (object, key.as_str()) {
                ("", "name") => out.name = map.next_value()?,
                ("", "alphaMode") => out.alpha_mode = map.next_value()?,
                ("", "doubleSided") => out.double_sided = map.next_value()?,
                ("", "occlusionTexture") => {
                    out.has_occlusion_map = map.next_value::<Option<TextureInfo>>()?.is_some();
                }
                ("", CORE) => map.next_value_seed(ObjectReader(CORE, out))?,
                ("", EXTENSIONS) => map.next_value_seed(ObjectReader(EXTENSIONS, out))?,
                (EXTENSIONS, name) => match find_material_object(name) {
                    Some(MaterialObject { name, .. }) => {
                        out.extensions.push(name);
                        map.next_value_seed(ObjectReader(name, out))?;
                    }
                    None => drop(out.others.insert(key, map.next_value()?)),
                },
                _ => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        Ok(())
    }
}

/// Reads a number, or a list of three or four numbers; missing numbers become 1.
fn read_numbers<'de, A: MapAccess<'de>>(
    map: &mut A,
    length: usize,
) -> Result<Option<[f64; 4]>, A::Error> {
    Ok(match length {
        1 => map.next_value::<Option<_>>()?.map(|x| [x, 1.0, 1.0, 1.0]),
        3 => map
            .next_value::<Option<[_; 3]>>()?
            .map(|[r, g, b]| [r, g, b, 1.0]),
        _ => map.next_value()?,
    })
}

entries! {
    /// A texture sampler, with the OpenGL codes of the specification; `None` leaves the choice to the
    /// importer.
    TextureSampler {
        mag_filter: Option<u32>,
        wrap_s: Option<u32>,
        wrap_t: Option<u32>,
    }

    /// An image: in another file, embedded in the JSON, or in a buffer view.
    ImageEntry {
        buffer_view: Option<u32>,
        name: Option<String>,
        uri: Option<String>,
    }

    /// A texture: an image with a sampler.
    TextureEntry {
        name: Option<String>,
        sampler: Option<u32>,
        source: Option<u32>,
        extensions: TextureExtensions,
    }
}

impl TextureEntry {
    /// Image indices in order of preference: images of extensions before the fallback.
    pub fn image_sources(&self) -> impl Iterator<Item = u32> {
        let TextureExtensions { webp, basis } = &self.extensions;
        [webp.source, basis.source, self.source]
            .into_iter()
            .flatten()
    }
}

entries! {
    /// Images of a texture in WebP and Basis Universal, each from an extension.
    TextureExtensions {
        #[serde(rename = "EXT_texture_webp")]
        webp: TextureSource,
        #[serde(rename = "KHR_texture_basisu")]
        basis: TextureSource,
    }

    /// Reference of a texture extension to an image.
    TextureSource {
        source: Option<u32>,
    }
}
