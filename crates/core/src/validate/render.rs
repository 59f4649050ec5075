//! Validation of a picture's settings, of the parameters, and of the rules that all classic
//! materials share.

use super::check::SceneCheck;
use crate::expr::find_parameter_name_problem;
use crate::scene::{ClassicRules, Parameter, ParameterRange, RenderSettings, Scene, SpawnRule};
use crate::settings::Settings;

pub(super) fn check_parameters(check: &mut SceneCheck<'_>, scene: &Scene) {
    check.require_finite("t", scene.t);
    if let Some(period) = scene.period {
        check.require_within("period", period, 1e-3, 1e9);
    }
    check.with_key("parameters", |check| {
        for (name, parameter) in &scene.parameters {
            check.with_key(name, |check| match find_parameter_name_problem(name) {
                Some(reason) => check.report_with_hint(
                    "",
                    format!("`{name}` cannot be the name of a parameter"),
                    reason,
                ),
                None => check_parameter(check, parameter),
            });
        }
    });
}

fn check_parameter(check: &mut SceneCheck<'_>, parameter: &Parameter) {
    check.require_finite("", parameter.value);
    let Some(ParameterRange { min, max, step }) = parameter.range else {
        return;
    };
    check.require_finite("min", min);
    check.require_finite("max", max);
    if min >= max {
        check.report(
            "",
            format!("`min` is {min}, which is not below `max`, {max}"),
        );
        return;
    }
    check.require_within("value", parameter.value, min, max);
    if step.is_some_and(|step| !(step > 0.0 && step <= max - min)) {
        check.report("", "`step` must be above 0, and at most `max` minus `min`");
    }
}

pub(super) fn check_render_settings(check: &mut SceneCheck<'_>, render: &RenderSettings) {
    check.check_each_element("size", &render.size, |check, side| {
        check.require_count_within("", *side, 1, Settings::MOST_EDGE)
    });
    check.require_count_within("samples", render.samples, 1, Settings::MOST_SAMPLES);
    check.require_count_within("max_depth", render.max_depth, 1, Settings::MOST_SEGMENTS);
    check.require_within("exposure", render.exposure, -64.0, 64.0);
    check.require_not_negative_colour("veil", render.veil);
}

pub(super) fn check_classic_rules(check: &mut SceneCheck<'_>, rules: &ClassicRules) {
    check.require_not_negative_colour("ambient", rules.ambient);
    check.require_optional_length("shadow_max_distance", rules.shadow_max_distance);
    if let SpawnRule::Constant(offsets) = rules.spawn {
        check.with_key("spawn.constant", |check| {
            check.require_not_negative("offset", offsets.offset);
            check.require_not_negative("camera_min", offsets.camera_min);
            check.require_not_negative("secondary_min", offsets.secondary_min);
            check.require_not_negative("shadow_min", offsets.shadow_min);
        });
    }
}
