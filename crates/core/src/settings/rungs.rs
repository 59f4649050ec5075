//! Settings that are rungs of a ladder: closed sets, each with its default.

/// Rung of the precision ladder (`--precision`). All rungs use the same samples: positions in the
/// pixel, on the lens and on lights are the same f32 numbers, so that their pictures differ by
/// arithmetic alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias = "Float")]
pub enum PrecisionChoice {
    /// f32 storage, cancellation-free intersections with an f64 core.
    #[default]
    Robust,
    /// f64 throughout.
    Reference,
}

/// Rung of the ladder of light sampling: how path tracing finds area lights. All rungs are unbiased
/// and differ in noise. Lights without size are always sampled, and lights seen in a mirror or
/// smooth glass are always hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("BVHLightSampler", "PowerLightSampler"))]
pub enum LightSampling {
    /// Paths hit lights by chance.
    Scattering,
    /// Each vertex samples one light.
    Lights,
    /// Both, combined by multiple importance sampling.
    #[default]
    Both,
}

/// Treatment of light scattered between microfacets, under path tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Microfacets {
    /// The light is lost.
    Single,
    /// The light is compensated, so that white metal reflects all light.
    #[default]
    Compensated,
}

/// Source of the random numbers of a pixel's samples. All are unbiased and differ in noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("ZSobolSampler", "IndependentSampler"))]
pub enum SamplerKind {
    /// Independent numbers.
    Independent,
    /// Sixteen at a time on a jittered grid of four by four.
    Stratified,
    /// Points of a scrambled Sobol sequence.
    #[default]
    Sobol,
}

/// Segment at which Russian roulette starts. All choices are unbiased and differ in time and noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Roulette {
    /// From the first surface on.
    Early,
    /// From the fourth segment on.
    #[default]
    Late,
    /// Never, except for paths without a limit, which only Russian roulette ends.
    Off,
}

/// Part of an area light that must be visible for its light to arrive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AreaShadows {
    /// The middle: hard shadows.
    Hard,
    /// The sampled point: unbiased penumbras.
    #[default]
    Soft,
}
