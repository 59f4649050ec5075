//! Settings with a closed set of values: the rungs (quality levels) of the ladders. Each has a
//! default.

/// Precision of the arithmetic (`--precision`). In all precisions, positions in the pixel, on the
/// lens and on lights come from the same f32 random numbers, so that pictures differ only by
/// rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias = "Float")]
pub enum PrecisionChoice {
    /// Storage in f32; intersections avoid cancellation and decide hits in f64.
    #[default]
    Robust,
    /// Storage and all arithmetic in f64.
    Reference,
}

/// Strategy by which path tracing finds area lights. All strategies are unbiased and differ only in
/// noise. Lights without size are always sampled directly. Lights seen in a mirror or through
/// smooth glass are always hit by paths.
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

/// Treatment of light scattered between microfacets, under path tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MicrofacetEnergy {
    /// Light scattered more than once between microfacets is lost.
    Single,
    /// The lost light is compensated, so that white metal reflects all light.
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

/// Segment of a path at which Russian roulette starts. All choices are unbiased and differ in time
/// and noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RouletteStart {
    /// From the first surface of a path on.
    Early,
    /// From the fourth segment of a path on.
    #[default]
    Late,
    /// Never, except for paths without a limit, which only Russian roulette ends.
    Off,
}

/// Visibility test of area lights: which point of the light must be visible for its light to count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AreaShadows {
    /// The centre of the light: hard shadows.
    Hard,
    /// The sampled point on the light: unbiased penumbras.
    #[default]
    Soft,
}
