//! Import of glTF 2.0: `.gltf` with its buffers and images, and `.glb`.
//!
//! The importer reads a scene's node hierarchy with skins and morph targets, at rest or at a time
//! of its animations; triangles in all three topologies from any valid accessor; materials with all
//! their textures, and their variants; perspective and orthographic cameras; and the extensions
//! listed in [`extensions`]. Unsupported parts (points, lines, further extensions) are reported in
//! a warning or in the effects report. A file that *requires* an unsupported extension is refused.
//!
//! Nothing in a file is trusted: the document has its own types, and the checks are in
//! [`document`], [`buffers`] and [`accessor`].

mod accessor;
mod animation;
mod animation_pointer;
mod buffers;
mod camera;
mod compression;
mod deform;
mod document;
mod entries;
mod extensions;
mod glb;
mod json;
mod keyframes;
mod layers;
mod light;
mod material;
mod mesh;
mod model_choice;
mod nodes;
mod objects;
mod specular_glossiness;
mod texture;
mod vertices;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use glam::DAffine3;
use raywright_core::validate::FARTHEST;
use raywright_core::{Observer, Scene};

pub(crate) use model_choice::ModelChoice;
pub use model_choice::{AnimationInfo, ExtensionInfo, ModelContents};

use accessor::{AccessorReader, MAX_ZERO_BYTES};
use animation::AnimatedTransform;
use buffers::{Buffers, missing_index_fault};
use deform::{DeformationKey, SkinsByIndex};
use document::Document;
use material::ConvertedMaterial;
use nodes::NodeInstance;
use specular_glossiness::RoughnessBaker;

use crate::folder::Folder;
use crate::image_decode_queue::{ImageDecodeQueue, drop_missing_images};
use crate::import::{DecodeBudget, Fault, ImportResult, UniqueNames, Warnings, validate_scene};
use crate::import_progress::ImportProgress;
use crate::warning::WarningCode;
use crate::{Error, Limits, Warning, uri};

/// An imported model file: its scene, its warnings, and the list of its scenes, variants and
/// animations.
pub(crate) struct ImportedModel {
    pub scene: Scene,
    pub warnings: Vec<Warning>,
    pub contents: ModelContents,
}

/// Imports a glTF or GLB file (detected by content) from its bytes, with the files in its folder.
///
/// # Errors
/// An error of kind input for an invalid file or buffer or an unsupported requirement, of kind
/// limit beyond `limits`, of kind usage for an unknown scene, variant or animation. A missing
/// texture is only a warning.
pub(crate) fn load(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
    choice: &ModelChoice<'_>,
    observer: &dyn Observer,
) -> Result<ImportedModel, Error> {
    let source = ImportSource {
        file,
        bytes,
        folder,
        limits,
    };
    source
        .import(choice, observer)
        .map_err(|fault| fault.into_error(file.display()))
}

/// The file to import, with its folder and the limits.
struct ImportSource<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    folder: &'a Folder,
    limits: &'a Limits,
}

impl ImportSource<'_> {
    fn import(
        &self,
        choice: &ModelChoice<'_>,
        observer: &dyn Observer,
    ) -> ImportResult<ImportedModel> {
        let &Self {
            file,
            bytes,
            folder,
            limits,
        } = self;
        if bytes.is_empty() {
            return Err(Fault::invalid_input("is empty"));
        }
        let mut warnings = Warnings::default();
        let mut budget = DecodeBudget::new(limits);
        let (json, binary) = match glb::is_glb(bytes) {
            true => glb::parse(bytes, &mut warnings).map(|parts| (parts.json, parts.binary))?,
            false => (bytes, None),
        };
        let mut document = document::parse(json, limits, &mut warnings)?;
        let scene = choice
            .scene
            .map(|wish| model_choice::find_scene(&document, wish))
            .transpose()?;
        let variant = choice
            .variant
            .map(|wish| model_choice::find_variant(&document, wish))
            .transpose()?;
        choice
            .animation
            .map(|wish| model_choice::select_animation(&mut document, wish))
            .transpose()?;
        // Images of unused materials are not read, but no output may replace them either.
        document
            .images
            .iter()
            .filter_map(|image| image.uri.as_ref())
            .for_each(|uri| uri::record_reference(folder, uri));
        let mut buffers = Buffers::load(&document, binary, folder, &mut budget)?;
        compression::decode_compressed_data(&document, &mut buffers, limits, &mut budget)?;
        let (memory_bytes, buffers) = (limits.memory_bytes, &buffers);
        let keyed = AccessorReader {
            document: &document,
            buffers,
            memory_bytes,
            zero_bytes_left: MAX_ZERO_BYTES.into(),
        };
        let moved = choice
            .time
            .map(|time| {
                animation_pointer::apply_animation_pointers(
                    time,
                    json,
                    &keyed,
                    limits,
                    &mut budget,
                    &mut warnings,
                )
            })
            .transpose()?;
        if let Some(moved) = moved.flatten() {
            document = moved;
            choice
                .animation
                .map(|wish| model_choice::select_animation(&mut document, wish))
                .transpose()?;
        }
        let reader = AccessorReader {
            document: &document,
            buffers,
            memory_bytes,
            zero_bytes_left: MAX_ZERO_BYTES.into(),
        };
        let import = GltfImport {
            document: &document,
            reader,
            file,
            folder,
            limits,
            budget,
            warnings,
            variant,
            scene: Scene {
                title: scene_title(&document, scene, file),
                ..Scene::default()
            },
            names: ImportedNames::default(),
            materials: HashMap::new(),
            textures: HashMap::new(),
            images: HashMap::new(),
            image_queue: ImageDecodeQueue::default(),
            roughness_baker: RoughnessBaker::default(),
            work: ImportProgress::new(observer),
            meshes: HashMap::new(),
            animated_nodes: HashMap::new(),
            world_transforms: Vec::new(),
            skins: SkinsByIndex::new(),
            point_and_line_count: 0,
            vertex_moves: 0,
        };
        import.import_scene(scene, choice.time)
    }
}

/// Title of the imported scene: the name of the glTF scene, or the file name without extension.
fn scene_title(document: &Document, scene: Option<usize>, file: &Path) -> String {
    let scene = document
        .scenes
        .get(scene.unwrap_or(document.scene.unwrap_or(0) as usize));
    match scene.and_then(|scene| scene.name.as_ref()) {
        Some(name) if !name.is_empty() => name.clone(),
        _ => file
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
            .unwrap_or_default(),
    }
}

/// Names used so far, for each kind of imported item, so that every new name is unique.
#[derive(Default)]
struct ImportedNames {
    images: UniqueNames,
    textures: UniqueNames,
    materials: UniqueNames,
    meshes: UniqueNames,
}

/// A mesh that was added to the scene: its name and its index.
#[derive(Clone, Debug)]
struct ConvertedMesh {
    name: String,
    /// Index in the scene's list of meshes.
    index: usize,
}

/// State of a glTF import.
struct GltfImport<'a> {
    document: &'a Document,
    reader: AccessorReader<'a>,
    file: &'a Path,
    folder: &'a Folder,
    limits: &'a Limits,
    budget: DecodeBudget,
    warnings: Warnings,
    /// Index of the chosen variant; `None`: the default materials.
    variant: Option<u32>,
    scene: Scene,
    names: ImportedNames,
    /// Converted materials, by index in the file; the key `None` is the default material.
    materials: HashMap<Option<usize>, ConvertedMaterial>,
    /// Names of textures in the scene, by texture index in the file and by whether the texture
    /// holds colours; the name is `None` if the image is unreadable.
    textures: HashMap<(usize, bool), Option<String>>,
    /// Names of images in the scene, by index in the file; `None` for an unreadable image.
    images: HashMap<usize, Option<String>>,
    /// Images with a valid header that are not decoded yet.
    image_queue: ImageDecodeQueue<'a>,
    /// Roughness images to compute from decoded glossiness images.
    roughness_baker: RoughnessBaker,
    work: ImportProgress<'a>,
    /// Converted meshes, by the indices of mesh and primitive and by the deformation; `None` for a
    /// primitive without triangles.
    meshes: HashMap<(usize, usize, DeformationKey), Option<ConvertedMesh>>,
    /// Animated properties at the chosen time, by node index.
    animated_nodes: HashMap<usize, AnimatedTransform>,
    /// World transforms of nodes, by index.
    world_transforms: Vec<Option<DAffine3>>,
    skins: SkinsByIndex,
    /// Number of primitives that consist of points or lines, which are skipped.
    point_and_line_count: usize,
    /// Number of vertex displacements by morph targets and joints so far.
    vertex_moves: u64,
}

impl GltfImport<'_> {
    fn import_scene(
        mut self,
        scene: Option<usize>,
        time: Option<f64>,
    ) -> ImportResult<ImportedModel> {
        extensions::warn_unsupported_extensions(self.document.extensions(), &mut self.warnings);
        let moved = match time {
            Some(time) => animation::evaluate_animations(
                time,
                self.document,
                &self.reader,
                &mut self.warnings,
            )?,
            None if self.document.animations.is_empty() => HashMap::new(),
            None => {
                self.warnings.add(
                    WarningCode::AtRest,
                    "has animations, but is shown at rest; --at chooses a time",
                );
                HashMap::new()
            }
        };
        let places = nodes::visit_nodes(self.document, scene, &moved, &mut self.warnings)?;
        (self.animated_nodes, self.world_transforms) = (moved, places.world_transforms);
        // A file may claim counts up to the largest integers.
        self.work.set_total(
            self.count_elements(&places.instances)
                .saturating_add(ImportProgress::IMAGE_COST * self.document.images.len() as u64),
        );
        for instance in &places.instances {
            self.add_node(instance)
                .map_err(|fault| fault.with_place(format_args!("nodes[{}]", instance.node)))?;
        }
        if self.point_and_line_count > 0 {
            self.warnings.add(
                WarningCode::PointsAndLines,
                format!(
                    "points and lines are ignored: {} of the visible primitives consist of points or lines",
                    self.point_and_line_count
                ),
            );
        }
        let (waiting, work) = (core::mem::take(&mut self.image_queue), &self.work);
        let report = waiting.decode_images(&mut self.scene.images, self.limits, &|| {
            work.report_done(ImportProgress::IMAGE_COST)
        })?;
        for reason in report.errors {
            self.warnings.add(
                WarningCode::Picture,
                format!("{reason}; only the material's factor is used"),
            );
        }
        report
            .remarks
            .into_iter()
            .for_each(|(code, remark)| self.warnings.add(code, remark));
        core::mem::take(&mut self.roughness_baker)
            .bake_roughness_images(&mut self.scene, &mut self.budget)?;
        drop_missing_images(&mut self.scene);
        if self.scene.objects.is_empty() {
            self.warnings.add(
                WarningCode::NothingToSee,
                "the scene has no visible triangles: the picture shows nothing of it",
            );
        }
        let contents = model_choice::list_contents(self.document, &self.reader);
        Ok(ImportedModel {
            scene: validate_scene(self.scene)?,
            warnings: self.warnings.into_warnings(self.file.display()),
            contents,
        })
    }

    /// Total number of vertices and indices in the meshes of visible nodes, each mesh counted once.
    fn count_elements(&self, instances: &[NodeInstance]) -> u64 {
        let node = |instance: &NodeInstance| self.document.nodes.get(instance.node)?.mesh;
        let meshes: HashSet<u32> = instances
            .iter()
            .filter(|instance| instance.visible)
            .filter_map(node)
            .collect();
        let primitives = meshes
            .iter()
            .filter_map(|&mesh| self.document.meshes.get(mesh as usize))
            .flat_map(|mesh| &mesh.primitives);
        primitives
            .flat_map(|primitive| mesh::declared_vertex_and_index_counts(self.document, primitive))
            .fold(0, u64::saturating_add)
    }

    /// Whether all numbers of a transform are within the supported range of coordinates; if not, a
    /// warning is added.
    fn check_coordinate_range(&mut self, world: &DAffine3, place: impl Fn() -> String) -> bool {
        let within = world.to_cols_array().iter().all(|x| x.abs() <= FARTHEST);
        if !within {
            self.warnings.add(
                WarningCode::Geometry,
                format!(
                    "{}: its transform exceeds the range of coordinates; the contents of the node were left out",
                    place()
                ),
            );
        }
        within
    }

    /// Adds the mesh, the camera and the light of a node to the scene.
    fn add_node(&mut self, instance: &NodeInstance) -> ImportResult<()> {
        let Some(node) = self.document.nodes.get(instance.node) else {
            return Ok(());
        };
        let carries =
            node.mesh.is_some() || node.camera.is_some() || node.extensions.light.light.is_some();
        if carries
            && !self.check_coordinate_range(&instance.world, || format!("nodes[{}]", instance.node))
        {
            return Ok(());
        }
        let node_name = node.name.clone().unwrap_or_default();
        if let Some(index) = node.mesh.filter(|_| instance.visible) {
            self.add_node_mesh(index as usize, node, instance)?;
        }
        if let Some(index) = node.camera.map(|i| i as usize) {
            let list = &self.document.cameras;
            let camera = list
                .get(index)
                .ok_or_else(|| missing_index_fault("cameras", index, list.len()))?;
            let name = camera
                .name
                .clone()
                .filter(|name| !name.is_empty())
                .unwrap_or(node_name.clone());
            self.scene.cameras.extend(camera::convert_camera(
                camera,
                index,
                name,
                instance,
                &mut self.warnings,
            ));
        }
        if let Some(index) = node
            .extensions
            .light
            .light
            .filter(|_| instance.visible)
            .map(|i| i as usize)
        {
            let list = &self.document.extensions.lights.lights;
            let light = list.get(index).ok_or_else(|| {
                missing_index_fault("KHR_lights_punctual.lights", index, list.len())
            })?;
            let name = light
                .name
                .clone()
                .filter(|name| !name.is_empty())
                .unwrap_or(node_name);
            self.scene.lights.extend(light::convert_light(
                light,
                index,
                name,
                instance,
                &mut self.warnings,
            ));
        }
        Ok(())
    }
}
