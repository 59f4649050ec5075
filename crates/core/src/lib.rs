//! Renderer from a scene in memory to a picture in memory. The crate reads and writes no files, and
//! prints nothing.
//!
//! A [`Scene`] is plain data. [`validate`] reports its errors, [`effects`] lists the features that
//! it needs. [`prepare()`] builds the data that an integrator traverses, and [`ReadyScene::render`]
//! renders the picture.
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
//! let settings = Settings { size: [10, 5], ..Settings::from_scene(&scene) };
//! let rendered = prepare(&scene, &settings, &())?.render(&());
//! assert_eq!(rendered.picture.pixel(5, 2), Some([1.0, 0.5, 0.0]));
//! assert_eq!(rendered.picture.pixel(0, 0), Some([0.25; 3]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Map
//!
//! | task | modules |
//! |---|---|
//! | describe a scene | [`scene`] (data types) |
//! | check a scene | [`validate`], [`effects`] (features that it needs), [`fault`] (faults and their severity) |
//! | choose what to render | [`settings`] |
//! | prepare a scene | [`prepare()`], [`mod@prepare`] (its errors) |
//! | render | [`ReadyScene::render`], [`counters`], [`film`] (sums of samples, and their error) |
//! | use a picture | [`picture`], [`denoise`], [`display`] (tone map and transfer curve) |
//!
//! The feature `measure` adds what measures scenes and the program itself: the error of a picture against its time
//! (`accuracy`), numerically hard cases (`stability`) and faults of a user's scene (`stress`). Further modules and items
//! are public for the other crates, tests and benches alone. They are not part of this documentation.
//!
//! # Words
//!
//! - **Effect:** a feature that a scene may need and a render may simulate, such as soft shadows
//!   ([`effects`]).
//! - **Replicate:** one of several independent sets of a pixel's samples. The differences between
//!   replicates give the error estimate ([`film`]).
//! - **Ladder:** a choice that trades accuracy for time, such as the number of samples. A **rung**
//!   is one of its values.
//!
//! # Threads and stopping
//!
//! The crate starts no threads. Preparation and rendering run on the rayon pool from which they are
//! called: the global pool, unless the caller installs another. An [`Observer`] can stop both.
//!
//! ```
//! use core::sync::atomic::{AtomicBool, Ordering};
//! use raywright_core::prepare::PrepareError;
//! use raywright_core::{Observer, Scene, Settings, prepare};
//!
//! /// Set by the user interface.
//! struct Stop(AtomicBool);
//!
//! impl Observer for Stop {
//!     fn is_cancelled(&self) -> bool {
//!         self.0.load(Ordering::Relaxed)
//!     }
//! }
//!
//! let scene = Scene::default();
//! let settings = Settings { size: [8, 8], ..Settings::from_scene(&scene) };
//! let stop = Stop(AtomicBool::new(false));
//! let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
//! let ready = pool.install(|| prepare(&scene, &settings, &stop))?;
//! assert!(pool.install(|| ready.render(&stop)).finished);
//!
//! stop.0.store(true, Ordering::Relaxed);
//! assert!(!pool.install(|| ready.render(&stop)).finished);
//! assert_eq!(pool.install(|| prepare(&scene, &settings, &stop)).err(), Some(PrepareError::Cancelled));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(
    not(feature = "measure"),
    allow(
        dead_code,
        unused_imports,
        reason = "measurements alone call some items"
    )
)]

#[cfg(feature = "measure")]
pub mod accuracy;
mod affine;
#[cfg(feature = "measure")]
#[doc(hidden)]
pub mod bench;
#[doc(hidden)]
pub mod camera;
pub mod counters;
pub mod denoise;
mod dispatch;
pub mod display;
#[cfg(feature = "measure")]
pub mod effect_costs;
pub mod effects;
#[doc(hidden)]
pub mod expr;
#[doc(hidden)]
pub mod extent;
pub mod fault;
pub mod film;
#[doc(hidden)]
pub mod filter;
#[doc(hidden)]
pub mod framing;
#[doc(hidden)]
pub mod generate;
mod hash;
mod integrator;
mod interaction;
#[doc(hidden)]
pub mod ladder;
#[doc(hidden)]
pub mod light;
mod lookup;
#[doc(hidden)]
pub mod material;
#[doc(hidden)]
pub mod memory;
#[doc(hidden)]
pub mod metrics;
mod motion;
#[doc(hidden)]
pub mod noise;
#[doc(hidden)]
pub mod number;
mod observer;
mod origin_grid;
pub mod picture;
pub mod prepare;
mod render;
#[doc(hidden)]
pub mod sampler;
pub mod scene;
pub mod settings;
mod shape;
pub mod sky_picture;
#[cfg(feature = "measure")]
pub mod stability;
mod storage_origin;
#[cfg(feature = "measure")]
pub mod stress;
mod studio;
#[doc(hidden)]
pub mod suggest;
mod texture;
#[cfg(feature = "measure")]
#[doc(hidden)]
pub mod topology;
pub mod validate;
#[doc(hidden)]
pub use affine::affine_from_steps;
pub use dispatch::{ReadyScene, prepare};
#[doc(hidden)]
pub use dispatch::{
    estimate_scene_memory, find_collapsed_objects, measure_scene_extent, prepare_for_previews,
};
#[doc(hidden)]
pub use lookup::SceneLookup;
pub use memory::MemoryUse;
pub use observer::Observer;
pub use raywright_bvh as bvh;
pub use render::{RenderOutput, RenderStage};
pub use scene::Scene;
pub use settings::Settings;
