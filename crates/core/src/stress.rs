//! The invariants on a scene of the user's own: what of its data, of rays of its own cameras and of
//! its lights makes a picture wrong or noisy.
//!
//! Each family of checks is a function from what is known of the scene to findings. Facts that
//! preparation and rendering tell anyway, such as gaps that storing closes, are taken from there.
//!
//! ```
//! use raywright_core::stress::{Code, Effort, Severity, stress};
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
//! let report = stress(&scene, &Settings::of(&scene), &Effort::default(), &())?;
//! assert!(report.findings.iter().any(|found| found.code == Code::EnergyMade && found.severity == Severity::PictureWrong));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod aimed;
mod bodies;
mod cameras;
mod causes;
mod coplanar;
mod duplicates;
mod faces;
mod facts;
mod fans;
mod finding;
mod furnace;
mod lamps;
mod materials;
mod meshes;
mod ray_survey;
mod rays;
mod samples;
mod seams;
mod sightlines;
mod stored;
mod textures;
mod topology;
mod triangles;
mod values;
mod windings;

use core::time::Duration;
use std::collections::BTreeMap;
use std::time::Instant;

use aimed::{AimedRays, EdgeAim};
pub(crate) use facts::SceneFacts;
pub use finding::{CheckRun, Code, Finding, Severity, Subject, counted, decimal};
use ray_survey::RaySurvey;
use rays::PictureRays;

use crate::dispatch::{Ready, collapsed, extent, prepare};
use crate::framing::{FIELD_OF_VIEW, Silhouette};
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::{Aov, Sampling, Settings};
use bodies::Bodies;
use cameras::View;
use coplanar::{Overlaps, Resolution};
use duplicates::Doubles;
use samples::SmallPicture;
use topology::Topology;

/// Cameras whose rays are sent; a scene with more has its first ones looked at.
const CAMERAS: usize = 8;

/// Pixels of the small picture of each camera, and most samples of each.
const PIXELS: f64 = 20_000.0;
const SAMPLES: u32 = 16;

/// How much is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Time after which no more rays are sent. The data is looked at whatever it takes.
    pub budget: Duration,
}

impl Default for Effort {
    fn default() -> Self {
        Self {
            budget: Duration::from_secs(30),
        }
    }
}

/// What was found, and what was looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The worst first, at most sixteen of each kind.
    pub findings: Vec<Finding>,
    /// How many more there are of the same kinds.
    pub left_out: usize,
    /// Checks by rays and samples.
    pub checks: Vec<CheckRun>,
    /// Cameras that were looked through, of how many.
    pub cameras: [usize; 2],
    /// Size of the picture by which pixels are told.
    pub size: [u32; 2],
}

impl Report {
    /// The worst that was found.
    pub fn worst(&self) -> Option<Severity> {
        self.findings.first().map(|found| found.severity)
    }

    /// Whether time ended some check.
    pub fn is_cut(&self) -> bool {
        self.checks.iter().any(CheckRun::is_cut)
    }
}

/// Ends rays when the time is over, and everything when the observer says so.
pub(crate) struct Deadline<'a> {
    observer: &'a dyn Observer,
    end: Option<Instant>,
}

impl Deadline<'_> {
    pub fn is_over(&self) -> bool {
        self.observer.cancelled() || self.end.is_some_and(|end| Instant::now() >= end)
    }
}

impl Observer for Deadline<'_> {
    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }

    fn has_enough(&self, _everywhere: bool) -> bool {
        self.is_over()
    }
}

/// Checks a validated scene as its settings would render it, on the current thread pool. What is
/// found depends on scene, settings and seed, and on the clock only where [`Report::is_cut`].
///
/// # Errors
/// See [`PrepareError`]; shapes of which storing leaves nothing are findings.
pub fn stress(
    scene: &Scene,
    settings: &Settings,
    effort: &Effort,
    observer: &dyn Observer,
) -> Result<Report, PrepareError> {
    let deadline = Deadline {
        observer,
        end: Instant::now().checked_add(effort.budget),
    };
    let session = Session {
        scene,
        settings,
        observer,
        deadline,
    };
    session.run()
}

struct Session<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    observer: &'a dyn Observer,
    deadline: Deadline<'a>,
}

impl Session<'_> {
    fn run(&self) -> Result<Report, PrepareError> {
        let (scene, settings) = (self.scene, self.settings);
        let lost = collapsed(scene, settings.precision);
        let size = settings.size;
        let facts = SceneFacts::new(scene, extent(scene, settings.precision).bounds);
        let views = self.views();
        if !lost.is_empty() {
            // It can't be prepared, so that no ray can be sent.
            let mut findings = stored::lost_shapes(scene, &lost);
            findings.extend(
                textures::check(&facts)
                    .into_iter()
                    .chain(lamps::check(&facts, &views)),
            );
            return Ok(Report {
                cameras: [0, scene.cameras.len().max(1)],
                ..report(&facts, &views, None, findings)
            });
        }
        let steps = 2 + views.len() as u64 * 3;
        let progress = |done: u64| self.observer.progress(done, steps);
        let resolution = Resolution {
            precision: settings.precision,
            views: &views,
        };
        let topologies = meshes::topologies(&facts);
        let overlaps = coplanar::overlaps(&facts, &topologies, &resolution);
        let doubles = Doubles::of(&facts);
        crate::prepare::go_on(self.observer)?;
        progress(1);
        let mut looks = Looks::default();
        let small = self.small(&views[0]);
        let mut ready = prepare(scene, &small, self.observer)?;
        let mut findings = Vec::new();
        for (done, view) in views.iter().enumerate() {
            if done > 0 && !ready.turn_to(scene, &view.data) {
                ready = prepare(scene, &self.small(view), self.observer)?;
            }
            self.look(&ready, (&facts, &topologies, &overlaps), view, &mut looks);
            let (gaps, leaks) = (ready.closed_gaps(), ready.light_leaks());
            findings.extend(bodies::closed(&facts, &doubles, &gaps, &leaks));
            crate::prepare::go_on(self.observer)?;
            progress(2 + 3 * done as u64);
        }
        let (furnaces, of) = furnace::measure(&facts, settings, &self.deadline);
        let seen = looks
            .rays
            .iter()
            .cloned()
            .reduce(RaySurvey::plus)
            .unwrap_or_default();
        findings.extend(stored::check(&facts, &ready, &seen, &views));
        findings.extend(meshes::check(&facts, &topologies, &seen, &views));
        findings.extend(duplicates::check(&facts, &doubles, &seen));
        let bodies = Bodies {
            facts: &facts,
            topologies: &topologies,
            doubles: &doubles,
            seen: &seen,
            resolution: &resolution,
        };
        findings.extend(bodies.check(&looks.aimed));
        findings.extend(coplanar::check(
            &facts,
            &overlaps,
            &seen,
            &resolution,
            |pair| doubles.are_one(pair) || bodies.flickers(pair),
        ));
        findings.extend(samples::check(&facts, &looks.pictures, size));
        findings.extend(materials::check(&facts, settings, &seen, &furnaces));
        findings.extend(textures::check(&facts));
        findings.extend(lamps::check(&facts, &views));
        findings.extend(cameras::check(&facts, &views, &looks.rays));
        progress(steps);
        let furnaces = CheckRun {
            name: "furnaces",
            looked_at: furnaces.len() as u64,
            unit: "materials",
            planned: of as u64,
        };
        Ok(Report {
            checks: looks.checks(furnaces),
            cameras: [views.len(), scene.cameras.len().max(1)],
            ..report(&facts, &views, Some(&ready), findings)
        })
    }

    /// The cameras that are looked through, each in the picture's size.
    fn views(&self) -> Vec<View> {
        let (scene, size) = (self.scene, self.settings.size);
        let cameras = scene.cameras.iter().enumerate().take(CAMERAS);
        let mut views: Vec<View> = cameras
            .map(|(index, camera)| {
                View::new(index, Subject::Camera(Some(index)), camera.clone(), size)
            })
            .collect();
        if views.is_empty() {
            let silhouette = Silhouette::of(scene);
            let framed = || {
                silhouette.frame(
                    silhouette.front(),
                    FIELD_OF_VIEW,
                    f64::from(size[0]) / f64::from(size[1]),
                )
            };
            let camera = self.settings.camera.clone().unwrap_or_else(framed);
            views.push(View::new(0, Subject::Camera(None), camera, size));
        }
        views
    }

    /// The settings of a small picture.
    fn small(&self, view: &View) -> Settings {
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
    fn look(
        &self,
        ready: &Ready,
        (facts, topologies, overlaps): (&SceneFacts<'_>, &BTreeMap<usize, Topology>, &Overlaps),
        view: &View,
        looks: &mut Looks,
    ) {
        let seed = self.settings.seed;
        let deadline = &self.deadline;
        looks.rays.push(ready.work(&PictureRays {
            facts,
            overlaps,
            size: ready.settings().size,
            seed,
            deadline,
        }));
        looks.aimed.push(ready.work(&EdgeAim {
            facts,
            topologies,
            seed,
            deadline,
        }));
        looks
            .pictures
            .push(SmallPicture::of(ready, view.index, &self.deadline));
    }
}

/// What rays of each camera saw.
#[derive(Default)]
struct Looks {
    rays: Vec<RaySurvey>,
    aimed: Vec<AimedRays>,
    pictures: Vec<SmallPicture>,
}

impl Looks {
    /// The checks of all cameras together.
    fn checks(&self, furnaces: CheckRun) -> Vec<CheckRun> {
        let rays = self.rays.iter().map(RaySurvey::run);
        let aimed = self.aimed.iter().map(AimedRays::run);
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
fn report(
    facts: &SceneFacts<'_>,
    views: &[View],
    ready: Option<&Ready>,
    mut findings: Vec<Finding>,
) -> Report {
    findings.extend(nothing_left(facts));
    let findings = causes::without_consequences(facts, findings);
    let mut findings = together(views, findings);
    findings.sort_by(|a, b| {
        (a.severity, a.code, a.subject, &a.why).cmp(&(b.severity, b.code, b.subject, &b.why))
    });
    let (all, mut of_kind) = (findings.len(), BTreeMap::new());
    findings.retain(|found| {
        let kept = of_kind.entry((found.severity, found.code)).or_insert(0);
        *kept += 1;
        *kept <= KEPT
    });
    let left_out = all - findings.len();
    if let Some(ready) = ready {
        sightlines::set_pixels(facts, ready, views, &mut findings);
    }
    Report {
        findings,
        left_out,
        checks: Vec::new(),
        cameras: [0; 2],
        size: views.first().map_or([1, 1], |view| view.size),
    }
}

/// That there is no object.
fn nothing_left(facts: &SceneFacts<'_>) -> Option<Finding> {
    let why = "it has no object: the file has none, or nothing was left of them when it was read";
    let remedy = "look at the warnings of reading, and whether the file's scene has a mesh with finite corners";
    facts.is_empty().then(|| {
        let (code, severity) = (Code::NothingSeen, Severity::PictureWrong);
        Finding::new(code, severity, Subject::Scene, why, remedy)
    })
}

/// Findings of one kind and cause as one, at the place that is nearest to a camera.
fn together(views: &[View], mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.sort_by(|a, b| {
        (a.severity, a.code, &a.why, &a.remedy, a.subject)
            .cmp(&(b.severity, b.code, &b.why, &b.remedy, b.subject))
    });
    let mut groups: Vec<Finding> = Vec::new();
    for found in findings {
        let is_one = |last: &&mut Finding| {
            (last.severity, last.code, &last.why, &last.remedy)
                == (found.severity, found.code, &found.why, &found.remedy)
                && last.subject.is_alike(found.subject)
        };
        match groups.last_mut().filter(is_one) {
            // Of several cameras.
            Some(last) if last.subject == found.subject => {}
            Some(last) => last.join(found, |place| cameras::nearness(views, place.into())),
            None => groups.push(found),
        }
    }
    groups
        .iter_mut()
        .for_each(|group| group.others.sort_unstable());
    groups
}
