//! Import of glTF 2.0: `.gltf` with its buffers and images, and `.glb`.
//!
//! What is read: a scene's node hierarchy, at rest or at a time of its animations; triangles in all three topologies with
//! positions, normals, texture coordinates and vertex colours from any valid accessor; metallic-roughness materials with base colour,
//! metallic-roughness and emissive textures, and their variants; perspective and orthographic cameras; and the extensions
//! listed in [`extensions`]. What is not read yet (skins, morph targets, normal maps, further extensions) is named in a
//! warning; when a file *requires* it, the file is refused.
//!
//! Nothing in a file is trusted: `gltf`'s validating entry is not used, because it refuses valid files and its readers
//! panic on invalid ones; the checks are those of [`document`], [`buffers`] and [`accessor`].

mod accessor;
mod animation;
mod buffers;
mod camera;
mod census;
mod choose;
mod document;
mod extensions;
mod glb;
mod light;
mod material;
mod mesh;
mod nodes;
mod specular_glossiness;
mod texture;

use std::collections::HashMap;
use std::path::Path;

use gltf::json::mesh::Primitive;
use raywright_core::Scene;
use raywright_core::scene::{Mesh, MeshSource, Object, Shape, SideRule};

pub(crate) use choose::Choice;
pub use choose::{AnimationInfo, Contents};

use accessor::{MOST_INVENTED, Reader};
use buffers::{Buffers, absent};
use document::Document;
use material::UsedMaterial;
use nodes::Placed;

use crate::folder::Folder;
use crate::import::{Budget, Fault, Names, Outcome, Warnings, checked};
use crate::{Error, Limits, Warning, mesh_tools, uri};

/// What came out of a file.
pub(crate) struct Model {
    pub scene: Scene,
    pub warnings: Vec<Warning>,
    pub contents: Contents,
}

/// Reads what is meant of a glTF or GLB file (told apart by content), given its bytes, with everything it refers to in its
/// folder.
///
/// # Errors
/// An error of kind input when the file or a buffer is wrong or needs what is not supported, of kind limit when it asks for
/// more than `limits`, of kind usage for a scene or variant that it has not. A texture that is missing is only a warning.
pub(crate) fn load(file: &Path, bytes: &[u8], folder: &Folder, limits: &Limits, choice: &Choice<'_>) -> Result<Model, Error> {
    import(file, bytes, folder, limits, choice).map_err(|fault| fault.into_error(file.display()))
}

fn import(file: &Path, bytes: &[u8], folder: &Folder, limits: &Limits, choice: &Choice<'_>) -> Outcome<Model> {
    if bytes.is_empty() {
        return Err(Fault::input("is empty"));
    }
    let mut warnings = Warnings::default();
    let mut budget = Budget::new(limits);
    let (json, binary) = match glb::is_container(bytes) {
        true => glb::parse(bytes, &mut warnings).map(|parts| (parts.json, parts.binary))?,
        false => (bytes, None),
    };
    let document = document::parse(json, limits, &mut warnings)?;
    let scene = choice.scene.map(|wish| choose::scene(&document, wish)).transpose()?;
    let variant = choice.variant.map(|wish| choose::variant(&document, wish)).transpose()?;
    // Images that nothing visible uses are not read, and are the user's all the same.
    document.images.iter().filter_map(|image| image.uri.as_ref()).for_each(|uri| uri::name(folder, uri));
    let buffers = Buffers::load(&document, binary, folder, &mut budget)?;
    let reader =
        Reader { document: &document, buffers: &buffers, memory_bytes: limits.memory_bytes, invented: MOST_INVENTED.into() };
    let import = Import {
        document: &document,
        reader,
        file,
        folder,
        limits,
        budget,
        warnings,
        variant,
        scene: Scene { title: title(&document, scene, file), ..Scene::default() },
        names: TableNames::default(),
        materials: HashMap::new(),
        textures: HashMap::new(),
        images: HashMap::new(),
        meshes: HashMap::new(),
    };
    import.run(scene, choice.time)
}

/// The scene's own name, or the file's.
fn title(document: &Document, scene: Option<usize>, file: &Path) -> String {
    let scene = document.scenes.get(scene.unwrap_or(document.scene.unwrap_or(0) as usize));
    match scene.and_then(|scene| scene.name.as_ref()) {
        Some(name) if !name.is_empty() => name.clone(),
        _ => file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default(),
    }
}

/// Names handed out so far, by table of the scene.
#[derive(Default)]
struct TableNames {
    images: Names,
    textures: Names,
    materials: Names,
    meshes: Names,
}

/// A mesh of the scene.
#[derive(Clone, Debug)]
struct UsedMesh {
    name: String,
    /// Its place in the scene's list.
    place: usize,
}

/// The import of one file under way.
struct Import<'a> {
    document: &'a Document,
    reader: Reader<'a>,
    file: &'a Path,
    folder: &'a Folder,
    limits: &'a Limits,
    budget: Budget,
    warnings: Warnings,
    /// Index of the variant whose materials are shown; none: the default look.
    variant: Option<u32>,
    scene: Scene,
    names: TableNames,
    /// By index in the file; none is the default material.
    materials: HashMap<Option<usize>, UsedMaterial>,
    /// Name in the scene by index in the file and colour space; none where the image could not be had.
    textures: HashMap<(usize, bool), Option<String>>,
    /// As `textures`, by index of the image.
    images: HashMap<usize, Option<String>>,
    /// By mesh and primitive; none where nothing of it can be drawn.
    meshes: HashMap<(usize, usize), Option<UsedMesh>>,
}

impl Import<'_> {
    fn run(mut self, scene: Option<usize>, time: Option<f64>) -> Outcome<Model> {
        extensions::warn_ignored(self.document.extensions(), &mut self.warnings);
        let moved = match time {
            Some(time) => animation::at(time, self.document, &self.reader, &mut self.warnings)?,
            None if self.document.animations.is_empty() => HashMap::new(),
            None => {
                self.warnings.add("has animations and is shown at rest; --at shows a moment of them");
                HashMap::new()
            }
        };
        let placed = nodes::placed(self.document, scene, &moved, &mut self.warnings)?;
        for placed in &placed {
            self.node(placed).map_err(|fault| fault.at(format_args!("nodes[{}]", placed.node)))?;
        }
        if self.scene.objects.is_empty() {
            self.warnings.add("the scene that is shown has no triangles: nothing to see");
        }
        let contents = choose::contents(self.document, &self.reader);
        Ok(Model { scene: checked(self.scene)?, warnings: self.warnings.finish(self.file.display()), contents })
    }

    /// Adds what one node carries.
    fn node(&mut self, placed: &Placed) -> Outcome<()> {
        let Some(node) = self.document.nodes.get(placed.node) else { return Ok(()) };
        let node_name = node.name.clone().unwrap_or_default();
        if let Some(index) = node.mesh {
            self.mesh_of_node(index as usize, &node_name, placed)?;
            if node.skin.is_some() {
                self.warnings.add("skins are ignored: skinned meshes are shown as their nodes place them");
            }
        }
        if let Some(index) = node.camera.map(|i| i as usize) {
            let list = &self.document.cameras;
            let camera = list.get(index).ok_or_else(|| absent("cameras", index, list.len()))?;
            let name = camera.name.clone().filter(|name| !name.is_empty()).unwrap_or(node_name.clone());
            self.scene.cameras.extend(camera::convert(camera, index, name, placed, &mut self.warnings));
        }
        if let Some(index) = node.extensions.light.light.map(|i| i as usize) {
            let list = &self.document.extensions.lights.lights;
            let light = list.get(index).ok_or_else(|| absent("KHR_lights_punctual.lights", index, list.len()))?;
            let name = light.name.clone().filter(|name| !name.is_empty()).unwrap_or(node_name);
            self.scene.lights.extend(light::convert(light, index, name, placed, &mut self.warnings));
        }
        Ok(())
    }

    /// Adds an object for each primitive of a mesh.
    fn mesh_of_node(&mut self, index: usize, node_name: &str, placed: &Placed) -> Outcome<()> {
        let list = &self.document.meshes;
        let mesh = list.get(index).ok_or_else(|| absent("meshes", index, list.len()))?;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let place = |fault: Fault| fault.at(format_args!("meshes[{index}].primitives[{i}]"));
            let material = self.material(self.look(primitive)).map_err(place)?;
            let used = match self.meshes.get(&(index, i)) {
                Some(known) => known.clone(),
                None => {
                    let data = self.primitive(primitive, &material, (index, i)).map_err(place)?;
                    let wish = mesh.name.as_deref().filter(|name| !name.is_empty()).unwrap_or("mesh");
                    let used = data.map(|data| {
                        let used = UsedMesh { name: self.names.meshes.unique(wish), place: self.scene.meshes.len() };
                        self.scene.meshes.push(Mesh {
                            name: used.name.clone(),
                            source: MeshSource::Inline(data.into()),
                            model: None,
                        });
                        used
                    });
                    self.meshes.insert((index, i), used.clone());
                    used
                }
            };
            if let Some(used) = used {
                let object_name = if node_name.is_empty() { mesh.name.as_deref().unwrap_or_default() } else { node_name };
                self.object(object_name, used, &material, placed)?;
            }
        }
        Ok(())
    }

    /// The material that a primitive shows, in the variant that is asked for.
    fn look(&self, primitive: &Primitive) -> Option<usize> {
        let mappings = primitive.extensions.as_ref().and_then(|extensions| extensions.khr_materials_variants.as_ref());
        let mapped = self.variant.zip(mappings).and_then(|(variant, variants)| {
            let mapping = variants.mappings.iter().find(|mapping| mapping.variants.contains(&variant))?;
            Some(mapping.material as usize)
        });
        mapped.or(primitive.material.map(|material| material.value()))
    }

    /// Adds one object that shows a mesh where a node puts it.
    fn object(&mut self, name: &str, mesh: UsedMesh, material: &UsedMaterial, placed: &Placed) -> Outcome<()> {
        self.budget.object()?;
        let (mesh, transform) = match mesh_tools::is_invertible(&placed.world) {
            true => (mesh.name, mesh_tools::transform_steps(&placed.world)),
            false => (self.flattened(mesh, placed)?, Vec::new()),
        };
        self.scene.objects.push(Object {
            name: name.to_owned(),
            shape: Shape::Mesh(mesh),
            material: material.name.clone(),
            side: if material.two_sided { SideRule::Both } else { SideRule::Outside },
            face_viewer: true,
            casts_shadow: true,
            transform,
            transform_end: None,
        });
        Ok(())
    }

    /// A copy of a mesh in world space, for nodes that squeeze it flat: such a transform has no inverse to trace rays with.
    fn flattened(&mut self, mesh: UsedMesh, placed: &Placed) -> Outcome<String> {
        let source = self.scene.meshes.get(mesh.place).map(|mesh| mesh.source.clone());
        let Some(MeshSource::Inline(data)) = source else { return Ok(mesh.name) };
        self.budget.memory(data.bytes(), 1)?;
        let name = self.names.meshes.unique(&mesh.name);
        let data = mesh_tools::squeezed(&data, &placed.world);
        self.scene.meshes.push(Mesh { name: name.clone(), source: MeshSource::Inline(data.into()), model: None });
        Ok(name)
    }
}
