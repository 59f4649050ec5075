//! Loading of a model file as a complete scene: with an up axis, an environment, clay and a section.

use std::path::Path;

use raywright_core::Observer;

use super::{
    LoadOptions, LoadedScene, ModelOptions, apply_clay_and_section, check_scene_limits,
    hash_overrides,
};
use crate::environment;
use crate::error::Error;
use crate::folder::Folder;
use crate::gltf::{ImportedModel, ModelChoice};
use crate::model_file;
use crate::source::{SceneFormat, SourceInfo};
use crate::up_axis::{UpAxis, rotate_to_y_up};

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
        mut warnings,
        contents,
    } = model_file::load(
        format,
        path,
        &bytes,
        (folder, &options.limits),
        &model_choice(options),
        observer,
    )?;
    check_scene_limits(&name, &scene, &options.limits)?;
    let own = if format == SceneFormat::Stl {
        UpAxis::Z
    } else {
        UpAxis::Y
    };
    let up = options.model.up;
    let turned = up.unwrap_or(own);
    rotate_to_y_up(&mut scene, turned);
    warnings.extend(apply_clay_and_section(
        &mut scene, options, turned, &name, folder,
    ));
    check_scene_limits(&name, &scene, &options.limits)?;
    let assumed_up = (up.is_none() && own != UpAxis::Y).then_some(own);
    let added_sky = environment::apply_environment(
        &mut scene,
        format,
        &options.environment,
        folder,
        &options.limits,
        &mut warnings,
    )?;
    let source = SourceInfo::new(name, stem, format, None);
    Ok(LoadedScene {
        scene,
        warnings,
        hash: folder.take_hash(),
        source,
        inputs: folder.inputs(),
        contents,
        added_sky,
        up: turned,
        assumed_up,
    })
}
