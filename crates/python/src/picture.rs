//! A picture, and how far it is from the true one.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyDict};
use raywright_cli::embedded::{FinishedPicture, Judged};
use raywright_io::output::pixel_hash;

use crate::array::{Array, Numbers};
use crate::failure::raised;

/// How far a picture probably is from the true one.
///
/// `value` is the root of the mean squared relative error (root relMSE): 0.1 is grainy, 0.02 clean.
/// In 95 of 100 pictures it lies between `low` and `high`. `rmse` is the same triple in radiance,
/// not relative. `doubt` says in a word why the interval may not hold, or is None. `converged` says
/// whether the `max_error` that was asked for is reached, or is None where none was.
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
/// Arrays are views of its memory, made without a copy, that can't be written to:
/// `picture.rgb.copy()` can.
#[pyclass(frozen, module = "raywright")]
pub struct Picture {
    inner: Arc<FinishedPicture>,
    layers: PyOnceLock<Py<PyDict>>,
}

impl Picture {
    /// What was rendered.
    pub fn new(finished: FinishedPicture) -> Self {
        Self {
            inner: Arc::new(finished),
            layers: PyOnceLock::new(),
        }
    }

    /// What a comparison takes.
    pub fn judged(&self) -> Judged {
        let FinishedPicture {
            display, metadata, ..
        } = &*self.inner;
        Judged::of(self.inner.shown(), *display, metadata)
    }

    /// A view of some of its numbers, so many for each pixel.
    fn view<'py>(
        &self,
        py: Python<'py>,
        of: impl FnOnce(Arc<FinishedPicture>) -> Numbers,
        each: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let picture = self.inner.shown();
        Array::new(
            of(Arc::clone(&self.inner)),
            &[picture.height as usize, picture.width as usize, each],
        )
        .view(py)
    }

    /// The layers by name. Those of one channel are views; the channels of others are brought
    /// together once.
    fn collected<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
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
                [one] => Numbers::Layer(of, *one),
                several => {
                    let pixels = 0..of.shown().pixels();
                    let channels =
                        |pixel: usize| several.iter().map(move |&i| layers[i].samples[pixel]);
                    Numbers::Floats(pixels.flat_map(channels).collect())
                }
            };
            dict.set_item(name, self.view(py, numbers, group.len())?)?;
        }
        if self.inner.rendered.denoised().is_some() {
            dict.set_item("denoised", self.view(py, Numbers::Shown, 3)?)?;
            dict.set_item("denoised.stderr", self.view(py, Numbers::Errors, 3)?)?;
        }
        Ok(dict)
    }
}

#[pymethods]
impl Picture {
    /// Radiance in linear Rec. 709, float32 of shape (height, width, 3), rows from the top:
    /// denoised where that was asked for. Where there is an `alpha`, colours are multiplied by it.
    #[getter]
    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.view(py, Numbers::Shown, 3)
    }

    /// The same as it was sampled, not denoised: what an .exr file has as R, G and B.
    #[getter]
    fn sampled<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.view(py, Numbers::Sampled, 3)
    }

    /// Coverage from 0 to 1, float32 of shape (height, width, 1), or None where every pixel is
    /// covered.
    #[getter]
    fn alpha<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.inner
            .shown()
            .alpha
            .as_ref()
            .map(|_| self.view(py, Numbers::Alpha, 1))
            .transpose()
    }

    /// Further layers by name, float32 of shape (height, width, channels): those that `layers`
    /// asked for, of a denoised picture `denoised` and `denoised.stderr` too. Depths are distances
    /// along the ray in units of the scene, objects and materials numbers, -1 where there is the
    /// sky alone.
    #[getter]
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        Ok(self
            .layers
            .get_or_try_init(py, || self.collected(py).map(Bound::unbind))?
            .bind(py)
            .clone())
    }

    /// How far the picture probably is from the true one; None where chance does not decide about
    /// it.
    #[getter]
    fn error(&self) -> Option<ErrorEstimate> {
        let error = self.inner.error?;
        let (relative, rmse) = (error.root_relmse, error.rmse);
        Some(ErrorEstimate {
            value: relative.value,
            low: relative.low,
            high: relative.high,
            rmse: (rmse.value, rmse.low, rmse.high),
            doubt: self.inner.doubt(),
            converged: self.inner.converged,
        })
    }

    /// Width and height in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.inner.shown().width, self.inner.shown().height)
    }

    /// Samples of a pixel, in words.
    #[getter]
    fn samples(&self) -> &str {
        &self.inner.samples
    }

    /// What the program would have said of scene and picture.
    #[getter]
    fn notes(&self) -> Vec<&str> {
        self.inner.notes.iter().map(String::as_str).collect()
    }

    /// The command that renders the same picture.
    #[getter]
    fn command(&self) -> &str {
        &self.inner.metadata.command
    }

    /// SHA-256 of the linear pixels, as `raywright --hash` prints it.
    #[getter]
    fn hash(&self, py: Python<'_>) -> String {
        py.detach(|| pixel_hash(self.inner.shown()))
    }

    /// The bytes of a PNG that shows the picture by its tone map, curve and exposure.
    fn png<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py
            .detach(|| self.inner.png())
            .map_err(|failure| raised(py, failure))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes the picture as its name ends: .png, .jpg or .webp (what a screen shows), or .exr
    /// (linear numbers with all layers). The name only ever holds a finished picture.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.inner.save(&path))
            .map_err(|failure| raised(py, failure))
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
