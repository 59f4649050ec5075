//! The tests of the library from without, in one program: each one more would be linked for itself.
//! What each part protects is told where it begins.

mod builds;
mod kernels;
mod numerics;
mod queries;
mod shapes;
mod split_mix;
