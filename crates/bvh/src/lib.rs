//! Rays, boxes, shapes and acceleration structures: this crate finds the primitive that a ray hits,
//! and the point of the hit. It contains no light, no materials and no files.
//!
//! A [`PrimitiveSet`] collects primitives. A [`Geometry`] runs queries over them: for the closest
//! hit, or for any hit that a filter accepts. A linear scan and a tree return the same bits.
//! Primitives are stored in f32 or f64, and intersections are computed in f64.
//!
//! ```
//! use glam::{DVec3, Vec3};
//! use raywright_bvh::shapes::{AnyShape, Disk, Sphere};
//! use raywright_bvh::{AcceleratorKind, Geometry, PrimitiveSet, Interval, Ray, Visibility};
//!
//! let mut group = PrimitiveSet::<f32>::default();
//! group.add_shape(AnyShape::Disk(Disk::new(DVec3::ZERO, DVec3::Y, 10.0)), Visibility::default())?;
//! let ball = group.add_sphere(Sphere { centre: Vec3::new(0.0, 1.0, 0.0), radius: 1.0 }, Visibility::default())?;
//! let geometry = Geometry::new(group, AcceleratorKind::default());
//!
//! let down = Ray::new(Vec3::new(0.0, 5.0, 0.0), Vec3::NEG_Y);
//! let hit = geometry.closest(&down, Interval::positive(), &mut ()).expect("the ball is below");
//! assert_eq!((hit.object, hit.t), (ball, 3.0));
//! assert_eq!(geometry.surface(&down, &hit).normal, Vec3::Y);
//!
//! // Any hit: both objects are opaque, so either occludes the ray, and the filter is not called.
//! assert!(geometry.occluded(&down, Interval::positive(), &mut |_| false, &mut ()));
//! # Ok::<(), raywright_bvh::GeometryError>(())
//! ```
//!
//! Tree nodes have eight child boxes. In trees of primitives stored in f32, a leaf holds up to
//! eight triangles or spheres. Queries use the fastest [`Kernel`] that the processor can run.
//!
//! [`Geometry::closest_of_packet`] traces rays with a common origin together.
//!
//! The module [`shapes`] has the shapes, their transforms, and the surface point of a hit. [`Real`] is the precision of
//! stored geometry as a type parameter. Further items (memory limits, SIMD tools, the hard cases of the feature
//! `measure`) are public for the other crates, tests and benches alone.
//!
//! Not implemented yet: SIMD tests of primitives other than triangles, spheres and planes; packets
//! of rays without a common origin; quantised nodes; refitting; motion other than of instances
//! along straight lines.
#![deny(unsafe_code)]

#[doc(hidden)]
pub mod aabb;
mod binary;
mod build;
mod bvh8;
mod error;
mod geometry;
mod geometry_memory;
mod heap;
mod instance;
mod locate;
mod math;
mod memory;
mod motion;
mod primitive_set;
mod processor;
mod query;
#[doc(hidden)]
pub mod ray;
mod ray_ends;
#[doc(hidden)]
pub mod scalar;
pub mod shapes;
mod slot;
#[cfg(feature = "measure")]
#[doc(hidden)]
pub mod stability;
mod standard_output;
mod stats;
pub use aabb::{Aabb, PaddedBox};
pub use build::{AcceleratorKind, BuildQuality, BuildWork};
pub use bvh8::Kernel;
pub use error::GeometryError;
pub use geometry::Geometry;
pub use geometry_memory::GeometryMemory;
#[doc(hidden)]
pub use heap::{
    AllocationRefusal, CountingHeap, allocate_fallibly, limit_heap, remaining_heap_bytes,
    set_heap_refusal_handler,
};
#[doc(hidden)]
pub use locate::{TriangleHitLanes, TriangleSurfaceLanes};
#[doc(hidden)]
pub use math::angles::LaneAngles;
#[doc(hidden)]
pub use math::lanes::{LaneFloats, LaneVector, SimdFloats};
#[doc(hidden)]
pub use math::simd::{Simd, WIDTH as SIMD_WIDTH};
#[doc(hidden)]
pub use memory::huge_page_vec;
pub use motion::Motion;
pub use primitive_set::PrimitiveSet;
#[doc(hidden)]
pub use processor::{
    LaneTask, RegisterWidth, SimdTask, prefetch, run_in_lanes, run_in_lanes_of, run_widest,
};
pub use query::{PacketBackoff, RayPacket};
pub use ray::{Hit, Interval, Occlusion, Ray, Side, Visibility};
#[doc(hidden)]
pub use ray_ends::{RayEndTriangles, TriangleSlot};
pub use scalar::{Real, Vector};
pub use shapes::{
    PreparedRay, Shape, ShapeHit, Surface, SurfacePoint, TextureCoordinates, Transform,
};
#[doc(hidden)]
pub use standard_output::stdout_was_closed;
pub use stats::{TraversalCounter, TraversalStats};
