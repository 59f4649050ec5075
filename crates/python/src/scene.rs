//! Scenes as Python objects: a scene is loaded once, and can be rendered or reported on any number
//! of times.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use raywright_cli::embedded::{ComparisonPicture, EmbeddedCommand, load};
use raywright_cli::failure::Failure;
use raywright_core::settings::Sampling;
use raywright_core::{Observer, Settings};
use raywright_io::{Input, LoadOptions, LoadedScene};

use crate::failure::to_exception;
use crate::keywords::keywords_to_flags;
use crate::picture::Picture;
use crate::work;

/// A loaded and validated scene or model.
#[pyclass(frozen, module = "raywright")]
pub struct Scene(Arc<SceneSource>);

/// Input of a scene, and the latest scene that was loaded from it.
struct SceneSource {
    input: Input,
    /// Flags that apply to every request, such as a render or a report.
    words: Vec<OsString>,
    latest_load: Mutex<Option<(LoadOptions, Arc<LoadedScene>)>>,
}

impl SceneSource {
    /// Returns the scene loaded with these options. The scene is loaded again if the options differ
    /// from those of the last load.
    fn load_cached(
        &self,
        options: LoadOptions,
        observer: &dyn Observer,
    ) -> Result<Arc<LoadedScene>, Failure> {
        let latest = || {
            self.latest_load
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
        };
        if let Some((_, loaded)) = latest().as_ref().filter(|(own, _)| *own == options) {
            return Ok(Arc::clone(loaded));
        }
        let loaded = Arc::new(load(&self.input, &options, observer)?);
        *latest() = Some((options, Arc::clone(&loaded)));
        Ok(loaded)
    }

    fn parse_command(
        &self,
        py: Python<'_>,
        command: &str,
        keywords: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<EmbeddedCommand> {
        let words = [self.words.clone(), keywords_to_flags(keywords)?].concat();
        EmbeddedCommand::new(command, words).map_err(|failure| to_exception(py, failure))
    }
}

/// Loads a scene from any input.
fn load_scene(
    py: Python<'_>,
    input: Input,
    keywords: Option<&Bound<'_, PyDict>>,
) -> PyResult<Scene> {
    let source = Arc::new(SceneSource {
        input,
        words: keywords_to_flags(keywords)?,
        latest_load: Mutex::default(),
    });
    let (request, own) = (
        source.parse_command(py, "render", None)?,
        Arc::clone(&source),
    );
    work::run_work(py, request.thread_count(), None, move |watch| {
        own.load_cached(request.load_options(), watch)
    })?;
    Ok(Scene(source))
}

/// Loads a file, or a built-in scene, `preset:NAME`.
#[pyfunction]
#[pyo3(signature = (path, **keywords))]
pub fn load_path(
    py: Python<'_>,
    path: PathBuf,
    keywords: Option<&Bound<'_, PyDict>>,
) -> PyResult<Scene> {
    let input = match path.to_str().and_then(|name| name.strip_prefix("preset:")) {
        Some(preset) => Input::Preset(preset.to_owned()),
        None => Input::Path(path),
    };
    load_scene(py, input, keywords)
}

/// Loads the content of a file. The extension of `name`, if any, gives the format.
#[pyfunction]
#[pyo3(signature = (name, bytes, **keywords))]
pub fn load_bytes(
    py: Python<'_>,
    name: String,
    bytes: &[u8],
    keywords: Option<&Bound<'_, PyDict>>,
) -> PyResult<Scene> {
    load_scene(
        py,
        Input::Bytes {
            name,
            bytes: bytes.to_vec(),
            resolver: None,
        },
        keywords,
    )
}

/// Compares two pictures, each a `Picture` or the name of a file, as `raywright compare --json`
/// does.
#[pyfunction]
#[pyo3(signature = (picture, reference, **keywords))]
pub fn compare<'py>(
    picture: &Bound<'py, PyAny>,
    reference: &Bound<'py, PyAny>,
    keywords: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = picture.py();
    let request = EmbeddedCommand::new("compare", keywords_to_flags(keywords)?)
        .map_err(|failure| to_exception(py, failure))?;
    let sides = [
        comparison_picture(picture, "the first picture")?,
        comparison_picture(reference, "the second picture")?,
    ];
    let compared = work::run_work(py, None, None, move |_| {
        let [(name, picture), (other, reference)] = sides;
        let judged = |side: Option<ComparisonPicture>, name: &PathBuf| {
            side.map_or_else(|| ComparisonPicture::read(name), Ok)
        };
        let pair = [judged(picture, &name)?, judged(reference, &other)?];
        request.comparison_json([name, other], &pair)
    })?;
    parse_json(py, &compared)
}

/// Returns a picture to compare: a rendered picture, which messages call `name`, or the picture in
/// a file.
fn comparison_picture(
    of: &Bound<'_, PyAny>,
    name: &str,
) -> PyResult<(PathBuf, Option<ComparisonPicture>)> {
    match of.cast::<Picture>() {
        Ok(picture) => Ok((name.into(), Some(picture.get().to_comparison_picture()))),
        Err(_) => Ok((of.extract()?, None)),
    }
}

/// Parses JSON to dicts and lists.
fn parse_json<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (json,))
}

impl Scene {
    fn run_report<'py>(
        &self,
        py: Python<'py>,
        command: &str,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (request, source) = (
            self.0.parse_command(py, command, keywords)?,
            Arc::clone(&self.0),
        );
        let report = work::run_work(py, request.thread_count(), None, move |watch| {
            let loaded = source.load_cached(request.load_options(), watch)?;
            request.report_json((*loaded).clone(), watch)
        })?;
        parse_json(py, &report)
    }
}

#[pymethods]
impl Scene {
    /// Renders the scene. Keywords are the flags of `raywright render` with underscores for
    /// hyphens; defaults are the scene's own.
    ///
    /// size: (width, height) in pixels. view: "front", "back", "left", "right", "top", "bottom",
    /// "iso" or (azimuth, elevation) in degrees. at: time in seconds. max_error: target root
    /// relMSE, such as 0.05; or spp: samples per pixel; or budget: a time, such as "10s". denoise:
    /// whether noise is filtered out. seed: of the random numbers. background: "env", "transparent"
    /// or a colour. layers: contents of `Picture.layers` besides depth, of albedo, normal,
    /// position, emission, object, material, samples, stderr. threads: number of threads, without
    /// effect on the picture. progress: called with the finished share, from 0 to 1; or True, which
    /// shows the picture as it comes, with its error, in the cell of a notebook, and a line of text
    /// elsewhere.
    #[pyo3(signature = (*, layers = None, progress = None, **keywords),
        text_signature = "($self, *, size=None, view=None, at=None, max_error=None, spp=None, denoise=False, seed=None, background=None, \
        layers=('depth',), threads=None, progress=None, **flags)")]
    fn render<'py>(
        scene: &Bound<'py, Self>,
        layers: Option<Bound<'py, PyAny>>,
        progress: Option<Bound<'py, PyAny>>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, source) = (scene.py(), Arc::clone(&scene.get().0));
        let is_shown = progress
            .as_ref()
            .and_then(|progress| progress.cast::<PyBool>().ok())
            .map(|shown| shown.is_true());
        if is_shown == Some(true) {
            let show = py.import("raywright._progress")?.getattr("render")?;
            return show.call((scene, layers), keywords);
        }
        let progress = progress.filter(|_| is_shown.is_none());
        let own = PyDict::new(py);
        own.set_item(
            "layers",
            layers.unwrap_or(("depth",).into_pyobject(py)?.into_any()),
        )?;
        if let Some(keywords) = keywords {
            own.update(keywords.as_mapping())?;
        }
        let request = source.parse_command(py, "render", Some(&own))?;
        let finished = work::run_work(
            py,
            request.thread_count(),
            progress.as_ref(),
            move |watch| {
                let loaded = source.load_cached(request.load_options(), &())?;
                request.render_picture((*loaded).clone(), watch)
            },
        )?;
        if let Some(progress) = progress {
            progress.call1((1.0,))?;
        }
        Ok(Bound::new(py, Picture::new(finished))?.into_any())
    }

    /// Samples per pixel without the keyword `spp`; None under a fixed pattern.
    #[getter]
    fn _samples(&self) -> Option<u32> {
        let latest = self
            .0
            .latest_load
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let (_, loaded) = latest.as_ref()?;
        match Settings::from_scene(&loaded.scene).sampling {
            Sampling::General(samples) => Some(samples),
            Sampling::Pattern(_) => None,
        }
    }

    /// The simulated, absent and left-out effects of the scene, and the current rungs of its
    /// ladders: the output of `raywright explain --json`, as dicts and lists.
    #[pyo3(signature = (**keywords))]
    fn explain<'py>(
        &self,
        py: Python<'py>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.run_report(py, "explain", keywords)
    }

    /// The cost of accuracy in time on this scene, measured for `budget` seconds: the output of
    /// `raywright accuracy --json`, as dicts and lists.
    #[pyo3(signature = (*, budget = None, **keywords), text_signature = "($self, *, budget=60, **flags)")]
    fn accuracy<'py>(
        &self,
        py: Python<'py>,
        budget: Option<Bound<'py, PyAny>>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let own = PyDict::new(py);
        own.set_item("budget", budget)?;
        if let Some(keywords) = keywords {
            own.update(keywords.as_mapping())?;
        }
        self.run_report(py, "accuracy", Some(&own))
    }

    /// Warnings about the scene, a sentence each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let latest = self
            .0
            .latest_load
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        latest
            .iter()
            .flat_map(|(_, loaded)| &loaded.warnings)
            .map(ToString::to_string)
            .collect()
    }

    fn __repr__(&self) -> String {
        let latest = self
            .0
            .latest_load
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let name = latest
            .as_ref()
            .map_or("", |(_, loaded)| loaded.source.name.as_str());
        format!("<raywright.Scene {name}>")
    }
}
