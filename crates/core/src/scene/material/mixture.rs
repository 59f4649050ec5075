//! A surface that reflects, transmits or diffuses each ray at random, as in a file.

use serde::{Deserialize, Serialize};

use super::super::input::{Colour, white};

/// A surface that mirrors, transmits or diffuses each ray, with probabilities given in the file;
/// the base colour tints the diffused light. With it, a family of well-known path-traced pictures
/// is data. Only path tracing reads it, in place of the other terms but `colour` and `emission`.
///
/// With h = unit(n + a uniform point of the unit sphere), m the mirrored and t the refracted
/// direction, the three directions are unit((1 − r²)·m + r²·h), unit((1 − q²)·t + q²·h') with h'
/// about −n, and h itself, for roughnesses r and q. Mirrored and refracted rays have no density, so
/// lights are not sampled for them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Mixture {
    /// Probability s of a mirrored ray, 0 to 1. Above zero and with an `ior` it becomes s + (1 −
    /// s)·F with Schlick's F.
    pub specular_chance: f64,
    /// Factor on the radiance of the mirrored ray.
    pub specular_colour: Colour,
    /// Roughness r, 0 to 1.
    pub specular_roughness: f64,
    /// Probability of a transmitted ray, 0 to 1 − `specular_chance`. Fresnel's increase of the
    /// mirrored probability reduces this probability and the diffuse one in proportion.
    pub refraction_chance: f64,
    /// Roughness q, 0 to 1.
    pub refraction_roughness: f64,
    /// Index of refraction of the inside over the outside, above zero; none: transmitted rays go
    /// straight on, without Fresnel.
    pub ior: Option<f64>,
    /// Absorption of the inside per metre, at least zero: light is multiplied by exp(−absorption ·
    /// distance).
    pub absorption: Colour,
    /// Whether throughput follows a published shader: divided by the probability of the chosen
    /// direction (at least 0.001), then normalised to a largest channel of one, where Russian
    /// roulette ends paths whose largest channel was below. This scales the light of mirrored and
    /// refracted rays.
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
