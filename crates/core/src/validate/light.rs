//! Validation of lights and of the sky.

use super::check::SceneCheck;
use crate::expr::ExprScope;
use crate::scene::{ColourInput, Falloff, Light, LightKind, Sky, Sun};

pub(super) fn light(check: &mut SceneCheck<'_>, light: &Light) {
    match light.kind {
        LightKind::Point {
            falloff: Falloff::InverseSquare,
            ..
        }
        | LightKind::Spot {
            falloff: Falloff::InverseSquare,
            ..
        } => {
            check.intensity("colour", light.colour);
        }
        _ => check.light("colour", light.colour),
    }
    check.with_key("kind", |check| match light.kind {
        LightKind::Directional { to_light } => {
            check.direction("directional.to_light", to_light);
        }
        LightKind::Point {
            position, range, ..
        } => check.with_key("point", |check| {
            check.point("position", position);
            reach(check, range);
        }),
        LightKind::Spot {
            position,
            direction,
            inner_angle,
            outer_angle,
            range,
            ..
        } => check.with_key("spot", |check| {
            check.point("position", position);
            check.direction("direction", direction);
            check.require_within("inner_angle", inner_angle, 0.0, 90.0);
            check.with_key("outer_angle", |check| {
                check.require_within("", outer_angle, 0.0, 90.0);
                if outer_angle < inner_angle {
                    check.report(format!(
                        "`outer_angle` must not be below `inner_angle`, which is {inner_angle}"
                    ));
                } else if outer_angle == 0.0 {
                    check.report("`outer_angle` must be above 0: such a cone is shut");
                }
            });
            reach(check, range);
        }),
    });
}

fn reach(check: &mut SceneCheck<'_>, range: Option<f64>) {
    if let Some(range) = range {
        check.length("range", range);
    }
}

pub(super) fn sky(check: &mut SceneCheck<'_>, sky: &Sky) {
    match sky {
        Sky::Constant(colour) => check.light("constant", *colour),
        Sky::Gradient { bottom, top, suns } => check.with_key("gradient", |check| {
            check.light("bottom", *bottom);
            check.light("top", *top);
            check.each("suns", suns, sun);
        }),
        Sky::Expression(input) => check.with_key("expression", |check| match input {
            ColourInput::Constant(colour) => check.light("", *colour),
            ColourInput::Expression(source) => check.expression(source, ExprScope::Sky),
            ColourInput::Texture(_) | ColourInput::Checker(_) => {
                let hint = "for a picture of the surroundings write `map = { image = \"…\" }`";
                check.advise(
                    "a sky has no surface for a texture or checkerboard to lie on",
                    hint,
                );
            }
        }),
        Sky::Map(map) => check.with_key("map", |check| {
            check.refers("image", &map.image, "image", |names| &names.images);
            check.finite("rotation", map.rotation);
            check.not_negative("strength", map.strength);
        }),
        Sky::Studio(studio) => check.with_key("studio", |check| {
            check.finite("rotation", studio.rotation);
            check.not_negative("strength", studio.strength);
            check.not_negative("backdrop", studio.backdrop.unwrap_or(0.0));
        }),
    }
}

fn sun(check: &mut SceneCheck<'_>, sun: &Sun) {
    check.direction("direction", sun.direction);
    check.light("colour", sun.colour);
    check.not_negative("weight", sun.weight);
    check.count("exponent", sun.exponent, 1, 65536);
}
