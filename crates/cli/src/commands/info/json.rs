//! `info` as JSON: the content of the table of `info`, as numbers and lists for scripts.

use std::collections::BTreeMap;

use raywright_core::extent::SceneExtent;
use raywright_core::scene::{Image, Shape};
use raywright_core::{Scene, SceneLookup, Settings, estimate_scene_memory, measure_scene_extent};
use raywright_io::LoadedScene;
use serde::Serialize;
use serde_json::{Value, json};

/// Contents of a scene or model file. A list is empty if the file has no item of its kind.
#[derive(Serialize)]
pub struct FileInfo {
    /// Version of the layout of this structure.
    format: u32,
    pub file: String,
    /// File format.
    pub notation: &'static str,
    pub title: String,
    /// Width and height in pixels of a picture rendered without flags.
    size: [u32; 2],
    pub cameras: Vec<String>,
    /// Number of lights and number of objects, by kind.
    pub lights: BTreeMap<&'static str, usize>,
    pub objects: BTreeMap<&'static str, usize>,
    pub triangles: TriangleCounts,
    materials: Vec<String>,
    textures: usize,
    images: Vec<Value>,
    scenes: Vec<String>,
    variants: Vec<String>,
    animations: Vec<Value>,
    extensions: Vec<Value>,
    /// Least and greatest corner of the box around all bounded shapes; null without bounded shapes.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Number of shapes without bounds.
    #[serde(skip)]
    pub unbounded: usize,
    /// Upper bound of a render's memory in bytes, for each part such as `geometry`.
    memory: BTreeMap<&'static str, u64>,
    pub hash: String,
}

/// Numbers of mesh triangles and of meshes.
#[derive(Serialize)]
pub struct TriangleCounts {
    /// Number of triangles of all meshes, each mesh counted once.
    pub stored: usize,
    /// Number of triangles of all listed objects, with each instance of a mesh counted.
    pub shown: usize,
    pub meshes: usize,
}

impl FileInfo {
    /// Collects the contents of a loaded file.
    pub fn from_loaded(loaded: &LoadedScene) -> Self {
        let (scene, contents) = (&loaded.scene, &loaded.contents);
        let settings = Settings::from_scene(scene);
        let SceneExtent { bounds, unbounded } = measure_scene_extent(scene, settings.precision);
        let animation = |info: &raywright_io::AnimationInfo| json!({ "name": info.name, "seconds": info.seconds });
        let extension = |info: &raywright_io::ExtensionInfo| json!({ "name": info.name, "required": info.required, "read": info.is_supported });
        Self {
            format: 1,
            file: loaded.source.name.clone(),
            notation: super::scene_format_name(loaded.source.format),
            title: scene.title.clone(),
            size: scene.render.size,
            cameras: scene
                .cameras
                .iter()
                .map(|camera| camera.name.clone())
                .collect(),
            lights: count_by_kind(
                scene
                    .lights
                    .iter()
                    .map(|light| super::light_kind(&light.kind)),
            ),
            objects: count_by_kind(
                scene
                    .objects
                    .iter()
                    .map(|object| super::shape_kind(&object.shape)),
            ),
            triangles: count_triangles(scene),
            materials: scene
                .materials
                .iter()
                .map(|material| material.name.clone())
                .collect(),
            textures: scene.textures.len(),
            images: scene.images.iter().map(describe_image).collect(),
            scenes: contents.scenes.clone(),
            variants: contents.variants.clone(),
            animations: contents.animations.iter().map(animation).collect(),
            extensions: contents.extensions.iter().map(extension).collect(),
            unbounded,
            bounds: (!bounds.is_empty()).then(|| [bounds.min.to_array(), bounds.max.to_array()]),
            memory: estimate_scene_memory(scene, &settings)
                .bytes_by_purpose()
                .into_iter()
                .collect(),
            hash: loaded.hash.to_string(),
        }
    }
}

/// Counts the items of each kind.
pub fn count_by_kind(kinds: impl Iterator<Item = &'static str>) -> BTreeMap<&'static str, usize> {
    let mut counts = BTreeMap::new();
    kinds.for_each(|kind| *counts.entry(kind).or_default() += 1);
    counts
}

pub fn count_triangles(scene: &Scene) -> TriangleCounts {
    let lookup = SceneLookup::new(scene);
    let triangle_count = |name: &str| lookup.mesh_data(name).map_or(0, |data| data.indices.len());
    let shown = scene.objects.iter().map(|object| {
        if let Shape::Mesh(name) = &object.shape {
            triangle_count(name)
        } else {
            0
        }
    });
    let stored = scene
        .meshes
        .iter()
        .map(|mesh| triangle_count(&mesh.name))
        .sum();
    TriangleCounts {
        stored,
        shown: shown.sum(),
        meshes: scene.meshes.len(),
    }
}

fn describe_image(image: &Image) -> Value {
    match &image.data {
        Some(data) => {
            json!({ "name": image.name, "width": data.width, "height": data.height, "bytes": data.byte_size() })
        }
        None => json!({ "name": image.name, "missing": true }),
    }
}
