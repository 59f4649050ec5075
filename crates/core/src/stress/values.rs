//! Values of a material at a hit: whether they are finite, and a base colour above 1.

use raywright_bvh::{Real, Vector};

use crate::interaction::Interaction;
use crate::prepare::{PreparedMaterial, PreparedScene};

/// Class of a material's values at a hit; if several hold, the worst.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MaterialValueClass {
    Fine,
    /// The base colour, above 1 in its greatest channel.
    ColourAboveOne(f64),
    /// The name in the scene file of a value that is not finite.
    NotNumbers(&'static str),
}

/// End of a colour's range, slightly above 1 to allow for rounding.
const MAX_IN_RANGE: f64 = 1.0 + 1e-5;

/// Returns the class of the material's values at a hit.
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
        return MaterialValueClass::NotNumbers(key);
    }
    let colour = match material {
        PreparedMaterial::Physical(_) => shares[0].1.into_iter().fold(0.0, f64::max),
        _ => 0.0,
    };
    match colour > MAX_IN_RANGE {
        true => MaterialValueClass::ColourAboveOne(colour),
        false => MaterialValueClass::Fine,
    }
}
