//! Loading: from a path or preset to a validated scene, in any supported format.

mod input;
mod model;

use std::path::Path;

use raywright_core::fault::Fault;
use raywright_core::scene::MeshSource;
use raywright_core::{Observer, Scene, generate};

use crate::clay;
use crate::environment::{self, EnvironmentOptions, LightShortage};
use crate::error::Error;
use crate::folder::{Folder, refuse_placeholder};
use crate::gltf::ModelContents;
use crate::hash::SceneHash;
use crate::inputs::InputFiles;
use crate::limits::Limits;
use crate::native::{self, ParameterOverrides, SceneNotation};
use crate::presets;
use crate::section::{self, SectionPlane};
use crate::source::{SceneFormat, SourceInfo};
use crate::up_axis::UpAxis;

pub use input::Input;

use input::{detect_format, read_input_file};
use model::{load_model, refuse_model_choices, refuse_up_axis};

/// Options of [`load`], which replace or complete what a scene or model file contains.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Time and parameters that replace the file's values. For a model, the time of its animations;
    /// `None`: the rest pose.
    pub overrides: ParameterOverrides,
    /// Choice of scene, variant, animation and up axis of a model.
    pub model: ModelOptions,
    /// Environment options of the user, which replace or change the scene's own environment.
    pub environment: EnvironmentOptions,
    /// Whether every surface gets a neutral clay material.
    pub clay: bool,
    /// Section plane, in coordinates after the model was rotated to its up axis.
    pub section: Option<SectionPlane>,
    /// Whether files outside the scene's folder may be read. If not, such files are refused.
    pub allow_outside: bool,
    /// Limits above which input is refused.
    pub limits: Limits,
}

/// Choices for a model file. Formats other than glTF support only the up axis; native scenes
/// support none of the choices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelOptions {
    /// Name of a scene or, if no name matches, its index; `None`: the file's default.
    pub scene: Option<String>,
    /// Name of a material variant (KHR_materials_variants); `None`: the default materials.
    pub variant: Option<String>,
    /// Name of an animation or, if no name matches, its index; `None`: all together. Without a
    /// time, the start of the animation is shown.
    pub animation: Option<String>,
    /// Up axis of a model. `None` stands for z in STL files, which do not state their axis, and for
    /// y in all other files.
    pub up: Option<UpAxis>,
}

/// A loaded and validated scene, with its warnings, its origin and the files that it read.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The scene, with every expression evaluated and every image and mesh in memory.
    pub scene: Scene,
    /// Warnings for the user.
    pub warnings: Vec<Fault>,
    /// SHA-256 of all bytes read, the time and the overridden parameters: equal hashes mean equal
    /// scenes.
    pub hash: SceneHash,
    /// Origin of the scene.
    pub source: SourceInfo,
    /// Every file that was read or that the scene names; no output of the same run may replace
    /// these.
    pub inputs: InputFiles,
    /// Contents of a glTF file; empty for every other format.
    pub contents: ModelContents,
    /// Reason why the neutral sky or, for a model, the default studio was added; `None`: the scene
    /// has light, or an environment was given.
    pub added_sky: Option<LightShortage>,
    /// Axis of the file that was turned to y; y for scene files.
    pub up: UpAxis,
    /// Up axis that was assumed because the file states none (STL); `None` if the user gave the
    /// axis, or if the axis is y, the default of all other formats.
    pub assumed_up: Option<UpAxis>,
}

/// Loads, validates and completes a scene. A scene without light gets the neutral sky; a model
/// whose own lights are absent or too faint gets the default studio (see
/// [`LoadedScene::added_sky`]). A scene without a camera stays without; its preparation for
/// rendering then places a camera that shows the whole scene.
///
/// # Errors
/// [`Error`] of kind input, file or limit; of kind usage for an unknown preset, parameter, scene,
/// variant or animation.
#[doc(alias("import", "ParseFiles"))]
pub fn load(input: &Input, options: &LoadOptions) -> Result<LoadedScene, Error> {
    load_observed(input, options, &())
}

/// Loads a scene as [`load`] does, and reports the progress of a glTF import to an observer. The
/// observer cannot cancel the import.
///
/// # Errors
/// As [`load`].
pub fn load_observed(
    input: &Input,
    options: &LoadOptions,
    observer: &dyn Observer,
) -> Result<LoadedScene, Error> {
    match input {
        Input::Preset(name) => {
            refuse_model_choices(&format!("preset:{name}"), &options.model)?;
            refuse_up_axis(&format!("preset:{name}"), &options.model)?;
            let preset = presets::get(name)?;
            let folder = Folder::for_built_in_scene(options.limits.file_bytes);
            load_native_scene(
                &format!("preset:{name}"),
                name,
                preset.text,
                SceneNotation::Toml,
                &folder,
                options,
            )
        }
        Input::Path(path) => {
            let bytes = read_input_file(path, &options.limits)?;
            let folder = Folder::parent_of(path, options.limits.file_bytes)
                .map_err(|cause| Error::unreadable(path, &cause))?;
            let folder = folder.with_outside_access(options.allow_outside);
            folder.record_scene_file(path);
            load_content(path, &input.file_stem(), bytes, &folder, options, observer)
        }
        Input::Bytes {
            name,
            bytes,
            resolver,
        } => {
            let folder = Folder::from_resolver(resolver.as_ref(), options.limits.file_bytes);
            let path = Path::new(name);
            let bytes = refuse_placeholder(bytes.clone())
                .map_err(|cause| Error::unreadable(path, &cause))?;
            load_content(path, &input.file_stem(), bytes, &folder, options, observer)
        }
    }
}

/// Loads a scene or model from its bytes, in the format that is detected from path and content.
fn load_content(
    path: &Path,
    stem: &str,
    bytes: Vec<u8>,
    folder: &Folder,
    options: &LoadOptions,
    observer: &dyn Observer,
) -> Result<LoadedScene, Error> {
    let name = path.display().to_string();
    match detect_format(path, &bytes)? {
        SceneFormat::Native(notation) => {
            refuse_model_choices(&name, &options.model)?;
            refuse_up_axis(&name, &options.model)?;
            let text = native::decode_utf8(&name, bytes, options.limits.text_bytes)?;
            load_native_scene(&name, stem, &text, notation, folder, options)
        }
        format => load_model(path, stem, bytes, format, folder, options, observer),
    }
}

/// Parses a native scene, reads its files and applies the options.
fn load_native_scene(
    name: &str,
    stem: &str,
    text: &str,
    notation: SceneNotation,
    folder: &Folder,
    options: &LoadOptions,
) -> Result<LoadedScene, Error> {
    folder.add_to_hash(text.as_bytes());
    hash_overrides(folder, &options.overrides);
    let mut parsed = native::parse(name, text, notation, &options.overrides)?;
    check_scene_limits(name, &parsed.scene, &options.limits)?;
    let mut warnings = native::files::read_files(&mut parsed, folder, &options.limits)?;
    let (mut scene, mut model_entries) = (parsed.scene, parsed.model_entries);
    let objects = scene.objects.len();
    check_scene_limits(name, &scene, &options.limits)?;
    warnings.extend(apply_clay_and_section(
        &mut scene,
        options,
        UpAxis::Y,
        name,
        folder,
    ));
    check_scene_limits(name, &scene, &options.limits)?;
    let format = SceneFormat::Native(notation);
    let added_sky = environment::apply_environment(
        &mut scene,
        format,
        &options.environment,
        folder,
        &options.limits,
        &mut warnings,
    )?;
    if scene.objects.len() != objects {
        // A section has taken objects away, so that the others have other indices.
        model_entries.clear();
    }
    let source = SourceInfo::new(name, stem, format, Some(text.into()));
    let source = source.with_model_entries(model_entries);
    let contents = ModelContents::default();
    Ok(LoadedScene {
        scene,
        warnings,
        hash: folder.take_hash(),
        source,
        inputs: folder.inputs(),
        contents,
        added_sky,
        up: UpAxis::Y,
        assumed_up: None,
    })
}

/// Applies the options for clay and section to a scene, in this order. Returns the warnings of the
/// section.
fn apply_clay_and_section(
    scene: &mut Scene,
    options: &LoadOptions,
    up: UpAxis,
    name: &str,
    folder: &Folder,
) -> Vec<Fault> {
    if options.clay {
        folder.add_to_hash(b"clay");
        clay::apply_clay(scene);
    }
    let Some(section) = &options.section else {
        return Vec::new();
    };
    folder.add_to_hash(format!("{section:?}").as_bytes());
    section::cut_scene(scene, section, up, name)
}

/// Refuses a scene with more objects or triangles than the limits allow. Called before any
/// acceleration structure is built.
fn check_scene_limits(name: &str, scene: &Scene, limits: &Limits) -> Result<(), Error> {
    let objects = generate::count_objects(scene);
    if objects > limits.objects {
        return Err(Error::over_limit(
            name,
            format!(
                "the scene has {objects} objects, more than the limit of {}; merge or remove objects",
                limits.objects
            ),
        ));
    }
    let inline = scene.meshes.iter().map(|mesh| match &mesh.source {
        MeshSource::Inline(data) => data.indices.len() as u64,
        MeshSource::File(_) => 0,
    });
    let triangles: u64 = inline.sum();
    if triangles > limits.triangles {
        return Err(Error::over_limit(
            name,
            format!(
                "the scene has {triangles} triangles, more than the limit of {}; simplify its meshes",
                limits.triangles
            ),
        ));
    }
    Ok(())
}

/// Adds the time and the overridden parameters to the scene's hash.
fn hash_overrides(folder: &Folder, overrides: &ParameterOverrides) {
    if let Some(t) = overrides.time {
        folder.add_to_hash(b"t");
        folder.add_to_hash(&t.to_le_bytes());
    }
    for (name, value) in &overrides.set {
        folder.add_to_hash(name.as_bytes());
        folder.add_to_hash(&value.to_le_bytes());
    }
}
