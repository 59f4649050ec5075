//! What the page is told besides the picture, as JSON.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_core::effects::{EffectReport, SWITCHABLE, Status as EffectStatus};
use raywright_core::film::Uncertainty;
use raywright_core::scene::{Camera, Pinhole, Pose, Projection};
use raywright_io::Format;
use serde::Serialize;

use super::flags::Flag;
use super::subject::Subject;
use crate::origin;

/// See the fields of the page's script that have these names.
#[derive(Serialize)]
pub struct Status {
    /// How often something was told.
    pub told: u64,
    /// Which wish this is about.
    pub wish: u64,
    /// What is being done: `loading`, `rendering` or `done`.
    pub phase: &'static str,
    /// What is wrong with the last wish or the files, over the last picture.
    pub failure: Option<String>,
    /// What was done for the wish, and how long that took.
    pub said: String,
    /// The command that renders what is seen.
    pub command: String,
    pub flags: Vec<Flag>,
    pub layer: String,
    /// Number of the picture.
    pub picture: u64,
    /// Width and height of the picture in its own pixels.
    pub size: [u32; 2],
    pub progress: Option<RenderProgress>,
    pub scene: Option<SceneStatus>,
    pub effects: Vec<EffectSwitch>,
}

/// How far a render has come.
#[derive(Clone, Default, Serialize)]
pub struct RenderProgress {
    /// Fewest and most samples of a pixel, and how many there are to be; null where the error
    /// decides.
    pub samples: [u32; 2],
    pub of: Option<u32>,
    pub error: Option<Uncertainty>,
    /// Why there is no error to be told.
    pub exact: bool,
    /// Seconds, samples, and the error with its interval, at each estimate.
    pub history: Vec<[f64; 5]>,
    pub rays_per_second: f64,
    pub seconds: f64,
    pub seconds_left: Option<f64>,
    /// Milliseconds from the wish to its first picture.
    pub first_ms: f64,
    /// The error that ends the render, where one does.
    pub max_error: Option<f64>,
    /// SHA-256 of the finished picture, as `--hash` prints it.
    pub hash: Option<String>,
}

/// What there is to choose from in a scene.
#[derive(Serialize)]
pub struct SceneStatus {
    pub name: String,
    pub cameras: Vec<String>,
    pub scenes: Vec<String>,
    pub variants: Vec<String>,
    pub animations: Vec<String>,
    pub parameters: BTreeMap<String, f64>,
    pub at: f64,
    /// Seconds over which something moves; null where nothing does.
    pub seconds: Option<f64>,
    pub camera: CameraStatus,
    pub exposure: f64,
    pub tonemap: String,
    pub denoise: bool,
    pub notes: Vec<String>,
}

/// Where the camera is.
#[derive(Serialize)]
pub struct CameraStatus {
    pub eye: [f64; 3],
    pub target: [f64; 3],
    pub up: [f64; 3],
    /// Degrees, vertically, about; null of parallel rays.
    pub fov: Option<f64>,
}

/// An effect of the scene, as `explain` has it.
#[derive(Serialize)]
pub struct EffectSwitch {
    pub name: String,
    /// As `--without` takes it.
    pub word: String,
    pub status: &'static str,
    pub because: String,
    pub can_switch: bool,
    /// Share of the time that it adds, where that was measured.
    pub cost: Option<f64>,
}

/// Seconds of a scene of formulas, which has no end of its own.
const SECONDS: f64 = 10.0;

impl SceneStatus {
    /// Of what is looked at.
    pub fn of(subject: &Subject) -> Self {
        let Subject { loaded, plan, .. } = subject;
        let contents = &loaded.contents;
        let moves = match loaded.source.format {
            Format::Native(_) => loaded
                .source
                .text
                .as_deref()
                .is_some_and(mentions_time)
                .then_some(SECONDS),
            _ => contents
                .seconds(subject.options().model.animation.as_deref())
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
            at: subject.options().overrides.at.unwrap_or(loaded.scene.t),
            seconds: moves,
            camera: CameraStatus::of(plan.settings.camera.as_ref(), subject.reach),
            exposure: plan.display.exposure_stops,
            tonemap: origin::name(&plan.display.tone_map),
            denoise: plan.settings.denoise,
            notes: loaded
                .warnings
                .iter()
                .map(|warning| warning.message.clone())
                .collect(),
        }
    }
}

/// Whether the text of a scene has `t` among the words of a formula.
fn mentions_time(text: &str) -> bool {
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
    /// Eye, target and up of a camera; one that is given by its axes looks at what is as far away
    /// as the middle of everything.
    fn of(camera: Option<&Camera>, (middle, radius): ([f64; 3], f64)) -> Self {
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
            Pose::Orbit {
                target,
                distance,
                azimuth,
                elevation,
            } => {
                let (a, e) = (azimuth.to_radians(), elevation.to_radians());
                let back = DVec3::new(
                    libm::cos(e) * libm::sin(a),
                    libm::sin(e),
                    libm::cos(e) * libm::cos(a),
                );
                (
                    (DVec3::from(target) + distance * back).into(),
                    target,
                    [0.0, 1.0, 0.0],
                )
            }
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

/// The effects that a scene calls for, and those that are switched off.
pub fn switches(report: &EffectReport, costs: &BTreeMap<String, f64>) -> Vec<EffectSwitch> {
    let shown = report
        .effects
        .iter()
        .filter(|finding| finding.status != EffectStatus::Absent || SWITCHABLE.has(finding.effect));
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
            can_switch: SWITCHABLE.has(finding.effect),
            cost: costs.get(finding.effect.name()).copied(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a scene moves where a formula has the time in it, and not where a name or a
    /// comment has a t.
    #[test]
    fn scenes_that_move_are_told() {
        for text in ["a = \"0.15*sin(0.8*t)\"", "a = [0, \"t+1\", 0]"] {
            assert!(mentions_time(text), "{text}");
        }
        for text in ["# \"2*t\"", "name = \"t\"", "a = \"sin(tilt)\"", "t = 5"] {
            assert!(!mentions_time(text), "{text}");
        }
    }
}
