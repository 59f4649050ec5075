//! Environment of a scene: the scene's own sky, no sky, the neutral sky, the default studio, a sky
//! by formula or a picture file; and the light that is added to a scene without light.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3};
use raywright_core::effects::{are_objects_lit_by_lights, emits_light, neutral_sky};
use raywright_core::scene::{Colour, Image, ImageData, Sky, SkyMap, Studio};
use raywright_core::sky_picture::SkyPicture;
use raywright_core::{Scene, fault};

use crate::error::Error;
use crate::error_kind::ErrorKind;
use crate::folder::{Folder, read_picture_file};
use crate::image_file::{self, DecodedImage};
use crate::limits::Limits;
use crate::source::SceneFormat;

/// The user's choices for the environment, which is a scene's sky or studio. By default a scene
/// keeps its own environment. A scene without light gets an environment: a native scene file the
/// neutral sky, a model file the default studio.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnvironmentOptions {
    /// Replacement of the scene's own sky.
    pub source: Option<EnvironmentSource>,
    /// Whether a studio keeps its ground.
    pub ground: GroundRule,
    /// Radiance of a studio's backdrop, the uniform background around the model; `None` keeps the
    /// studio's own value.
    pub backdrop: Option<f64>,
    /// Rotation about +y in degrees, added to the rotation of the sky.
    pub rotation: Option<f64>,
    /// Factor on the radiance of the environment, at least zero.
    pub strength: Option<f64>,
}

/// Environment that replaces a scene's own sky.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EnvironmentSource {
    /// No environment: rays that hit nothing are black.
    None,
    /// The neutral grey sky of scenes without light.
    Default,
    /// The default studio, which also replaces the scene's lights.
    Studio,
    /// A sky by formula.
    Picture(SkyPicture),
    /// An equirectangular picture: HDR, EXR, PNG or JPEG.
    File(PathBuf),
}

/// Whether a studio keeps its ground, the surface below the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GroundRule {
    /// The studio's own ground. The default studio has an invisible ground, on which only shadows
    /// are visible.
    #[default]
    Auto,
    /// The ground is removed.
    None,
}

/// Reason why a scene was given light that its file lacks: no light, or only light too faint to
/// see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightShortage {
    /// The scene has no light. Emissive surfaces of a model do not count as lights.
    NoLight,
    /// Lights too faint for a visible picture.
    TooDim,
}

/// Applies the environment options to a scene. Returns the reason if light was added without a
/// request: the neutral sky for a native scene, the default studio for a model. The bytes of a
/// picture file are added to the folder's hash, and its path to the folder's inputs.
///
/// # Errors
/// An unreadable file, a file that is no picture or exceeds a limit, and a sky that cannot be
/// rotated or scaled.
pub(crate) fn apply_environment(
    scene: &mut Scene,
    format: SceneFormat,
    options: &EnvironmentOptions,
    folder: &Folder,
    limits: &Limits,
    warnings: &mut Vec<fault::Fault>,
) -> Result<Option<LightShortage>, Error> {
    let studio = || Sky::Studio(Studio::default());
    match &options.source {
        None => {}
        Some(EnvironmentSource::None) => scene.sky = None,
        Some(EnvironmentSource::Default) => scene.sky = Some(neutral_sky()),
        Some(EnvironmentSource::Studio) => {
            scene.sky = Some(studio());
            scene.lights.clear();
        }
        Some(EnvironmentSource::Picture(picture)) => {
            set_sky_picture(scene, String::new(), picture.image(), 0)
        }
        Some(EnvironmentSource::File(path)) => {
            load_sky_picture(scene, path, folder, limits, warnings)?
        }
    }
    if options.source.is_some() {
        folder.add_to_hash(format!("environment {:?}", options.source).as_bytes());
    }
    let shortage = if options.source.is_some() {
        None
    } else {
        detect_light_shortage(scene, format)
    };
    let is_model = !matches!(format, SceneFormat::Native(_));
    if shortage.is_some() && is_model {
        scene.sky = Some(studio());
    }
    if options.ground == GroundRule::None {
        folder.add_to_hash(b"ground none");
        if let Some(Sky::Studio(studio)) = &mut scene.sky {
            studio.ground = false;
        }
    }
    if let Some(radiance) = options.backdrop {
        folder.add_to_hash(b"backdrop");
        folder.add_to_hash(&radiance.to_le_bytes());
        if let Some(Sky::Studio(studio)) = &mut scene.sky {
            studio.backdrop = Some(radiance);
        }
    }
    for (key, value) in [
        ("rotation", options.rotation),
        ("strength", options.strength),
    ] {
        let Some(value) = value else { continue };
        folder.add_to_hash(key.as_bytes());
        folder.add_to_hash(&value.to_le_bytes());
        let Some(sky) = &mut scene.sky else {
            let error = Error::invalid_usage(format!(
                "--env-{key} changes the environment, but the scene has no environment"
            ));
            return Err(error.with_hint("add an environment with --env default or --env FILE"));
        };
        if key == "rotation" {
            rotate_sky(sky, value)?
        } else {
            scale_sky(sky, value)?
        }
    }
    if shortage.is_some() && !is_model {
        scene.sky = Some(neutral_sky());
    }
    // A model with lights of its own stands in front of the studio's backdrop, without its light.
    if is_model && options.source.is_none() && scene.sky.is_none() {
        scene.sky = Some(Sky::Studio(Studio {
            strength: 0.0,
            backdrop: options.backdrop,
            ground: false,
            ..Studio::default()
        }));
    }
    Ok(shortage)
}

/// Returns the shortage of light in a scene, if any. A native scene lacks light only if nothing in
/// the scene emits, because its author may want a dark picture. A model also lacks light if its
/// lights are too faint, because its emissive surfaces rarely light the other surfaces.
fn detect_light_shortage(scene: &Scene, format: SceneFormat) -> Option<LightShortage> {
    match format {
        SceneFormat::Native(_) => (!emits_light(scene)).then_some(LightShortage::NoLight),
        _ if scene.sky.is_some() => None,
        _ if scene.lights.is_empty() => Some(LightShortage::NoLight),
        _ => (!are_objects_lit_by_lights(scene)).then_some(LightShortage::TooDim),
    }
}

/// Replaces the scene's sky by an equirectangular picture file.
fn load_sky_picture(
    scene: &mut Scene,
    path: &Path,
    folder: &Folder,
    limits: &Limits,
    warnings: &mut Vec<fault::Fault>,
) -> Result<(), Error> {
    folder.record_scene_file(path);
    // A pipe could block the reader for ever, and a folder has no content.
    if path.exists() && !path.is_file() {
        return Err(Error::invalid_input(
            path.display(),
            "is not a regular file",
        ));
    }
    let bytes = read_picture_file(path, limits)?;
    folder.add_to_hash(&bytes);
    let DecodedImage {
        image,
        remarks,
        repaired_count: repaired,
    } = image_file::decode(&bytes, limits).map_err(|fault| match fault.kind {
        ErrorKind::Limit => fault.into_error(path.display()),
        _ => (fault.into_error(path.display()))
            .with_hint("an environment is an equirectangular picture (.hdr, .exr, .png, .jpg)"),
    })?;
    warnings.extend(
        remarks
            .into_iter()
            .map(|remark| image_file::remark_kind(repaired).in_file(path.display(), remark)),
    );
    let path = path.display().to_string();
    set_sky_picture(scene, path, Arc::new(image), repaired);
    Ok(())
}

/// Replaces the scene's sky by an equirectangular picture. `path` is its file, empty without one.
fn set_sky_picture(scene: &mut Scene, path: String, picture: Arc<ImageData>, mended: u64) {
    let mut name = "environment".to_owned();
    while scene.images.iter().any(|image| image.name == name) {
        name.push('\'');
    }
    scene.images.push(Image {
        name: name.clone(),
        path,
        data: Some(picture),
        mended,
    });
    scene.sky = Some(Sky::Map(SkyMap {
        image: name,
        rotation: 0.0,
        strength: 1.0,
    }));
}

/// Adds a rotation about +y to a sky. A sky given by an expression is refused.
fn rotate_sky(sky: &mut Sky, degrees: f64) -> Result<(), Error> {
    match sky {
        Sky::Constant(_) => {}
        Sky::Map(map) => map.rotation += degrees,
        Sky::Studio(studio) => studio.rotation += degrees,
        Sky::Gradient { suns, .. } => {
            // The direction of rotation is that of a sky picture: after 90°, the view along +z
            // shows the former view along +x.
            let turn = DQuat::from_rotation_y(-degrees.to_radians());
            for sun in suns {
                sun.direction = (turn * DVec3::from(sun.direction)).to_array();
            }
        }
        Sky::Expression(_) => return Err(expression_sky_error("rotated", "--env-rotation")),
    }
    Ok(())
}

/// Multiplies the radiance of a sky by a factor. A sky given by an expression is refused.
fn scale_sky(sky: &mut Sky, factor: f64) -> Result<(), Error> {
    let scaled = |colour: &mut Colour| colour.0.iter_mut().for_each(|channel| *channel *= factor);
    match sky {
        Sky::Constant(colour) => scaled(colour),
        Sky::Map(map) => map.strength *= factor,
        Sky::Studio(studio) => studio.strength *= factor,
        Sky::Gradient { bottom, top, suns } => {
            [bottom, top].into_iter().for_each(scaled);
            suns.iter_mut().for_each(|sun| sun.weight *= factor);
        }
        Sky::Expression(_) => return Err(expression_sky_error("scaled", "--env-strength")),
    }
    Ok(())
}

/// Creates the error for `flag`, an option that cannot change a sky given by an expression.
fn expression_sky_error(label: &str, flag: &str) -> Error {
    let error = Error::invalid_usage(format!(
        "{flag}: the scene's sky is an expression, which cannot be {label} from the command line"
    ));
    error.with_hint("change the expression in the scene, or choose another environment with --env")
}

#[cfg(test)]
mod tests;
