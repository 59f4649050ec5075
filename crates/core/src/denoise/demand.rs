//! What denoising needs: of a picture's samples, of its film, and of memory.

use crate::settings::{Aov, Sampling};

/// As many replicates as errors are told from: two pairs, of which each filters the other.
pub(crate) const FOUR: usize = 4;

/// Replicates that a film has to have.
pub(crate) const REPLICATES: u32 = FOUR as u32;

/// Samples of a pixel from which on a picture can be denoised: two in each replicate.
pub const FEWEST_SAMPLES: u32 = 8;

/// Whether so many samples tell noise from what is seen: enough of them, and none of a fixed
/// pattern, which are different places.
pub fn is_possible(sampling: Sampling) -> bool {
    !sampling.is_fixed() && sampling.count() >= FEWEST_SAMPLES
}

/// Layers that a film has to have.
pub const LAYERS: [Aov; 4] = [Aov::Albedo, Aov::Normal, Aov::Emission, Aov::Depth];

/// Bytes a pixel that denoising takes beside the film, its result included; each thread takes some
/// megabytes more.
pub(crate) const BYTES_A_PIXEL: u64 = (size_of::<CandidatePixel>() + 12 + 24 + 16) as u64;

/// What may be added to a pixel, by where it comes from: filtered light, filtered emission,
/// fireflies that are dimmed.
pub(super) const CANDIDATES: usize = 3;

/// What is kept of a pixel between the stages: 21 numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CandidatePixel {
    /// The filtered colour without the pixel's own; after mixing no less than it has in common with
    /// the colour.
    pub base: [f32; 3],
    /// What each candidate adds to the colour. After mixing the first one is all that is added, and
    /// the second the colour that they would make without shares.
    pub added: [[f32; 3]; CANDIDATES],
    /// How little what each adds to replicates goes with their partners' noise, on average: half of
    /// what the squared error changes by in the first order. After mixing the first one is the
    /// squared error.
    pub apart: [[f32; 3]; CANDIDATES],
}
