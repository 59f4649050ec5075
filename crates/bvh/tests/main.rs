//! The tests of the library from without, in one program: linking one takes a fifth of the time that five take. What each part
//! protects is told where it begins.

mod builds;
mod kernels;
mod numerics;
mod queries;
mod shapes;
