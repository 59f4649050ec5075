//! Models that a native scene places: the contents of their files become part of the scene, under
//! unique names.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::rc::Rc;

use raywright_core::affine_from_steps;
use raywright_core::fault::Fault;
use raywright_core::scene::{
    Light, MaterialFields, MaterialModel, MeshSource, ModelFile, Object, Scene, Shape,
};
use raywright_core::suggest::most_similar_word;
use raywright_core::validate::MAX_COORDINATE;

use super::ParsedScene;
use super::node::ModelEntries;
use crate::error::Error;
use crate::error_kind::ErrorKind;
use crate::folder::{Folder, ReadError};
use crate::gltf::ModelChoice;
use crate::import::{MODELS, UniqueNames, sanitise_text};
use crate::limits::Limits;
use crate::model_file;
use crate::source::SceneFormat;
use crate::up_axis::transform_light;

/// Key of a loaded model: path, scene, variant, and the bits of the time in seconds.
type ModelKey = (String, Option<String>, Option<String>, Option<u64>);

/// Objects and lights of a loaded model, which each placement copies. The model's images, textures,
/// materials and meshes are already in the scene.
struct LoadedModel {
    /// Objects, with material names as in the model's file.
    objects: Vec<Object>,
    lights: Vec<Light>,
    /// Names of the materials in the scene, by their names in the model's file.
    materials: BTreeMap<String, String>,
}

/// Returns the names of a scene's images, textures, materials and meshes.
fn part_names(scene: &mut Scene) -> [Vec<&mut String>; 4] {
    [
        scene.images.iter_mut().map(|part| &mut part.name).collect(),
        scene
            .textures
            .iter_mut()
            .map(|part| &mut part.name)
            .collect(),
        scene
            .materials
            .iter_mut()
            .map(|part| &mut part.name)
            .collect(),
        scene.meshes.iter_mut().map(|part| &mut part.name).collect(),
    ]
}

/// Loads all models that a scene places, adds their contents to the scene, and empties the scene's
/// list of models.
///
/// # Errors
/// At the position of the model: an unreadable or invalid file, a missing choice, and a transform
/// beyond the range of coordinates.
pub(super) fn add_models(
    parsed: &mut ParsedScene<'_>,
    outer: &Folder,
    limits: &Limits,
) -> Result<Vec<Fault>, Error> {
    let models = core::mem::take(&mut parsed.scene.models);
    // Names of models must differ from those that the scene uses already.
    let mut taken = part_names(&mut parsed.scene).map(|names| {
        let mut taken = UniqueNames::default();
        names
            .into_iter()
            .for_each(|name| drop(taken.make_unique(name)));
        taken
    });
    let mut parts = HashMap::<ModelKey, Rc<LoadedModel>>::new();
    let mut warnings = Vec::new();
    for (i, model) in models.iter().enumerate() {
        let key = (
            model.file.clone(),
            model.scene.clone(),
            model.variant.clone(),
            model.time.map(f64::to_bits),
        );
        let before = scene_list_lengths(&parsed.scene);
        let part = match parts.get(&key) {
            Some(known) => Rc::clone(known),
            None => {
                let (scene, more) = load_model_file(parsed, outer, limits, model, i)?;
                warnings.extend(more);
                let part = Rc::new(merge_model(
                    &mut parsed.scene,
                    scene,
                    &model_name_prefix(model),
                    &mut taken,
                ));
                parts.insert(key, Rc::clone(&part));
                part
            }
        };
        place_model(parsed, &part, model, i)?;
        let entries = before.into_iter().zip(scene_list_lengths(&parsed.scene));
        parsed
            .model_entries
            .extend(entries.map(|((list, start), (_, end))| ModelEntries {
                list,
                range: start..end,
                model: i,
            }));
    }
    Ok(warnings)
}

/// The lists that models add to, with their lengths.
fn scene_list_lengths(scene: &Scene) -> [(&'static str, usize); 6] {
    [
        ("images", scene.images.len()),
        ("textures", scene.textures.len()),
        ("materials", scene.materials.len()),
        ("meshes", scene.meshes.len()),
        ("objects", scene.objects.len()),
        ("lights", scene.lights.len()),
    ]
}

/// Returns the prefix of all names of a model: the model's own name or, without a name, the file
/// name without extension.
fn model_name_prefix(model: &ModelFile) -> String {
    let stem = || {
        Path::new(&model.file)
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
            .unwrap_or_default()
    };
    if model.name.is_empty() {
        stem()
    } else {
        model.name.clone()
    }
}

/// Loads a model's file as a scene of its own.
fn load_model_file(
    parsed: &ParsedScene<'_>,
    outer: &Folder,
    limits: &Limits,
    model: &ModelFile,
    index: usize,
) -> Result<(Scene, Vec<Fault>), Error> {
    let at = |key: &str| format!("models[{index}].{key}");
    let bytes = outer
        .read(&model.file)
        .map_err(|why| unreadable_file_error(parsed, &at("file"), &why))?;
    let folder = outer
        .folder_of_reference(&model.file)
        .map_err(|why| unreadable_file_error(parsed, &at("file"), &why))?;
    let file = Path::new(&model.file);
    // Memory that earlier models take is subtracted from the limit.
    let limits = Limits {
        memory_bytes: limits
            .memory_bytes
            .saturating_sub(image_and_mesh_bytes(&parsed.scene)),
        ..*limits
    };
    let format = SceneFormat::from_model_path(file).ok_or_else(|| {
        parsed.error_at(
            ErrorKind::Input,
            &at("file"),
            format!("models can only be read from {MODELS} files; convert this file"),
        )
    })?;
    let asks = [
        ("scene", model.scene.is_some()),
        ("variant", model.variant.is_some()),
        ("time", model.time.is_some()),
    ];
    if let Some((key, _)) = asks
        .iter()
        .find(|(_, requested)| *requested && !format.has_model_choices())
    {
        let message = format!(
            "{} has no scenes, variants or animations to choose from: remove this key",
            format.file_description()
        );
        return Err(parsed.error_at(ErrorKind::Input, &at(key), message));
    }
    let choice = ModelChoice {
        scene: model.scene.as_deref(),
        variant: model.variant.as_deref(),
        animation: None,
        time: model.time,
    };
    let loaded = model_file::load(format, file, &bytes, (&folder, &limits), &choice, &());
    outer.add_to_hash(folder.take_hash().to_string().as_bytes());
    loaded
        .map(|loaded| (loaded.scene, loaded.warnings))
        .map_err(|error| match error.kind() {
            // On the command line, an unknown choice is an error of kind usage. Written in a scene,
            // it is an error in the scene's content.
            ErrorKind::Usage if error.message().contains("has no variant") => {
                parsed.error_at(ErrorKind::Input, &at("variant"), error.message())
            }
            ErrorKind::Usage => parsed.error_at(ErrorKind::Input, &at("scene"), error.message()),
            kind => parsed.error_at(kind, &at("file"), error.message()),
        })
}

/// Returns the size of all images and meshes in memory, in bytes.
fn image_and_mesh_bytes(scene: &Scene) -> u64 {
    let images = scene
        .images
        .iter()
        .filter_map(|image| image.data.as_ref())
        .map(|data| data.byte_size());
    let meshes = scene.meshes.iter().map(|mesh| match &mesh.source {
        MeshSource::Inline(data) => data.byte_size(),
        MeshSource::File(_) => 0,
    });
    images.chain(meshes).sum::<usize>() as u64
}

/// New names of a model's images, textures, materials and meshes, by their names in the model's
/// file.
type RenamedParts = [BTreeMap<String, String>; 4];

/// Moves the images, textures, materials and meshes of a model into the scene, under names with the
/// prefix `label`. Returns the objects and lights for placement.
fn merge_model(
    scene: &mut Scene,
    mut own_scene: Scene,
    label: &str,
    taken: &mut [UniqueNames; 4],
) -> LoadedModel {
    let renamed = rename_parts(&mut own_scene, label, taken);
    update_references(&mut own_scene, &renamed);
    for object in &mut own_scene.objects {
        object.name = format!("{label}/{}", object.name);
    }
    for light in &mut own_scene.lights {
        light.name = format!("{label}/{}", light.name);
    }
    scene.images.append(&mut own_scene.images);
    scene.textures.append(&mut own_scene.textures);
    scene.materials.append(&mut own_scene.materials);
    scene.meshes.append(&mut own_scene.meshes);
    scene.unread.append(&mut own_scene.unread);
    let [_, _, materials, _] = renamed;
    LoadedModel {
        objects: own_scene.objects,
        lights: own_scene.lights,
        materials,
    }
}

/// Gives the images, textures, materials and meshes of a model unique names with the prefix
/// `label`. Returns the new names.
fn rename_parts(own_scene: &mut Scene, label: &str, taken: &mut [UniqueNames; 4]) -> RenamedParts {
    let mut renamed = RenamedParts::default();
    let parts = part_names(own_scene).into_iter().zip(taken);
    for ((names, taken), renamed) in parts.zip(&mut renamed) {
        for name in names {
            let new = taken.make_unique(&format!("{label}/{name}"));
            renamed.insert(core::mem::replace(name, new.clone()), new);
        }
    }
    renamed
}

/// Changes all references of a model to its renamed parts. The references of objects to materials
/// stay, because each placement chooses its own materials.
fn update_references(own_scene: &mut Scene, [images, textures, materials, meshes]: &RenamedParts) {
    let update = |name: &mut String, known: &BTreeMap<String, String>| {
        if let Some(new) = known.get(name) {
            name.clone_from(new);
        }
    };
    for texture in &mut own_scene.textures {
        update(&mut texture.image, images);
    }
    for material in &mut own_scene.materials {
        // Importers create physical materials only.
        let MaterialModel::Physical(model) = &mut material.model else {
            continue;
        };
        model.change_values(&mut |value| {
            if let Some(texture) = value.texture_mut() {
                update(&mut texture.name, textures);
            }
        });
    }
    for part in &mut own_scene.unread {
        update(&mut part.material, materials);
    }
    for object in &mut own_scene.objects {
        if let Shape::Mesh(mesh) = &mut object.shape {
            update(mesh, meshes);
        }
    }
}

/// Adds a copy of a model's objects and lights to the scene, under the transform of the placement.
fn place_model(
    parsed: &mut ParsedScene<'_>,
    part: &LoadedModel,
    model: &ModelFile,
    index: usize,
) -> Result<(), Error> {
    let at = |key: &str| format!("models[{index}].{key}");
    if let Some(name) = model
        .materials
        .keys()
        .find(|name| !part.materials.contains_key(*name))
    {
        let listed: Vec<String> = part
            .materials
            .keys()
            .take(20)
            .map(|name| format!("`{}`", sanitise_text(name)))
            .collect();
        let meant = most_similar_word(name, part.materials.keys().map(String::as_str));
        let meant = meant
            .map(|name| format!("; did you mean `{}`?", sanitise_text(name)))
            .unwrap_or_default();
        let message = format!(
            "`{}` has no material `{}` (its materials: {}){meant}",
            model.file,
            sanitise_text(name),
            listed.join(", ")
        );
        return Err(parsed.error_at(ErrorKind::Input, &at("materials"), message));
    }
    let map = affine_from_steps(&model.transform);
    for object in &part.objects {
        let mut object = object.clone();
        let own = part.materials.get(&object.material);
        if let Some(name) = model.materials.get(&object.material).or(own) {
            object.material.clone_from(name);
        }
        object.transform.extend(&model.transform);
        let whole = affine_from_steps(&object.transform);
        if !(whole.is_finite()
            && whole.inverse().is_finite()
            && whole.translation.abs().max_element() <= MAX_COORDINATE)
        {
            let message = format!(
                "the transform of `{}` has no inverse, or moves the object beyond ±1e15, the largest coordinate",
                sanitise_text(&object.name)
            );
            return Err(parsed.error_at(ErrorKind::Input, &at("transform"), message));
        }
        parsed.scene.objects.push(object);
    }
    parsed
        .scene
        .lights
        .extend(part.lights.iter().map(|light| transform_light(light, &map)));
    Ok(())
}

/// Creates the error for an unreadable file, at the position of the path `at` in the scene's text.
pub(super) fn unreadable_file_error(parsed: &ParsedScene<'_>, at: &str, why: &ReadError) -> Error {
    let kind = match why {
        ReadError::Refused(_) => ErrorKind::Input,
        ReadError::Unreadable(_) => ErrorKind::File,
        ReadError::TooLarge(_) => ErrorKind::Limit,
    };
    parsed.error_at(kind, at, why.to_string())
}
