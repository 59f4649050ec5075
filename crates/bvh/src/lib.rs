//! Rays, boxes, shapes and acceleration structures.
pub mod ray;
pub mod scalar;
pub use ray::{Hit, Interval, Ray, Side};
pub use scalar::{Fast, Precision, Real, Reference, Robust, Vec3Of, Vector};
