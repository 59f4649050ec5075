//! Raywright: a data-driven scene engine. One file in - a scene, a glTF or an OBJ model - and one honest picture out.
//!
//! This crate only re-exports: [`bvh`] (rays, shapes, acceleration), [`core`] (scene data, effects, light), [`io`] (files)
//! and [`cli`] (the program). What each of them promises, and what it does not do yet, stands on its own front page.
#![forbid(unsafe_code)]

pub use raywright_bvh as bvh;
pub use raywright_cli as cli;
pub use raywright_core as core;
pub use raywright_io as io;
