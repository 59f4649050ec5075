//! Materials of both families, and the inputs that vary over a surface.

use super::check::Check;
use crate::expr::Scope;
use crate::scene::{
    AlphaMode, Bounds, Classic, Colour, ColourInput, ConstantValue, FieldValue, Fields,
    MOST_UV_SETS, Mixture, Model, Physical, TextureRef, TransmissionChoice, Weight,
};

pub(super) fn model(check: &mut Check<'_>, model: &Model) {
    match model {
        Model::Classic(material) => check.inside("classic", |check| {
            classic(check, material);
            traced(check, material);
        }),
        Model::Physical(material) => check.inside("physical", |check| physical(check, material)),
    }
}

/// Checks the terms that are evaluated at the hit.
fn classic(check: &mut Check<'_>, material: &Classic) {
    check.inside("colour", |check| colour_input(check, &material.colour));
    check.inside("local", |check| {
        weight(check, &material.local, Scope::Surface)
    });
    if let Some(ambient) = material.ambient {
        check.light("ambient", ambient);
    }
    check.inside("diffuse", |check| {
        weight(check, &material.diffuse, Scope::Light)
    });
    if let Some(specular) = &material.specular {
        check.inside("specular", |check| {
            check.count("exponent", specular.exponent, 1, 65536);
            check.inside("strength", |check| {
                weight(check, &specular.strength, Scope::Light)
            });
        });
    }
    if let Some(rim) = &material.rim {
        check.inside("rim", |check| {
            check.inside("strength", |check| {
                weight(check, &rim.strength, Scope::Surface)
            });
            check.count("exponent", rim.exponent, 1, 64);
        });
    }
    if let Some(emission) = &material.emission {
        check.inside("emission", |check| colour_input(check, emission));
    }
    if let Some(m) = &material.mixture {
        check.inside("mixture", |check| mixture(check, m));
    }
    check.within(
        "shadow_transmittance",
        material.shadow_transmittance,
        0.0,
        1.0,
    );
    if let Some(shadow) = &material.shadow {
        check.inside("shadow", |check| weight(check, shadow, Scope::Light));
    }
}

fn mixture(check: &mut Check<'_>, m: &Mixture) {
    check.within("specular_chance", m.specular_chance, 0.0, 1.0);
    check.light("specular_colour", m.specular_colour);
    check.within("specular_roughness", m.specular_roughness, 0.0, 1.0);
    check.within("refraction_chance", m.refraction_chance, 0.0, 1.0);
    if m.specular_chance + m.refraction_chance > 1.0 {
        let message = "`specular_chance` and `refraction_chance` together must be at most 1";
        check.inside("refraction_chance", |check| {
            check.advise(message, "what they leave is diffused")
        });
    }
    check.within("refraction_roughness", m.refraction_roughness, 0.0, 1.0);
    if let Some(ior) = m.ior {
        check.within("ior", ior, 1e-3, 1e3);
    }
    check.light("absorption", m.absorption);
}

/// Checks the terms that spawn rays.
fn traced(check: &mut Check<'_>, material: &Classic) {
    if material.reflection.is_some() && material.transmission.is_some() {
        let message =
            "a material with `transmission` reflects already, so it cannot have `reflection` too";
        check.inside("reflection", |check| {
            check.advise(message, "remove one of the two")
        });
    }
    if let Some(reflection) = &material.reflection {
        check.inside("reflection", |check| {
            check.inside("weight", |check| {
                weight(check, &reflection.weight, Scope::Light)
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
        check.inside("transmission", |check| {
            check.within("ior", transmission.ior, 1e-3, 1e3);
            if let TransmissionChoice::Switch { threshold } = transmission.choice {
                check.within("choice.switch.threshold", threshold, 0.0, 1.0);
            }
            check.light("reflected_tint", transmission.reflected_tint);
            check.light("refracted_tint", transmission.refracted_tint);
        });
    }
}

fn physical(check: &mut Check<'_>, material: &Physical) {
    for field in material.fields() {
        check.inside(field, |check| {
            varying(check, field.value);
            bounded(check, field.value.constant_value(), field.bounds);
        });
    }
    if material.priority > 0 && material.thin_walled {
        check.inside("priority", |check| {
            check.report("a thin wall has no inside that could have a priority")
        });
    }
    if let AlphaMode::Mask { cutoff } = material.alpha {
        check.not_negative("alpha.mask.cutoff", cutoff);
    }
}

/// Checks a constant against its bounds.
fn bounded(check: &mut Check<'_>, constant: Option<ConstantValue>, bounds: Bounds) {
    match (constant, bounds) {
        (Some(ConstantValue::Number(number)), Bounds::Within(least, most)) => {
            check.within("", number, least, most)
        }
        (Some(ConstantValue::Number(number)), Bounds::ZeroOrWithin(least, most)) => {
            check.zero_or_within("", number, least, most)
        }
        (Some(ConstantValue::Number(number)), Bounds::Finite) => check.finite("", number),
        (Some(ConstantValue::Number(number)), Bounds::Length) => check.length("", number),
        (Some(ConstantValue::Colour(Colour(channels))), Bounds::Within(least, most)) => {
            for (i, channel) in channels.into_iter().enumerate() {
                check.element(i, |check| check.within("", channel, least, most));
            }
        }
        (Some(ConstantValue::Colour(colour)), Bounds::Light) => check.light("", colour),
        _ => {}
    }
}

fn weight(check: &mut Check<'_>, weight: &Weight, scope: Scope) {
    match weight {
        Weight::Number(value) => check.not_negative("", *value),
        Weight::Expression(source) => check.number_expression(source, scope),
    }
}

/// Checks an expression in place of a texture coordinate, which may have any sign.
fn coordinate(check: &mut Check<'_>, coordinate: &Weight) {
    match coordinate {
        Weight::Number(value) => check.finite("", *value),
        Weight::Expression(source) => check.coordinate_expression(source, Scope::Surface),
    }
}

fn colour_input(check: &mut Check<'_>, input: &ColourInput) {
    varying(check, input);
    if let Some(colour) = input.constant() {
        check.light("", colour);
    }
}

/// Checks an input that is not constant.
fn varying(check: &mut Check<'_>, input: &dyn FieldValue) {
    match input.expression() {
        Some((source, true)) => check.number_expression(source, Scope::Surface),
        Some((source, false)) => check.expression(source, Scope::Surface),
        None => {}
    }
    match input.texture() {
        Some(("", texture)) => texture_ref(check, texture),
        Some((key, texture)) => check.inside(key, |check| texture_ref(check, texture)),
        None => {}
    }
    if let Some(checker) = input.checker() {
        check.inside("checker", |check| {
            check.light("even", checker.even);
            check.light("odd", checker.odd);
            check.length("size", checker.size);
        });
    }
}

fn texture_ref(check: &mut Check<'_>, texture: &TextureRef) {
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
