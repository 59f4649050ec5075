//! Requirements of denoising: samples, film layers and memory.

use crate::settings::{Aov, Sampling};

/// Number of replicates for the error estimate: two pairs, each filtered by the other.
pub(crate) const FOUR: usize = 4;

/// Number of replicates that a film must have.
pub(crate) const REPLICATES: u32 = FOUR as u32;

/// Least samples a pixel for denoising: two in each replicate.
pub const FEWEST_SAMPLES: u32 = 8;

/// Whether the sampling allows denoising: enough samples, and no fixed pattern, since its samples
/// are different positions.
pub fn is_possible(sampling: Sampling) -> bool {
    !sampling.is_fixed() && sampling.count() >= FEWEST_SAMPLES
}

/// Layers that a film must have.
pub const LAYERS: [Aov; 4] = [Aov::Albedo, Aov::Normal, Aov::Emission, Aov::Depth];

/// Bytes a pixel that denoising needs besides the film, its result included; each thread needs some
/// megabytes more.
pub(crate) const BYTES_A_PIXEL: u64 = (size_of::<CandidatePixel>() + 12 + 24 + 16) as u64;

/// Number of candidate changes of a pixel: filtered light, filtered emission, dimmed fireflies.
pub(super) const CANDIDATES: usize = 3;

/// Data of a pixel between the stages: 21 numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CandidatePixel {
    /// The filtered colour without the pixel's own value; after mixing, clamped to agree with the
    /// filtered colour.
    pub base: [f32; 3],
    /// Change of the colour by each candidate. After mixing the first entry is the total change,
    /// and the second the colour with all candidates in full.
    pub added: [[f32; 3]; CANDIDATES],
    /// Negated mean correlation of each candidate's change of replicates with their partners'
    /// noise: half of the first-order change of the squared error. After mixing the first entry is
    /// the squared error.
    pub apart: [[f32; 3]; CANDIDATES],
}
