//! Decisions before preparation: the integrator and the simulated effects, with reasons.

use std::borrow::Cow;

use super::detect::{choose_integrator, evaluate_effects};
use super::facts::EffectFacts;
use super::switch::remove_effects;
use super::{EffectAssessment, EffectReport, EffectSet, EffectStatus};
use crate::scene::{Integrator, Scene};
use crate::settings::Settings;

/// Decisions before preparation: integrator, simulated effects, and the scene without the effects
/// that are switched off.
pub(crate) struct RenderSetup<'a> {
    /// The scene, without the effects that are switched off.
    pub scene: Cow<'a, Scene>,
    /// The settings with the chosen integrator and the adapted camera. Effects that are switched
    /// off are removed from the camera.
    pub settings: Settings,
    /// Status and reason of every effect.
    pub effects: EffectReport,
}

impl<'a> RenderSetup<'a> {
    /// Chooses the integrator for a scene with these settings, and determines the simulated
    /// effects.
    pub fn new(scene: &'a Scene, settings: &Settings) -> Self {
        let (effect_facts, requested) = (
            EffectFacts::gather(scene, settings.camera.as_ref()),
            settings.integrator,
        );
        let integrator = if requested == Integrator::Auto {
            choose_integrator(&effect_facts)
        } else {
            requested
        };
        let paths = integrator == Integrator::Path;
        let mut settings = Settings {
            integrator,
            ..settings.clone()
        };
        let mut findings = evaluate_effects(&effect_facts, &settings, paths);
        let mut rest = Cow::Borrowed(scene);
        if !settings.without.is_empty() {
            let (scene, camera) = remove_effects(scene, &settings.camera, settings.without);
            settings.camera = camera;
            let remaining = evaluate_effects(
                &EffectFacts::gather(&scene, settings.camera.as_ref()),
                &settings,
                paths,
            );
            for (finding, left) in findings.iter_mut().zip(remaining) {
                mark_if_switched_off(finding, left.status, settings.without);
            }
            rest = Cow::Owned(scene);
        }
        let because = integrator_reason(requested, paths, &findings).to_owned();
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

    /// Returns the chosen integrator.
    pub fn integrator(&self) -> Integrator {
        self.settings.integrator
    }
}

/// Returns the status of every effect of a scene under these settings, with the reasons.
pub fn assess_effects(scene: &Scene, settings: &Settings) -> EffectReport {
    RenderSetup::new(scene, settings).effects
}

/// Returns the integrator that renders a scene with these settings: the requested integrator, or
/// the one that suits the scene.
pub(crate) fn chosen_integrator(scene: &Scene, settings: &Settings) -> Integrator {
    match settings.integrator {
        Integrator::Auto => {
            choose_integrator(&EffectFacts::gather(scene, settings.camera.as_ref()))
        }
        requested => requested,
    }
}

/// Returns the reason, for the report, why this integrator was chosen.
fn integrator_reason(
    requested: Integrator,
    paths: bool,
    findings: &[EffectAssessment],
) -> &'static str {
    match requested {
        Integrator::Whitted | Integrator::Path => "requested by flag or scene",
        Integrator::Auto if paths => "the scene has effects that only path tracing simulates",
        Integrator::Auto if findings.iter().any(|f| f.status == EffectStatus::LeftOut) => {
            "no effect of the scene needs path tracing; the list shows which effects are left out"
        }
        Integrator::Auto => "Whitted ray tracing simulates every effect of the scene",
    }
}

/// Changes the status of an effect to left out in two cases: `off` contains the effect, or the
/// scene no longer needs it once all effects of `off` are removed. `left` is the effect's status in
/// the scene without the effects of `off`.
fn mark_if_switched_off(finding: &mut EffectAssessment, left: EffectStatus, off: EffectSet) {
    let named = off.has(finding.effect);
    if finding.status == EffectStatus::Absent || !named && left != EffectStatus::Absent {
        return;
    }
    finding.status = EffectStatus::LeftOut;
    finding.because = if named {
        "switched off"
    } else {
        "another effect is switched off, which removes the cause of this effect from the scene"
    }
    .to_owned();
    finding.hint = Some("remove the effect from --without".to_owned());
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::facts::WALKS;
    use super::*;
    use crate::dispatch;
    use crate::effects::Effect;

    /// Protects: a run traverses the scene once for its effects, whoever chooses the integrator,
    /// and the reduced scene once where effects are switched off: not again for the memory
    /// estimate, the integrator or preparation.
    #[test]
    fn a_run_walks_the_scene_once() {
        let scene: Scene = serde_json::from_value(json!({
            "format": 1,
            "lights": [{ "kind": { "directional": { "to_light": [0, 0, 1] } }, "colour": 1 }],
            "materials": [{ "name": "paint", "model": { "physical": { "clearcoat": {} } } }],
            "objects": [{ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "paint" }],
        }))
        .expect("a scene");
        let off = EffectSet::from_effects(&[Effect::Clearcoat]);
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
                ..Settings::from_scene(&scene)
            };
            let ready = dispatch::prepare(&scene, &settings, &()).expect("it can be prepared");
            assert_eq!(
                (
                    WALKS.get(),
                    ready.effects().status(Effect::Clearcoat) == EffectStatus::Simulated
                ),
                (walks, without.is_empty())
            );
        }
    }
}
