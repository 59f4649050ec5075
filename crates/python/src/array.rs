//! Numbers that NumPy looks at where they are.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use raywright_cli::embedded::FinishedPicture;

/// What an array shows.
pub enum Numbers {
    /// Colours that are to be looked at.
    Shown(Arc<FinishedPicture>),
    /// Colours as they were sampled.
    Sampled(Arc<FinishedPicture>),
    /// What the denoised colours are off by.
    Errors(Arc<FinishedPicture>),
    /// Coverage.
    Alpha(Arc<FinishedPicture>),
    /// One of the layers.
    Layer(Arc<FinishedPicture>, usize),
    /// Numbers of its own.
    Floats(Vec<f32>),
    Doubles(Vec<f64>),
    Integers(Vec<i64>),
    Booleans(Vec<bool>),
}

/// A block of numbers, row after row, by the protocol of NumPy's `__array_interface__`: an array of
/// it is a view that keeps it alive.
#[pyclass(frozen, module = "raywright")]
pub struct Array {
    numbers: Numbers,
    shape: Vec<usize>,
}

impl Array {
    /// Of that shape.
    pub fn new(numbers: Numbers, shape: &[usize]) -> Self {
        Self {
            numbers,
            shape: shape.to_vec(),
        }
    }

    /// As a NumPy array that can't be written to.
    pub fn view(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        numpy(py)?.call_method1("asarray", (self,))
    }

    /// As a NumPy array of the caller's own.
    pub fn copy(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        numpy(py)?.call_method1("array", (self,))
    }

    /// Where the first number is, and what they are.
    fn place(&self) -> (usize, &'static str) {
        const FLOAT: &str = if cfg!(target_endian = "little") {
            "<f4"
        } else {
            ">f4"
        };
        const DOUBLE: &str = if cfg!(target_endian = "little") {
            "<f8"
        } else {
            ">f8"
        };
        const INTEGER: &str = if cfg!(target_endian = "little") {
            "<i8"
        } else {
            ">i8"
        };
        let floats = |numbers: &[f32]| (numbers.as_ptr().addr(), FLOAT);
        match &self.numbers {
            Numbers::Shown(of) => floats(of.shown().rgb.as_flattened()),
            Numbers::Sampled(of) => floats(of.rendered.picture.rgb.as_flattened()),
            Numbers::Errors(of) => floats(
                of.rendered
                    .denoised()
                    .map_or(&[], |denoised| denoised.standard_error.as_flattened()),
            ),
            Numbers::Alpha(of) => floats(of.shown().alpha.as_deref().unwrap_or_default()),
            Numbers::Layer(of, i) => floats(&of.rendered.picture.layers[*i].samples),
            Numbers::Floats(own) => floats(own),
            Numbers::Doubles(own) => (own.as_ptr().addr(), DOUBLE),
            Numbers::Integers(own) => (own.as_ptr().addr(), INTEGER),
            Numbers::Booleans(own) => (own.as_ptr().addr(), "|b1"),
        }
    }
}

#[pymethods]
impl Array {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (address, kind) = self.place();
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("shape", pyo3::types::PyTuple::new(py, &self.shape)?)?;
        interface.set_item("typestr", kind)?;
        interface.set_item("data", (address, true))?;
        Ok(interface)
    }
}

/// NumPy, which is imported when it is first needed.
pub fn numpy(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    py.import("numpy")
}
