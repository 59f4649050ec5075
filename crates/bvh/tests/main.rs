//! Integration tests of the crate in a single binary, which saves linking several. Each module says
//! what it protects.

mod builds;
mod kernels;
mod numerics;
mod queries;
mod shapes;
mod split_mix;
