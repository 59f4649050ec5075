//! The choices of a render that are rungs of a ladder: closed sets, each with the one that a scene
//! gets which says nothing.

/// A rung of the arithmetic ladder (`--precision`). All rungs trace the same samples: positions in
/// the pixel, on the lens and on lights are the same f32 numbers, so what differs between their
/// pictures is arithmetic alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PrecisionChoice {
    /// f32 storage, cancellation-free intersections with an f64 core.
    #[default]
    Robust,
    /// f64 throughout.
    Reference,
}

/// How a path tracer finds light that has a size: a rung of the ladder of light sampling. All are
/// right in the mean; what differs is noise. Lights without size are always asked, and what a
/// mirror or smooth glass shows is always met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LightSampling {
    /// Paths meet it by chance.
    Scattering,
    /// Each vertex asks one light for it.
    Lights,
    /// Both, each in the share in which it is the better one.
    #[default]
    Both,
}

/// What becomes of light that microfacets send to each other, under path tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Microfacets {
    /// It is lost.
    Single,
    /// It is given back, so that white metal sends back all.
    #[default]
    Compensated,
}

/// Where the random numbers of a pixel's samples come from. All are right in the mean; what differs
/// is noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SamplerKind {
    /// Each number by itself.
    Independent,
    /// Sixteen at a time on a jittered grid of four by four.
    Stratified,
    /// Points of a scrambled Sobol sequence.
    #[default]
    Sobol,
}

/// From which segment on chance decides whether a path goes on (Russian roulette). All are right in
/// the mean; what differs is time and noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Roulette {
    /// From the first surface on.
    Early,
    /// From the fourth segment on.
    #[default]
    Late,
    /// Never, but for paths without a limit, which end by chance alone.
    Off,
}

/// Which part of a lamp with a size has to be seen for its light to arrive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AreaShadows {
    /// Its middle: shadows are hard.
    Hard,
    /// The point that was drawn: penumbras are right in the mean.
    #[default]
    Soft,
}
