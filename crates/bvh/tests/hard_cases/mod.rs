//! Hard cases of the numerics specification that the textbook's formulas fail, judged for any arithmetic: the tests hold the library against
//! them, and the bench `precision` makes a table of all three.
#![expect(clippy::print_stderr, reason = "a test says how many rays it judged and how near the bound they came")]

pub mod quadrics;
pub mod sphere;
pub mod support;
pub mod textbook;
pub mod torus;
pub mod triangles;

use raywright_bvh::shapes::AnyShape;
use raywright_bvh::{Ray, Real};

/// The distance at which an arithmetic has a ray meet a shape first, in front of its origin and from either side.
pub type Intersect<R> = fn(&AnyShape<R>, &Ray<R>) -> Option<R>;

/// That of the library.
pub fn intersect<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>) -> Option<R> {
    support::hit(shape, ray).map(|hit| hit.t)
}
