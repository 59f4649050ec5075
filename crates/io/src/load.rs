//! Loading: from a path or preset to a validated scene, in any supported format.

mod input;

use std::path::Path;

pub use input::Input;
use input::{detect_format, read_input_file};
use raywright_core::fault::Fault;
use raywright_core::scene::MeshSource;
use raywright_core::{Observer, Scene, generate};

use crate::environment::{self, EnvironmentOptions, LightShortage};
use crate::error::Error;
use crate::folder::{Folder, refuse_placeholder};
use crate::gltf::{ImportedModel, ModelChoice, ModelContents};
use crate::hash::SceneHash;
use crate::inputs::InputFiles;
use crate::limits::Limits;
use crate::native::{self, ParameterOverrides, SceneNotation};
use crate::section::{self, SectionPlane};
use crate::source::{SceneFormat, SourceInfo};
use crate::up_axis::{UpAxis, rotate_to_y_up};
use crate::{clay, model_file, presets};

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
    let warnings = native::files::read_files(&mut parsed, folder, &options.limits)?;
    let mut source = SourceInfo::new(name, stem, SceneFormat::Native(notation), Some(text.into()));
    source.model_entries = parsed.model_entries;
    let objects = parsed.scene.objects.len();
    let scene = LoadedScene::new(parsed.scene, warnings, source);
    let mut loaded = scene.with_options(options, folder)?;
    if loaded.scene.objects.len() != objects {
        // A section has taken objects away, so that the others have other indices.
        loaded.source.model_entries.clear();
    }
    Ok(loaded)
}

impl LoadedScene {
    fn new(scene: Scene, warnings: Vec<Fault>, source: SourceInfo) -> Self {
        Self {
            scene,
            warnings,
            hash: SceneHash::default(),
            source,
            inputs: InputFiles::default(),
            contents: ModelContents::default(),
            added_sky: None,
            up: UpAxis::Y,
            assumed_up: None,
        }
    }

    /// Applies the options for clay, section and environment, in this order, and takes the hash and
    /// the files of the folder.
    fn with_options(mut self, options: &LoadOptions, folder: &Folder) -> Result<Self, Error> {
        let (scene, name) = (&mut self.scene, &self.source.name);
        check_scene_limits(name, scene, &options.limits)?;
        if options.clay {
            folder.add_to_hash(b"clay");
            clay::apply_clay(scene);
        }
        if let Some(section) = &options.section {
            folder.add_to_hash(format!("{section:?}").as_bytes());
            let cut = section::cut_scene(scene, section, self.up, name);
            self.warnings.extend(cut);
        }
        check_scene_limits(name, scene, &options.limits)?;
        self.added_sky = environment::apply_environment(
            scene,
            self.source.format,
            &options.environment,
            folder,
            &options.limits,
            &mut self.warnings,
        )?;
        (self.hash, self.inputs) = (folder.take_hash(), folder.inputs());
        Ok(self)
    }
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

// Loading of a model file as a complete scene: with an up axis, an environment, clay and a section.

/// Refuses a scene, variant or animation that is chosen for a file of another format than glTF.
pub(super) fn refuse_model_choices(name: &str, model: &ModelOptions) -> Result<(), Error> {
    let wishes = [
        ("scene", &model.scene),
        ("variant", &model.variant),
        ("animation", &model.animation),
    ];
    let Some((label, wish)) = wishes
        .into_iter()
        .find_map(|(label, wish)| Some((label, wish.as_ref()?)))
    else {
        return Ok(());
    };
    let message = format!("{name} has no {label}s, but the {label} `{wish}` was requested");
    Err(Error::invalid_usage(message).with_hint(format!("only glTF and GLB files have {label}s")))
}

/// Refuses an up axis for native scenes, which state all positions themselves.
pub(super) fn refuse_up_axis(name: &str, model: &ModelOptions) -> Result<(), Error> {
    let Some(up) = model.up else { return Ok(()) };
    let message = format!(
        "{name}: the up axis {} was requested, but only models have an up axis, not scene files (.scene.toml, .scene.json)",
        up.name()
    );
    Err(Error::invalid_usage(message)
        .with_hint("the up vector of a camera is given by three numbers, such as --up 0,0,1"))
}

/// Refuses overridden parameters, which only native scenes have.
fn refuse_parameters(name: &str, options: &LoadOptions) -> Result<(), Error> {
    let Some((parameter, _)) = options.overrides.set.first() else {
        return Ok(());
    };
    let error = Error::invalid_usage(format!("{name} has no parameter `{parameter}`"));
    Err(error.with_hint("only native scenes (.scene.toml, .scene.json) have parameters"))
}

/// Adds the choices for a model file to the scene's hash.
fn hash_model_options(folder: &Folder, model: &ModelOptions) {
    let axis = model.up.map(|up| up.name().to_owned());
    for (kind, wish) in [
        ("scene", &model.scene),
        ("variant", &model.variant),
        ("animation", &model.animation),
        ("up", &axis),
    ] {
        if let Some(wish) = wish {
            folder.add_to_hash(kind.as_bytes());
            folder.add_to_hash(wish.as_bytes());
        }
    }
}

/// Returns the choices for the importer. A chosen animation without a time is shown at its start.
fn model_choice(options: &LoadOptions) -> ModelChoice<'_> {
    let model = &options.model;
    let start = model.animation.as_ref().map(|_| 0.0);
    ModelChoice {
        scene: model.scene.as_deref(),
        variant: model.variant.as_deref(),
        animation: model.animation.as_deref(),
        time: options.overrides.time.or(start),
    }
}

/// Loads a model and adds what a complete scene needs: up axis, environment, clay and section.
pub(super) fn load_model(
    path: &Path,
    stem: &str,
    bytes: Vec<u8>,
    format: SceneFormat,
    folder: &Folder,
    options: &LoadOptions,
    observer: &dyn Observer,
) -> Result<LoadedScene, Error> {
    let name = path.display().to_string();
    refuse_parameters(&name, options)?;
    folder.add_to_hash(&bytes);
    hash_overrides(folder, &options.overrides);
    hash_model_options(folder, &options.model);
    if !format.has_model_choices() {
        refuse_model_choices(&name, &options.model)?;
    }
    let ImportedModel {
        mut scene,
        warnings,
        contents,
    } = model_file::load(
        format,
        path,
        &bytes,
        (folder, &options.limits),
        &model_choice(options),
        observer,
    )?;
    let own = if format == SceneFormat::Stl {
        UpAxis::Z
    } else {
        UpAxis::Y
    };
    let turned = options.model.up.unwrap_or(own);
    rotate_to_y_up(&mut scene, turned);
    let source = SourceInfo::new(name, stem, format, None);
    let loaded = LoadedScene {
        contents,
        up: turned,
        assumed_up: (options.model.up.is_none() && own != UpAxis::Y).then_some(own),
        ..LoadedScene::new(scene, warnings, source)
    };
    loaded.with_options(options, folder)
}
