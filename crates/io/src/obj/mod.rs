//! Import of Wavefront OBJ with its MTL material libraries (the Advanced Visualizer's manual,
//! appendices B1 and "MTL").
//!
//! The importer reads polygons with any number of corners, normals given or by smoothing groups,
//! texture coordinates, vertex colours, and materials with their textures, see [`material`]. Each
//! material becomes a mesh, or two if some of its faces are flat and others smooth; named objects
//! and groups are not kept. Curves, surfaces, points and lines are reported in a warning.
mod material;
mod mesh;
mod survey;
mod texture;

use std::collections::HashMap;
use std::path::Path;

use raywright_core::Scene;
use raywright_core::scene::{
    Material, MaterialModel, Mesh, MeshData, MeshSource, Object, Shape, SideRule,
    UnsupportedProperty,
};

use crate::folder::Folder;
use crate::import::{
    DecodeBudget, ImportResult, ImportedScene, UniqueNames, Warnings, format_count, sanitise_text,
    validate_scene,
};
use crate::text::refuse_non_text;
use crate::{Limits, mesh_tools};

use material::{LibraryMaterial, MaterialLibrary};
use survey::ObjSurvey;
use texture::TextureNames;

/// Imports an OBJ file from its bytes, with the material libraries and images beside the file.
///
/// # Errors
/// A fault of kind input that names line and cause, or of kind limit. A missing library or texture
/// is only a warning.
pub(crate) fn import(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
) -> ImportResult<ImportedScene> {
    refuse_non_text(bytes)?;
    let (budget, warnings) = (DecodeBudget::new(limits), Warnings::default());
    let mut builder = SceneBuilder::new((folder, limits), budget, warnings);
    let SceneBuilder {
        budget, warnings, ..
    } = &mut builder;
    let text = survey::decode_text(bytes);
    let mut survey = ObjSurvey::read(&text, false, budget, warnings)?;
    let models = match survey.is_healthy.then(|| parse_obj(&text)) {
        Some(Ok(models)) => models,
        _ => {
            // The first pass added all warnings.
            survey = ObjSurvey::read(&text, true, budget, &mut Warnings::default())?;
            parse_obj(&survey.mended.concat())?
        }
    };
    let library = material::load(&survey.libraries, folder, warnings)?;
    let parts = mesh::build_meshes(survey.runs, models, warnings)?;
    builder.build(file, parts, (survey.materials, library))
}

/// A mesh, with the index of its material in the file; `None` for a mesh without a material.
pub(crate) type MaterialMesh = (Option<usize>, MeshData);

/// Builds the scene of a file that consists of meshes, each with an optional index into `images`.
/// The meshes have the material of an OBJ file without materials. The same mesh therefore gives the
/// same picture in every format.
pub(crate) fn scene_from_meshes(
    file: &Path,
    parts: Vec<MaterialMesh>,
    images: Vec<String>,
    context: (&Folder, &Limits),
    budget: DecodeBudget,
    warnings: Warnings,
) -> ImportResult<ImportedScene> {
    let is_whole = matches!(parts[..], [(Some(_), _)]);
    let materials = MaterialLibrary::from_images(images, is_whole);
    SceneBuilder::new(context, budget, warnings).build(file, parts, materials)
}

/// Parses a text with `tobj`. Returns a model, vertices and polygons, for each run of faces.
fn parse_obj(text: &str) -> ImportResult<Vec<tobj::Model>> {
    let options = tobj::LoadOptions {
        single_index: true,
        ..tobj::LoadOptions::default()
    };
    let no_materials = |_: &Path| Ok(Default::default());
    tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map(|(models, _)| models)
        .map_err(|error| fault!("is no valid OBJ ({error})"))
}

/// Builder of a scene with an object for each mesh. Materials and textures are converted on first
/// use.
struct SceneBuilder<'a> {
    folder: &'a Folder,
    limits: &'a Limits,
    budget: DecodeBudget,
    warnings: Warnings,
    scene: Scene,
    material_names: UniqueNames,
    /// Names of the converted materials in the scene, by index of the material and by whether
    /// vertex colours are used.
    materials: HashMap<(Option<usize>, bool), String>,
    textures: TextureNames,
}

impl<'a> SceneBuilder<'a> {
    fn new(
        (folder, limits): (&'a Folder, &'a Limits),
        budget: DecodeBudget,
        warnings: Warnings,
    ) -> Self {
        Self {
            folder,
            limits,
            budget,
            warnings,
            scene: Scene::default(),
            material_names: UniqueNames::default(),
            materials: HashMap::new(),
            textures: TextureNames::default(),
        }
    }

    /// Builds the scene, with the names of the materials in the file and their libraries.
    fn build(
        mut self,
        file: &Path,
        parts: Vec<MaterialMesh>,
        (used, library): (Vec<String>, MaterialLibrary),
    ) -> ImportResult<ImportedScene> {
        let stem = file.file_stem().unwrap_or_default();
        self.scene.title = stem.to_string_lossy().into_owned();
        let name_in_file = |number: Option<usize>| {
            let name = number.and_then(|number| used.get(number));
            name.map_or(material::DEFAULT, String::as_str)
        };
        let statements = parts
            .iter()
            .filter_map(|(number, _)| library.find_material(name_in_file(*number)))
            .flat_map(LibraryMaterial::image_statements);
        self.load_images(statements)?;
        let (mut names, mut dropped) = (UniqueNames::default(), 0);
        for (number, mut data) in parts {
            dropped += mesh_tools::drop_non_finite_triangles(&mut data);
            if data.indices.is_empty() {
                continue;
            }
            mesh_tools::repair_normals(&mut data);
            let label = name_in_file(number);
            let key = (number, !data.colours.is_empty());
            let material = self.convert_material(key, label, &library);
            self.budget.reserve_object()?;
            let name = names.make_unique(label);
            self.scene.meshes.push(Mesh {
                name: name.clone(),
                source: MeshSource::Inline(data.into()),
                model: None,
            });
            self.scene.objects.push(Object {
                name: label.to_owned(),
                shape: Shape::Mesh(name),
                material,
                side: SideRule::Both,
                face_viewer: true,
                casts_shadow: true,
                transform: Vec::new(),
                transform_end: None,
            });
        }
        self.warnings.add_dropped("", dropped);
        self.warn_glass();
        if self.scene.objects.is_empty() {
            warn!(
                self.warnings,
                NothingSeen, "the file has no triangles: nothing to see"
            );
        }
        let warnings = self.warnings.into_warnings(file.display());
        Ok((validate_scene(self.scene)?, warnings))
    }

    /// Warns about the materials that were taken for glass.
    fn warn_glass(&mut self) {
        let is_glass = |material: &&Material| match &material.model {
            MaterialModel::Physical(physical) => physical.may_transmit(),
            _ => false,
        };
        let glass = self.scene.materials.iter().filter(is_glass).count();
        if glass > 0 {
            warn!(
                self.warnings,
                Conversion,
                "{} taken for glass, by `illum` 4, 6, 7 or 9 and by `d`, `Tr`, `Tf` or a black `Kd`",
                format_count(glass, "material")
            );
        }
    }

    /// Returns the name in the scene of a material, by its index and by whether vertex colours are
    /// used. `label` is its name in the file.
    fn convert_material(
        &mut self,
        key: (Option<usize>, bool),
        label: &str,
        library: &MaterialLibrary,
    ) -> String {
        if let Some(name) = self.materials.get(&key) {
            return name.clone();
        }
        let grey = LibraryMaterial::default();
        let source = library.find_material(label).unwrap_or_else(|| {
            if key.0.is_some() {
                warn!(
                    self.warnings,
                    Material,
                    "material `{}` is in no material library; a grey material is used",
                    sanitise_text(label)
                );
            }
            &grey
        });
        let mut model = self.convert_physical(source);
        model.vertex_colours = key.1;
        let name = self.material_names.make_unique(label);
        let unsupported = source.unsupported.iter().take(20);
        let unread = unsupported.map(|key| UnsupportedProperty {
            material: name.clone(),
            label: format!("MTL {}", sanitise_text(key)),
        });
        self.scene.unread.extend(unread);
        self.scene.materials.push(Material {
            name: name.clone(),
            model: MaterialModel::Physical(Box::new(model)),
        });
        self.materials.insert(key, name.clone());
        name
    }
}
