//! Raywright: a data-driven scene engine. One file in - a scene, a glTF or an OBJ model - and one honest picture out.
//!
//! This crate only re-exports: [`bvh`] (rays, shapes, acceleration), [`core`] (scene data, effects, light), [`io`] (files)
//! and [`cli`] (the program). What each of them promises, and what it does not do yet, stands on its own front page.
//!
//! ```
//! use raywright::prelude::*;
//!
//! let loaded = load(&Input::Preset("whitted".to_owned()), &LoadOptions::default())?;
//! let settings = Settings { size: [10, 5], ..Settings::of(&loaded.scene) };
//! let rendered = prepare(&loaded.scene, &settings)?.render(&());
//! assert!(rendered.finished && rendered.picture.rgb.iter().flatten().all(|v| v.is_finite()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub use raywright_bvh as bvh;
pub use raywright_cli as cli;
pub use raywright_core as core;
pub use raywright_io as io;

/// What most programs need: load a scene, prepare it, render it.
pub mod prelude {
    pub use raywright_core::{Observer, Ready, Rendered, Scene, Settings, prepare};
    pub use raywright_io::{Input, LoadOptions, load};
}
