//! The mixture of a classic material for path tracing, as in a scene file.

use serde::{Deserialize, Serialize};

use super::super::input::{Colour, default_white};

/// A surface that mirrors, transmits or diffuses each ray at random, with given probabilities, as
/// several well-known path-tracing shaders do. The base colour tints the diffused light. Only path
/// tracing uses the mixture, in place of all other terms except `colour` and `emission`.
///
/// Directions are computed with roughnesses r and q, the normal n, a uniform point s on the unit
/// sphere, the mirrored direction m and the refracted direction t. Let h = unit(n + s) and h' =
/// unit(−n + s). The mirrored ray has the direction unit((1 − r²)·m + r²·h). The transmitted ray
/// has the direction unit((1 − q²)·t + q²·h'). The diffused ray has the direction h. Mirrored and
/// transmitted rays have no density, so lights are not sampled for these rays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Mixture {
    /// Probability s of a mirrored ray, 0 to 1. If it is above zero and an `ior` is given, the
    /// probability becomes s + (1 − s)·F with Schlick's reflectance F.
    pub specular_chance: f64,
    /// Factor on the radiance of the mirrored ray.
    pub specular_colour: Colour,
    /// Roughness r of the mirrored ray, 0 to 1.
    pub specular_roughness: f64,
    /// Probability of a transmitted ray, 0 to 1 − `specular_chance`. Where Schlick's reflectance
    /// increases the probability of a mirrored ray, it reduces the probabilities of a transmitted
    /// and of a diffused ray in proportion.
    pub refraction_chance: f64,
    /// Roughness q of the transmitted ray, 0 to 1.
    pub refraction_roughness: f64,
    /// Index of refraction of the inside over the outside, above zero. None: transmitted rays go
    /// straight on, and Schlick's reflectance is not used.
    pub ior: Option<f64>,
    /// Absorption coefficient of the inside per metre, at least zero: light is multiplied by
    /// exp(−absorption · distance).
    pub absorption: Colour,
    /// Whether throughput and Russian roulette follow a published path-tracing shader instead of
    /// unbiased rules. The throughput is divided by the probability of the chosen ray (at least
    /// 0.001). Russian roulette may end a path whose largest channel is below 1, and scales the
    /// throughput of each surviving path to a largest channel of 1. This changes the brightness of
    /// mirrored and refracted light.
    pub published_roulette: bool,
}

impl Default for Mixture {
    fn default() -> Self {
        Self {
            specular_chance: 0.0,
            specular_colour: default_white(),
            specular_roughness: 0.0,
            refraction_chance: 0.0,
            refraction_roughness: 0.0,
            ior: None,
            absorption: Colour::BLACK,
            published_roulette: false,
        }
    }
}
