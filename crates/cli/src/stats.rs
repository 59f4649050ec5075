//! `--stats`: what a render took, as JSON that scripts can rely on. Fields may be added; none is
//! renamed or removed without a new [`FORMAT`].

use raywright_core::counters::Counters;
use raywright_core::denoise::Denoised;
use raywright_core::effects::Finding;
use raywright_core::film::Uncertainty;
use raywright_core::{Ready, Rendered};
use raywright_io::{Loaded, Warning};
use serde::Serialize;

use crate::clock::Seconds;
use crate::{memory, origin};

/// Version of the layout below.
pub const FORMAT: u32 = 1;

/// The whole file.
#[derive(Debug, Serialize)]
pub struct Stats<'a> {
    format: u32,
    version: &'static str,
    command: String,
    scene_hash: String,
    seconds: Seconds,
    rays: Rays,
    samples: u64,
    /// Samples that did not enter the picture because they were not finite.
    dropped: u64,
    /// Rays that ended at the limit of surfaces that are passed unchanged.
    cut_short: u64,
    effects: &'a [Finding],
    memory: Memory,
    accelerator: &'static str,
    /// About the scene, its files or the picture.
    warnings: &'a [Warning],
    /// Absent where it can't be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<Uncertainty>,
    /// Absent where the picture was not denoised.
    #[serde(skip_serializing_if = "Option::is_none")]
    denoised: Option<Claim>,
}

/// What is claimed of a denoised picture.
#[derive(Debug, Serialize)]
struct Claim {
    #[serde(flatten)]
    error: Uncertainty,
    /// What denoising did to the picture's light, as a share of it: below zero where it is darker.
    brightened: f64,
}

/// Rays by kind.
#[derive(Debug, Serialize)]
struct Rays {
    camera: u64,
    reflection: u64,
    refraction: u64,
    scatter: u64,
    shadow: u64,
}

impl From<&Counters> for Rays {
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

/// Bytes.
#[derive(Debug, Serialize)]
struct Memory {
    /// Of the whole process; null where the system does not tell.
    peak_bytes: Option<u64>,
    geometry_bytes: u64,
    texture_bytes: u64,
}

impl<'a> Stats<'a> {
    /// Gathers what is known after a finished render.
    pub fn new(
        loaded: &'a Loaded,
        ready: &'a Ready,
        rendered: &Rendered,
        error: Option<Uncertainty>,
        seconds: Seconds,
    ) -> Self {
        let held = ready.memory();
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            command: origin::command_line(),
            scene_hash: loaded.hash.to_string(),
            seconds,
            rays: Rays::from(&rendered.counters),
            samples: rendered.counters.samples,
            dropped: rendered.counters.dropped,
            cut_short: rendered.counters.cut_short,
            effects: &ready.effects().effects,
            memory: Memory {
                peak_bytes: memory::peak_bytes(),
                geometry_bytes: held.geometry,
                texture_bytes: held.textures,
            },
            accelerator: origin::accelerator(ready.settings().accelerator),
            warnings: &loaded.warnings,
            error,
            denoised: rendered.denoised().map(
                |&Denoised {
                     error, brightened, ..
                 }| Claim { error, brightened },
            ),
        }
    }
}
