//! Rays, boxes, shapes and acceleration structures.
pub mod aabb;
mod build;
pub mod geometry;
pub mod ray;
pub mod scalar;
pub mod shapes;
pub mod transform;
mod tree;
pub use aabb::{Aabb, PaddedBox};
pub use build::BuildQuality;
pub use geometry::{AcceleratorKind, Geometry, GeometryError, Group, Visibility};
pub use ray::{Hit, Interval, Ray, Side};
pub use scalar::{Fast, Precision, Real, Reference, Robust, Vec3Of, Vector};
pub use shapes::{Located, Parameters, Probe, Shape, ShapeHit, Surface};
pub use transform::Transform;
pub use tree::{Tally, Visits};
