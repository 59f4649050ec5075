//! Rays, boxes, shapes and acceleration structures.
pub mod aabb;
pub mod ray;
pub mod scalar;
pub mod shapes;
pub use aabb::{Aabb, PaddedBox};
pub use ray::{Hit, Interval, Ray, Side};
pub use scalar::{Fast, Precision, Real, Reference, Robust, Vec3Of, Vector};
pub use shapes::{Probe, Shape, ShapeHit, Surface};
