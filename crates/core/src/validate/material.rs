//! Validation of classic and physical materials, and of inputs that vary over a surface.

use super::check::SceneCheck;
use crate::expr::ExprScope;
use crate::scene::{
    AlphaMode, Boundary, ClassicMaterial, Colour, ColourInput, ConstantValue, FieldBounds,
    FieldValue, MOST_UV_SETS, MaterialFields, MaterialModel, Medium, Mixture, Physical,
    ScalarFactor, TextureRef, TransmissionChoice,
};

pub(super) fn check_material_model(check: &mut SceneCheck<'_>, model: &MaterialModel) {
    match model {
        MaterialModel::Classic(material) => check.with_key("classic", |check| {
            check_classic_terms(check, material);
            check_traced_terms(check, material);
        }),
        MaterialModel::Physical(material) => {
            check.with_key("physical", |check| check_physical(check, material))
        }
    }
}

/// Checks the terms of a classic material that need no further rays.
fn check_classic_terms(check: &mut SceneCheck<'_>, material: &ClassicMaterial) {
    check_colour_input(check, "colour", &material.colour);
    check_weight_factor(check, "local", &material.local, ExprScope::Surface);
    if let Some(ambient) = material.ambient {
        check.require_not_negative_colour("ambient", ambient);
    }
    check_weight_factor(check, "diffuse", &material.diffuse, ExprScope::Light);
    if let Some(specular) = &material.specular {
        check.with_key("specular", |check| {
            check.require_count_within("exponent", specular.exponent, 1, 65536);
            check_weight_factor(check, "strength", &specular.strength, ExprScope::Light);
        });
    }
    if let Some(rim) = &material.rim {
        check.with_key("rim", |check| {
            check_weight_factor(check, "strength", &rim.strength, ExprScope::Surface);
            check.require_count_within("exponent", rim.exponent, 1, 64);
        });
    }
    if let Some(emission) = &material.emission {
        check_colour_input(check, "emission", emission);
    }
    if let Some(m) = &material.mixture {
        check.with_key("mixture", |check| check_mixture(check, m));
    }
    check.require_within(
        "shadow_transmittance",
        material.shadow_transmittance,
        0.0,
        1.0,
    );
    if let Some(shadow) = &material.shadow {
        check_weight_factor(check, "shadow", shadow, ExprScope::Light);
    }
}

fn check_mixture(check: &mut SceneCheck<'_>, m: &Mixture) {
    check.require_within("specular_chance", m.specular_chance, 0.0, 1.0);
    check.require_not_negative_colour("specular_colour", m.specular_colour);
    check.require_within("specular_roughness", m.specular_roughness, 0.0, 1.0);
    check.require_within("refraction_chance", m.refraction_chance, 0.0, 1.0);
    if m.specular_chance + m.refraction_chance > 1.0 {
        let message = "`specular_chance` and `refraction_chance` together must be at most 1";
        check.report_with_hint("refraction_chance", message, "reduce one of the two probabilities; 1 minus both is the probability of diffuse reflection");
    }
    check.require_within("refraction_roughness", m.refraction_roughness, 0.0, 1.0);
    if let Some(ior) = m.ior {
        check.require_within("ior", ior, 1e-3, 1e3);
    }
    check.require_not_negative_colour("absorption", m.absorption);
}

/// Checks the terms of a classic material that spawn rays.
fn check_traced_terms(check: &mut SceneCheck<'_>, material: &ClassicMaterial) {
    if material.reflection.is_some() && material.transmission.is_some() {
        let message = "`transmission` includes a reflection, so a material cannot have `reflection` and `transmission`";
        check.report_with_hint(
            "reflection",
            message,
            "remove `reflection` or `transmission`",
        );
    }
    if let Some(reflection) = &material.reflection {
        check.with_key("reflection", |check| {
            check_weight_factor(check, "weight", &reflection.weight, ExprScope::Light);
            if let Some(fuzz) = &reflection.fuzz {
                check.require_finite("fuzz.amount", fuzz.amount);
                check.check_each_element("fuzz.frequencies", &fuzz.frequencies, |check, row| {
                    check.require_point("", *row)
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
            check.require_not_negative_colour("reflected_tint", transmission.reflected_tint);
            check.require_not_negative_colour("refracted_tint", transmission.refracted_tint);
        });
    }
}

fn check_physical(check: &mut SceneCheck<'_>, material: &Physical) {
    check_fields(check, material);
    if material.priority > 0 && material.thin_walled {
        check.report("priority", "a thin wall has no inside, so it cannot have a `priority`: remove `priority` or `thin_walled`");
    }
    if let AlphaMode::Mask { cutoff } = material.alpha {
        check.require_not_negative("alpha.mask.cutoff", cutoff);
    }
    check_body(check, material);
}

/// Checks the interior and the boundary of a body.
fn check_body(check: &mut SceneCheck<'_>, material: &Physical) {
    if material.boundary == Boundary::None {
        check.with_key("boundary", |check| {
            if material.thin_walled {
                check.report("", "a thin wall has no inside, so its `boundary` is its surface: remove `boundary` or `thin_walled`");
            }
            if material.active_emission().is_some() {
                check.report("", "a body without a surface emits no light: remove `boundary` or `emission`");
            }
        });
    }
    let Some(medium) = &material.interior else {
        return;
    };
    check.with_key("interior", |check| {
        check_medium(check, medium);
        if medium.radius.is_some() {
            check.report("radius", "a body ends at its boundary; `radius` is a key of `air` alone: remove it");
        }
        if material.thin_walled {
            check.report("", "a thin wall has no inside, so it cannot have an `interior`: remove `interior` or `thin_walled`");
        } else if !material.bounds_body() {
            check.report_with_hint("",
                "light cannot enter the `interior` of an opaque surface",
                "set `transmission` above 0, or `boundary = \"none\"` for a body without a surface",
            );
        }
        if material.attenuation_distance.is_some() {
            check.report_with_hint("",
                "a body has an `interior` or an `attenuation_distance`, not both",
                "remove `attenuation_distance`, and give `absorption` in the `interior`",
            );
        }
    });
}

/// Checks the rules of a medium that bounds of its fields do not state.
pub(super) fn check_medium(check: &mut SceneCheck<'_>, medium: &Medium) {
    if medium.colour.is_some() != medium.distance.is_some() {
        check.report("", "`colour` and `distance` (metres) describe a medium together: give both, or `absorption` and `scattering` per metre");
    } else if medium.colour.is_some()
        && [medium.absorption, medium.scattering] != [Colour::BLACK; 2]
    {
        check.report("", "a medium has `colour` and `distance`, or `absorption` and `scattering`, not both: remove one pair");
    }
    check_weight_factor(check, "density", &medium.density, ExprScope::Medium);
}

/// Checks the inputs and the bounds of all fields of a material or a layer.
pub(super) fn check_fields(check: &mut SceneCheck<'_>, owner: &dyn MaterialFields) {
    for field in owner.fields() {
        check.with_key(field, |check| {
            check_varying_input(check, field.value);
            check_field_bounds(check, field.value.constant_value(), field.bounds);
        });
    }
}

/// Checks a constant value of a field against the bounds of the field.
fn check_field_bounds(
    check: &mut SceneCheck<'_>,
    constant: Option<ConstantValue>,
    bounds: FieldBounds,
) {
    use ConstantValue::Number;
    use FieldBounds::{Finite, Length, Light, Range, ZeroOrWithin};
    match (constant, bounds) {
        (Some(Number(number)), Range(minimum, maximum)) => {
            check.require_within("", number, minimum, maximum)
        }
        (Some(Number(number)), ZeroOrWithin(minimum, maximum)) => {
            check.require_zero_or_within("", number, minimum, maximum)
        }
        (Some(Number(number)), Finite) => check.require_finite("", number),
        (Some(Number(number)), Length) => check.require_length("", number),
        (Some(ConstantValue::Colour(Colour(channels))), Range(minimum, maximum)) => {
            check.check_each_element("", &channels, |check, channel| {
                check.require_within("", *channel, minimum, maximum)
            });
        }
        (Some(ConstantValue::Colour(colour)), Light) => {
            check.require_not_negative_colour("", colour)
        }
        _ => {}
    }
}

fn check_weight_factor(
    check: &mut SceneCheck<'_>,
    key: &str,
    weight: &ScalarFactor,
    scope: ExprScope,
) {
    match weight {
        ScalarFactor::Number(value) => check.require_not_negative(key, *value),
        ScalarFactor::Expression(source) => {
            check.with_key(key, |check| check.check_weight_expression(source, scope))
        }
    }
}

/// Checks a number or an expression that replaces a texture coordinate. It may have any sign.
fn check_coordinate(check: &mut SceneCheck<'_>, coordinate: &ScalarFactor) {
    match coordinate {
        ScalarFactor::Number(value) => check.require_finite("", *value),
        ScalarFactor::Expression(source) => {
            check.check_coordinate_expression(source, ExprScope::Surface)
        }
    }
}

fn check_colour_input(check: &mut SceneCheck<'_>, key: &str, input: &ColourInput) {
    check.with_key(key, |check| check_varying_input(check, input));
    if let Some(colour) = input.constant() {
        check.require_not_negative_colour(key, colour);
    }
}

/// Checks the expression, the texture or the checkerboard of an input.
fn check_varying_input(check: &mut SceneCheck<'_>, input: &dyn FieldValue) {
    match input.expression() {
        Some((source, true)) => check.check_weight_expression(source, ExprScope::Surface),
        Some((source, false)) => check.check_colour_expression(source, ExprScope::Surface),
        None => {}
    }
    if let Some((key, texture)) = input.texture() {
        check.with_key(key, |check| check_texture_ref(check, texture));
    }
    if let Some(checker) = input.checker() {
        check.with_key("checker", |check| {
            check.require_not_negative_colour("even", checker.even);
            check.require_not_negative_colour("odd", checker.odd);
            check.require_length("size", checker.size);
        });
    }
}

fn check_texture_ref(check: &mut SceneCheck<'_>, texture: &TextureRef) {
    check.check_reference("name", &texture.name, "texture", |names| &names.textures);
    check.require_not_negative_colour("factor", texture.factor);
    check.require_count_within("uv_set", texture.uv_set, 0, MOST_UV_SETS as u32 - 1);
    if let Some(rows) = &texture.uv_transform {
        check.check_each_element("uv_transform", rows, |check, row| {
            check.require_point("", *row)
        });
    }
    if let Some(coordinates) = &texture.uv {
        check.check_each_element("uv", coordinates, check_coordinate);
    }
}
