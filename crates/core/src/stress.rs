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
mod bodies;
mod cameras;
mod coarse;
mod consequences;
mod copies;
mod coplanar;
mod count;
mod covers;
mod duplicates;
mod faces;
mod facts;
mod fans;
mod finding;
mod furnace;
mod lights;
mod materials;
mod meshes;
mod ray_survey;
mod rays;
mod rounding;
mod samples;
mod seams;
mod sightlines;
mod storage;
mod textures;
mod topology;
mod triangles;
mod values;
mod windings;

use core::time::Duration;
use std::collections::BTreeMap;
use std::time::Instant;

use aimed::{AimedRayResult, AimedRayTask};
pub(crate) use facts::SceneFacts;
pub use finding::{
    CheckRun, FindingCode, FindingSubject, Severity, StressFinding, count_with_unit, format_decimal,
};
use ray_survey::RaySurvey;
use rays::RaySurveyTask;

use crate::dispatch::{ReadyScene, find_collapsed_objects, measure_extent, prepare};
use crate::framing::{FIELD_OF_VIEW, Silhouette};
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::{Aov, Sampling, Settings};
use bodies::BodyChecks;
use cameras::CameraView;
use coplanar::{DepthResolution, OverlapTable};
use covers::CoverSearch;
use duplicates::DuplicateObjects;
use samples::SmallRender;
use topology::Topology;

/// Cameras whose rays are sent; a scene with more has its first ones looked at.
const CAMERAS: usize = 8;

/// Pixels of the small picture of each camera, and most samples of each.
const PIXELS: f64 = 20_000.0;
const SAMPLES: u32 = 16;

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

struct StressSession<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    observer: &'a dyn Observer,
    deadline: RayDeadline<'a>,
}

impl StressSession<'_> {
    fn run_all_checks(&self) -> Result<StressSummary, PrepareError> {
        let (scene, settings) = (self.scene, self.settings);
        let lost = find_collapsed_objects(scene, settings.precision);
        let size = settings.size;
        let scene_facts = SceneFacts::new(scene, measure_extent(scene, settings.precision).bounds);
        let views = self.camera_views();
        if !lost.is_empty() {
            // It can't be prepared, so that no ray can be sent.
            let mut findings = storage::lost_shape_findings(scene, &lost);
            findings.extend(
                textures::check_textures(&scene_facts)
                    .into_iter()
                    .chain(lights::check_lights(&scene_facts, &views)),
            );
            return Ok(StressSummary {
                cameras: [0, scene.cameras.len().max(1)],
                ..summarise_findings(&scene_facts, &views, None, findings)
            });
        }
        let steps = 2 + views.len() as u64 * 3;
        let progress = |done: u64| self.observer.progress(done, steps);
        let resolution = DepthResolution {
            precision: settings.precision,
            views: &views,
        };
        let topologies = meshes::mesh_topologies(&scene_facts);
        let overlaps = coplanar::find_overlaps(&scene_facts, &topologies, &resolution);
        let doubles = DuplicateObjects::from_scene(&scene_facts);
        crate::prepare::check_cancelled(self.observer)?;
        progress(1);
        let mut looks = CameraCheckResults::default();
        let small = self.small_picture_settings(&views[0]);
        let mut ready = prepare(scene, &small, self.observer)?;
        let mut findings = Vec::new();
        for (done, view) in views.iter().enumerate() {
            if done > 0 && !ready.replace_camera(scene, &view.data) {
                ready = prepare(scene, &self.small_picture_settings(view), self.observer)?;
            }
            self.run_camera_checks(
                &ready,
                (&scene_facts, &topologies, &overlaps),
                view,
                &mut looks,
            );
            let (gaps, leaks) = (ready.find_closed_gaps(), ready.find_light_leaks());
            findings.extend(bodies::closed_gap_findings(
                &scene_facts,
                &doubles,
                &gaps,
                &leaks,
            ));
            crate::prepare::check_cancelled(self.observer)?;
            progress(2 + 3 * done as u64);
        }
        let (furnaces, total) = furnace::measure_furnaces(&scene_facts, settings, &self.deadline);
        let survey = looks
            .rays
            .iter()
            .cloned()
            .reduce(RaySurvey::combine)
            .unwrap_or_default();
        findings.extend(storage::check_storage(
            &scene_facts,
            &ready,
            &survey,
            &views,
        ));
        findings.extend(meshes::check_meshes(
            &scene_facts,
            &topologies,
            &survey,
            &views,
        ));
        findings.extend(duplicates::check_duplicates(
            &scene_facts,
            &doubles,
            &survey,
        ));
        findings.extend(copies::check(&scene_facts));
        let bodies = BodyChecks {
            scene_facts: &scene_facts,
            topologies: &topologies,
            doubles: &doubles,
            survey: &survey,
            resolution: &resolution,
        };
        findings.extend(bodies.check_bodies(&looks.aimed));
        findings.extend(coplanar::check_overlaps(
            &scene_facts,
            &overlaps,
            &survey,
            &resolution,
            |pair| doubles.are_duplicates(pair) || bodies.is_flickering_pair(pair),
        ));
        findings.extend(samples::check_samples(&scene_facts, &looks.pictures, size));
        findings.extend(materials::check_materials(
            &scene_facts,
            settings,
            &survey,
            &furnaces,
        ));
        findings.extend(textures::check_textures(&scene_facts));
        findings.extend(lights::check_lights(&scene_facts, &views));
        findings.extend(cameras::check_cameras(&scene_facts, &views, &looks.rays));
        progress(steps);
        let furnaces = CheckRun {
            name: "furnaces",
            looked_at: furnaces.len() as u64,
            unit: "materials",
            planned: total as u64,
        };
        Ok(StressSummary {
            checks: looks.merge_check_runs(furnaces),
            cameras: [views.len(), scene.cameras.len().max(1)],
            ..summarise_findings(&scene_facts, &views, Some(&ready), findings)
        })
    }

    /// The cameras that are checked, each with a picture of the size in the settings.
    fn camera_views(&self) -> Vec<CameraView> {
        let (scene, size) = (self.scene, self.settings.size);
        let cameras = scene.cameras.iter().enumerate().take(CAMERAS);
        let mut views: Vec<CameraView> = cameras
            .map(|(index, camera)| {
                CameraView::new(
                    index,
                    FindingSubject::Camera(Some(index)),
                    camera.clone(),
                    size,
                )
            })
            .collect();
        if views.is_empty() {
            let silhouette = Silhouette::from_scene(scene);
            let framed = || {
                silhouette.frame_camera(
                    silhouette.default_view(),
                    FIELD_OF_VIEW,
                    f64::from(size[0]) / f64::from(size[1]),
                )
            };
            let camera = self.settings.camera.clone().unwrap_or_else(framed);
            views.push(CameraView::new(
                0,
                FindingSubject::Camera(None),
                camera,
                size,
            ));
        }
        views
    }

    /// The settings of a small picture.
    fn small_picture_settings(&self, view: &CameraView) -> Settings {
        let [width, height] = view.size.map(f64::from);
        let scale = (PIXELS / (width * height)).sqrt().min(1.0);
        let sampling = match self.settings.sampling {
            Sampling::General(samples) => Sampling::General(samples.min(SAMPLES)),
            pattern => pattern,
        };
        Settings {
            size: [width, height].map(|edge| ((edge * scale).round() as u32).max(1)),
            crop: None,
            camera: Some(view.data.clone()),
            sampling,
            aovs: vec![Aov::Samples],
            denoise: false,
            max_error: None,
            ..self.settings.clone()
        }
    }

    /// Sends rays of a camera.
    fn run_camera_checks(
        &self,
        ready: &ReadyScene,
        (scene_facts, topologies, overlaps): (
            &SceneFacts<'_>,
            &BTreeMap<usize, Topology>,
            &OverlapTable,
        ),
        view: &CameraView,
        looks: &mut CameraCheckResults,
    ) {
        let seed = self.settings.seed;
        let deadline = &self.deadline;
        let survey = ready.run_task(&RaySurveyTask {
            scene_facts,
            overlaps,
            size: ready.settings().size,
            seed,
            deadline,
        });
        looks.aimed.push(ready.run_task(&AimedRayTask {
            scene_facts,
            topologies,
            seed,
            deadline,
        }));
        let mut picture = SmallRender::render_small_picture(ready, view.index, &self.deadline);
        if picture.is_black() {
            let seen = survey
                .first
                .values()
                .map(|sighting| view.in_front_of(sighting.position));
            picture.cover = ready.run_task(&CoverSearch {
                scene_facts,
                seen: seen.collect(),
            });
        }
        looks.pictures.push(picture);
        looks.rays.push(survey);
    }
}

/// What rays of each camera saw.
#[derive(Default)]
struct CameraCheckResults {
    rays: Vec<RaySurvey>,
    aimed: Vec<AimedRayResult>,
    pictures: Vec<SmallRender>,
}

impl CameraCheckResults {
    /// The checks of all cameras together.
    fn merge_check_runs(&self, furnaces: CheckRun) -> Vec<CheckRun> {
        let rays = self.rays.iter().map(RaySurvey::to_check_run);
        let aimed = self.aimed.iter().map(AimedRayResult::to_check_run);
        let mut sums: Vec<CheckRun> = Vec::new();
        for run in rays
            .chain(aimed)
            .chain(self.pictures.iter().map(|picture| picture.run.clone()))
            .chain([furnaces])
        {
            match sums.iter_mut().find(|sum| sum.name == run.name) {
                Some(sum) => {
                    (sum.looked_at, sum.planned) =
                        (sum.looked_at + run.looked_at, sum.planned + run.planned)
                }
                None => sums.push(run),
            }
        }
        sums
    }
}

/// Findings of a kind that are kept.
const KEPT: usize = 16;

/// The findings, the worst first, each cause once, with the pixels in which they are.
fn summarise_findings(
    scene_facts: &SceneFacts<'_>,
    views: &[CameraView],
    ready: Option<&ReadyScene>,
    mut findings: Vec<StressFinding>,
) -> StressSummary {
    findings.extend(empty_scene_finding(scene_facts));
    let findings = consequences::remove_consequent_findings(scene_facts, findings);
    let mut findings = merge_findings(views, findings);
    findings.sort_by(|a, b| {
        (a.severity, a.code, a.subject, &a.reason).cmp(&(b.severity, b.code, b.subject, &b.reason))
    });
    let (all, mut of_kind) = (findings.len(), BTreeMap::new());
    findings.retain(|finding| {
        let kept = of_kind.entry((finding.severity, finding.code)).or_insert(0);
        *kept += 1;
        *kept <= KEPT
    });
    let left_out = all - findings.len();
    if let Some(ready) = ready {
        sightlines::assign_pixels(scene_facts, ready, views, &mut findings);
    }
    StressSummary {
        findings,
        left_out,
        checks: Vec::new(),
        cameras: [0; 2],
        size: views.first().map_or([1, 1], |view| view.size),
    }
}

/// That there is no object.
fn empty_scene_finding(scene_facts: &SceneFacts<'_>) -> Option<StressFinding> {
    let reason =
        "it has no object: the file has none, or nothing was left of them when it was read";
    let remedy = "look at the warnings of reading, and whether the file's scene has a mesh with finite corners";
    scene_facts.is_empty().then(|| {
        let (code, severity) = (FindingCode::NothingSeen, Severity::PictureWrong);
        StressFinding::new(code, severity, FindingSubject::Scene, reason, remedy)
    })
}

/// Findings of one kind and cause as one, at the place that is nearest to a camera.
fn merge_findings(views: &[CameraView], mut findings: Vec<StressFinding>) -> Vec<StressFinding> {
    findings.sort_by(|a, b| {
        (a.severity, a.code, &a.reason, &a.remedy, a.subject)
            .cmp(&(b.severity, b.code, &b.reason, &b.remedy, b.subject))
    });
    let mut groups: Vec<StressFinding> = Vec::new();
    for finding in findings {
        let is_one = |last: &&mut StressFinding| {
            (last.severity, last.code, &last.reason, &last.remedy)
                == (
                    finding.severity,
                    finding.code,
                    &finding.reason,
                    &finding.remedy,
                )
                && last.subject.is_same_kind(finding.subject)
        };
        match groups.last_mut().filter(is_one) {
            // Of several cameras.
            Some(last) if last.subject == finding.subject => {}
            Some(last) => last.merge(finding, |place| {
                cameras::view_distance_key(views, place.into())
            }),
            None => groups.push(finding),
        }
    }
    groups
        .iter_mut()
        .for_each(|group| group.others.sort_unstable());
    groups
}
