//! Requirements of denoising: samples, film layers and memory.

use crate::settings::{Aov, Sampling};

/// Number of replicates (pictures from independent samples) that denoising uses. They form two
/// pairs, each filtered by weights from the other pair.
pub(crate) const REPLICATE_COUNT: usize = 4;

/// Number of replicates that a film must have.
pub(crate) const REPLICATES: u32 = REPLICATE_COUNT as u32;

/// Least number of samples per pixel for denoising: two in each of four replicates.
pub const FEWEST_SAMPLES: u32 = 8;

/// Whether the sampling allows denoising: it has enough samples, and they are random. In a fixed
/// pattern, samples differ by their positions, not by noise.
pub fn can_denoise(sampling: Sampling) -> bool {
    !sampling.is_fixed() && sampling.samples_per_pixel() >= FEWEST_SAMPLES
}

/// Layers that a film must have for denoising.
pub const LAYERS: [Aov; 4] = [Aov::Albedo, Aov::Normal, Aov::Emission, Aov::Depth];

/// Bytes per pixel that denoising needs besides the film, including its result. Each thread needs
/// some megabytes more.
pub(crate) const BYTES_A_PIXEL: u64 = (size_of::<PixelCandidates>() + 12 + 24 + 16) as u64;

/// Number of candidate changes of a pixel: filtered light, filtered emission, dimmed fireflies.
pub(super) const CANDIDATES: usize = 3;

/// Candidates of a pixel, 21 numbers. After mixing, the fields hold the result.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelCandidates {
    /// Filtered colour without the pixel's own value (leave-one-out). Mixing clamps it to a limited
    /// ratio to the filtered colour.
    pub base_colour: [f32; 3],
    /// Change of the colour by each candidate. After mixing, the first entry is the total applied
    /// change, and the second is the colour with all candidates applied in full.
    pub changes: [[f32; 3]; CANDIDATES],
    /// Negated mean product of each candidate's change in a replicate and the noise of its partner:
    /// half of the first-order change of the squared error. After mixing, the first entry is the
    /// estimated squared error.
    pub error_terms: [[f32; 3]; CANDIDATES],
}
