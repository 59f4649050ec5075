//! Files of a renderer: loads scene and model files into a [`Scene`](raywright_core::Scene), and
//! writes pictures, unfinished renders and reports.
//!
//! Nothing in a file can make this crate panic, hang, read outside the scene's folder or exceed its
//! memory limit.
//!
//! ```
//! use raywright_core::{Settings, prepare};
//! use raywright_io::{Input, LoadOptions, load};
//!
//! # if raywright_io::presets::get("whitted").is_err() { return Ok(()); } // its file may have been deleted
//! let loaded = load(&Input::Preset("whitted".to_owned()), &LoadOptions::default())?;
//! let settings = Settings { size: [16, 9], ..Settings::from_scene(&loaded.scene) };
//! let picture = prepare(&loaded.scene, &settings, &())?.render(&()).picture;
//! assert_eq!(picture.rgb.len(), 16 * 9);
//!
//! let wrong = load(&Input::Preset("whited".to_owned()), &LoadOptions::default()).unwrap_err();
//! assert!(wrong.to_string().contains("whitted"), "the message suggests the right name: {wrong}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | task | item | formats |
//! |---|---|---|
//! | load a scene or model | [`load()`] | native TOML and JSON, glTF, GLB, OBJ, STL, PLY |
//! | load a built-in scene | [`Input::Preset`], [`presets`] | |
//! | write a picture | [`output::write_picture`] | PNG, JPEG, WebP, OpenEXR |
//! | read a picture | [`output::read_picture`] | PNG, JPEG, WebP, OpenEXR |
//! | write an animation | [`output::AnimationWriter`] | GIF, APNG |
//! | store and continue an unfinished render | [`output::write_film`], [`output::read_film`] | film files |
//! | write a measurement report | [`report`] | SVG, HTML |
//! | show text from untrusted files | [`masking`] | |
//!
//! A failure is an [`Error`]. A scene or model that loads with doubts has warnings, each a [`Fault`](raywright_core::fault::Fault), in
//! [`LoadedScene::warnings`].
//!
//! Not supported yet: subsurface scattering and vendor extensions of glTF materials (each is listed
//! in [`Scene::unread`](raywright_core::Scene::unread), and therefore an effect left out), points
//! and lines (a warning).
#![forbid(unsafe_code)]

#[macro_use]
mod import;

mod clay;
mod colour;
mod diagnostic;
mod environment;
mod error;
mod error_kind;
mod folder;
mod gltf;
mod hash;
mod image_decode_queue;
mod image_file;
mod inputs;
mod ktx2;
mod limits;
mod load;
pub mod masking;
mod mesh_file;
mod mesh_tools;
mod meshopt;
mod model_file;
mod native;
mod obj;
pub mod output;
mod ply;
mod polygon;
pub mod presets;
#[cfg(feature = "measure")]
pub mod report;
mod section;
mod source;
mod stl;
mod text;
mod up_axis;
mod uri;

pub use colour::parse_colour;
pub use diagnostic::{Diagnostic, Diagnostics, TextPosition};
pub use environment::{EnvironmentOptions, EnvironmentSource, GroundRule, LightShortage};
pub use error::Error;
pub use error_kind::ErrorKind;
pub use folder::{Folder, ReadError, Resolver};
pub use gltf::{AnimationInfo, ExtensionInfo, ModelContents};
pub use hash::SceneHash;
pub use inputs::{InputFiles, OverwrittenInput};
pub use limits::{Limits, format_bytes};
pub use load::{Input, LoadOptions, LoadedScene, ModelOptions, load, load_observed};
pub use native::{ParameterOverrides, SceneNotation};
pub use section::SectionPlane;
pub use source::{SceneFormat, SourceInfo, is_scene_or_model, list_scenes_and_models};
pub use up_axis::UpAxis;
