//! Properties of every shape, compared with oracles that share no formula with it: implicit
//! functions for hits and normals, and crossings of random lines for areas and densities.

mod area;
mod bounds;
mod gallery;
mod hits;
mod parameters;
mod refused;
mod scalar;
