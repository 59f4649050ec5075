//! The scene as plain data: the content of a file, in f64, with names as references and without
//! behaviour.
//!
//! This module holds serde data alone. [`crate::validate`] checks it, [`crate::effects`] lists the
//! features that it needs, and [`crate::prepare()`] builds the data that an integrator traverses.
//! Numbers in a file may be expressions of `t` and the scene's parameters. The loader evaluates
//! them, so every number here is a number. Values evaluated at each hit stay text
//! ([`Weight::Expression`], [`ColourInput::Expression`]).
//!
//! Units: metres, seconds, degrees; radiance in linear Rec. 709 primaries.

mod camera;
mod field;
mod input;
mod light;
mod material;
mod mesh;
mod model;
mod object;
mod positions;
mod render;
#[cfg(test)]
mod schema;

pub use camera::{Camera, Fit, Pinhole, Pose, Projection};
pub use field::{ConstantValue, FieldBounds, FieldValue, MaterialField, MaterialFields};
pub use input::{
    Channel, Checker, CheckerInput, Colour, ColourInput, Input, InputValue, NumberInput,
    TextureInput, TextureRef, Weight,
};
pub use light::{Falloff, Light, LightKind, Sky, SkyMap, Studio, Sun};
pub use material::*;
pub use mesh::{
    ColourSpace, Filter, Image, ImageData, MOST_UV_SETS, Mesh, MeshData, MeshSource, ModelPart,
    Pixels, Texture, Wrap,
};
pub use model::ModelFile;
pub use object::{Generator, GeneratorKind, Object, Shape, SideRule, TransformStep};
pub use positions::{Positions, origin_near};
pub use render::{
    ClassicRules, ConstantOffset, DepthLimit, Integrator, OffsetDirection, Pattern, Render,
    ShadowRule, SpawnRule, ToneMap, TransferCurve,
};

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Version of the scene format that this program reads.
pub const FORMAT: u32 = 1;

/// JSON Schema (draft 2020-12) of scene files, in TOML and JSON alike, for editors and generators.
/// Derived from the scene types; numbers may also be expressions. Kept as a file, because deriving
/// it compiles longer than the scene types themselves; a test compares it with the types.
pub const SCHEMA: &str = include_str!("schema.json");

/// A point or direction of a scene file: x, y, z in world units.
pub type Triple = [f64; 3];

/// A scene: everything that a picture depends on besides the flags of the command line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[doc(alias = "BasicScene")]
pub struct Scene {
    /// Version of the format; must be 1 and comes first in a file.
    pub format: u32,
    /// One line about the scene, shown by `presets` and `info`.
    #[serde(default)]
    pub title: String,
    /// Time in seconds at which the expressions are evaluated; `--at` overrides it.
    #[serde(default)]
    pub t: f64,
    /// Named numbers for expressions; a parameter may use earlier ones. `--set NAME=VALUE`
    /// overrides.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Picture size, samples, depth, display; flags override each.
    #[serde(default)]
    pub render: Render,
    /// Rules that the classic materials of this scene share.
    #[serde(default)]
    pub classic: ClassicRules,
    /// Views; the first is the default. Empty: the scene is framed automatically.
    #[serde(default)]
    pub cameras: Vec<Camera>,
    /// Radiance of rays that hit nothing, which also lights the scene. None: black, and no light.
    #[serde(default)]
    pub sky: Option<Sky>,
    /// Light sources besides the sky and emissive surfaces.
    #[serde(default)]
    pub lights: Vec<Light>,
    /// Image files that textures read.
    #[serde(default)]
    pub images: Vec<Image>,
    /// Named textures: an image with its filter and wrap modes.
    #[serde(default)]
    pub textures: Vec<Texture>,
    /// Named materials.
    #[serde(default)]
    pub materials: Vec<Material>,
    /// Named triangle meshes; an object shows a mesh by its name.
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    /// Models in their own files, placed with their objects, materials and lights.
    #[serde(default)]
    pub models: Vec<ModelFile>,
    /// Objects that rays can hit. Their order decides ties and the "first occluder".
    #[serde(default)]
    pub objects: Vec<Object>,
    /// Rules that each make many objects, for scaling studies; their objects follow the listed
    /// ones.
    #[serde(default)]
    pub generators: Vec<Generator>,
    /// Material properties of an imported file that the scene format cannot represent; filled in by
    /// importers.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub unread: Vec<UnreadPart>,
}

/// A material property of an imported file that the scene format cannot represent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnreadPart {
    /// Name of the material.
    pub material: String,
    /// Name in the file's format: the name of an extension.
    pub label: String,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            format: FORMAT,
            title: String::new(),
            t: 0.0,
            parameters: BTreeMap::new(),
            render: Render::default(),
            classic: ClassicRules::default(),
            cameras: Vec::new(),
            sky: None,
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
