//! The invariants on a scene of the user's own: what of its data, of rays of its own cameras and of
//! its lights makes a picture wrong or noisy.
//!
//! Each family of checks is a function from what is known of the scene to findings. Facts that
//! preparation and rendering tell anyway, such as gaps that storing closes, are taken from there.
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
mod cameras;
mod chance;
mod closed_parts;
mod coarse;
mod consequences;
mod coordinates;
mod copies;
mod coplanar;
mod count;
mod covers;
mod duplicates;
mod faces;
mod facts;
mod fans;
mod finding;
mod finding_code;
mod furnace;
mod hidden;
mod light_reach;
mod light_survey;
mod lights;
mod materials;
mod meshes;
mod numbers;
mod overlaps;
mod ray_survey;
mod rays;
mod rounding;
mod samples;
mod seams;
mod session;
mod sightlines;
mod small_render;
mod storage;
mod stray;
mod summary;
mod textures;
mod topology;
mod triangles;
mod used_mesh;
mod values;
mod windings;

use core::time::Duration;
use std::time::Instant;

pub use finding::{CheckRun, FindingSubject, StressFinding};
pub use finding_code::{FindingCode, Severity};
pub use numbers::{count_with_unit, format_decimal};
use session::StressSession;
pub use textures::is_uniform_image;

use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

/// How much is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StressEffort {
    /// Time after which no more rays are sent. The data is looked at whatever it takes.
    pub budget: Duration,
}

impl Default for StressEffort {
    fn default() -> Self {
        Self {
            budget: Duration::from_secs(30),
        }
    }
}

/// What was found, and what was looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct StressSummary {
    /// The worst first, at most sixteen of each kind.
    pub findings: Vec<StressFinding>,
    /// How many more there are of the same kinds.
    pub left_out: usize,
    /// Checks by rays and samples.
    pub checks: Vec<CheckRun>,
    /// Cameras that were looked through, of how many.
    pub cameras: [usize; 2],
    /// Size of the picture by which pixels are told.
    pub size: [u32; 2],
}

impl StressSummary {
    /// The worst that was found.
    pub fn worst_severity(&self) -> Option<Severity> {
        self.findings.first().map(|finding| finding.severity)
    }

    /// Whether time ended some check.
    pub fn is_cut_short(&self) -> bool {
        self.checks.iter().any(CheckRun::is_cut_short)
    }
}

/// Ends rays when the time is over, and everything when the observer says so.
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

/// Checks a validated scene as its settings would render it, on the current thread pool. What is
/// found depends on scene, settings and seed, and on the clock only where
/// [`StressSummary::is_cut_short`].
///
/// # Errors
/// See [`PrepareError`]; shapes of which storing leaves nothing are findings.
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
