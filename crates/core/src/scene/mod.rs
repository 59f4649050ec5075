//! The scene as plain data: what a file says, in doubles, with names as references and no
//! behaviour.
//!
//! Everything here is serde data and nothing else; [`crate::validate`] checks it,
//! [`crate::effects`] reads it, and [`crate::prepare()`] turns it into what an integrator walks.
//! Numbers in a file may be expressions of `t` and the scene's parameters; the loader evaluates
//! them, so here every number is a number. What is evaluated per hit stays text
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
pub use field::{Bounds, ConstantValue, Field, FieldValue, Fields};
pub use input::{
    Channel, Checker, CheckerInput, Colour, ColourInput, Input, NumberInput, TextureInput,
    TextureRef, Value, Weight,
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

/// The version of the scene format that this program reads.
pub const FORMAT: u32 = 1;

/// The JSON Schema (draft 2020-12) of scene files, in TOML and JSON alike, for editors and
/// generators: what the types say, and that numbers may be expressions. A file, since making it
/// takes a compiler longer than all that it describes; a test holds it to the types.
pub const SCHEMA: &str = include_str!("schema.json");

/// A point or direction of a scene file: x, y, z in world units.
pub type Triple = [f64; 3];

/// One scene: everything a picture depends on besides the flags of the command line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Version of the format; must be 1 and stands first in a file.
    pub format: u32,
    /// One line about the scene, shown by `presets` and `info`.
    #[serde(default)]
    pub title: String,
    /// Time in seconds at which the expressions are evaluated; `--at` overrides it.
    #[serde(default)]
    pub t: f64,
    /// Named numbers for expressions; a later one may use the earlier ones. `--set NAME=VALUE`
    /// overrides.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Picture size, samples, depth, display; flags override each.
    #[serde(default)]
    pub render: Render,
    /// Rules that the classic materials of this scene share.
    #[serde(default)]
    pub classic: ClassicRules,
    /// Views; the first one is the default. Empty: the scene is framed automatically.
    #[serde(default)]
    pub cameras: Vec<Camera>,
    /// What a ray sees that hits nothing, and the light it brings. None: black, and no light from
    /// it.
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
    /// Named triangle meshes; an object that names a mesh shows it.
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    /// Models in files of their own, placed with all that they bring.
    #[serde(default)]
    pub models: Vec<ModelFile>,
    /// What can be hit, in order: the order decides ties and "first occluder".
    #[serde(default)]
    pub objects: Vec<Object>,
    /// Rules that make many objects, for scaling studies; their objects follow the listed ones.
    #[serde(default)]
    pub generators: Vec<Generator>,
    /// What the file that a scene was imported from says of materials beyond what they have here;
    /// filled in by importers.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub unread: Vec<Unread>,
}

/// A part of a material that the scene has no words for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unread {
    /// Name of the material.
    pub material: String,
    /// What the file's format calls it: the name of an extension.
    pub what: String,
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
