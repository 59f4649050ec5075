//! Validation of lights and of the sky.

use super::check::SceneCheck;
use crate::expr::ExprScope;
use crate::scene::{ColourInput, Falloff, Light, LightKind, Sky, Sun};

pub(super) fn check_light(check: &mut SceneCheck<'_>, light: &Light) {
    match light.kind {
        LightKind::Point {
            falloff: Falloff::InverseSquare,
            ..
        }
        | LightKind::Spot {
            falloff: Falloff::InverseSquare,
            ..
        } => {
            check.require_intensity("colour", light.colour);
        }
        _ => check.require_not_negative_colour("colour", light.colour),
    }
    check.with_key("kind", |check| match light.kind {
        LightKind::Directional { to_light } => {
            check.require_direction("directional.to_light", to_light);
        }
        LightKind::Point {
            position, range, ..
        } => check.with_key("point", |check| {
            check.require_point("position", position);
            check.require_optional_length("range", range);
        }),
        LightKind::Spot {
            position,
            direction,
            inner_angle,
            outer_angle,
            range,
            ..
        } => {
            check.with_key("spot", |check| {
                check.require_point("position", position);
                check.require_direction("direction", direction);
                check.require_within("inner_angle", inner_angle, 0.0, 90.0);
                check.with_key("outer_angle", |check| {
                    check.require_within("", outer_angle, 0.0, 90.0);
                    if outer_angle < inner_angle {
                        check.report("", format!(
                        "`outer_angle` must not be below `inner_angle`, which is {inner_angle}"
                    ));
                    } else if outer_angle == 0.0 {
                        check.report(
                            "",
                            "`outer_angle` must be above 0: a cone with the angle 0 emits no light",
                        );
                    }
                });
                check.require_optional_length("range", range);
            })
        }
    });
}

pub(super) fn check_sky(check: &mut SceneCheck<'_>, sky: &Sky) {
    match sky {
        Sky::Constant(colour) => check.require_not_negative_colour("constant", *colour),
        Sky::Gradient { bottom, top, suns } => check.with_key("gradient", |check| {
            check.require_not_negative_colour("bottom", *bottom);
            check.require_not_negative_colour("top", *top);
            check.check_each_element("suns", suns, check_sun);
        }),
        Sky::Expression(input) => check.with_key("expression", |check| match input {
            ColourInput::Constant(colour) => check.require_not_negative_colour("", *colour),
            ColourInput::Expression(source) => {
                check.check_colour_expression(source, ExprScope::Sky)
            }
            ColourInput::Texture(_) | ColourInput::Checker(_) => {
                let hint = "for an environment map write `map = { image = \"…\" }`";
                check.report_with_hint(
                    "",
                    "a sky has no surface, so it cannot have a texture or a checkerboard",
                    hint,
                );
            }
        }),
        Sky::Map(map) => check.with_key("map", |check| {
            check.check_reference("image", &map.image, "image", |names| &names.images);
            check.require_finite("rotation", map.rotation);
            check.require_not_negative("strength", map.strength);
        }),
        Sky::Studio(studio) => check.with_key("studio", |check| {
            check.require_finite("rotation", studio.rotation);
            check.require_not_negative("strength", studio.strength);
            check.require_not_negative("backdrop", studio.backdrop.unwrap_or(0.0));
        }),
    }
}

fn check_sun(check: &mut SceneCheck<'_>, sun: &Sun) {
    check.require_direction("direction", sun.direction);
    check.require_not_negative_colour("colour", sun.colour);
    check.require_not_negative("weight", sun.weight);
    check.require_count_within("exponent", sun.exponent, 1, 65536);
}
