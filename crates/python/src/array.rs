//! Arrays of numbers that NumPy reads without a copy.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use raywright_cli::embedded::FinishedPicture;

/// Numbers of an array: data of a picture, or numbers that the array owns.
pub enum ArrayData {
    /// Colours of the finished picture, denoised if requested.
    Displayed(Arc<FinishedPicture>),
    /// Colours before denoising.
    Sampled(Arc<FinishedPicture>),
    /// Standard errors of the denoised colours.
    Errors(Arc<FinishedPicture>),
    /// Coverage of each pixel.
    Alpha(Arc<FinishedPicture>),
    /// Data of a layer, by its index.
    Layer(Arc<FinishedPicture>, usize),
    /// Numbers that the array owns.
    Floats(Vec<f32>),
    Doubles(Vec<f64>),
    Integers(Vec<i64>),
    Booleans(Vec<bool>),
}

/// A row-major block of numbers for NumPy's `__array_interface__`. A NumPy array made from the
/// block is a view that keeps the block alive.
#[pyclass(frozen, module = "raywright")]
pub struct Array {
    numbers: ArrayData,
    shape: Vec<usize>,
}

impl Array {
    /// Creates an array of this shape.
    pub fn new(numbers: ArrayData, shape: &[usize]) -> Self {
        Self {
            numbers,
            shape: shape.to_vec(),
        }
    }

    /// Returns a read-only NumPy view.
    pub fn view(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        import_numpy(py)?.call_method1("asarray", (self,))
    }

    /// Returns a NumPy copy that the caller owns.
    pub fn copy(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        import_numpy(py)?.call_method1("array", (self,))
    }

    /// Returns the address of the first number, and NumPy's name of the number type, such as `<f4`.
    fn data_pointer(&self) -> (usize, &'static str) {
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
            ArrayData::Displayed(of) => floats(of.shown_picture().rgb.as_flattened()),
            ArrayData::Sampled(of) => floats(of.rendered.picture.rgb.as_flattened()),
            ArrayData::Errors(of) => floats(
                of.rendered
                    .denoise_output()
                    .map_or(&[], |denoised| denoised.standard_error.as_flattened()),
            ),
            ArrayData::Alpha(of) => floats(of.shown_picture().alpha.as_deref().unwrap_or_default()),
            ArrayData::Layer(of, i) => floats(&of.rendered.picture.layers[*i].samples),
            ArrayData::Floats(own) => floats(own),
            ArrayData::Doubles(own) => (own.as_ptr().addr(), DOUBLE),
            ArrayData::Integers(own) => (own.as_ptr().addr(), INTEGER),
            ArrayData::Booleans(own) => (own.as_ptr().addr(), "|b1"),
        }
    }
}

#[pymethods]
impl Array {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (address, kind) = self.data_pointer();
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("shape", pyo3::types::PyTuple::new(py, &self.shape)?)?;
        interface.set_item("typestr", kind)?;
        interface.set_item("data", (address, true))?;
        Ok(interface)
    }
}

/// Imports NumPy on first use.
pub fn import_numpy(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    py.import("numpy")
}
