//! What is settled of a render before anything is prepared: the integrator that runs, what it
//! simulates and why.

use std::borrow::Cow;

use super::detect::{called_for, found};
use super::facts::SceneFacts;
use super::switch::switched_off;
use super::{EffectReport, EffectSet, Finding, Status};
use crate::scene::{Integrator, Scene};
use crate::settings::Settings;

/// What is settled of a render before anything is prepared: made once, by one walk over the scene
/// (and one over what is left of it where effects are switched off), and handed down.
pub(crate) struct RenderSetup<'a> {
    /// The scene, without what is switched off.
    pub scene: Cow<'a, Scene>,
    /// The settings, with the integrator that runs and the camera without what is switched off.
    pub settings: Settings,
    /// What is simulated, and why.
    pub effects: EffectReport,
}

impl<'a> RenderSetup<'a> {
    /// What these settings make of a scene.
    pub fn new(scene: &'a Scene, settings: &Settings) -> Self {
        let (facts, asked) = (
            SceneFacts::gather(scene, settings.camera.as_ref()),
            settings.integrator,
        );
        let integrator = if asked == Integrator::Auto {
            called_for(&facts)
        } else {
            asked
        };
        let paths = integrator == Integrator::Path;
        let mut settings = Settings {
            integrator,
            ..settings.clone()
        };
        let mut findings = found(&facts, &settings, paths);
        let mut rest = Cow::Borrowed(scene);
        if !settings.without.is_empty() {
            let (scene, camera) = switched_off(scene, &settings.camera, settings.without);
            settings.camera = camera;
            let remaining = found(
                &SceneFacts::gather(&scene, settings.camera.as_ref()),
                &settings,
                paths,
            );
            for (finding, left) in findings.iter_mut().zip(remaining) {
                switch_off(finding, left.status, settings.without);
            }
            rest = Cow::Owned(scene);
        }
        let because = reason(asked, paths, &findings).to_owned();
        let effects = EffectReport {
            integrator: if paths { "path" } else { "whitted" },
            because,
            effects: findings,
        };
        Self {
            scene: rest,
            settings,
            effects,
        }
    }

    /// The integrator that runs.
    pub fn integrator(&self) -> Integrator {
        self.settings.integrator
    }
}

/// What the scene and the settings make of every effect.
pub fn detect(scene: &Scene, settings: &Settings) -> EffectReport {
    RenderSetup::new(scene, settings).effects
}

/// The integrator that runs.
pub(crate) fn chosen(scene: &Scene, settings: &Settings) -> Integrator {
    match settings.integrator {
        Integrator::Auto => called_for(&SceneFacts::gather(scene, settings.camera.as_ref())),
        asked => asked,
    }
}

/// Why an integrator runs, where these settings asked for one or for none.
fn reason(asked: Integrator, paths: bool, findings: &[Finding]) -> &'static str {
    match asked {
        Integrator::Whitted | Integrator::Path => "asked for",
        Integrator::Auto if paths => "the scene has what only paths find",
        Integrator::Auto if findings.iter().any(|f| f.status == Status::LeftOut) => {
            "the scene asks for no other; what it leaves out is listed"
        }
        Integrator::Auto => "the scene is exactly what Whitted ray tracing solves",
    }
}

/// Turns a finding of the whole scene into that of the scene without what was switched off, where
/// `left` is what it is.
fn switch_off(finding: &mut Finding, left: Status, off: EffectSet) {
    let named = off.has(finding.effect);
    if finding.status == Status::Absent || !named && left != Status::Absent {
        return;
    }
    finding.status = Status::LeftOut;
    finding.because = if named {
        "switched off"
    } else {
        "what calls for it is switched off"
    }
    .to_owned();
    finding.hint = Some("leave --without away".to_owned());
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::facts::WALKS;
    use super::*;
    use crate::dispatch;
    use crate::effects::Effect;

    /// Protects: a run walks the scene once for what it calls for, whoever chooses the integrator,
    /// and what is left of it once where effects are switched off: not anew for the estimate of
    /// memory, the integrator and preparation.
    #[test]
    fn a_run_walks_the_scene_once() {
        let scene: Scene = serde_json::from_value(json!({
            "format": 1,
            "lights": [{ "kind": { "directional": { "to_light": [0, 0, 1] } }, "colour": 1 }],
            "materials": [{ "name": "paint", "model": { "physical": { "clearcoat": {} } } }],
            "objects": [{ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "paint" }],
        }))
        .expect("a scene");
        let off = EffectSet::of(&[Effect::Clearcoat]);
        let runs = [
            (Integrator::Auto, EffectSet::EMPTY, 1),
            (Integrator::Path, EffectSet::EMPTY, 1),
            (Integrator::Auto, off, 2),
        ];
        for (integrator, without, walks) in runs {
            WALKS.set(0);
            let settings = Settings {
                integrator,
                without,
                ..Settings::of(&scene)
            };
            let ready = dispatch::prepare(&scene, &settings, &()).expect("it can be prepared");
            assert_eq!(
                (
                    WALKS.get(),
                    ready.effects().status(Effect::Clearcoat) == Status::Simulated
                ),
                (walks, without.is_empty())
            );
        }
    }
}
