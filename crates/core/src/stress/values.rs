//! Whether the values of a material at a point are numbers, and within their range.

use raywright_bvh::{Real, Vector};

use crate::interaction::Interaction;
use crate::prepare::{Material, Prepared};

/// What the values at a point are, by the worst of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Values {
    Fine,
    OutOfRange,
    NotNumbers,
}

/// A little above the end of a range: what rounding makes of one.
const ONE: f64 = 1.0 + 1e-5;

/// Judges the material of an interaction there.
pub(super) fn judge_values<R: Real>(prepared: &Prepared<R>, at: &Interaction<R>) -> Values {
    let here = prepared.sources.at(at);
    let material = &prepared.materials[at.material as usize];
    let emission = material.emission_at(&here).to_f64();
    let (colour, shares) = match material {
        Material::Classic(m) => (
            m.colour.colour(&here),
            [m.local.number(&here), R::ZERO, R::ZERO],
        ),
        Material::Physical(m) => (
            m.base_at(&here),
            [
                m.roughness.number(&here),
                m.metallic.number(&here),
                m.opacity.number(&here),
            ],
        ),
        Material::Unused => return Values::Fine,
    };
    let (colour, shares) = (colour.to_f64(), shares.map(Real::to_f64));
    if !colour.is_finite() || !emission.is_finite() || shares.iter().any(|share| !share.is_finite())
    {
        return Values::NotNumbers;
    }
    let is_physical = matches!(material, Material::Physical(_));
    let is_beyond =
        is_physical && (colour.max_element() > ONE || shares.iter().any(|&share| share > ONE));
    if is_beyond {
        Values::OutOfRange
    } else {
        Values::Fine
    }
}
