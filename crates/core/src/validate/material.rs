//! Materials of both families, and the inputs that vary over a surface.

use super::check::Check;
use crate::expr::Scope;
use crate::scene::{
    AlphaMode, Classic, Colour, ColourInput, MOST_UV_SETS, Mixture, Model, NumberInput, Physical, TextureRef, TransmissionChoice,
    Varying, Weight,
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

/// The terms that are evaluated where the ray hits.
fn classic(check: &mut Check<'_>, material: &Classic) {
    check.inside("colour", |check| colour_input(check, &material.colour));
    check.inside("local", |check| weight(check, &material.local, Scope::Surface));
    if let Some(ambient) = material.ambient {
        check.colour("ambient", ambient);
    }
    check.inside("diffuse", |check| weight(check, &material.diffuse, Scope::Light));
    if let Some(specular) = &material.specular {
        check.inside("specular", |check| {
            check.count("exponent", specular.exponent, 1, 65536);
            check.inside("strength", |check| weight(check, &specular.strength, Scope::Light));
        });
    }
    if let Some(rim) = &material.rim {
        check.inside("rim", |check| {
            check.inside("strength", |check| weight(check, &rim.strength, Scope::Surface));
            check.count("exponent", rim.exponent, 1, 64);
        });
    }
    if let Some(emission) = &material.emission {
        check.inside("emission", |check| colour_input(check, emission));
    }
    if let Some(m) = &material.mixture {
        check.inside("mixture", |check| mixture(check, m));
    }
    check.within("shadow_transmittance", material.shadow_transmittance, 0.0, 1.0);
    if let Some(shadow) = &material.shadow {
        check.inside("shadow", |check| weight(check, shadow, Scope::Light));
    }
}

fn mixture(check: &mut Check<'_>, m: &Mixture) {
    check.within("specular_chance", m.specular_chance, 0.0, 1.0);
    check.colour("specular_colour", m.specular_colour);
    check.within("specular_roughness", m.specular_roughness, 0.0, 1.0);
    check.within("refraction_chance", m.refraction_chance, 0.0, 1.0);
    if m.specular_chance + m.refraction_chance > 1.0 {
        let message = "`specular_chance` and `refraction_chance` together must be at most 1";
        check.inside("refraction_chance", |check| check.advise(message, "what they leave is diffused"));
    }
    check.within("refraction_roughness", m.refraction_roughness, 0.0, 1.0);
    if let Some(ior) = m.ior {
        check.within("ior", ior, 1e-3, 1e3);
    }
    check.colour("absorption", m.absorption);
}

/// The terms that send further rays.
fn traced(check: &mut Check<'_>, material: &Classic) {
    if material.reflection.is_some() && material.transmission.is_some() {
        let message = "a material with `transmission` reflects already, so it cannot have `reflection` too";
        check.inside("reflection", |check| check.advise(message, "remove one of the two"));
    }
    if let Some(reflection) = &material.reflection {
        check.inside("reflection", |check| {
            check.inside("weight", |check| weight(check, &reflection.weight, Scope::Light));
            if let Some(fuzz) = &reflection.fuzz {
                check.finite("fuzz.amount", fuzz.amount);
                check.each("fuzz.frequencies", &fuzz.frequencies, |check, row| check.point("", *row));
            }
        });
    }
    if let Some(transmission) = &material.transmission {
        check.inside("transmission", |check| {
            check.within("ior", transmission.ior, 1e-3, 1e3);
            if let TransmissionChoice::Switch { threshold } = transmission.choice {
                check.within("choice.switch.threshold", threshold, 0.0, 1.0);
            }
            check.colour("reflected_tint", transmission.reflected_tint);
            check.colour("refracted_tint", transmission.refracted_tint);
        });
    }
}

fn physical(check: &mut Check<'_>, material: &Physical) {
    for (key, input) in material.inputs() {
        check.inside(key, |check| varying(check, input));
    }
    if let Some(colour) = material.base_colour.constant() {
        check.colour("base_colour", colour);
    }
    if let Some(colour) = material.emission.constant() {
        check.light("emission", colour);
    }
    let share = [0.0, 1.0];
    let numbers = [
        ("metallic", &material.metallic, share),
        ("roughness", &material.roughness, share),
        ("opacity", &material.opacity, share),
        ("ior", &material.ior, Physical::IOR),
        ("transmission", &material.transmission, share),
    ];
    for (key, number, [least, most]) in numbers {
        if let Some(number) = number.constant() {
            check.within(key, number, least, most);
        }
    }
    check.each("attenuation_colour", &material.attenuation_colour.0, |check, channel| check.within("", *channel, 0.0, 1.0));
    if let Some(distance) = material.attenuation_distance {
        check.length("attenuation_distance", distance);
    }
    if material.priority > 0 && material.thin_walled {
        check.inside("priority", |check| check.report("a thin wall has no inside that could have a priority"));
    }
    layers(check, material);
    check.finite("normal_scale", material.normal_scale);
    if let AlphaMode::Mask { cutoff } = material.alpha {
        check.not_negative("alpha.mask.cutoff", cutoff);
    }
}

/// What the factors of further layers may be.
fn layers(check: &mut Check<'_>, material: &Physical) {
    check.within("dispersion", material.dispersion, 0.0, 400.0);
    if let Some(number) = material.specular.constant() {
        check.within("specular", number, 0.0, 1.0);
    }
    if let Some(colour) = material.specular_colour.constant() {
        check.light("specular_colour", colour);
    }
    let share = |check: &mut Check<'_>, key: &str, number: &NumberInput| {
        if let Some(number) = number.constant() {
            check.within(key, number, 0.0, 1.0);
        }
    };
    let tint = |check: &mut Check<'_>, colour: &ColourInput| {
        if let Some(Colour(colour)) = colour.constant() {
            check.each("colour", &colour, |check, channel| check.within("", *channel, 0.0, 1.0));
        }
    };
    if let Some(conductor) = material.conductor {
        check.inside("conductor", |check| {
            check.each("n", &conductor.n.0, |check, n| check.within("", *n, 1e-3, 1e3));
            check.each("k", &conductor.k.0, |check, k| check.within("", *k, 0.0, 1e3));
        });
    }
    if let Some(layer) = &material.diffuse_transmission {
        check.inside("diffuse_transmission", |check| {
            share(check, "factor", &layer.factor);
            tint(check, &layer.colour);
        });
    }
    if let Some(layer) = &material.anisotropy {
        check.inside("anisotropy", |check| {
            share(check, "strength", &layer.strength);
            check.finite("rotation", layer.rotation);
        });
    }
    if let Some(layer) = &material.iridescence {
        check.inside("iridescence", |check| {
            share(check, "factor", &layer.factor);
            check.within("ior", layer.ior, Physical::IOR[0], Physical::IOR[1]);
            check.within("thinnest", layer.thinnest, 0.0, 1e6);
            if let Some(thickness) = layer.thickness.constant() {
                check.within("thickness", thickness, 0.0, 1e6);
            }
        });
    }
    if let Some(layer) = &material.sheen {
        check.inside("sheen", |check| {
            share(check, "roughness", &layer.roughness);
            tint(check, &layer.colour);
        });
    }
    if let Some(layer) = &material.clearcoat {
        check.inside("clearcoat", |check| {
            share(check, "factor", &layer.factor);
            share(check, "roughness", &layer.roughness);
            check.finite("normal_scale", layer.normal_scale);
        });
    }
}

fn weight(check: &mut Check<'_>, weight: &Weight, scope: Scope) {
    match weight {
        Weight::Number(value) => check.finite("", *value),
        Weight::Expression(source) => check.number_expression(source, scope),
    }
}

fn colour_input(check: &mut Check<'_>, input: &ColourInput) {
    varying(check, input);
    if let Some(colour) = input.constant() {
        check.colour("", colour);
    }
}

/// What holds for every input that is not the same everywhere.
fn varying(check: &mut Check<'_>, input: &dyn Varying) {
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
            check.colour("even", checker.even);
            check.colour("odd", checker.odd);
            check.length("size", checker.size);
        });
    }
}

fn texture_ref(check: &mut Check<'_>, texture: &TextureRef) {
    check.refers("name", &texture.name, "texture", |names| &names.textures);
    check.colour("factor", texture.factor);
    check.count("uv_set", texture.uv_set, 0, MOST_UV_SETS as u32 - 1);
    if let Some(rows) = &texture.uv_transform {
        check.each("uv_transform", rows, |check, row| check.point("", *row));
    }
    if let Some(coordinates) = &texture.uv {
        check.each("uv", coordinates, |check, coordinate| weight(check, coordinate, Scope::Surface));
    }
}
