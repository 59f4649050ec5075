//! Raywright as a Python module: pictures as arrays, rays for arrays, and the program itself.
//!
//! A rim beside the command line, with its words: keywords become flags (`keywords`), whose meaning
//! and messages are the program's. Work is done without the interpreter's lock (`work`), pictures
//! and hits are handed over as NumPy arrays (`array`). What of it needs no Rust is in
//! `python/raywright`.
#![forbid(unsafe_code)]

mod array;
mod bvh;
mod failure;
mod keywords;
mod picture;
mod scene;
mod work;

/// Counts what is held, so that no scene takes memory unasked where the program is run.
#[global_allocator]
static HEAP: raywright_bvh::CountingHeap = raywright_bvh::CountingHeap;

#[pyo3::pymodule]
mod _raywright {
    use std::ffi::OsString;

    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::array::Array;
    #[pymodule_export]
    use crate::bvh::Bvh;
    #[pymodule_export]
    use crate::picture::{ErrorEstimate, Picture};
    #[pymodule_export]
    use crate::scene::{Scene, compare, load_bytes, load_path};

    /// Runs the program with a command line, the first word of which is a name; its exit code.
    #[pyfunction]
    fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
        py.detach(|| raywright_cli::main_with(words) as u8)
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
