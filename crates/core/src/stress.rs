//! Checks of a user's scene for faults that make its picture wrong, slow or noisy. They examine the
//! scene's data and trace rays from its own cameras and lights.
//!
//! Each check is a function from facts about the scene to findings. Preparation and rendering
//! detect some faults themselves, such as gaps that are lost when coordinates are rounded for
//! storage. The checks report those faults too.
//!
//! ```
//! use raywright_core::stress::{FindingCode, StressEffort, Severity, stress};
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
//! assert!(summary.findings.iter().any(|finding| finding.code == FindingCode::EnergyMade && finding.severity == Severity::PictureWrong));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod aimed;
mod black;
mod bodies;
mod camera_bodies;
mod cameras;
mod chance;
mod closed_parts;
mod coarse;
mod coincident_surfaces;
mod consequences;
mod coordinates;
mod copies;
mod coplanar;
mod copy_crossings;
mod count;
mod covers;
mod depth_loss;
mod directions;
mod duplicates;
mod emission_peaks;
mod enclosing_glass;
mod faces;
mod facts;
mod fans;
mod finding;
mod finding_code;
mod furnace;
mod glass_contacts;
mod hidden_backs;
mod lamp_light;
mod light_reach;
mod light_survey;
mod light_tracer;
mod light_walks;
mod lights;
mod materials;
mod meshes;
mod numbers;
mod orientation;
mod overlap_table;
mod overlaps;
mod ray_crossings;
mod ray_hits;
mod ray_survey;
mod rays;
mod rounding;
mod samples;
mod seams;
mod session;
mod sightlines;
mod sky_peaks;
mod small_render;
mod storage;
mod stray;
mod summary;
mod textures;
mod thin_bodies;
mod topology;
mod triangles;
mod twin_shadows;
mod used_mesh;
mod values;
mod windings;

use core::time::Duration;
use std::time::Instant;

pub use finding::{CheckRun, FindingSubject, StressFinding};
pub use finding_code::{FindingCode, Severity};
pub use numbers::{count_with_unit, format_decimal};
use session::StressSession;

use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

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
    pub findings: Vec<StressFinding>,
    /// Number of further findings, beyond the sixteen that are kept for each pair of kind and
    /// severity.
    pub left_out: usize,
    /// Checks that trace rays or take samples, with their planned and actual numbers.
    pub checks: Vec<CheckRun>,
    /// Number of cameras that were checked, and number of cameras in the scene (at least 1).
    pub cameras: [usize; 2],
    /// Width and height of the picture to which the pixels of findings refer.
    pub size: [u32; 2],
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

/// Time limit of the checks, which also observes cancellation. When the time is over, no more rays
/// are traced. When the observer cancels, all work ends.
pub(crate) struct RayDeadline<'a> {
    observer: &'a dyn Observer,
    end: Option<Instant>,
}

impl RayDeadline<'_> {
    pub fn has_passed(&self) -> bool {
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
    let deadline = RayDeadline {
        observer,
        end: Instant::now().checked_add(effort.budget),
    };
    let session = StressSession {
        scene,
        settings,
        observer,
        deadline,
    };
    session.run_all_checks()
}
