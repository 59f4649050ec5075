//! The hard cases of the numerics specification. Each test is named by its case: P for primitives,
//! S for spawned rays, T for traversal. Inputs are f32 numbers, which the oracle gets exactly;
//! bounds are those of the specification.
#![expect(
    clippy::print_stderr,
    reason = "a test says how many rays it judged and how near the bound they came"
)]

mod borders;
mod closed;
mod edged;
mod far;
mod lit;
mod magnified;
mod mapped;
mod meshes;
mod moving;
mod nested;
mod planes;
mod quadrics;
mod same;
mod scaled;
mod sharp;
mod sizes;
mod spawned;
mod sphere;
mod stated;
mod support;
mod torus;
mod traversal;
mod triangles;
