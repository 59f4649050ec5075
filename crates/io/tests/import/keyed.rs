//! A small model with two scenes, three variants and animation keys given by a test.

use std::path::PathBuf;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DAffine3;
use raywright_core::affine_from_steps;
use raywright_io::{Error, Input, LoadOptions, LoadedScene, ModelOptions, ParameterOverrides};
use serde_json::{Value, json};

/// A triangle, keys at 1 and 3 seconds, and their values, each in its own accessor.
pub struct KeyedTriangle {
    document: Value,
    bytes: Vec<u8>,
    folder: tempfile::TempDir,
}

impl KeyedTriangle {
    /// Creates two scenes, each of a node with a child; the first child is at (0, 0, 5).
    pub fn new() -> Self {
        let primitive = json!({ "attributes": { "POSITION": 0 }, "material": 0, "extensions": { "KHR_materials_variants": {
            "mappings": [{ "material": 1, "variants": [1, 2] }] } } });
        let colour = |c: [f64; 3]| json!({ "pbrMetallicRoughness": { "baseColorFactor": [c[0], c[1], c[2], 1] } });
        let document = json!({
            "asset": { "version": "2.0" }, "scene": 0,
            "scenes": [{ "name": "day", "nodes": [0] }, { "nodes": [2] }],
            "nodes": [{ "children": [1], "translation": [0, 0, 5] }, { "mesh": 0 }, { "mesh": 0, "translation": [7, 0, 0] }],
            "meshes": [{ "primitives": [primitive] }],
            "materials": [colour([1.0, 0.0, 0.0]), colour([0.0, 0.0, 1.0])],
            "extensions": { "KHR_materials_variants": { "variants": [{ "name": "red" }, { "name": "blue" }, { "name": "sea" }] } },
            "accessors": [], "bufferViews": [], "animations": [],
        });
        let mut made = Self {
            document,
            bytes: Vec::new(),
            folder: tempfile::tempdir().expect("a folder"),
        };
        made.accessor("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        made
    }

    /// Adds floats of an element type; returns the accessor's index.
    pub fn accessor(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let arity = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": 4 * numbers.len() });
        self.bytes
            .extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        let accessors = self.document["accessors"].as_array_mut().expect("a list");
        let accessor = json!({ "bufferView": accessors.len(), "componentType": 5126, "count": numbers.len() / arity, "type": kind });
        accessors.push(accessor);
        let index = accessors.len() - 1;
        self.document["bufferViews"]
            .as_array_mut()
            .expect("a list")
            .push(view);
        index
    }

    /// Adds an animation of one channel with keys at 1 and 3 seconds.
    pub fn animated(
        mut self,
        name: &str,
        node: u32,
        path: &str,
        interpolation: &str,
        values: &[f32],
    ) -> Self {
        let input = self.accessor("SCALAR", &[1.0, 3.0]);
        let kind = match path {
            "rotation" => "VEC4",
            "weights" => "SCALAR",
            _ => "VEC3",
        };
        let output = self.accessor(kind, values);
        self.document["animations"]
            .as_array_mut()
            .expect("a list")
            .push(json!({
            "name": name, "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
            "samplers": [{ "input": input, "output": output, "interpolation": interpolation }] }));
        self
    }

    /// Adds vectors of four bytes, integers or normalised; returns their index.
    pub fn bytes(&mut self, fractions: bool, values: &[[u8; 4]]) -> usize {
        let floats: Vec<f32> = values.iter().map(|v| f32::from_le_bytes(*v)).collect();
        let index = self.accessor("SCALAR", &floats);
        let accessor = &mut self.document["accessors"][index];
        (
            accessor["componentType"],
            accessor["type"],
            accessor["normalized"],
        ) = (json!(5121), json!("VEC4"), json!(fractions));
        index
    }

    /// Applies a change to the JSON.
    pub fn with(mut self, change: impl FnOnce(&mut Value)) -> Self {
        change(&mut self.document);
        self
    }

    /// Writes the file.
    pub fn write(&self) -> PathBuf {
        let mut document = self.document.clone();
        let uri = format!(
            "data:application/octet-stream;base64,{}",
            STANDARD.encode(&self.bytes)
        );
        document["buffers"] = json!([{ "byteLength": self.bytes.len(), "uri": uri }]);
        let path = self.folder.path().join("made.gltf");
        std::fs::write(&path, document.to_string()).expect("a file");
        path
    }

    /// Loads the file with these choices.
    pub fn load_with(
        &self,
        scene: Option<&str>,
        variant: Option<&str>,
        at: Option<f64>,
    ) -> Result<LoadedScene, Error> {
        load_with(self.write(), scene, variant, at)
    }

    /// Transform of the only visible object at a time.
    pub fn transform_at(&self, time: f64) -> DAffine3 {
        let loaded = self
            .load_with(None, None, Some(time))
            .unwrap_or_else(|e| panic!("{e}"));
        let [object] = &loaded.scene.objects[..] else {
            panic!("one object")
        };
        affine_from_steps(&object.transform)
    }
}

/// Loads a file with these choices.
pub fn load_with(
    path: PathBuf,
    scene: Option<&str>,
    variant: Option<&str>,
    at: Option<f64>,
) -> Result<LoadedScene, Error> {
    let model = ModelOptions {
        scene: scene.map(str::to_owned),
        variant: variant.map(str::to_owned),
        ..ModelOptions::default()
    };
    let overrides = ParameterOverrides {
        time: at,
        set: Vec::new(),
    };
    raywright_io::load(
        &Input::Path(path),
        &LoadOptions {
            overrides,
            model,
            ..LoadOptions::default()
        },
    )
}
