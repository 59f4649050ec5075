//! Validation of classic and physical materials, and of inputs that vary over a surface.

use super::check::SceneCheck;
use crate::expr::ExprScope;
use crate::scene::{
    AlphaMode, Classic, Colour, ColourInput, ConstantValue, FieldBounds, FieldValue, MOST_UV_SETS,
    MaterialFields, Mixture, Model, Physical, TextureRef, TransmissionChoice, Weight,
};

pub(super) fn model(check: &mut SceneCheck<'_>, model: &Model) {
    match model {
        Model::Classic(material) => check.with_key("classic", |check| {
            classic(check, material);
            traced(check, material);
        }),
        Model::Physical(material) => check.with_key("physical", |check| physical(check, material)),
    }
}

/// Checks the terms of a classic material that are evaluated at the hit.
fn classic(check: &mut SceneCheck<'_>, material: &Classic) {
    check.with_key("colour", |check| colour_input(check, &material.colour));
    check.with_key("local", |check| {
        weight(check, &material.local, ExprScope::Surface)
    });
    if let Some(ambient) = material.ambient {
        check.light("ambient", ambient);
    }
    check.with_key("diffuse", |check| {
        weight(check, &material.diffuse, ExprScope::Light)
    });
    if let Some(specular) = &material.specular {
        check.with_key("specular", |check| {
            check.count("exponent", specular.exponent, 1, 65536);
            check.with_key("strength", |check| {
                weight(check, &specular.strength, ExprScope::Light)
            });
        });
    }
    if let Some(rim) = &material.rim {
        check.with_key("rim", |check| {
            check.with_key("strength", |check| {
                weight(check, &rim.strength, ExprScope::Surface)
            });
            check.count("exponent", rim.exponent, 1, 64);
        });
    }
    if let Some(emission) = &material.emission {
        check.with_key("emission", |check| colour_input(check, emission));
    }
    if let Some(m) = &material.mixture {
        check.with_key("mixture", |check| mixture(check, m));
    }
    check.require_within(
        "shadow_transmittance",
        material.shadow_transmittance,
        0.0,
        1.0,
    );
    if let Some(shadow) = &material.shadow {
        check.with_key("shadow", |check| weight(check, shadow, ExprScope::Light));
    }
}

fn mixture(check: &mut SceneCheck<'_>, m: &Mixture) {
    check.require_within("specular_chance", m.specular_chance, 0.0, 1.0);
    check.light("specular_colour", m.specular_colour);
    check.require_within("specular_roughness", m.specular_roughness, 0.0, 1.0);
    check.require_within("refraction_chance", m.refraction_chance, 0.0, 1.0);
    if m.specular_chance + m.refraction_chance > 1.0 {
        let message = "`specular_chance` and `refraction_chance` together must be at most 1";
        check.with_key("refraction_chance", |check| {
            check.advise(message, "what they leave is diffused")
        });
    }
    check.require_within("refraction_roughness", m.refraction_roughness, 0.0, 1.0);
    if let Some(ior) = m.ior {
        check.require_within("ior", ior, 1e-3, 1e3);
    }
    check.light("absorption", m.absorption);
}

/// Checks the terms of a classic material that spawn rays.
fn traced(check: &mut SceneCheck<'_>, material: &Classic) {
    if material.reflection.is_some() && material.transmission.is_some() {
        let message =
            "a material with `transmission` reflects already, so it cannot have `reflection` too";
        check.with_key("reflection", |check| {
            check.advise(message, "remove one of the two")
        });
    }
    if let Some(reflection) = &material.reflection {
        check.with_key("reflection", |check| {
            check.with_key("weight", |check| {
                weight(check, &reflection.weight, ExprScope::Light)
            });
            if let Some(fuzz) = &reflection.fuzz {
                check.finite("fuzz.amount", fuzz.amount);
                check.each("fuzz.frequencies", &fuzz.frequencies, |check, row| {
                    check.point("", *row)
                });
            }
        });
    }
    if let Some(transmission) = &material.transmission {
        check.with_key("transmission", |check| {
            check.require_within("ior", transmission.ior, 1e-3, 1e3);
            if let TransmissionChoice::Switch { threshold } = transmission.choice {
                check.require_within("choice.switch.threshold", threshold, 0.0, 1.0);
            }
            check.light("reflected_tint", transmission.reflected_tint);
            check.light("refracted_tint", transmission.refracted_tint);
        });
    }
}

fn physical(check: &mut SceneCheck<'_>, material: &Physical) {
    for field in material.fields() {
        check.with_key(field, |check| {
            varying(check, field.value);
            bounded(check, field.value.constant_value(), field.bounds);
        });
    }
    if material.priority > 0 && material.thin_walled {
        check.with_key("priority", |check| {
            check.report("a thin wall has no inside that could have a priority")
        });
    }
    if let AlphaMode::Mask { cutoff } = material.alpha {
        check.not_negative("alpha.mask.cutoff", cutoff);
    }
}

/// Checks the value of a constant field against the field's bounds.
fn bounded(check: &mut SceneCheck<'_>, constant: Option<ConstantValue>, bounds: FieldBounds) {
    match (constant, bounds) {
        (Some(ConstantValue::Number(number)), FieldBounds::Within(minimum, maximum)) => {
            check.require_within("", number, minimum, maximum)
        }
        (Some(ConstantValue::Number(number)), FieldBounds::ZeroOrWithin(minimum, maximum)) => {
            check.require_zero_or_within("", number, minimum, maximum)
        }
        (Some(ConstantValue::Number(number)), FieldBounds::Finite) => check.finite("", number),
        (Some(ConstantValue::Number(number)), FieldBounds::Length) => check.length("", number),
        (Some(ConstantValue::Colour(Colour(channels))), FieldBounds::Within(minimum, maximum)) => {
            for (i, channel) in channels.into_iter().enumerate() {
                check.element(i, |check| {
                    check.require_within("", channel, minimum, maximum)
                });
            }
        }
        (Some(ConstantValue::Colour(colour)), FieldBounds::Light) => check.light("", colour),
        _ => {}
    }
}

fn weight(check: &mut SceneCheck<'_>, weight: &Weight, scope: ExprScope) {
    match weight {
        Weight::Number(value) => check.not_negative("", *value),
        Weight::Expression(source) => check.number_expression(source, scope),
    }
}

/// Checks a number or an expression in place of a texture coordinate, which may have any sign.
fn coordinate(check: &mut SceneCheck<'_>, coordinate: &Weight) {
    match coordinate {
        Weight::Number(value) => check.finite("", *value),
        Weight::Expression(source) => check.coordinate_expression(source, ExprScope::Surface),
    }
}

fn colour_input(check: &mut SceneCheck<'_>, input: &ColourInput) {
    varying(check, input);
    if let Some(colour) = input.constant() {
        check.light("", colour);
    }
}

/// Checks the expression, the texture or the checkerboard of an input.
fn varying(check: &mut SceneCheck<'_>, input: &dyn FieldValue) {
    match input.expression() {
        Some((source, true)) => check.number_expression(source, ExprScope::Surface),
        Some((source, false)) => check.expression(source, ExprScope::Surface),
        None => {}
    }
    match input.texture() {
        Some(("", texture)) => texture_ref(check, texture),
        Some((key, texture)) => check.with_key(key, |check| texture_ref(check, texture)),
        None => {}
    }
    if let Some(checker) = input.checker() {
        check.with_key("checker", |check| {
            check.light("even", checker.even);
            check.light("odd", checker.odd);
            check.length("size", checker.size);
        });
    }
}

fn texture_ref(check: &mut SceneCheck<'_>, texture: &TextureRef) {
    check.refers("name", &texture.name, "texture", |names| &names.textures);
    check.light("factor", texture.factor);
    check.count("uv_set", texture.uv_set, 0, MOST_UV_SETS as u32 - 1);
    if let Some(rows) = &texture.uv_transform {
        check.each("uv_transform", rows, |check, row| check.point("", *row));
    }
    if let Some(coordinates) = &texture.uv {
        check.each("uv", coordinates, coordinate);
    }
}
