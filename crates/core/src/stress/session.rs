//! Order of all checks of a scene: its data, then rays and samples of each camera, then the
//! findings from both.

use super::light_survey::{LightSurvey, LightSurveyTask};
use super::rays::RaySurveyTask;
use super::samples::SmallRender;
use super::*;
use crate::dispatch::{find_collapsed_objects, measure_scene_extent, prepare};
use crate::prepare::{LightLeak, check_cancelled};
use crate::settings::{Aov, Sampling};
use crate::topology::find_topologies;

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
    /// Rays of each camera.
    rays: Vec<RaySurvey>,
    lights: LightSurvey,
    pictures: Vec<SmallRender>,
    depth_losses: Vec<(f64, Fault)>,
    leaks: Vec<LightLeak>,
    /// Pairs of objects with a closed gap between them.
    gaps: BTreeSet<[usize; 2]>,
    gap_findings: Vec<Fault>,
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
        let mut findings = lost;
        findings.extend(facts.check_textures());
        findings.extend(facts.check_lights(&LightSurvey::default()));
        let summary = facts.summarise(None, findings);
        return Ok(StressSummary {
            cameras: [0, summary.cameras[1]],
            ..summary
        });
    }
    facts.topologies = find_topologies(scene);
    facts.duplicates = facts.find_duplicates();
    let (facts, observer) = (&facts, deadline.observer);
    let steps = 2 + facts.views.len() as u64;
    check_cancelled(observer)?;
    observer.progress(1, steps);
    let mut results = CameraResults::default();
    let ready = facts.visit_views(settings.precision, observer, |ready, view| {
        results.check_camera(facts, ready, view, deadline);
        check_cancelled(observer)?;
        observer.progress(1 + results.rays.len() as u64, steps);
        Ok(())
    })?;
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

impl SceneFacts<'_> {
    /// Prepares the small pictures of all cameras one after the other, in a precision, and calls
    /// `visit` with each. Returns the last one.
    fn visit_views(
        &self,
        precision: PrecisionChoice,
        observer: &dyn Observer,
        mut visit: impl FnMut(&mut ReadyScene, &CameraView) -> Result<(), PrepareError>,
    ) -> Result<ReadyScene, PrepareError> {
        let prepare = |view| {
            let settings = Settings {
                precision,
                ..small_settings(self.settings, view)
            };
            prepare(self.scene, &settings, observer)
        };
        let mut ready = prepare(&self.views[0])?;
        for (done, view) in self.views.iter().enumerate() {
            if done > 0 && !ready.replace_camera(self.scene, &view.data) {
                ready = prepare(view)?;
            }
            visit(&mut ready, view)?;
        }
        Ok(ready)
    }

    /// Traces the cameras' rays through the scene in double precision.
    fn survey_in_doubles(&self, deadline: &RayDeadline<'_>) -> Option<RaySurvey> {
        let mut survey = RaySurvey::default();
        let visit = |ready: &mut ReadyScene, _: &CameraView| {
            let own = ready.run_task(&RaySurveyTask::new(self, ready, deadline));
            survey = core::mem::take(&mut survey).combine(own);
            Ok(())
        };
        let ready = self.visit_views(PrecisionChoice::Reference, deadline.observer, visit);
        ready.is_ok().then_some(survey)
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
        let rays = ready.run_task(&RaySurveyTask::new(facts, ready, deadline));
        let lights = ready.run_task(&LightSurveyTask::new(facts, ready, view, deadline));
        self.lights = core::mem::take(&mut self.lights).combine(lights);
        let picture = SmallRender::render(ready, view, deadline);
        self.lights.add_shadow_rays(facts, &picture.light_rays);
        let loss = facts.depth_loss_finding(ready, view, &picture, deadline);
        self.depth_losses.extend(loss);
        self.pictures.push(picture);
        self.leaks.extend(ready.find_light_leaks());
        let gaps = ready.find_unresolved_gaps();
        let pairs = gaps
            .iter()
            .map(|gap| facts.sorted_pair([gap.object, gap.other]));
        self.gaps.extend(pairs);
        self.gap_findings.extend(facts.gap_findings(&rays, &gaps));
        self.rays.push(rays);
    }

    /// Returns the findings from the scene's data and from all rays.
    fn summarise(
        self,
        facts: &SceneFacts<'_>,
        ready: &ReadyScene,
        deadline: &RayDeadline<'_>,
    ) -> StressSummary {
        let survey = self.rays.iter().cloned().reduce(RaySurvey::combine);
        let survey = survey.unwrap_or_default();
        // What is stored coarsely may be seen as in double precision, and what seems to lie in one
        // place may lie apart.
        let is_doubtful = ready.first_unresolved_object().is_some()
            || survey
                .events
                .keys()
                .any(|event| matches!(event, RayEvent::InPlace(_)));
        let is_robust = facts.settings.precision == PrecisionChoice::Robust;
        let exact = (is_robust && is_doubtful)
            .then(|| facts.survey_in_doubles(deadline))
            .flatten();
        // Where both are in one plane, neither is in front.
        let gap = |pair: [usize; 2]| facts.gap_between((&survey, exact.as_ref()), pair);
        let leaks = self.leaks.iter().filter(|leak| {
            facts
                .leaking_pair(leak)
                .is_none_or(|pair| gap(pair) != Some(0.0))
        });
        let leaking: BTreeSet<_> = leaks
            .clone()
            .filter_map(|leak| facts.leaking_pair(leak))
            .collect();
        let is_told = |pair| {
            let is_gap = leaking.contains(&pair) || self.gaps.contains(&pair);
            is_gap || facts.duplicates.are_duplicates(pair)
        };
        let storage = match facts.settings.precision {
            PrecisionChoice::Robust => facts.check_storage::<f32>(ready, &survey, exact.as_ref()),
            PrecisionChoice::Reference => facts.check_storage::<f64>(ready, &survey, None),
        };
        let losses = self.depth_losses.into_iter();
        let worst = losses.max_by(|a, b| a.0.total_cmp(&b.0));
        let pictures = self.pictures.iter();
        let (energy, furnaces) = facts.run_furnace_tests(&survey, deadline);
        let mut findings = self.gap_findings;
        findings.extend(leaks.map(|leak| leak.fault(facts.scene, facts.settings.precision)));
        let lists = [
            pictures
                .clone()
                .flat_map(|picture| picture.loss_findings(facts.settings.size))
                .collect(),
            energy,
            storage,
            facts.check_meshes(&survey),
            facts.check_duplicates(&survey),
            facts.check_bodies(&survey, &self.gaps),
            facts.check_overlaps(&survey, gap, is_told),
            facts.not_number_findings(&survey),
            facts.check_textures(),
            facts.check_cameras(&self.rays),
            facts.check_lights(&self.lights),
        ];
        let by_chance = pictures.filter_map(|p| facts.light_by_chance_finding(&self.lights, p));
        let single = [
            worst.map(|(_, finding)| finding),
            facts.depth_limit_finding(),
            facts.sky_spike_finding(),
        ];
        let single = single.into_iter().flatten();
        findings.extend(lists.into_iter().flatten().chain(single).chain(by_chance));
        facts.add_black_picture_findings(&self.lights, &self.pictures, &mut findings);
        let run = |name, unit, [looked_at, planned]: [u64; 2]| CheckRun {
            name,
            unit,
            looked_at,
            planned,
        };
        let samples = self.pictures.iter().map(|picture| picture.samples);
        let samples = samples.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
        StressSummary {
            checks: vec![
                run("rays of the cameras", "rays", [survey.rays, survey.planned]),
                run("rays of the lights", "lights", self.lights.surveyed),
                run("samples", "samples", samples),
                run("furnaces", "materials", furnaces),
            ],
            ..facts.summarise(Some(ready), findings)
        }
    }
}
