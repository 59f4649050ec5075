//! Status of the viewer for the page, as JSON.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_core::effects::{EffectReport, EffectStatus, SWITCHABLE_EFFECTS};
use raywright_core::film::Uncertainty;
use raywright_core::scene::{Camera, Pinhole, Pose, Projection};
use raywright_io::SceneFormat;
use serde::Serialize;

use super::flags::Flag;
use super::viewed_scene::ViewedScene;
use crate::origin;

/// Status of the viewer, which the page's script reads as JSON by these names of fields.
#[derive(Serialize)]
pub struct ViewStatus {
    /// Number of the status, which rises with each change.
    pub told: u64,
    /// Number of the page's request that the status belongs to.
    pub wish: u64,
    /// Current activity: `rendering`, `done` or `failed`.
    pub phase: &'static str,
    /// Message of the last failure of a request or of the scene's files, which the page shows over
    /// the last picture.
    pub failure: Option<String>,
    /// Description of the work done for the request, and its duration.
    pub said: String,
    /// Command that renders the current view.
    pub command: String,
    pub flags: Vec<Flag>,
    pub layer: String,
    /// Number of the displayed picture.
    pub picture: u64,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    pub progress: Option<RenderProgress>,
    pub scene: Option<SceneStatus>,
    pub effects: Vec<EffectSwitch>,
}

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

/// Contents of the displayed scene, from which the page offers choices.
#[derive(Serialize)]
pub struct SceneStatus {
    pub name: String,
    pub cameras: Vec<String>,
    pub scenes: Vec<String>,
    pub variants: Vec<String>,
    pub animations: Vec<String>,
    pub parameters: BTreeMap<String, f64>,
    /// Time of the animation that the picture shows, in seconds.
    pub at: f64,
    /// Length of the animation in seconds; null for a static scene.
    pub seconds: Option<f64>,
    pub camera: CameraStatus,
    /// Exposure of the displayed picture in stops.
    pub exposure: f64,
    pub tonemap: String,
    pub denoise: bool,
    pub notes: Vec<String>,
}

/// Position and field of view of the displayed camera.
#[derive(Serialize)]
pub struct CameraStatus {
    pub eye: [f64; 3],
    pub target: [f64; 3],
    pub up: [f64; 3],
    /// Vertical field of view in degrees; approximate if the camera states a horizontal one, null
    /// for parallel projections.
    pub fov: Option<f64>,
}

/// An effect of the scene, as `explain` lists it, with its switch on the page.
#[derive(Serialize)]
pub struct EffectSwitch {
    pub name: String,
    /// Name of the effect for `--without`.
    pub word: String,
    pub status: &'static str,
    /// Reason for the status of the effect.
    pub because: String,
    /// Whether `--without` can switch the effect off.
    pub can_switch: bool,
    /// Additional time of a render with the effect, divided by the time of a render without the
    /// effect; null before a measurement.
    pub cost: Option<f64>,
}

/// Length in seconds that the page offers for a scene file with time expressions. The scene file
/// states no length.
const DEFAULT_LENGTH: f64 = 10.0;

impl SceneStatus {
    /// Collects the contents of the displayed scene.
    pub fn from_scene(subject: &ViewedScene) -> Self {
        let ViewedScene { loaded, plan, .. } = subject;
        let contents = &loaded.contents;
        let animation_seconds = match loaded.source.format {
            SceneFormat::Native(_) => loaded
                .source
                .text
                .as_deref()
                .is_some_and(contains_time_variable)
                .then_some(DEFAULT_LENGTH),
            _ => contents
                .animation_seconds(subject.load_options().model.animation.as_deref())
                .filter(|seconds| *seconds > 0.0),
        };
        Self {
            name: loaded.source.name.clone(),
            cameras: loaded
                .scene
                .cameras
                .iter()
                .map(|camera| camera.name.clone())
                .collect(),
            scenes: contents.scenes.clone(),
            variants: contents.variants.clone(),
            animations: contents
                .animations
                .iter()
                .map(|animation| animation.name.clone())
                .collect(),
            parameters: loaded.scene.parameters.clone(),
            at: subject
                .load_options()
                .overrides
                .time
                .unwrap_or(loaded.scene.t),
            seconds: animation_seconds,
            camera: CameraStatus::from_camera(
                plan.settings.camera.as_ref(),
                subject.bounding_sphere,
            ),
            exposure: plan.display.exposure_stops,
            tonemap: origin::variant_name(&plan.display.tone_map),
            denoise: plan.settings.denoise,
            notes: loaded
                .warnings
                .iter()
                .map(|warning| warning.message.clone())
                .collect(),
        }
    }
}

/// Whether an expression in the text of a scene file contains the variable `t`.
fn contains_time_variable(text: &str) -> bool {
    let formulas = text
        .lines()
        .filter(|line| !line.trim_start().starts_with('#'))
        .flat_map(|line| line.split('"').skip(1).step_by(2));
    formulas.filter(|formula| formula.len() > 1).any(|formula| {
        let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        formula.split(|c| !is_part(c)).any(|word| word == "t")
    })
}

impl CameraStatus {
    /// Converts a camera to eye, target and up vector. A camera given by its axes has no target;
    /// its target is placed at the distance of the scene's centre.
    fn from_camera(camera: Option<&Camera>, (middle, radius): ([f64; 3], f64)) -> Self {
        let Some(camera) = camera else {
            return Self {
                eye: [0.0, 0.0, 1.0],
                target: [0.0; 3],
                up: [0.0, 1.0, 0.0],
                fov: None,
            };
        };
        let (eye, target, up) = match camera.pose {
            Pose::LookAt { eye, target, up } => (eye, target, up),
            Pose::Orbit { target, .. } => (camera.pose.eye().into(), target, [0.0, 1.0, 0.0]),
            Pose::Axes { eye, back, .. } => {
                let ahead = -DVec3::from(back);
                let distance = (DVec3::from(middle) - DVec3::from(eye)).dot(ahead);
                let distance = if distance > 0.01 * radius {
                    distance
                } else {
                    radius
                };
                (
                    eye,
                    (DVec3::from(eye) + distance * ahead).into(),
                    [0.0, 1.0, 0.0],
                )
            }
        };
        let fov = match &camera.projection {
            Projection::Orthographic { .. } => None,
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
        Self {
            eye,
            target,
            up,
            fov,
        }
    }
}

/// Lists the effects of a scene for the page: all that are simulated, left out or can be switched
/// off.
pub fn list_effect_switches(
    report: &EffectReport,
    costs: &BTreeMap<String, f64>,
) -> Vec<EffectSwitch> {
    let shown = report.effects.iter().filter(|finding| {
        finding.status != EffectStatus::Absent || SWITCHABLE_EFFECTS.has(finding.effect)
    });
    shown
        .map(|finding| EffectSwitch {
            name: finding.effect.name().to_owned(),
            word: finding.effect.name().replace(' ', "-"),
            status: match finding.status {
                EffectStatus::Simulated => "simulated",
                EffectStatus::Absent => "absent",
                EffectStatus::LeftOut => "left-out",
            },
            because: finding.because.clone(),
            can_switch: SWITCHABLE_EFFECTS.has(finding.effect),
            cost: costs.get(finding.effect.name()).copied(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a scene is animated where an expression contains the time `t`, and not where a
    /// name or a comment contains that letter.
    #[test]
    fn scenes_that_move_are_told() {
        for text in ["a = \"0.15*sin(0.8*t)\"", "a = [0, \"t+1\", 0]"] {
            assert!(contains_time_variable(text), "{text}");
        }
        for text in ["# \"2*t\"", "name = \"t\"", "a = \"sin(tilt)\"", "t = 5"] {
            assert!(!contains_time_variable(text), "{text}");
        }
    }
}
