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
    Material, Mesh, MeshData, MeshSource, Model, Object, Shape, SideRule, UnreadPart,
};

use crate::folder::Folder;
use crate::import::{DecodeBudget, Fault, ImportedScene, Outcome, UniqueNames, Warnings, checked};
use crate::text::refuse_foreign;
use crate::warning::WarningCode;
use crate::{Error, Limits, mesh_tools};

use mesh::MaterialFaces;
use mtl::MaterialLibrary;
use survey::ObjSurvey;
use texture::Textures;

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

fn import(file: &Path, bytes: &[u8], folder: &Folder, limits: &Limits) -> Outcome<ImportedScene> {
    let mut warnings = Warnings::default();
    let mut budget = DecodeBudget::new(limits);
    refuse_foreign(bytes)?;
    let survey = survey::survey(&lines::decode(bytes), &mut budget, &mut warnings)?;
    let library = mtl::load(&survey.libraries, folder, &mut warnings)?;
    let models = models(&survey)?;
    let parts = mesh::build(&survey.runs, models)?;
    let materials = Materials::new(survey.materials, library, Textures::new(folder, limits));
    scene(file, parts, materials, budget, warnings)
}

/// Builds the scene of a file with a single mesh as for an OBJ file without a material, so that the
/// same mesh gives the same picture in every format.
pub(crate) fn of_mesh(
    file: &Path,
    data: MeshData,
    context: (&Folder, &Limits),
    budget: DecodeBudget,
    warnings: Warnings,
) -> Outcome<ImportedScene> {
    of_parts(
        file,
        vec![(None, data)],
        Vec::new(),
        context,
        budget,
        warnings,
    )
}

/// Builds the scene of several meshes, each with an optional index of an image, as [`of_mesh`] does
/// for a single mesh.
pub(crate) fn of_parts(
    file: &Path,
    parts: Vec<(Option<usize>, MeshData)>,
    images: Vec<String>,
    (folder, limits): (&Folder, &Limits),
    budget: DecodeBudget,
    warnings: Warnings,
) -> Outcome<ImportedScene> {
    let is_whole = parts.len() == 1 && parts.iter().all(|(image, _)| image.is_some());
    let (names, library) = MaterialLibrary::of_images(images, is_whole);
    let parts = parts
        .into_iter()
        .map(|(material, data)| MaterialFaces { material, data })
        .collect();
    scene(
        file,
        parts,
        Materials::new(names, library, Textures::new(folder, limits)),
        budget,
        warnings,
    )
}

/// Builds a scene with an object for each part.
fn scene(
    file: &Path,
    parts: Vec<MaterialFaces>,
    mut materials: Materials,
    mut budget: DecodeBudget,
    mut warnings: Warnings,
) -> Outcome<ImportedScene> {
    let mut scene = Scene {
        title: file
            .file_stem()
            .map(|s| s.to_string_lossy().into_owned())
            .unwrap_or_default(),
        ..Scene::default()
    };
    materials.read_images(&parts, &mut scene, &mut budget, &mut warnings)?;
    let mut names = UniqueNames::default();
    for mut part in parts {
        let dropped = mesh_tools::drop_unusable(&mut part.data);
        if dropped > 0 {
            warnings.add(
                WarningCode::Geometry,
                format!("{dropped} triangles with vertices that are not finite were left out"),
            );
        }
        if part.data.indices.is_empty() {
            continue;
        }
        mesh_tools::mend_normals(&mut part.data);
        let material = materials.get(
            part.material,
            !part.data.colours.is_empty(),
            &mut scene,
            &mut warnings,
        );
        budget.object()?;
        let label = materials.label(part.material).to_owned();
        let name = names.unique(&label);
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
    if scene.objects.is_empty() {
        warnings.add(
            WarningCode::NothingToSee,
            "the file has no triangles: nothing to see",
        );
    }
    Ok((checked(scene)?, warnings.finish(file.display())))
}

/// Parses the rewritten text with tobj: for each run a list of welded vertices, and polygons.
fn models(survey: &ObjSurvey) -> Outcome<Vec<tobj::Model>> {
    let options = tobj::LoadOptions {
        single_index: true,
        ..tobj::LoadOptions::default()
    };
    let no_materials = |_: &Path| Ok(Default::default());
    match tobj::load_obj_buf(&mut survey.text.as_bytes(), &options, no_materials) {
        Ok((models, _)) => Ok(models),
        Err(error) => Err(Fault::input(format!("is no valid OBJ ({error})"))),
    }
}

/// Materials of a file, converted on first use.
struct Materials<'a> {
    /// Names of materials in the file, by number.
    used: Vec<String>,
    library: MaterialLibrary,
    textures: Textures<'a>,
    names: UniqueNames,
    /// Name in the scene, by number and by the use of vertex colours.
    known: HashMap<(Option<usize>, bool), String>,
}

impl<'a> Materials<'a> {
    /// Creates a converter without converted materials.
    fn new(used: Vec<String>, library: MaterialLibrary, textures: Textures<'a>) -> Self {
        Self {
            used,
            library,
            textures,
            names: UniqueNames::default(),
            known: HashMap::new(),
        }
    }

    /// Returns the name of a material in the file, or the default name.
    fn label(&self, number: Option<usize>) -> &str {
        number
            .and_then(|i| self.used.get(i))
            .map_or(mtl::DEFAULT, String::as_str)
    }

    /// Reads the images of the materials that the parts use.
    fn read_images(
        &mut self,
        parts: &[MaterialFaces],
        scene: &mut Scene,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> Outcome<()> {
        let mut statements = Vec::new();
        for part in parts {
            let source = self.library.get(self.label(part.material), false, warnings);
            statements.extend(material::images(&source).map(str::to_owned));
        }
        self.textures.load(
            statements.iter().map(String::as_str),
            scene,
            budget,
            warnings,
        )
    }

    /// Returns a material's name in the scene, for meshes with or without vertex colours.
    fn get(
        &mut self,
        number: Option<usize>,
        coloured: bool,
        scene: &mut Scene,
        warnings: &mut Warnings,
    ) -> String {
        if let Some(name) = self.known.get(&(number, coloured)) {
            return name.clone();
        }
        let label = self.label(number).to_owned();
        let source = self.library.get(&label, number.is_some(), warnings);
        let mut model = material::convert(source.as_ref(), &mut self.textures, scene, warnings);
        model.vertex_colours = coloured;
        let name = self.names.unique(&label);
        let unread = material::unread(source.as_ref()).into_iter();
        scene.unread.extend(unread.map(|subject| UnreadPart {
            material: name.clone(),
            label: subject,
        }));
        scene.materials.push(Material {
            name: name.clone(),
            model: Model::Physical(Box::new(model)),
        });
        self.known.insert((number, coloured), name.clone());
        name
    }
}
