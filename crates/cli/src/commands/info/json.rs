//! What `info` tells as JSON: the same facts as its table, as numbers and lists that a script can
//! use.

use raywright_core::scene::{Image, Shape};
use raywright_core::{Lookup, Scene, Settings, estimate, extent};
use raywright_io::Loaded;
use serde::Serialize;
use serde_json::{Map, Value, json};

/// A file and what is in it. Lists are empty where there is none of a thing.
#[derive(Serialize)]
pub struct Facts {
    /// Version of this layout.
    format: u32,
    file: String,
    /// What it is written in.
    notation: &'static str,
    title: String,
    /// Width and height that a picture has without flags.
    size: [u32; 2],
    cameras: Vec<String>,
    /// Counts by kind, as those of objects.
    lights: Map<String, Value>,
    objects: Map<String, Value>,
    triangles: Triangles,
    materials: Vec<String>,
    textures: usize,
    images: Vec<Value>,
    scenes: Vec<String>,
    variants: Vec<String>,
    animations: Vec<Value>,
    extensions: Vec<Value>,
    /// Least and greatest corner of all that has an end; null where nothing has.
    bounds: Option<[[f64; 3]; 2]>,
    /// Bytes that a picture would take at the most, by what takes them.
    memory: Map<String, Value>,
    hash: String,
}

/// Triangles of meshes.
#[derive(Serialize)]
struct Triangles {
    /// Each mesh once.
    stored: usize,
    /// As often as listed objects show them.
    shown: usize,
    meshes: usize,
}

impl Facts {
    /// The facts of a loaded file.
    pub fn of(loaded: &Loaded) -> Self {
        let (scene, contents) = (&loaded.scene, &loaded.contents);
        let settings = Settings::of(scene);
        let bounds = extent(scene, settings.precision).bounds;
        let animation = |info: &raywright_io::AnimationInfo| json!({ "name": info.name, "seconds": info.seconds });
        let extension = |info: &raywright_io::ExtensionInfo| json!({ "name": info.name, "required": info.required, "read": info.read });
        Self {
            format: 1,
            file: loaded.source.name.clone(),
            notation: super::format(loaded.source.format),
            title: scene.title.clone(),
            size: scene.render.size,
            cameras: scene
                .cameras
                .iter()
                .map(|camera| camera.name.clone())
                .collect(),
            lights: counted(
                scene
                    .lights
                    .iter()
                    .map(|light| super::light_kind(&light.kind)),
            ),
            objects: counted(
                scene
                    .objects
                    .iter()
                    .map(|object| super::shape_kind(&object.shape)),
            ),
            triangles: triangles(scene),
            materials: scene
                .materials
                .iter()
                .map(|material| material.name.clone())
                .collect(),
            textures: scene.textures.len(),
            images: scene.images.iter().map(image).collect(),
            scenes: contents.scenes.clone(),
            variants: contents.variants.clone(),
            animations: contents.animations.iter().map(animation).collect(),
            extensions: contents.extensions.iter().map(extension).collect(),
            bounds: (!bounds.is_empty()).then(|| [bounds.min.to_array(), bounds.max.to_array()]),
            memory: estimate(scene, &settings)
                .parts()
                .into_iter()
                .map(|(name, bytes)| (name.to_owned(), bytes.into()))
                .collect(),
            hash: loaded.hash.to_string(),
        }
    }
}

fn counted<'a>(kinds: impl Iterator<Item = &'a str>) -> Map<String, Value> {
    let mut counts = Map::new();
    for kind in kinds {
        let count = counts.get(kind).and_then(Value::as_u64).unwrap_or_default();
        counts.insert(kind.to_owned(), (count + 1).into());
    }
    counts
}

fn triangles(scene: &Scene) -> Triangles {
    let lookup = Lookup::new(scene);
    let of = |name: &str| lookup.mesh_data(name).map_or(0, |data| data.indices.len());
    let shown = scene.objects.iter().map(|object| {
        if let Shape::Mesh(name) = &object.shape {
            of(name)
        } else {
            0
        }
    });
    let stored = scene.meshes.iter().map(|mesh| of(&mesh.name)).sum();
    Triangles {
        stored,
        shown: shown.sum(),
        meshes: scene.meshes.len(),
    }
}

fn image(image: &Image) -> Value {
    match &image.data {
        Some(data) => {
            json!({ "name": image.name, "width": data.width, "height": data.height, "bytes": data.bytes() })
        }
        None => json!({ "name": image.name, "missing": true }),
    }
}
