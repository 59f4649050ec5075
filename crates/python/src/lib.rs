//! Raywright as a Python module: pictures as arrays, ray queries on arrays, and the program itself.
//!
//! The module wraps the command line: keywords become flags (`keywords`) with the meaning and the
//! messages of the program. Work runs without the interpreter's lock (`work`), pictures and hits
//! are returned as NumPy arrays (`array`). Pure Python code is in `python/raywright`.
#![forbid(unsafe_code)]

mod array;
mod bvh;
mod failure;
mod keywords;
mod picture;
mod scene;
mod work;

/// Tracks allocations, so that loading a scene respects the memory limit.
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

    /// Runs the program with a command line and returns the exit code. The first word is the name
    /// of a program.
    #[pyfunction]
    fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
        py.detach(|| raywright_cli::main_with(words) as u8)
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
