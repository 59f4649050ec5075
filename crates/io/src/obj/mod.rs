//! Import of Wavefront OBJ with its MTL material libraries (the Advanced Visualizer's manual,
//! appendices B1 and "MTL").
//!
//! The importer reads polygons with any number of corners, normals given or by smoothing groups,
//! texture coordinates, vertex colours, and materials with their textures, see [`material`]. Each
//! material becomes a mesh, or two if some of its faces are flat and others smooth; named objects
//! and groups are not kept. Curves, surfaces, points and lines are reported in a warning.

mod lines;
mod material;
mod mesh;
mod mtl;
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
    DecodeBudget, Fault, ImportResult, ImportedScene, UniqueNames, Warnings, format_count,
    sanitise_text, validate_scene,
};
use crate::text::refuse_non_text;
use crate::warning::WarningCode;
use crate::{Error, Limits, mesh_tools};

use mesh::MaterialMesh;
use mtl::{LibraryMaterial, MaterialLibrary};
use survey::RewrittenObj;
use texture::TextureLoader;

/// Imports an OBJ file from its bytes, with the material libraries and images beside the file.
///
/// # Errors
/// An error of kind input that names line and cause, or of kind limit. A missing library or texture
/// is only a warning.
pub(crate) fn load(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
) -> Result<ImportedScene, Error> {
    import(file, bytes, folder, limits).map_err(|fault| fault.into_error(file.display()))
}

fn import(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
) -> ImportResult<ImportedScene> {
    let mut warnings = Warnings::default();
    let mut budget = DecodeBudget::new(limits);
    refuse_non_text(bytes)?;
    let survey =
        survey::check_and_rewrite_obj(&lines::decode_text(bytes), &mut budget, &mut warnings)?;
    let library = mtl::load(&survey.libraries, folder, &mut warnings)?;
    let models = parse_rewritten_text(&survey)?;
    let parts = mesh::build_meshes(&survey.runs, models, &mut warnings)?;
    let materials = MaterialConverter::new(
        survey.materials,
        library,
        TextureLoader::new(folder, limits),
    );
    build_scene(file, parts, materials, budget, warnings)
}

/// Builds the scene of a file that consists of a single mesh. The mesh has the material of an OBJ
/// file without materials. The same mesh therefore gives the same picture in every format.
pub(crate) fn scene_from_mesh(
    file: &Path,
    data: MeshData,
    context: (&Folder, &Limits),
    budget: DecodeBudget,
    warnings: Warnings,
) -> ImportResult<ImportedScene> {
    scene_from_meshes(
        file,
        vec![(None, data)],
        Vec::new(),
        context,
        budget,
        warnings,
    )
}

/// Builds the scene of a file that consists of several meshes, each with an optional index into
/// `images`. Otherwise as [`scene_from_mesh`].
pub(crate) fn scene_from_meshes(
    file: &Path,
    parts: Vec<(Option<usize>, MeshData)>,
    images: Vec<String>,
    (folder, limits): (&Folder, &Limits),
    budget: DecodeBudget,
    warnings: Warnings,
) -> ImportResult<ImportedScene> {
    let is_whole = parts.len() == 1 && parts.iter().all(|(image, _)| image.is_some());
    let (names, library) = MaterialLibrary::from_images(images, is_whole);
    let parts = parts
        .into_iter()
        .map(|(material, data)| MaterialMesh { material, data })
        .collect();
    build_scene(
        file,
        parts,
        MaterialConverter::new(names, library, TextureLoader::new(folder, limits)),
        budget,
        warnings,
    )
}

/// Builds a scene with an object for each mesh.
fn build_scene(
    file: &Path,
    parts: Vec<MaterialMesh>,
    mut materials: MaterialConverter,
    mut budget: DecodeBudget,
    mut warnings: Warnings,
) -> ImportResult<ImportedScene> {
    let mut scene = Scene {
        title: file
            .file_stem()
            .map(|s| s.to_string_lossy().into_owned())
            .unwrap_or_default(),
        ..Scene::default()
    };
    materials.read_images(&parts, &mut scene, &mut budget, &mut warnings)?;
    let (mut names, mut dropped) = (UniqueNames::default(), 0);
    for mut part in parts {
        dropped += mesh_tools::drop_non_finite_triangles(&mut part.data);
        if part.data.indices.is_empty() {
            continue;
        }
        mesh_tools::repair_normals(&mut part.data);
        let material = materials.convert(
            part.material,
            !part.data.colours.is_empty(),
            &mut scene,
            &mut warnings,
        );
        budget.reserve_object()?;
        let label = materials.name_in_file(part.material).to_owned();
        let name = names.make_unique(&label);
        scene.meshes.push(Mesh {
            name: name.clone(),
            source: MeshSource::Inline(part.data.into()),
            model: None,
        });
        scene.objects.push(Object {
            name: label,
            shape: Shape::Mesh(name),
            material,
            side: SideRule::Both,
            face_viewer: true,
            casts_shadow: true,
            transform: Vec::new(),
            transform_end: None,
        });
    }
    warnings.add_dropped("", dropped);
    let is_glass = |material: &&Material| match &material.model {
        MaterialModel::Physical(physical) => physical.may_transmit(),
        _ => false,
    };
    let glass = scene.materials.iter().filter(is_glass).count();
    if glass > 0 {
        warnings.add(
            WarningCode::Conversion,
            format!(
                "{} taken for glass, by `illum` 4, 6, 7 or 9 and by `d`, `Tr`, `Tf` or a black `Kd`",
                format_count(glass, "material")
            ),
        );
    }
    if scene.objects.is_empty() {
        warnings.add(
            WarningCode::NothingToSee,
            "the file has no triangles: nothing to see",
        );
    }
    Ok((
        validate_scene(scene)?,
        warnings.into_warnings(file.display()),
    ))
}

/// Parses the rewritten text with `tobj`. Returns a model, vertices and polygons, for each run of
/// faces with the same properties.
fn parse_rewritten_text(survey: &RewrittenObj) -> ImportResult<Vec<tobj::Model>> {
    let options = tobj::LoadOptions {
        single_index: true,
        ..tobj::LoadOptions::default()
    };
    let no_materials = |_: &Path| Ok(Default::default());
    match tobj::load_obj_buf(&mut survey.text.as_bytes(), &options, no_materials) {
        Ok((models, _)) => Ok(models),
        Err(error) => Err(Fault::invalid_input(format!("is no valid OBJ ({error})"))),
    }
}

/// Converts the materials of a file, each on first use.
struct MaterialConverter<'a> {
    /// Names of the materials in the file, by index.
    names_in_file: Vec<String>,
    library: MaterialLibrary,
    textures: TextureLoader<'a>,
    unique_names: UniqueNames,
    /// Names of the converted materials in the scene, by index of the material and by whether
    /// vertex colours are used.
    converted_names: HashMap<(Option<usize>, bool), String>,
}

impl<'a> MaterialConverter<'a> {
    /// Creates a converter without converted materials.
    fn new(used: Vec<String>, library: MaterialLibrary, textures: TextureLoader<'a>) -> Self {
        Self {
            names_in_file: used,
            library,
            textures,
            unique_names: UniqueNames::default(),
            converted_names: HashMap::new(),
        }
    }

    /// Returns the name of the material with this index in the file, or the default name.
    fn name_in_file(&self, number: Option<usize>) -> &str {
        number
            .and_then(|i| self.names_in_file.get(i))
            .map_or(mtl::DEFAULT, String::as_str)
    }

    /// Reads the images of all materials that the meshes use.
    fn read_images(
        &mut self,
        parts: &[MaterialMesh],
        scene: &mut Scene,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        let used = parts.iter().map(|part| self.name_in_file(part.material));
        let statements: Vec<(&str, &str)> = used
            .filter_map(|name| self.library.find_material(name))
            .flat_map(material::image_statements)
            .collect();
        self.textures
            .load(statements.into_iter(), scene, budget, warnings)
    }

    /// Returns the name in the scene of the material with this index, for meshes with or without
    /// vertex colours. The material is converted on first use.
    fn convert(
        &mut self,
        number: Option<usize>,
        coloured: bool,
        scene: &mut Scene,
        warnings: &mut Warnings,
    ) -> String {
        if let Some(name) = self.converted_names.get(&(number, coloured)) {
            return name.clone();
        }
        let label = self.name_in_file(number).to_owned();
        let (found, grey) = (
            self.library.find_material(&label),
            LibraryMaterial::default(),
        );
        if found.is_none() && number.is_some() {
            warnings.add(
                WarningCode::Material,
                format!(
                    "material `{}` is in no material library; a grey material is used",
                    sanitise_text(&label)
                ),
            );
        }
        let source = found.unwrap_or(&grey);
        let mut model = material::convert_material(source, &mut self.textures, scene, warnings);
        model.vertex_colours = coloured;
        let name = self.unique_names.make_unique(&label);
        let unread = material::unsupported_keys(&source.source).into_iter();
        scene
            .unread
            .extend(unread.map(|subject| UnsupportedProperty {
                material: name.clone(),
                label: subject,
            }));
        scene.materials.push(Material {
            name: name.clone(),
            model: MaterialModel::Physical(Box::new(model)),
        });
        self.converted_names
            .insert((number, coloured), name.clone());
        name
    }
}
