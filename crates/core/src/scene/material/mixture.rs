//! A surface that sends each ray one of three ways by chance: what a file says of it.

use serde::{Deserialize, Serialize};

use super::super::input::{Colour, white};

/// A surface that sends each ray one of three ways by chance, with chances that a file names:
/// mirrored, through, or diffused by the base colour. So that a family of well-known path-traced
/// pictures is data; only path tracing reads it, in place of the other terms but `colour` and
/// `emission`.
///
/// With h = unit(n + a point of the unit sphere, drawn evenly), m the mirrored and t the refracted
/// direction, the ways are unit((1 − r²)·m + r²·h), unit((1 − q²)·t + q²·h') with h' about −n, and
/// h itself, for roughnesses r and q. Mirrored and refracted rays have no density, so a light is
/// not asked for them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Mixture {
    /// Chance s of being mirrored, 0 to 1; above zero and with an `ior` it grows to s + (1 − s)·F
    /// by Schlick's F.
    pub specular_chance: f64,
    /// Factor of what the mirrored ray sees.
    pub specular_colour: Colour,
    /// Roughness r, 0 to 1.
    pub specular_roughness: f64,
    /// Chance of going through, 0 to 1 − `specular_chance`; what Fresnel adds to the chance of
    /// being mirrored is taken from it and from the rest alike.
    pub refraction_chance: f64,
    /// Roughness q, 0 to 1.
    pub refraction_roughness: f64,
    /// Index of refraction of the inside over the outside, above zero; none: nothing bends, and no
    /// Fresnel.
    pub ior: Option<f64>,
    /// What the inside absorbs, per metre, above or equal to zero: light is multiplied by
    /// exp(−absorption · distance).
    pub absorption: Colour,
    /// Whether, as in a published shader, throughput is divided by the chance of the way taken (at
    /// least 0.001) and then brought to a largest channel of one, where chance ends a path whose
    /// was below: this scales what mirrored and refracted rays bring.
    pub published_roulette: bool,
}

impl Default for Mixture {
    fn default() -> Self {
        Self {
            specular_chance: 0.0,
            specular_colour: white(),
            specular_roughness: 0.0,
            refraction_chance: 0.0,
            refraction_roughness: 0.0,
            ior: None,
            absorption: Colour::BLACK,
            published_roulette: false,
        }
    }
}
