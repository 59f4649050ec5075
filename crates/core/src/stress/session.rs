//! Order of all checks of a scene: its data, then rays and samples of each camera, then the
//! findings from both.

use super::bodies::sorted;
use super::light_survey::LightSurvey;
use super::light_tracer::LightSurveyTask;
use super::rays::RaySurveyTask;
use super::samples::SmallRender;
use super::*;
use crate::dispatch::{find_collapsed_objects, measure_scene_extent, prepare};
use crate::prepare::check_cancelled;
use crate::settings::{Aov, Sampling};

/// Size of each camera's small picture. `PIXELS`: greatest number of pixels, approximately.
/// `SAMPLES`: greatest number of samples per pixel.
const PIXELS: f64 = 20_000.0;
const SAMPLES: u32 = 16;
/// Number of replicates of the small pictures. More of them, with fewer samples each, would
/// underestimate the error of rare light.
const REPLICATES: u32 = 2;

/// Results of the rays and samples of the cameras.
#[derive(Default)]
struct CameraResults {
    rays: Vec<RaySurvey>,
    lights: Vec<LightSurvey>,
    pictures: Vec<SmallRender>,
    depth_losses: Vec<(f64, StressFinding)>,
    /// Pairs of an emissive object and the cover through which it shines.
    leaks: BTreeSet<[usize; 2]>,
    /// Pairs of objects with a closed gap between them.
    gaps: BTreeSet<[usize; 2]>,
    findings: Vec<StressFinding>,
}

/// Checks a scene within a time limit.
///
/// # Errors
/// See [`PrepareError`].
pub(super) fn run_all_checks(
    scene: &Scene,
    settings: &Settings,
    deadline: &RayDeadline<'_>,
) -> Result<StressSummary, PrepareError> {
    let lost = find_collapsed_objects(scene, settings.precision);
    let bounds = measure_scene_extent(scene, settings.precision).bounds;
    let mut facts = SceneFacts::new(scene, settings, bounds);
    if !lost.is_empty() {
        let mut findings = facts.lost_shape_findings(&lost);
        findings.extend(facts.check_textures());
        findings.extend(facts.check_lights(&LightSurvey::default()));
        let summary = facts.summarise(None, findings);
        return Ok(StressSummary {
            cameras: [0, summary.cameras[1]],
            ..summary
        });
    }
    facts.topologies = facts.find_topologies();
    facts.overlaps = facts.find_overlaps();
    facts.duplicates = facts.find_duplicates();
    let (facts, observer) = (&facts, deadline.observer);
    let steps = 2 + facts.views.len() as u64;
    check_cancelled(observer)?;
    observer.progress(1, steps);
    let mut results = CameraResults::default();
    let mut ready = prepare(scene, &small_settings(settings, &facts.views[0]), observer)?;
    for (done, view) in facts.views.iter().enumerate() {
        if done > 0 && !ready.replace_camera(scene, &view.data) {
            ready = prepare(scene, &small_settings(settings, view), observer)?;
        }
        results.check_camera(facts, &mut ready, view, deadline);
        check_cancelled(observer)?;
        observer.progress(2 + done as u64, steps);
    }
    let summary = results.summarise(facts, &ready, deadline);
    observer.progress(steps, steps);
    Ok(summary)
}

/// Returns the settings of a camera's small picture.
fn small_settings(settings: &Settings, view: &CameraView) -> Settings {
    let [width, height] = view.size.map(f64::from);
    let scale = (PIXELS / (width * height)).sqrt().min(1.0);
    let sampling = match settings.sampling {
        Sampling::General(samples) => Sampling::General(samples.min(SAMPLES)),
        pattern => pattern,
    };
    Settings {
        size: [width, height].map(|edge| ((edge * scale).round() as u32).max(1)),
        crop: None,
        camera: Some(view.data.clone()),
        sampling,
        aovs: vec![Aov::Samples, Aov::Object],
        denoise: false,
        max_error: None,
        replicates: Some(REPLICATES),
        ..settings.clone()
    }
}

impl CameraResults {
    /// Traces all rays of a camera, renders its small picture and adds the results.
    fn check_camera(
        &mut self,
        facts: &SceneFacts<'_>,
        ready: &mut ReadyScene,
        view: &CameraView,
        deadline: &RayDeadline<'_>,
    ) {
        let size = ready.settings().size;
        self.rays.push(ready.run_task(&RaySurveyTask {
            facts,
            size,
            deadline,
        }));
        let lights = LightSurveyTask::new(facts, ready, view, deadline);
        self.lights.push(ready.run_task(&lights));
        let picture = SmallRender::render(facts, ready, view, deadline);
        let loss = facts.depth_loss_finding(ready, view, &picture, deadline);
        self.depth_losses.extend(loss);
        self.pictures.push(picture);
        let (gaps, leaks) = (ready.find_unresolved_gaps(), ready.find_light_leaks());
        for leak in &leaks {
            if let (FindingSubject::Object(lamp), cover) = facts.leak_subjects(leak) {
                self.leaks.insert(sorted([lamp, cover]));
            }
        }
        for gap in &gaps {
            let pair = [gap.object, gap.other].map(|object| facts.facts_index(object as u32));
            self.gaps.insert(sorted(pair));
        }
        self.findings.extend(facts.gap_findings(&gaps));
        self.findings
            .extend(leaks.iter().filter_map(|leak| facts.leak_finding(leak)));
    }

    /// Returns the findings from the scene's data and from all rays.
    fn summarise(
        self,
        facts: &SceneFacts<'_>,
        ready: &ReadyScene,
        deadline: &RayDeadline<'_>,
    ) -> StressSummary {
        let survey = self
            .rays
            .iter()
            .cloned()
            .reduce(RaySurvey::combine)
            .unwrap_or_default();
        let lights = self
            .lights
            .iter()
            .cloned()
            .reduce(LightSurvey::combine)
            .unwrap_or_default();
        let is_leak = |[a, b]: [usize; 2]| {
            self.leaks.contains(&[a, b]) && facts.overlaps.gap_between([a, b]) != Some(0.0)
        };
        let is_told = |pair| {
            let is_flicker = facts.is_flickering_pair(&survey, pair);
            is_flicker || facts.duplicates.are_duplicates(pair) || is_leak(pair)
        };
        let worst = self
            .depth_losses
            .into_iter()
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let pictures = self.pictures.iter();
        let losses = pictures.flat_map(|picture| picture.loss_findings(facts.settings.size));
        let (energy, furnaces) = facts.run_furnace_tests(&survey, deadline);
        let mut findings = self.findings;
        let lists = [
            losses.collect(),
            energy,
            facts.check_storage(ready, &survey),
            facts.check_meshes(&survey),
            facts.check_duplicates(&survey),
            facts.check_bodies(&survey, &self.gaps),
            facts.check_overlaps(&survey, is_told),
            facts.not_number_findings(&survey),
            facts.check_textures(),
            facts.check_cameras(&self.rays),
            facts.check_lights(&lights),
            facts.unreached_light_findings(&lights, &self.pictures),
            facts.light_by_chance_findings(&lights, &self.pictures),
        ];
        let single = [
            worst.map(|(_, finding)| finding),
            facts.depth_limit_finding(),
            facts.sky_spike_finding(),
            facts.sky_peak_finding(ready, deadline),
        ];
        findings.extend(
            lists
                .into_iter()
                .flatten()
                .chain(single.into_iter().flatten()),
        );
        facts.add_black_picture_findings(&lights, &self.pictures, &mut findings);
        let surveyed = self.lights.iter().map(|lights| lights.surveyed).sum();
        let planned = self
            .lights
            .iter()
            .map(|lights| lights.lights.len() as u64)
            .sum();
        let samples = self.pictures.into_iter().map(|picture| picture.run);
        let samples = samples.reduce(|sum, run| CheckRun {
            looked_at: sum.looked_at + run.looked_at,
            planned: sum.planned + run.planned,
            ..sum
        });
        let run = |name, unit, [looked_at, planned]: [u64; 2]| CheckRun {
            name,
            unit,
            looked_at,
            planned,
        };
        let mut checks = vec![
            run("rays of the cameras", "rays", [survey.rays, survey.planned]),
            run("rays of the lights", "lights", [surveyed, planned]),
        ];
        checks.extend(samples);
        checks.push(run("furnaces", "materials", furnaces));
        StressSummary {
            checks,
            ..facts.summarise(Some(ready), findings)
        }
    }
}
