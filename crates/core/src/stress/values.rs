//! Validity of a material's values at a hit: finite and within their range.

use raywright_bvh::{Real, Vector};

use crate::interaction::Interaction;
use crate::prepare::{PreparedMaterial, PreparedScene};

/// Validity of the values of a material at a hit, with the name of the invalid value in the scene
/// file. If several values are invalid, the worst case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MaterialValueClass {
    Fine,
    OutOfRange { key: &'static str, value: f64 },
    NotNumbers { key: &'static str },
}

/// End of a value's range, slightly above 1 to allow for rounding.
const MAX_IN_RANGE: f64 = 1.0 + 1e-5;

/// Returns the validity of the material's values at a hit.
pub(super) fn classify_values<R: Real>(
    prepared: &PreparedScene<R>,
    interaction: &Interaction<R>,
) -> MaterialValueClass {
    let context = prepared.texture_tables.shading_context(interaction);
    let material = &prepared.materials[interaction.material as usize];
    let emission = (
        "emission",
        material.emission_at(&context).to_f64().to_array(),
    );
    let number = |key: &'static str, value: R| (key, [value.to_f64(); 3]);
    let shares = match material {
        PreparedMaterial::Classic(m) => vec![
            ("colour", m.colour.eval_colour(&context).to_f64().to_array()),
            number("local", m.local.eval_number(&context)),
        ],
        PreparedMaterial::Physical(m) => vec![
            (
                "base_colour",
                m.base_colour_at(&context).to_f64().to_array(),
            ),
            number("roughness", m.roughness.eval_number(&context)),
            number("metallic", m.metallic.eval_number(&context)),
            number("opacity", m.opacity.eval_number(&context)),
        ],
        PreparedMaterial::Unused => return MaterialValueClass::Fine,
    };
    let is_wrong = |(_, value): &&(&str, [f64; 3])| !value.iter().all(|x| x.is_finite());
    if let Some(&(key, _)) = shares.iter().chain([&emission]).find(is_wrong) {
        return MaterialValueClass::NotNumbers { key };
    }
    let greatest = |value: &[f64; 3]| value.iter().copied().fold(0.0, f64::max);
    let is_beyond = |(_, value): &&(&str, [f64; 3])| greatest(value) > MAX_IN_RANGE;
    match (material, shares.iter().find(is_beyond)) {
        (PreparedMaterial::Physical(_), Some((key, value))) => MaterialValueClass::OutOfRange {
            key,
            value: greatest(value),
        },
        _ => MaterialValueClass::Fine,
    }
}
