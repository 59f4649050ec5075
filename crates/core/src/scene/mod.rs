//! The scene as plain data: the content of a scene file, with numbers in `f64` and references by
//! name.
//!
//! The types of this module are read and written by serde. [`crate::validate`] checks a scene,
//! [`crate::effects`] lists the effects that it needs, and [`crate::prepare()`] builds the data
//! that an integrator reads. Numbers in a file may be expressions of `t` and the scene's
//! parameters; the loader replaces these expressions by their values. Expressions that are
//! evaluated at each hit remain text ([`ScalarFactor::Expression`], [`ColourInput::Expression`]).
//!
//! Units: metres, seconds, degrees; radiance in linear Rec. 709 primaries.

mod camera;
mod field;
mod input;
mod light;
mod material;
mod medium;
mod mesh;
mod object;
mod parameter;
mod positions;
mod render;
#[cfg(test)]
mod schema;

pub use camera::{AspectFit, Camera, Pinhole, Pose, Projection};
#[doc(hidden)]
pub use field::{ConstantValue, FieldBounds, FieldValue, MaterialField, MaterialFields};
pub use input::{
    Channel, Checker, CheckerInput, Colour, ColourInput, Input, NumberInput, TextureInput,
    TextureRef,
};
#[doc(hidden)]
pub use input::{InputValue, ScalarFactor};
pub use light::{Falloff, Light, LightKind, Sky, SkyMap, Studio, Sun};
pub use material::*;
pub use medium::{Medium, single_scattering_albedo};
#[doc(hidden)]
pub use mesh::MOST_UV_SETS;
pub use mesh::{
    ColourSpace, Image, ImageData, Mesh, MeshData, MeshSource, ModelSelection, PixelData, Texture,
    TextureFilter, WrapMode,
};
pub use object::{Generator, GeneratorKind, ModelFile, Object, Shape, SideRule, TransformStep};
pub use parameter::{Parameter, ParameterRange};
pub use positions::VertexPositions;
#[doc(hidden)]
pub use positions::choose_storage_origin;
pub use render::{
    ClassicRules, ConstantOffset, DepthLimit, Integrator, OffsetDirection, RenderSettings,
    SamplePattern, ShadowRule, SpawnRule, ToneMap, TransferCurve,
};

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Version of the scene format that this program reads.
pub const FORMAT: u32 = 1;

/// JSON Schema (draft 2020-12) of scene files in TOML and JSON, for editors and generators. It
/// permits expressions in place of numbers. The schema is kept as a file, because deriving it from
/// the scene types takes long to compile. A test compares the file with the types.
pub const SCHEMA: &str = include_str!("schema.json");

/// A point or direction of a scene file: x, y, z in world units.
pub type Triple = [f64; 3];

/// A scene: all data that a picture depends on, except the flags of the command line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[doc(alias = "BasicScene")]
pub struct Scene {
    /// Version of the format: 1. It is the first key of a file.
    pub format: u32,
    /// A line of text about the scene, which the commands `presets` and `info` show.
    #[serde(default)]
    pub title: String,
    /// Time in seconds at which expressions are evaluated. The flag `--at` overrides it.
    #[serde(default)]
    pub t: f64,
    /// Seconds after which the scene looks as at the start: the length of `--frames all` and of the
    /// viewer's time slider. None: it does not repeat.
    #[serde(default)]
    pub period: Option<f64>,
    /// Named numbers for expressions. A parameter may be an expression of earlier parameters. A
    /// table `{ value, min, max, step }` states the range of a slider, in which `--set` must lie.
    /// The flag `--set NAME=VALUE` overrides a parameter.
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
    /// Picture size, samples, depth and display. Flags of the command line override each.
    #[serde(default)]
    pub render: RenderSettings,
    /// Rules for all classic materials of the scene.
    #[serde(default)]
    pub classic: ClassicRules,
    /// Cameras, of which the first is the default. Empty: a camera is placed automatically.
    #[serde(default)]
    pub cameras: Vec<Camera>,
    /// The sky: radiance of rays that hit nothing. It also lights the scene. None: a black sky.
    #[serde(default)]
    pub sky: Option<Sky>,
    /// The medium between the bodies, such as fog. None: clear air.
    #[serde(default)]
    pub air: Option<Medium>,
    /// Light sources besides the sky and emissive surfaces.
    #[serde(default)]
    pub lights: Vec<Light>,
    /// Image files that textures read.
    #[serde(default)]
    pub images: Vec<Image>,
    /// Named textures: images with their colour spaces, filters and wrap modes.
    #[serde(default)]
    pub textures: Vec<Texture>,
    /// Named materials.
    #[serde(default)]
    pub materials: Vec<Material>,
    /// Named triangle meshes, which objects show by name.
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    /// Models in their own files, which add objects, materials and lights to the scene.
    #[serde(default)]
    pub models: Vec<ModelFile>,
    /// Objects that rays can hit. Of several hits at equal distances, the first object in this
    /// order counts. The order also determines which occluder is the first.
    #[serde(default)]
    pub objects: Vec<Object>,
    /// Generators, each of which makes many objects, for studies of speed. Their objects follow the
    /// listed objects.
    #[serde(default)]
    pub generators: Vec<Generator>,
    /// Material properties of imported files that the scene format cannot represent; importers fill
    /// in the list.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub unread: Vec<UnsupportedProperty>,
}

impl Scene {
    /// Returns the values of the parameters by name.
    pub fn parameter_values(&self) -> BTreeMap<String, f64> {
        let values = self.parameters.iter();
        values
            .map(|(name, parameter)| (name.clone(), parameter.value))
            .collect()
    }
}

/// A material property of an imported file that the scene format cannot represent, and that the
/// picture therefore lacks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnsupportedProperty {
    /// Name of the material.
    pub material: String,
    /// Name of the property in the file's format, such as the name of an extension.
    pub label: String,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            format: FORMAT,
            title: String::new(),
            t: 0.0,
            period: None,
            parameters: BTreeMap::new(),
            render: RenderSettings::default(),
            classic: ClassicRules::default(),
            cameras: Vec::new(),
            sky: None,
            air: None,
            lights: Vec::new(),
            images: Vec::new(),
            textures: Vec::new(),
            materials: Vec::new(),
            meshes: Vec::new(),
            models: Vec::new(),
            objects: Vec::new(),
            generators: Vec::new(),
            unread: Vec::new(),
        }
    }
}
