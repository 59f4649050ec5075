//! Scene data, effects, preparation, materials, lights, samplers, integrators, film, metrics and reports.
pub mod display;
pub mod expr;
pub mod noise;
pub mod picture;
pub mod scene;
pub mod suggest;
pub mod validate;
pub use raywright_bvh as bvh;
pub use scene::Scene;
