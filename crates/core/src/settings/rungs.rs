//! Settings whose values are the rungs of a ladder: closed sets, each with its default.

/// Precision of the arithmetic (`--precision`). All precisions use the same f32 numbers for
/// positions in the pixel, on the lens and on lights, so that their pictures differ by arithmetic
/// alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias = "Float")]
pub enum PrecisionChoice {
    /// f32 storage; intersections avoid cancellation and decide hits in f64.
    #[default]
    Robust,
    /// f64 for storage and all arithmetic.
    Reference,
}

/// Strategy by which path tracing finds area lights. All strategies are unbiased and differ in
/// noise. Lights without size are always sampled directly, and lights in a mirror or behind smooth
/// glass are always hit by paths.
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

/// Source of the random numbers of a pixel's samples. All sources are unbiased and differ in noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("ZSobolSampler", "IndependentSampler"))]
pub enum SamplerKind {
    /// Independent random numbers.
    Independent,
    /// Jittered grids of four by four numbers, sixteen samples at a time.
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

/// Point of an area light that must be visible for its light to arrive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AreaShadows {
    /// The centre of the light: hard shadows.
    Hard,
    /// The sampled point on the light: unbiased penumbras.
    #[default]
    Soft,
}
