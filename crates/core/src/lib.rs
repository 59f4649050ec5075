//! Scene data, validation, expressions, effects, preparation, integrators, film, display and metrics: everything between a
//! scene in memory and a picture in memory.
//!
//! A [`Scene`] is plain data. [`validate`] finds what is wrong with it, [`effects`] what it calls for; [`prepare()`] turns it into
//! what an integrator walks, and [`Ready::render`] into a picture.
//!
//! ```
//! use raywright_core::{Scene, Settings, prepare};
//!
//! let scene: Scene = serde_json::from_str(r#"{
//!     "format": 1,
//!     "cameras": [{ "pose": { "look_at": { "eye": [0, 0, 5], "target": [0, 0, 0] } },
//!                   "projection": { "pinhole": { "vertical_fov": 40 } } }],
//!     "sky": { "constant": 0.25 },
//!     "materials": [{ "name": "glowing", "model": { "classic": { "local": 0, "emission": [1, 0.5, 0] } } }],
//!     "objects": [{ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "glowing" }]
//! }"#)?;
//! assert!(raywright_core::validate::validate(&scene).is_empty());
//!
//! let settings = Settings { size: [10, 5], ..Settings::of(&scene) };
//! let rendered = prepare(&scene, &settings)?.render(&());
//! assert_eq!(rendered.picture.pixel(5, 2), Some([1.0, 0.5, 0.0]));
//! assert_eq!(rendered.picture.pixel(0, 0), Some([0.25; 3]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not here yet: a path tracer (what Whitted ray tracing leaves out, [`effects`] lists), a measurement of the [`ladder`]s, files of
//! half-finished pictures (a [`film::Film`] holds one in memory).
#![forbid(unsafe_code)]

pub mod bench;
pub mod camera;
pub mod counters;
pub mod dispatch;
pub mod display;
pub mod effects;
pub mod expr;
pub mod film;
pub mod generate;
mod hash;
mod integrator;
mod interaction;
pub mod ladder;
pub mod light;
pub mod lookup;
pub mod material;
pub mod metrics;
pub mod noise;
pub mod picture;
pub mod prepare;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod settings;
pub mod suggest;
pub mod validate;
pub use dispatch::{Ready, prepare};
pub use lookup::Lookup;
pub use raywright_bvh as bvh;
pub use render::{Observer, Rendered};
pub use scene::Scene;
pub use settings::Settings;
