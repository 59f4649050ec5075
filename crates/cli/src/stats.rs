//! Statistics of a render for `--stats`, as JSON that scripts can rely on. Later versions may add
//! fields; a removed or renamed field changes [`FORMAT`].

use raywright_core::counters::Counters;
use raywright_core::denoise::DenoiseOutput;
use raywright_core::effects::EffectAssessment;
use raywright_core::film::Uncertainty;
use raywright_core::{ReadyScene, RenderOutput};
use raywright_io::{LoadedScene, Warning};
use serde::Serialize;

use crate::clock::StageSeconds;
use crate::{memory, origin};

/// Version of the layout of [`RenderStats`].
pub const FORMAT: u32 = 1;

/// Contents of the file of `--stats`.
#[derive(Debug, Serialize)]
pub struct RenderStats<'a> {
    format: u32,
    version: &'static str,
    command: String,
    scene_hash: String,
    seconds: StageSeconds,
    rays: RayCounts,
    /// Number of samples in the picture, of all pixels together.
    samples: u64,
    /// Number of non-finite samples, which were left out of the picture.
    dropped: u64,
    /// Number of rays that ended because they crossed the largest allowed number of surfaces
    /// without a change of direction.
    cut_short: u64,
    effects: &'a [EffectAssessment],
    memory: MemoryUse,
    accelerator: &'static str,
    /// Warnings about the scene, its files or the picture.
    warnings: &'a [Warning],
    /// Estimated error; absent where the samples allow no estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<Uncertainty>,
    /// Estimated error of the denoised picture; absent if the picture was not denoised.
    #[serde(skip_serializing_if = "Option::is_none")]
    denoised: Option<DenoisedError>,
}

/// Estimated error of a denoised picture, and the change of its light by denoising.
#[derive(Debug, Serialize)]
struct DenoisedError {
    #[serde(flatten)]
    error: Uncertainty,
    /// Relative change of the picture's total light by denoising; negative if the denoised picture
    /// is darker.
    brightened: f64,
}

/// Number of rays of each kind.
#[derive(Debug, Serialize)]
struct RayCounts {
    /// Number of rays that start at the camera.
    camera: u64,
    /// Number of mirror reflections.
    reflection: u64,
    /// Number of rays that continue through a refracting surface.
    refraction: u64,
    /// Number of rays scattered in a random direction by a rough surface.
    scatter: u64,
    /// Number of rays that test whether a light is visible.
    shadow: u64,
}

impl From<&Counters> for RayCounts {
    fn from(counters: &Counters) -> Self {
        let Counters {
            camera,
            reflection,
            refraction,
            scatter,
            shadow,
            ..
        } = *counters;
        Self {
            camera,
            reflection,
            refraction,
            scatter,
            shadow,
        }
    }
}

/// Memory use of the process and of the prepared scene, in bytes.
#[derive(Debug, Serialize)]
struct MemoryUse {
    /// Peak resident memory of the process; null where the system does not report it.
    peak_bytes: Option<u64>,
    /// Memory of shapes and their acceleration structures.
    geometry_bytes: u64,
    /// Memory of textures.
    texture_bytes: u64,
}

impl<'a> RenderStats<'a> {
    /// Collects the statistics of a finished render.
    pub fn new(
        loaded: &'a LoadedScene,
        ready: &'a ReadyScene,
        rendered: &RenderOutput,
        error: Option<Uncertainty>,
        seconds: StageSeconds,
    ) -> Self {
        let held = ready.memory();
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            command: origin::command_line(),
            scene_hash: loaded.hash.to_string(),
            seconds,
            rays: RayCounts::from(&rendered.counters),
            samples: rendered.counters.samples,
            dropped: rendered.counters.dropped,
            cut_short: rendered.counters.cut_short,
            effects: &ready.effects().effects,
            memory: MemoryUse {
                peak_bytes: memory::peak_memory_bytes(),
                geometry_bytes: held.geometry,
                texture_bytes: held.textures,
            },
            accelerator: origin::accelerator_name(ready.settings().accelerator),
            warnings: &loaded.warnings,
            error,
            denoised: rendered.denoise_output().map(
                |&DenoiseOutput {
                     error,
                     light_change: brightened,
                     ..
                 }| DenoisedError { error, brightened },
            ),
        }
    }
}
