//! Lights and the sky.

use super::check::Check;
use crate::expr::Scope;
use crate::scene::{ColourInput, Falloff, Light, LightKind, Sky, Sun};

pub(super) fn light(check: &mut Check<'_>, light: &Light) {
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
    check.inside("kind", |check| match light.kind {
        LightKind::Directional { to_light } => {
            check.direction("directional.to_light", to_light);
        }
        LightKind::Point {
            position, range, ..
        } => check.inside("point", |check| {
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
        } => check.inside("spot", |check| {
            check.point("position", position);
            check.direction("direction", direction);
            check.within("inner_angle", inner_angle, 0.0, 90.0);
            check.inside("outer_angle", |check| {
                check.within("", outer_angle, 0.0, 90.0);
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

fn reach(check: &mut Check<'_>, range: Option<f64>) {
    if let Some(range) = range {
        check.length("range", range);
    }
}

pub(super) fn sky(check: &mut Check<'_>, sky: &Sky) {
    match sky {
        Sky::Constant(colour) => check.light("constant", *colour),
        Sky::Gradient { bottom, top, suns } => check.inside("gradient", |check| {
            check.light("bottom", *bottom);
            check.light("top", *top);
            check.each("suns", suns, sun);
        }),
        Sky::Expression(input) => check.inside("expression", |check| match input {
            ColourInput::Constant(colour) => check.light("", *colour),
            ColourInput::Expression(source) => check.expression(source, Scope::Sky),
            ColourInput::Texture(_) | ColourInput::Checker(_) => {
                let hint = "for a picture of the surroundings write `map = { image = \"…\" }`";
                check.advise(
                    "a sky has no surface for a texture or checkerboard to lie on",
                    hint,
                );
            }
        }),
        Sky::Map(map) => check.inside("map", |check| {
            check.refers("image", &map.image, "image", |names| &names.images);
            check.finite("rotation", map.rotation);
            check.not_negative("strength", map.strength);
        }),
        Sky::Studio(studio) => check.inside("studio", |check| {
            check.finite("rotation", studio.rotation);
            check.not_negative("strength", studio.strength);
            check.not_negative("backdrop", studio.backdrop.unwrap_or(0.0));
        }),
    }
}

fn sun(check: &mut Check<'_>, sun: &Sun) {
    check.direction("direction", sun.direction);
    check.light("colour", sun.colour);
    check.not_negative("weight", sun.weight);
    check.count("exponent", sun.exponent, 1, 65536);
}
