//! Order of all checks of a scene: its data, then rays and samples of each camera, then the
//! findings from both.

use std::collections::BTreeMap;

use super::aimed::{AimedRayResult, AimedRayTask};
use super::bodies::BodyChecks;
use super::camera_bodies::check_bodies_at_cameras;
use super::cameras::CameraView;
use super::coplanar::DepthResolution;
use super::covers::LightBlockerTask;
use super::depth_loss::DepthLoss;
use super::duplicates::DuplicateObjects;
use super::facts::SceneFacts;
use super::finding::{CheckRun, FindingSubject, StressFinding};
use super::furnace::FurnaceAlbedo;
use super::light_survey::{LightSurvey, LightSurveyTask};
use super::orientation::OrientationTable;
use super::overlap_table::OverlapTable;
use super::ray_survey::RaySurvey;
use super::rays::RaySurveyTask;
use super::small_render::SmallRender;
use super::summary::summarise_findings;
use super::topology::Topology;
use super::{
    RayDeadline, StressSummary, black, bodies, cameras, copies, coplanar, depth_loss, furnace,
    lights, materials, meshes, overlaps, samples, sky_peaks, storage, textures,
};
use crate::dispatch::{ReadyScene, find_collapsed_objects, measure_scene_extent, prepare};
use crate::framing::{FIELD_OF_VIEW, Silhouette};
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::prepare::{LampRef, check_cancelled};
use crate::scene::Scene;
use crate::settings::{Aov, Sampling, Settings};
use crate::validate::Problem;

/// Greatest number of cameras that are checked: the first ones of the scene.
const CAMERAS: usize = 8;

/// Size of each camera's small picture. `PIXELS`: greatest number of pixels, approximately.
/// `SAMPLES`: greatest number of samples per pixel.
const PIXELS: f64 = 20_000.0;
const SAMPLES: u32 = 16;
/// Number of replicates of the small pictures. More of them, with fewer samples each, would
/// underestimate the error of rare light.
const REPLICATES: u32 = 2;

pub(super) struct StressSession<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub observer: &'a dyn Observer,
    pub deadline: RayDeadline<'a>,
}

/// Facts about a scene that are known before rays are traced.
struct SceneData<'a> {
    scene_facts: &'a SceneFacts<'a>,
    topologies: &'a BTreeMap<usize, Topology>,
    orientations: OrientationTable<'a>,
    overlaps: OverlapTable,
    doubles: DuplicateObjects,
    resolution: &'a DepthResolution<'a>,
}

/// Returns the summary of a scene that cannot be prepared, so that no ray can be traced. `lost`
/// holds the reasons.
fn summarise_unprepared(
    scene_facts: &SceneFacts<'_>,
    views: &[CameraView],
    lost: &[Problem],
) -> StressSummary {
    let mut findings = storage::lost_shape_findings(scene_facts.scene, lost);
    findings.extend(textures::check_textures(scene_facts));
    findings.extend(lights::check_lights(scene_facts, views, None));
    StressSummary {
        cameras: [0, scene_facts.scene.cameras.len().max(1)],
        ..summarise_findings(scene_facts, views, None, findings)
    }
}

impl StressSession<'_> {
    pub fn run_all_checks(&self) -> Result<StressSummary, PrepareError> {
        let (scene, settings) = (self.scene, self.settings);
        let lost = find_collapsed_objects(scene, settings.precision);
        let scene_facts = SceneFacts::new(
            scene,
            measure_scene_extent(scene, settings.precision).bounds,
        );
        let views = self.camera_views();
        if !lost.is_empty() {
            return Ok(summarise_unprepared(&scene_facts, &views, &lost));
        }
        let steps = 2 + views.len() as u64 * 3;
        let progress = |done: u64| self.observer.progress(done, steps);
        let resolution = DepthResolution::new(settings.precision, &views, &scene_facts.bounds);
        let topologies = meshes::mesh_topologies(&scene_facts);
        let data = SceneData {
            scene_facts: &scene_facts,
            overlaps: coplanar::find_overlaps(&scene_facts, &topologies, &resolution),
            doubles: DuplicateObjects::from_scene(&scene_facts),
            orientations: OrientationTable::new(&topologies),
            topologies: &topologies,
            resolution: &resolution,
        };
        check_cancelled(self.observer)?;
        progress(1);
        let mut looks = CameraCheckResults::default();
        let mut ready = prepare(
            scene,
            &self.small_picture_settings(&views[0]),
            self.observer,
        )?;
        let mut findings = Vec::new();
        for (done, view) in views.iter().enumerate() {
            if done > 0 && !ready.replace_camera(scene, &view.data) {
                ready = prepare(scene, &self.small_picture_settings(view), self.observer)?;
            }
            self.run_camera_checks(&ready, &data, view, &mut looks);
            let measure = |picture: &SmallRender| {
                depth_loss::measure_depth_loss(&scene_facts, &mut ready, picture, &self.deadline)
            };
            let loss = looks.pictures.last().and_then(measure);
            looks.depth_losses.extend(loss);
            findings.extend(check_gaps_and_leaks(&ready, &data, &mut looks));
            check_cancelled(self.observer)?;
            progress(2 + 3 * done as u64);
        }
        let surveys = looks.combine_surveys();
        let (furnaces, total) =
            furnace::run_furnace_tests(&scene_facts, &surveys.0, settings, &self.deadline);
        let ready_views = (&ready, &views[..]);
        findings.extend(self.collect_findings(&data, ready_views, (&looks, surveys), &furnaces));
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

    /// Returns the findings from the scene's data and from all rays.
    fn collect_findings(
        &self,
        data: &SceneData<'_>,
        (ready, views): (&ReadyScene, &[CameraView]),
        (looks, (survey, lights)): (&CameraCheckResults, (RaySurvey, LightSurvey)),
        furnaces: &[FurnaceAlbedo],
    ) -> Vec<StressFinding> {
        let (scene_facts, settings) = (data.scene_facts, self.settings);
        let bodies = BodyChecks {
            scene_facts,
            topologies: data.topologies,
            doubles: &data.doubles,
            survey: &survey,
            resolution: data.resolution,
            overlaps: &data.overlaps,
        };
        let is_leak = |[a, b]: [usize; 2]| {
            let leaks = &looks.leaks;
            let is_one = leaks.contains(&[a, b]) || leaks.contains(&[b, a]);
            is_one && data.overlaps.gap_between([a, b]) != Some(0.0)
        };
        let is_told = |pair| {
            data.doubles.are_duplicates(pair) || bodies.is_flickering_pair(pair) || is_leak(pair)
        };
        let mut findings = storage::check_storage(scene_facts, ready, &survey, views);
        findings.extend(meshes::check_meshes(
            scene_facts,
            data.topologies,
            &survey,
            views,
        ));
        findings.extend(data.doubles.check_listed_objects(scene_facts, &survey));
        findings.extend(copies::check_generator_copies(
            scene_facts,
            &data.doubles,
            &survey,
        ));
        findings.extend(bodies.check_bodies(&looks.aimed));
        findings.extend(overlaps::check_overlaps(
            scene_facts,
            &data.overlaps,
            &survey,
            data.resolution,
            is_told,
        ));
        findings.extend(samples::check_samples(
            scene_facts,
            &looks.pictures,
            &lights,
            settings,
        ));
        findings.extend(materials::check_materials(
            scene_facts,
            settings,
            &survey,
            furnaces,
        ));
        findings.extend(depth_loss::depth_loss_finding(
            scene_facts,
            &looks.depth_losses,
        ));
        findings.extend(sky_peaks::check_sky_peaks(ready, settings, &self.deadline));
        findings.extend(textures::check_textures(scene_facts));
        findings.extend(lights::check_lights(scene_facts, views, Some(&lights)));
        findings.extend(cameras::check_cameras(scene_facts, views, &looks.rays));
        findings.extend(check_bodies_at_cameras(scene_facts, views, &looks.rays));
        black::add_black_picture_findings(scene_facts, &looks.pictures, &mut findings);
        findings
    }

    /// Returns the cameras to check, each with the picture size of the settings. Without cameras,
    /// the scene is framed automatically.
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

    /// Returns the settings of a camera's small picture.
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
            aovs: vec![Aov::Samples, Aov::Object],
            denoise: false,
            max_error: None,
            replicates: Some(REPLICATES),
            ..self.settings.clone()
        }
    }

    /// Traces all rays of a camera, renders its small picture and adds the results.
    fn run_camera_checks(
        &self,
        ready: &ReadyScene,
        data: &SceneData<'_>,
        view: &CameraView,
        looks: &mut CameraCheckResults,
    ) {
        let (scene_facts, deadline, seed) = (data.scene_facts, &self.deadline, self.settings.seed);
        let size = ready.settings().size;
        let survey = ready.run_task(&RaySurveyTask {
            scene_facts,
            overlaps: &data.overlaps,
            orientations: &data.orientations,
            size,
            seed,
            deadline,
        });
        looks.aimed.push(ready.run_task(&AimedRayTask {
            scene_facts,
            topologies: data.topologies,
            seed,
            deadline,
        }));
        looks.lights.push(ready.run_task(&LightSurveyTask {
            scene_facts,
            size,
            eye: view.eye(),
            deadline,
        }));
        let mut picture = SmallRender::render_small_picture(ready, view.index, &self.deadline);
        if picture.is_black() {
            let seen = survey
                .first_hits
                .values()
                .map(|sighting| view.point_in_front_of(sighting.position));
            picture.cover = ready.run_task(&LightBlockerTask {
                scene_facts,
                seen: seen.collect(),
            });
        }
        looks.pictures.push(picture);
        looks.rays.push(survey);
    }
}

/// Finds gaps that the precision closes and light that leaks, seen by the camera of `ready`. The
/// leaks are added to `looks`.
fn check_gaps_and_leaks(
    ready: &ReadyScene,
    data: &SceneData<'_>,
    looks: &mut CameraCheckResults,
) -> Vec<StressFinding> {
    let (gaps, leaks) = (ready.find_unresolved_gaps(), ready.find_light_leaks());
    looks.leaks.extend(leaks.iter().filter_map(|leak| {
        let LampRef::Object(lamp) = leak.lamp else {
            return None;
        };
        Some([lamp, leak.cover].map(|object| data.scene_facts.facts_index(object as u32)))
    }));
    bodies::closed_gap_findings(
        data.scene_facts,
        (&data.doubles, &data.overlaps),
        &gaps,
        &leaks,
    )
}

/// Results of the rays of each camera.
#[derive(Default)]
struct CameraCheckResults {
    rays: Vec<RaySurvey>,
    aimed: Vec<AimedRayResult>,
    lights: Vec<LightSurvey>,
    pictures: Vec<SmallRender>,
    depth_losses: Vec<DepthLoss>,
    /// Pairs of an emissive object and the cover through which it shines.
    leaks: Vec<[usize; 2]>,
}

impl CameraCheckResults {
    /// Returns the surveys of camera rays and of light, each combined over the cameras.
    fn combine_surveys(&self) -> (RaySurvey, LightSurvey) {
        let rays = self.rays.iter().cloned().reduce(RaySurvey::combine);
        let lights = self.lights.iter().cloned().reduce(LightSurvey::combine);
        (rays.unwrap_or_default(), lights.unwrap_or_default())
    }

    /// Returns the work of all checks, summed over the cameras.
    fn merge_check_runs(&self, furnaces: CheckRun) -> Vec<CheckRun> {
        let rays = self.rays.iter().map(RaySurvey::to_check_run);
        let aimed = self.aimed.iter().map(AimedRayResult::to_check_run);
        let mut sums: Vec<CheckRun> = Vec::new();
        let lights = self
            .lights
            .iter()
            .filter(|survey| !survey.lights.is_empty());
        let lights = lights.map(LightSurvey::to_check_run);
        for run in rays
            .chain(aimed)
            .chain(lights)
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
