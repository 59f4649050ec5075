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
mod camera;
mod compression;
mod deform;
mod document;
mod entries;
mod extensions;
mod glb;
mod json;
mod keyframes;
mod material;
mod mesh;
mod model_choice;
mod nodes;
mod objects;
mod texture;
mod vertices;

use std::collections::HashMap;
use std::path::Path;

use glam::DAffine3;
use raywright_core::fault::Fault;
use raywright_core::{Observer, Scene};

pub(crate) use model_choice::ModelChoice;
pub use model_choice::{AnimationInfo, ExtensionInfo, ModelContents};

use accessor::{AccessorReader, Buffers, MAX_ZERO_BYTES};
use animation::AnimatedTransform;
use deform::{DeformationKey, SkinsByIndex};
use document::Document;
use material::{ConvertedMaterial, RoughnessTextures};

use crate::folder::Folder;
use crate::image_decode_queue::{ImageDecodeQueue, drop_missing_images};
use crate::import::{
    DecodeBudget, FaultPlace, ImportProgress, ImportResult, UniqueNames, Warnings, validate_scene,
};
use crate::{Error, Limits, uri};

/// An imported model file: its scene, its warnings, and the list of its scenes, variants and
/// animations.
pub(crate) struct ImportedModel {
    pub scene: Scene,
    pub warnings: Vec<Fault>,
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
        if self.bytes.is_empty() {
            return Err(fault!("is empty"));
        }
        let mut warnings = Warnings::default();
        let mut budget = DecodeBudget::new(self.limits);
        let (json, binary) = match glb::is_glb(self.bytes) {
            true => {
                glb::parse(self.bytes, &mut warnings).map(|parts| (parts.json, parts.binary))?
            }
            false => (self.bytes, None),
        };
        let mut document = document::parse(json, self.limits, &mut warnings)?;
        let scene = choice
            .scene
            .map(|wish| model_choice::find_scene(&document, wish))
            .transpose()?;
        let variant = choice
            .variant
            .map(|wish| model_choice::find_variant(&document, wish))
            .transpose()?;
        deactivate_other_animations(&mut document, choice)?;
        let buffers = self.load_buffers(&document, binary, &mut budget)?;
        if let Some(time) = choice.time {
            let moved = animation_pointer::apply_animation_pointers(
                time,
                json,
                &self.accessor_reader(&document, &buffers),
                self.limits,
                &mut budget,
                &mut warnings,
            )?;
            if let Some(moved) = moved {
                document = moved;
                deactivate_other_animations(&mut document, choice)?;
            }
        }
        let reader = self.accessor_reader(&document, &buffers);
        let mut import = GltfImport::new(self, reader, (budget, warnings), observer);
        import.variant = variant;
        import.scene.title = scene_title(&document, scene, self.file);
        import.import_scene(scene, choice.time)
    }

    /// Loads and decompresses the buffers of a document. `binary` is the binary chunk of a GLB
    /// file.
    fn load_buffers<'b>(
        &self,
        document: &Document,
        binary: Option<&'b [u8]>,
        budget: &mut DecodeBudget,
    ) -> ImportResult<Buffers<'b>> {
        // Images of unused materials are not read, but no output may replace them either.
        document
            .images
            .iter()
            .filter_map(|image| image.uri.as_ref())
            .for_each(|uri| uri::record_reference(self.folder, uri));
        let mut buffers = Buffers::load(document, binary, self.folder, budget)?;
        compression::decode_compressed_data(document, &mut buffers, self.limits, budget)?;
        Ok(buffers)
    }

    fn accessor_reader<'b>(
        &self,
        document: &'b Document,
        buffers: &'b Buffers<'b>,
    ) -> AccessorReader<'b> {
        AccessorReader {
            document,
            buffers,
            memory_bytes: self.limits.memory_bytes,
            zero_bytes_left: MAX_ZERO_BYTES.into(),
        }
    }
}

/// Removes the channels of all animations but the chosen one. Without a choice, all animations keep
/// their channels.
fn deactivate_other_animations(
    document: &mut Document,
    choice: &ModelChoice<'_>,
) -> ImportResult<()> {
    match choice.animation {
        Some(wish) => model_choice::select_animation(document, wish),
        None => Ok(()),
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
    /// Indices in the file of the scene's cameras.
    camera_sources: Vec<usize>,
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
    roughness_textures: RoughnessTextures,
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

impl<'a> GltfImport<'a> {
    /// Creates the state before any node is imported: an empty scene without a title, and the
    /// default materials.
    fn new(
        source: &ImportSource<'a>,
        reader: AccessorReader<'a>,
        (budget, warnings): (DecodeBudget, Warnings),
        observer: &'a dyn Observer,
    ) -> Self {
        Self {
            document: reader.document,
            reader,
            file: source.file,
            folder: source.folder,
            limits: source.limits,
            budget,
            warnings,
            variant: None,
            scene: Scene::default(),
            camera_sources: Vec::new(),
            names: ImportedNames::default(),
            materials: HashMap::new(),
            textures: HashMap::new(),
            images: HashMap::new(),
            image_queue: ImageDecodeQueue::default(),
            roughness_textures: RoughnessTextures::new(),
            work: ImportProgress::new(observer),
            meshes: HashMap::new(),
            animated_nodes: HashMap::new(),
            world_transforms: Vec::new(),
            skins: SkinsByIndex::new(),
            point_and_line_count: 0,
            vertex_moves: 0,
        }
    }

    /// Imports the scene with this index at a time in seconds. Without an index, the file's default
    /// scene is imported; without a time, its rest pose.
    fn import_scene(
        mut self,
        scene: Option<usize>,
        time: Option<f64>,
    ) -> ImportResult<ImportedModel> {
        extensions::warn_unsupported_extensions(self.document.extensions(), &mut self.warnings);
        let moved = self.animate_nodes(time)?;
        let places = nodes::visit_nodes(self.document, scene, &moved, &mut self.warnings)?;
        (self.animated_nodes, self.world_transforms) = (moved, places.world_transforms);
        // A file may claim counts up to the largest integers.
        self.work.set_total(
            self.count_elements(&places.instances)
                .saturating_add(ImportProgress::IMAGE_COST * self.document.images.len() as u64),
        );
        for instance in &places.instances {
            self.add_node(instance)
                .with_place(format_args!("nodes[{}]", instance.node))?;
        }
        self.warn_points_and_lines();
        self.warn_converted_materials();
        camera::warn_clipped_objects(
            self.document,
            &self.scene,
            &self.camera_sources,
            &mut self.warnings,
        );
        self.decode_images()?;
        if self.scene.objects.is_empty() {
            warn!(
                self.warnings,
                NothingSeen,
                "the scene has no visible triangles: the picture shows only the background"
            );
        }
        let contents = model_choice::list_contents(self.document, &self.reader);
        Ok(ImportedModel {
            scene: validate_scene(self.scene)?,
            warnings: self.warnings.into_warnings(self.file.display()),
            contents,
        })
    }

    /// Returns the animated properties of nodes at a time in seconds, by node index. Without a
    /// time, no node is animated, and a file with animations gets a warning.
    fn animate_nodes(
        &mut self,
        time: Option<f64>,
    ) -> ImportResult<HashMap<usize, AnimatedTransform>> {
        if let Some(time) = time {
            return animation::evaluate_animations(
                time,
                self.document,
                &self.reader,
                &mut self.warnings,
            );
        }
        if !self.document.animations.is_empty() {
            warn!(
                self.warnings,
                AtRest, "has animations, but is shown at rest; --at chooses a time"
            );
        }
        Ok(HashMap::new())
    }

    /// Warns about visible primitives that consist of points or lines, which are skipped.
    fn warn_points_and_lines(&mut self) {
        if self.point_and_line_count > 0 {
            warn!(
                self.warnings,
                PointsAndLines,
                "points and lines are ignored: {} of the visible primitives consist of points or lines",
                self.point_and_line_count
            );
        }
    }

    /// Decodes the images of the scene, and computes its roughness images. Unreadable images are
    /// removed, with a warning.
    fn decode_images(&mut self) -> ImportResult<()> {
        let (waiting, work) = (core::mem::take(&mut self.image_queue), &self.work);
        let report = waiting.decode_images(&mut self.scene.images, self.limits, &|| {
            work.report_done(ImportProgress::IMAGE_COST)
        })?;
        for reason in report.errors {
            warn!(self.warnings, Picture, "{reason}; the texture is left out");
        }
        report
            .remarks
            .into_iter()
            .for_each(|(code, remark)| self.warnings.add(code, remark));
        self.bake_roughness_images()?;
        drop_missing_images(&mut self.scene);
        Ok(())
    }
}
