//! Status of the viewer for the page, as JSON.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_core::effects::{EffectReport, EffectStatus, SWITCHABLE_EFFECTS};
use raywright_core::film::Uncertainty;
use raywright_core::scene::{Camera, Pinhole, Pose, Projection};
use serde::Serialize;
use serde_json::{Value, json};

use super::viewed_scene::ViewedScene;
use crate::origin;
use crate::scene_input::{depends_on_time, loop_seconds};

/// Progress of the viewer's current render.
#[derive(Clone, Default, Serialize)]
pub struct RenderProgress {
    /// Least and greatest number of samples of a pixel so far.
    pub samples: [u32; 2],
    /// Requested number of samples per pixel; null with a target error.
    pub of: Option<u32>,
    /// Latest error estimate; null before the first.
    pub error: Option<Uncertainty>,
    /// Whether the picture has no random error, so that no error is estimated.
    pub exact: bool,
    /// Each error estimate: seconds of rendering, least samples per pixel, root relMSE, and the
    /// ends of its interval.
    pub history: Vec<[f64; 5]>,
    pub rays_per_second: f64,
    /// Seconds of rendering so far.
    pub seconds: f64,
    /// Estimated seconds of rendering until the picture is finished; null where unknown.
    pub seconds_left: Option<f64>,
    /// Milliseconds from the page's request to its first preview.
    pub first_ms: f64,
    /// Target error that ends the render, if any.
    pub max_error: Option<f64>,
    /// SHA-256 hash of the finished picture's pixels, as `--hash` prints it.
    pub hash: Option<String>,
}

/// Length in seconds that the page offers for a scene file with time expressions that states no
/// period.
const DEFAULT_LENGTH: f64 = 10.0;

/// Describes the displayed scene, from which the page offers choices: `at` is the time of the
/// animation that the picture shows, `seconds` the animation's length, null for a static scene;
/// `fits_page` whether the picture takes the size of its place in the page.
pub fn scene_status(subject: &ViewedScene) -> Value {
    let ViewedScene { loaded, plan, .. } = subject;
    let (scene, contents) = (&loaded.scene, &loaded.contents);
    let options = subject.load_options();
    let seconds = loop_seconds(loaded, options.model.animation.as_deref())
        .or(depends_on_time(loaded).then_some(DEFAULT_LENGTH));
    let cameras: Vec<&String> = scene.cameras.iter().map(|camera| &camera.name).collect();
    let animations: Vec<&String> = contents.animations.iter().map(|item| &item.name).collect();
    let notes: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    json!({
        "name": loaded.source.name,
        "fits_page": loaded.source.format.is_model(),
        "cameras": cameras,
        "scenes": contents.scenes,
        "variants": contents.variants,
        "animations": animations,
        "parameters": scene.parameters,
        "at": options.overrides.time.unwrap_or(scene.t),
        "seconds": seconds,
        "camera": camera_status(plan.settings.camera.as_ref(), subject.bounding_sphere),
        "exposure": plan.display.exposure_stops,
        "tonemap": origin::variant_name(&plan.display.tone_map),
        "denoise": plan.settings.denoise,
        "notes": notes,
    })
}

/// Converts a camera to eye, target and up vector. A camera given by its axes has no target; its
/// target is placed at the distance of the scene's centre. `fov` is the vertical field of view in
/// degrees: approximate if the camera states a horizontal one, null for parallel projections, which
/// have a height of the view instead.
fn camera_status(camera: Option<&Camera>, (middle, radius): ([f64; 3], f64)) -> Value {
    let upright = [0.0, 1.0, 0.0];
    let Some(camera) = camera else {
        return json!({ "eye": [0.0, 0.0, 1.0], "target": [0.0, 0.0, 0.0], "up": upright, "fov": null, "height": 1.0 });
    };
    let (eye, target, up) = match camera.pose {
        Pose::LookAt { eye, target, up } => (eye, target, up),
        Pose::Orbit { target, .. } => (camera.pose.eye().into(), target, upright),
        Pose::Axes { eye, back, .. } => {
            let ahead = -DVec3::from(back);
            let distance = (DVec3::from(middle) - DVec3::from(eye)).dot(ahead);
            let is_ahead = distance > 0.01 * radius;
            let distance = if is_ahead { distance } else { radius };
            let target = DVec3::from(eye) + distance * ahead;
            (eye, target.into(), upright)
        }
    };
    let mut height = None;
    let fov = match &camera.projection {
        Projection::Orthographic { height: own } => {
            height = Some(own);
            None
        }
        Projection::Pinhole(pinhole) | Projection::ThinLens { pinhole, .. } => {
            Some(match *pinhole {
                Pinhole {
                    vertical_fov: Some(fov),
                    ..
                } => fov,
                Pinhole {
                    focal_length: Some(length),
                    ..
                } => 2.0 * libm::atan(0.5 / length).to_degrees(),
                Pinhole { horizontal_fov, .. } => horizontal_fov.unwrap_or(40.0) * 9.0 / 16.0,
            })
        }
    };
    json!({ "eye": eye, "target": target, "up": up, "fov": fov, "height": height })
}

/// Lists the effects that the scene has or that can be switched off, as `explain` lists them, each
/// with its name for `--without` (`word`) and the additional time of a render with it, as a share of
/// the time without it (`cost`; null before it is measured).
pub fn list_effect_switches(report: &EffectReport, costs: &BTreeMap<String, f64>) -> Vec<Value> {
    let switches = report.effects.iter().filter_map(|finding| {
        let can_switch = SWITCHABLE_EFFECTS.has(finding.effect);
        let status = match finding.status {
            EffectStatus::Simulated => "simulated",
            EffectStatus::Absent if !can_switch => return None,
            EffectStatus::Absent => "absent",
            EffectStatus::LeftOut => "left-out",
        };
        let name = finding.effect.name();
        Some(json!({
            "name": name,
            "word": name.replace(' ', "-"),
            "status": status,
            "because": finding.because,
            "can_switch": can_switch,
            "cost": costs.get(name),
        }))
    });
    switches.collect()
}
