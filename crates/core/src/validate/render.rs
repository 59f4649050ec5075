//! Validation of the picture's settings, the parameters, and the rules that classic materials
//! share.

use super::check::SceneCheck;
use crate::expr::parameter_name_problem;
use crate::scene::{ClassicRules, Render, Scene, SpawnRule};
use crate::settings::Settings;

pub(super) fn parameters(check: &mut SceneCheck<'_>, scene: &Scene) {
    check.finite("t", scene.t);
    check.with_key("parameters", |check| {
        for (name, value) in &scene.parameters {
            check.with_key(name, |check| match parameter_name_problem(name) {
                Some(reason) => check.advise(
                    format!("`{name}` cannot be the name of a parameter"),
                    reason,
                ),
                None => check.finite("", *value),
            });
        }
    });
}

pub(super) fn render(check: &mut SceneCheck<'_>, render: &Render) {
    check.each("size", &render.size, |check, side| {
        check.count("", *side, 1, Settings::MOST_EDGE)
    });
    check.count("samples", render.samples, 1, Settings::MOST_SAMPLES);
    check.count("max_depth", render.max_depth, 1, Settings::MOST_SEGMENTS);
    check.require_within("exposure", render.exposure, -64.0, 64.0);
    check.light("veil", render.veil);
}

pub(super) fn classic_rules(check: &mut SceneCheck<'_>, rules: &ClassicRules) {
    check.light("ambient", rules.ambient);
    if let Some(distance) = rules.shadow_max_distance {
        check.length("shadow_max_distance", distance);
    }
    if let SpawnRule::Constant(offsets) = rules.spawn {
        check.with_key("spawn.constant", |check| {
            check.not_negative("offset", offsets.offset);
            check.not_negative("camera_min", offsets.camera_min);
            check.not_negative("secondary_min", offsets.secondary_min);
            check.not_negative("shadow_min", offsets.shadow_min);
        });
    }
}
