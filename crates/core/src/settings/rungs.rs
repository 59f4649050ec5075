//! Settings with a fixed list of values, which are the rungs (quality levels) of ladders. Each
//! setting has a default.

/// Precision of the arithmetic (`--precision`). In all precisions, the same `f32` random numbers
/// determine positions in the pixel, on the lens and on lights. So pictures differ only by
/// rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias = "Float")]
pub enum PrecisionChoice {
    /// Numbers are stored in `f32`. Intersections avoid cancellation and decide hits in `f64`.
    #[default]
    Robust,
    /// All numbers are stored and computed in `f64`.
    Reference,
}

/// Strategy by which path tracing finds area lights. All strategies are unbiased and differ only in
/// noise. Two kinds of light are found in one manner whatever the strategy. Lights without size are
/// sampled directly. Lights seen in a mirror or through smooth glass are hit by paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("BVHLightSampler", "PowerLightSampler"))]
pub enum LightSampling {
    /// Paths hit lights by chance (BSDF sampling).
    Scattering,
    /// Each vertex samples a point on one light (light sampling).
    Lights,
    /// BSDF and light sampling, combined by multiple importance sampling.
    #[default]
    Both,
}

/// Choice of the sky's directions that path tracing samples. Both choices are unbiased and differ
/// only in noise and time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("portal", "light portal"))]
pub enum SkyChoice {
    /// By the sky's radiance.
    Power,
    /// By the light that reaches each part of the scene, where walls hide most of the sky. It is
    /// found before the first sample, by a million rays.
    #[default]
    Openings,
}

/// Treatment of light that scatters several times between microfacets, under path tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MicrofacetEnergy {
    /// Light scattered more than once between microfacets is lost.
    Single,
    /// The lost light is compensated, so white metal reflects all light.
    #[default]
    Compensated,
}

/// Source of the random numbers of a pixel's samples. All sources are unbiased and differ only in
/// noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("ZSobolSampler", "IndependentSampler"))]
pub enum SamplerKind {
    /// Independent random numbers.
    Independent,
    /// Jittered grids of four by four numbers, one grid per sixteen samples.
    Stratified,
    /// Points of a scrambled Sobol sequence.
    #[default]
    Sobol,
}

/// Start of Russian roulette along a path, by the number of path segments (from hit to hit). The
/// choices are unbiased; they differ in time and noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RouletteStart {
    /// From the first surface of a path on, with the probability of its absorption.
    Early,
    /// From the third segment of a path on, while the throughput is below a half.
    #[default]
    Late,
    /// Never, except for paths without a limit, which only Russian roulette ends.
    Off,
}

/// Point of an area light that must be visible for the light to arrive. It determines whether
/// shadows are hard or soft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AreaShadows {
    /// The centre of the light: hard shadows.
    Hard,
    /// The sampled point on the light: unbiased penumbras.
    #[default]
    Soft,
}
