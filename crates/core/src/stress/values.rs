//! Whether the values of a material at a point are numbers, and within their range.

use raywright_bvh::{Real, Vector};

use crate::interaction::Interaction;
use crate::prepare::{Material, Prepared};

/// What the values at a point are, by the worst of them, with its key in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Values {
    Fine,
    OutOfRange { key: &'static str, value: f64 },
    NotNumbers { key: &'static str },
}

/// A little above the end of a range: what rounding makes of one.
const ONE: f64 = 1.0 + 1e-5;

/// Judges the material of an interaction there.
pub(super) fn judge_values<R: Real>(prepared: &Prepared<R>, at: &Interaction<R>) -> Values {
    let here = prepared.sources.at(at);
    let material = &prepared.materials[at.material as usize];
    let emission = ("emission", material.emission_at(&here).to_f64().to_array());
    let number = |key: &'static str, value: R| (key, [value.to_f64(); 3]);
    let shares = match material {
        Material::Classic(m) => vec![
            ("colour", m.colour.colour(&here).to_f64().to_array()),
            number("local", m.local.number(&here)),
        ],
        Material::Physical(m) => vec![
            ("base_colour", m.base_at(&here).to_f64().to_array()),
            number("roughness", m.roughness.number(&here)),
            number("metallic", m.metallic.number(&here)),
            number("opacity", m.opacity.number(&here)),
        ],
        Material::Unused => return Values::Fine,
    };
    let is_wrong = |(_, value): &&(&str, [f64; 3])| !value.iter().all(|x| x.is_finite());
    if let Some(&(key, _)) = shares.iter().chain([&emission]).find(is_wrong) {
        return Values::NotNumbers { key };
    }
    let greatest = |value: &[f64; 3]| value.iter().copied().fold(0.0, f64::max);
    let is_beyond = |(_, value): &&(&str, [f64; 3])| greatest(value) > ONE;
    match (material, shares.iter().find(is_beyond)) {
        (Material::Physical(_), Some((key, value))) => Values::OutOfRange {
            key,
            value: greatest(value),
        },
        _ => Values::Fine,
    }
}
