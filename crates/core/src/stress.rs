//! Checks of a user's scene for faults that make its picture wrong, slow or noisy. They examine the
//! scene's data and trace rays from its own cameras and lights.
//!
//! Each check is a method of the facts about the scene that returns findings. Preparation and
//! rendering detect some faults themselves, such as gaps that are lost when coordinates are rounded
//! for storage. The checks report those faults too.
//!
//! ```
//! use raywright_core::fault::{FaultKind, Severity};
//! use raywright_core::stress::{StressEffort, stress};
//! use raywright_core::{Scene, Settings};
//!
//! let scene: Scene = serde_json::from_str(r#"{
//!     "format": 1,
//!     "render": { "size": [32, 18], "integrator": "path" },
//!     "cameras": [{ "pose": { "look_at": { "eye": [0, 0, 5], "target": [0, 0, 0] } },
//!                   "projection": { "pinhole": { "vertical_fov": 40 } } }],
//!     "sky": { "constant": 1 },
//!     "materials": [{ "name": "paint", "model": { "physical": { "base_colour": 1.5 } } }],
//!     "objects": [{ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "paint" }]
//! }"#)?;
//! let summary = stress(&scene, &Settings::from_scene(&scene), &StressEffort::default(), &())?;
//! assert!(summary.findings.iter().any(|finding| finding.kind == FaultKind::EnergyMade && finding.severity == Severity::PictureWrong));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bodies;
mod cameras;
mod duplicates;
mod facts;
mod light_survey;
mod lights;
mod materials;
mod meshes;
mod overlaps;
mod ray_survey;
mod rays;
mod samples;
mod session;
mod storage;
mod summary;
mod textures;

use core::f64::consts::{PI, TAU};
use core::time::Duration;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::time::Instant;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use raywright_bvh::{Aabb, Hit, Interval, Ray, Real, Surface, Vector};
use serde::Serialize;

use crate::dispatch::{PreparedSceneTask, ReadyScene};
use crate::observer::Observer;
use crate::prepare::{PrepareError, PreparedScene};
use crate::scene::{Material, MaterialModel, MeshData, Scene, Shape, SideRule, Sky};
use crate::settings::{PrecisionChoice, Settings};
use crate::topology::{CountAndFirst, SolidSummary};

use crate::fault::{Fault, FaultKind, Severity, Subject, format_decimal, format_metres, round_up};
use FaultKind::*;
use Severity::{Harmless, PictureWrong, SlowOrNoisy};
use cameras::CameraView;
use facts::{ObjectFacts, SceneFacts, hits_along_ray, unit_random};
use ray_survey::{RayEvent, RaySurvey, Sighting};

/// Limits on the work of the checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StressEffort {
    /// Time after which no more rays are traced. Data such as meshes and images is always examined
    /// in full.
    pub budget: Duration,
}

impl Default for StressEffort {
    fn default() -> Self {
        Self {
            budget: Duration::from_secs(30),
        }
    }
}

/// Findings about a scene, and the extent of the checks.
#[derive(Clone, Debug, PartialEq)]
pub struct StressSummary {
    /// Findings, worst first. At most sixteen are kept for each pair of kind and severity.
    pub findings: Vec<Fault>,
    /// Number of further findings, beyond the sixteen that are kept for each pair of kind and
    /// severity.
    pub left_out: usize,
    /// Checks that trace rays or take samples, with their planned and actual numbers.
    pub checks: Vec<CheckRun>,
    /// Number of cameras that were checked, and number of cameras in the scene (at least 1).
    pub cameras: [usize; 2],
    /// Width and height of the picture to which the pixels of findings refer.
    pub size: [u32; 2],
    /// Whether the meshes are closed, with size and volume. `None` without meshes.
    pub solid: Option<SolidSummary>,
}

impl StressSummary {
    /// Returns the severity of the worst finding, or `None` without findings.
    pub fn worst_severity(&self) -> Option<Severity> {
        self.findings.first().map(|finding| finding.severity)
    }

    /// Returns whether the time ran out before some check was complete.
    pub fn is_cut_short(&self) -> bool {
        self.checks.iter().any(CheckRun::is_cut_short)
    }
}

/// Work of a check, planned and done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CheckRun {
    /// Name of the check.
    pub name: &'static str,
    /// Name of the examined items, in the plural.
    pub unit: &'static str,
    /// Number of rays, samples or materials that were examined.
    pub looked_at: u64,
    /// Number of items to examine in total.
    pub planned: u64,
}

impl CheckRun {
    /// Returns whether fewer items than planned were examined.
    pub fn is_cut_short(&self) -> bool {
        self.looked_at < self.planned
    }
}

/// Time limit of the checks, which also observes cancellation. When the time is over, no more rays
/// are traced. When the observer cancels, all work ends.
struct RayDeadline<'a> {
    observer: &'a dyn Observer,
    end: Option<Instant>,
}

impl RayDeadline<'_> {
    fn has_passed(&self) -> bool {
        self.observer.is_cancelled() || self.end.is_some_and(|end| Instant::now() >= end)
    }
}

impl Observer for RayDeadline<'_> {
    fn is_cancelled(&self) -> bool {
        self.observer.is_cancelled()
    }

    fn has_enough_samples(&self, _everywhere: bool) -> bool {
        self.has_passed()
    }
}

/// Checks a validated scene for faults, as the settings would render it, on the current thread
/// pool. The findings depend on the scene, the settings and the seed. They depend on the time only
/// if [`StressSummary::is_cut_short`] is true.
///
/// # Errors
/// See [`PrepareError`]. A shape that degenerates when its coordinates are stored is a finding, not
/// an error.
pub fn stress(
    scene: &Scene,
    settings: &Settings,
    effort: &StressEffort,
    observer: &dyn Observer,
) -> Result<StressSummary, PrepareError> {
    let end = Instant::now().checked_add(effort.budget);
    session::run_all_checks(scene, settings, &RayDeadline { observer, end })
}
