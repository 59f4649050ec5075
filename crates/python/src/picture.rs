//! A rendered picture as a Python object, and its error estimate.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyDict};
use raywright_cli::embedded::{ComparisonPicture, FinishedPicture};
use raywright_io::output::pixel_hash;

use crate::array::{Array, ArrayData};
use crate::failure::to_exception;

/// Estimated error of a picture.
///
/// `value` is the root of the mean squared relative error (root relMSE): 0.1 is grainy, 0.02 clean.
/// In 95 of 100 pictures the true error lies between `low` and `high`. `rmse` holds the same three
/// values for the root mean squared error, which is absolute, in units of radiance. `doubt` names a
/// reason why the interval may not hold, or is None.
/// `converged` says whether the requested `max_error` is reached, or is None without one.
#[pyclass(frozen, get_all, module = "raywright")]
#[derive(Clone)]
pub struct ErrorEstimate {
    value: f64,
    low: f64,
    high: f64,
    rmse: (f64, f64, f64),
    doubt: Option<String>,
    converged: Option<bool>,
}

#[pymethods]
impl ErrorEstimate {
    fn __repr__(&self) -> String {
        let Self {
            value,
            low,
            high,
            converged,
            ..
        } = self;
        let converged = converged.map_or("None", |reached| if reached { "True" } else { "False" });
        format!("<error {value:.3} ({low:.3} to {high:.3}), converged={converged}>")
    }
}

/// A rendered picture.
///
/// Arrays are read-only views of its memory, without a copy; `picture.rgb.copy()` is writable.
#[pyclass(frozen, module = "raywright")]
pub struct Picture {
    inner: Arc<FinishedPicture>,
    layers: PyOnceLock<Py<PyDict>>,
}

impl Picture {
    /// Wraps a finished picture.
    pub fn new(finished: FinishedPicture) -> Self {
        Self {
            inner: Arc::new(finished),
            layers: PyOnceLock::new(),
        }
    }

    /// Picture and metadata for a comparison.
    pub fn to_comparison_picture(&self) -> ComparisonPicture {
        let FinishedPicture {
            display, metadata, ..
        } = &*self.inner;
        ComparisonPicture::from_memory(self.inner.shown_picture(), *display, metadata)
    }

    /// Returns a NumPy view of picture data, with `each` numbers per pixel.
    fn array_view<'py>(
        &self,
        py: Python<'py>,
        value_of: impl FnOnce(Arc<FinishedPicture>) -> ArrayData,
        each: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let picture = self.inner.shown_picture();
        Array::new(
            value_of(Arc::clone(&self.inner)),
            &[picture.height as usize, picture.width as usize, each],
        )
        .view(py)
    }

    /// Collects the layers by name. A layer with a single channel is a view; several channels are
    /// joined in a copy.
    fn collect_layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (layers, dict) = (&self.inner.rendered.picture.layers, PyDict::new(py));
        let names = layers.iter().map(|layer| {
            layer
                .name
                .rsplit_once('.')
                .map_or(layer.name.as_str(), |(name, _)| name)
        });
        let mut groups: Vec<(&str, Vec<usize>)> = Vec::new();
        for (i, name) in names.enumerate() {
            match groups.iter_mut().find(|(other, _)| *other == name) {
                Some((_, group)) => group.push(i),
                None => groups.push((name, vec![i])),
            }
        }
        for (name, group) in groups {
            let numbers = |of: Arc<FinishedPicture>| match group.as_slice() {
                [one] => ArrayData::Layer(of, *one),
                several => {
                    let pixels = 0..of.shown_picture().pixel_count();
                    let channels =
                        |pixel: usize| several.iter().map(move |&i| layers[i].samples[pixel]);
                    ArrayData::Floats(pixels.flat_map(channels).collect())
                }
            };
            dict.set_item(name, self.array_view(py, numbers, group.len())?)?;
        }
        if self.inner.rendered.denoise_output().is_some() {
            dict.set_item("denoised", self.array_view(py, ArrayData::Displayed, 3)?)?;
            dict.set_item(
                "denoised.stderr",
                self.array_view(py, ArrayData::Errors, 3)?,
            )?;
        }
        Ok(dict)
    }
}

#[pymethods]
impl Picture {
    /// Radiance in linear Rec. 709, float32 of shape (height, width, 3), rows from the top;
    /// denoised if requested. With an `alpha`, colours are premultiplied.
    #[getter]
    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array_view(py, ArrayData::Displayed, 3)
    }

    /// Radiance before denoising: R, G and B of an .exr file.
    #[getter]
    fn sampled<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array_view(py, ArrayData::Sampled, 3)
    }

    /// Coverage from 0 to 1, float32 of shape (height, width, 1), or None if every pixel is
    /// covered.
    #[getter]
    fn alpha<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.inner
            .shown_picture()
            .alpha
            .as_ref()
            .map(|_| self.array_view(py, ArrayData::Alpha, 1))
            .transpose()
    }

    /// Further layers by name, float32 of shape (height, width, channels): the layers requested by
    /// `layers`, and for a denoised picture also `denoised` and `denoised.stderr`. Depths are
    /// distances along the ray in units of the scene; objects and materials are numbers; all are -1
    /// for the sky.
    #[getter]
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        Ok(self
            .layers
            .get_or_try_init(py, || self.collect_layers(py).map(Bound::unbind))?
            .bind(py)
            .clone())
    }

    /// Estimated error of the picture; None without random error.
    #[getter]
    fn error(&self) -> Option<ErrorEstimate> {
        let error = self.inner.error?;
        let (relative, rmse) = (error.root_relmse, error.rmse);
        Some(ErrorEstimate {
            value: relative.value,
            low: relative.low,
            high: relative.high,
            rmse: (rmse.value, rmse.low, rmse.high),
            doubt: self.inner.describe_doubt(),
            converged: self.inner.converged,
        })
    }

    /// Width and height in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (
            self.inner.shown_picture().width,
            self.inner.shown_picture().height,
        )
    }

    /// Samples per pixel, in words.
    #[getter]
    fn samples(&self) -> &str {
        &self.inner.samples
    }

    /// Messages that the program would print about scene and picture.
    #[getter]
    fn notes(&self) -> Vec<&str> {
        self.inner.notes.iter().map(String::as_str).collect()
    }

    /// The command that renders the same picture.
    #[getter]
    fn command(&self) -> &str {
        &self.inner.metadata.command
    }

    /// SHA-256 of the linear pixels, as printed by `raywright --hash`.
    #[getter]
    fn hash(&self, py: Python<'_>) -> String {
        py.detach(|| pixel_hash(self.inner.shown_picture()))
    }

    /// The bytes of a PNG of the picture, with its tone map, curve and exposure.
    fn png<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py
            .detach(|| self.inner.encode_png())
            .map_err(|failure| to_exception(py, failure))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes the picture in the format of its name: .png, .jpg or .webp (display), or .exr (linear
    /// values with all layers). The name only ever holds a finished picture.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.inner.save(&path))
            .map_err(|failure| to_exception(py, failure))
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.png(py)
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.size();
        let error = self
            .error()
            .map(|error| format!(", {}", error.__repr__().trim_matches(['<', '>'])))
            .unwrap_or_default();
        format!(
            "<raywright.Picture {width}x{height}, {}{error}>",
            self.inner.samples
        )
    }
}
