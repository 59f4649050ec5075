//! Requirements of denoising: samples, film layers and memory.

use crate::settings::{Aov, Sampling};

/// Number of replicates (pictures from parts of the samples) that denoising uses: two in each of
/// two independent halves.
pub(crate) const REPLICATE_COUNT: usize = 4;

/// Number of replicates that a film must have.
pub(crate) const REPLICATES: u32 = REPLICATE_COUNT as u32;

/// Least number of samples per pixel for denoising: two for each of four replicates.
pub const FEWEST_SAMPLES: u32 = 8;

/// Whether a sampling permits denoising: it must be random and have enough samples. In a fixed
/// pattern, samples differ by their positions, not by noise.
pub fn is_denoisable_sampling(sampling: Sampling) -> bool {
    !sampling.is_fixed() && sampling.samples_per_pixel() >= FEWEST_SAMPLES
}

/// Layers that a render must store in its film, so that the film can be denoised.
pub const REQUIRED_LAYERS: [Aov; 4] = [Aov::Albedo, Aov::Normal, Aov::Emission, Aov::Depth];

/// Bytes per pixel that denoising needs besides the film, its result included. Each thread needs
/// some megabytes more.
pub(crate) const BYTES_A_PIXEL: u64 = (size_of::<PixelCandidates>() + 12 + 24 + 16) as u64;

/// Number of candidate changes of a pixel's colour: by filtered light, by filtered emission, and by
/// dimmed fireflies.
pub(super) const CANDIDATES: usize = 3;

/// Candidate changes of a pixel's colour, with error terms: 21 numbers. Mixing (`mixture`) replaces
/// them by its result.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelCandidates {
    /// Filtered colour without the pixel's own value (leave-one-out). After mixing, this colour is
    /// clamped to a limited ratio to the filtered colour.
    pub base_colour: [f32; 3],
    /// Change of the colour by each candidate. After mixing, the first entry is the total applied
    /// change. The second entry is the colour with all candidates applied in full.
    pub changes: [[f32; 3]; CANDIDATES],
    /// For each candidate, a quarter of the product of the difference of both halves and the
    /// difference of its changes of both halves. It is half of the first-order change of the squared error. After
    /// mixing, the first entry is the estimated squared error.
    pub error_terms: [[f32; 3]; CANDIDATES],
}
