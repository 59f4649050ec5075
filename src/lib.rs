//! Raywright renders a model or a scene file to a picture with an estimate of its error.
//!
//! ```
//! use raywright::prelude::*;
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//! #   if raywright::io::presets::get("cornell").is_err() { return Ok(()); } // its file may have been deleted
//!     let loaded = load(&Input::Preset("cornell".into()), &LoadOptions::default())?; // or Input::Path("model.glb".into())
//!     let settings = Settings { size: [64, 64], sampling: Sampling::General(16), denoise: true, ..Settings::from_scene(&loaded.scene) };
//!     let rendered = prepare(&loaded.scene, &settings, &())?.render(&());
//!     let denoised = rendered.denoise_output().expect("it was asked for");
//!     println!("root relMSE {:.3}", denoised.error.root_relmse.value);
//!     let path = std::env::temp_dir().join("cornell.png");
//!     write_picture(&path, rendered.final_picture(), Display::from_render(&loaded.scene.render), &PictureMetadata::default())?;
//!     Ok(())
//! }
//! ```
//!
//! # Stages of a render
//!
//! | step | result |
//! |---|---|
//! | [`load`](prelude::load) | a [`Scene`](prelude::Scene): plain data, checked, with its images and meshes in memory. A model without lights stands in a studio |
//! | [`Settings::from_scene`](prelude::Settings::from_scene) | `size`, `sampling` (the samples of a pixel), `integrator` and so on as in the scene, to be changed field by field |
//! | [`prepare`](fn@prelude::prepare) | a [`ReadyScene`](prelude::ReadyScene): the tree, tables and textures for these settings. A scene without camera is framed |
//! | [`ReadyScene::render`](prelude::ReadyScene::render) | a [`RenderOutput`](prelude::RenderOutput): picture, error, counts. Any number of threads gives the same bits |
//! | [`write_picture`](prelude::write_picture) | a PNG to look at or an EXR to compute with |
//!
//! A scene is rendered by Whitted's integrator if it needs nothing more, and by a path tracer
//! otherwise. [`ReadyScene::effects`](prelude::ReadyScene::effects) lists which effects are
//! simulated, absent and left out.
//!
//! # Words
//!
//! - **Effect:** a feature that a scene may need and a render may simulate, such as soft shadows
//!   or refraction ([`Effect`](prelude::Effect)).
//! - **Replicate:** one of several independent sets of a pixel's samples. The differences between
//!   replicates give the error estimate.
//! - **Film:** the sums of all samples rendered so far ([`Film`](prelude::Film)). A film can be
//!   stored, continued and merged with other films.
//! - **Ladder:** a choice that trades accuracy for time, such as the number of samples. A **rung**
//!   is one of its values ([`core::ladder`]).
//! - **Native scene:** a scene file in this program's own format, in TOML or JSON. A **model** is a
//!   glTF, OBJ, STL or PLY file.
//! - **Studio:** the lights and backdrop around a model that has no lights of its own.
//!
//! # Errors
//!
//! Every fallible operation returns a typed error: [`io::Error`] for files,
//! [`core::settings::SettingsError`] for settings, [`core::prepare::PrepareError`] for a scene that
//! does not fit into memory. Nothing is printed, and nothing in a file can cause a panic.
//!
//! ```
//! use raywright::core::prepare::PrepareError;
//! use raywright::core::settings::SettingsError;
//! use raywright::prelude::*;
//!
//! let input = Input::Bytes { name: "sheet.obj".into(), bytes: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".into(), resolver: None };
//! let loaded = load(&input, &LoadOptions::default())?;
//! assert_eq!(loaded.added_sky, Some(LightShortage::NoLight));
//!
//! let none = Settings { size: [0, 16], ..Settings::from_scene(&loaded.scene) };
//! assert_eq!(prepare(&loaded.scene, &none, &()).err(), Some(PrepareError::Settings(SettingsError::Size([0, 16]))));
//!
//! // The studio lights all of it.
//! let settings = Settings { size: [16, 16], ..none };
//! let picture = prepare(&loaded.scene, &settings, &())?.render(&()).picture;
//! assert!(picture.rgb.iter().flatten().all(|&channel| channel > 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The crates
//!
//! This crate only re-exports others: [`bvh`] has rays, shapes and the tree over them, [`core`] has
//! scenes, effects, light and film, [`io`] has files, and `cli` is the program. Without default
//! features, the crate omits the program and the crates that only a command line needs.
//!
//! Not implemented: caustics of lights without size, subsurface scattering, moving lights.
#![forbid(unsafe_code)]

pub use raywright_bvh as bvh;
#[cfg(feature = "cli")]
pub use raywright_cli as cli;
pub use raywright_core as core;
#[cfg(feature = "measure")]
pub use raywright_core::{stability, stress};
pub use raywright_io as io;

/// Items that most programs need to load, render and write a scene.
pub mod prelude {
    pub use raywright_core::display::Display;
    pub use raywright_core::effects::{Effect, EffectReport, EffectStatus};
    pub use raywright_core::film::Film;
    pub use raywright_core::picture::Picture;
    pub use raywright_core::scene::Scene;
    pub use raywright_core::settings::Sampling;
    pub use raywright_core::{Observer, ReadyScene, RenderOutput, RenderStage, Settings, prepare};
    pub use raywright_io::output::{PictureMetadata, read_picture, write_picture};
    pub use raywright_io::{
        EnvironmentOptions, EnvironmentSource, Input, LightShortage, Limits, LoadOptions,
        LoadedScene, Resolver, load,
    };
}
