//! Raywright is a data-driven scene engine: one file in - a scene, a glTF, OBJ, STL or PLY model - and one honest picture out.
//!
//! This crate only re-exports. [`bvh`] knows rays, shapes and acceleration; [`core`] knows scenes, effects and light; [`io`]
//! knows files; [`cli`] is the program. The way of the data, from a scene that the program carries to a picture:
//!
//! ```
//! use raywright::prelude::*;
//!
//! # if raywright::io::presets::get("whitted").is_err() { return Ok(()); } // its file may have been deleted
//! let loaded = load(&Input::Preset("whitted".to_owned()), &LoadOptions::default())?;
//! let settings = Settings { size: [32, 18], ..Settings::of(&loaded.scene) };
//! let ready = prepare(&loaded.scene, &settings, &())?;
//! assert_eq!(ready.effects().status(Effect::Refraction), Status::Simulated);
//!
//! let rendered = ready.render(&());
//! assert!(rendered.finished);
//! // The mirror sphere, left of the middle, shows the blue of the sky.
//! let [red, _, blue] = rendered.picture.pixel(11, 7).unwrap();
//! assert!(blue > red);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Loading completes a scene as the command line does: a model without lights stands in the default studio, and one without a camera is
//! shown whole. Ask for [`EnvironmentSource::None`](io::EnvironmentSource) and it stays dark.
//!
//! ```
//! use raywright::prelude::*;
//!
//! # let folder = tempfile::tempdir()?;
//! # let file = folder.path().join("sheet.obj");
//! std::fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")?;
//! let loaded = load(&Input::Path(file), &LoadOptions::default())?;
//! assert_eq!(loaded.added_sky, Some(LightShortage::NoLight));
//!
//! let settings = Settings { size: [16, 16], ..Settings::of(&loaded.scene) };
//! let picture = prepare(&loaded.scene, &settings, &())?.render(&()).picture;
//! assert!(picture.rgb.iter().flatten().all(|&channel| channel > 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A scene is shaded by Whitted's integrator where that is all it calls for, and by the path tracer otherwise.
//!
//! What is not done yet: caustics of lights without size, subsurface scattering, lights that move. A render says what a
//! scene calls for and does not get ([`core::effects`]).
#![forbid(unsafe_code)]

pub use raywright_bvh as bvh;
pub use raywright_cli as cli;
pub use raywright_core as core;
pub use raywright_io as io;

/// What most programs need to load, render and write.
pub mod prelude {
    pub use raywright_core::display::Display;
    pub use raywright_core::effects::{Effect, EffectReport, Status};
    pub use raywright_core::picture::Picture;
    pub use raywright_core::scene::Scene;
    pub use raywright_core::{Observer, Ready, Rendered, Settings, prepare};
    pub use raywright_io::output::{Metadata, read_picture, write_picture};
    pub use raywright_io::{Environment, EnvironmentSource, Input, LightShortage, Limits, LoadOptions, Loaded, load};
}
