//! Denoising of a film, with an estimate of the error of the denoised picture.
//!
//! A film holds four *replicates*: pictures from quarters of the samples. The first two and the last
//! two are the *halves* of the film, which are independent. Each half is filtered by weights that
//! are computed from itself. The filter has two passes of non-local means (Buades, Coll and Morel,
//! "A Non-Local Algorithm for Image Denoising", 2005). In the first, the weights of each replicate
//! are those of the other one of its half, so that noise does not choose them; the result guides
//! the second. The filter uses features and variances as in Rousselle, Manzi and Zwicker ("Robust
//! Denoising Using Feature and Color Information", 2013).
//!
//! - Reflected light is divided by the albedo plus a tenth before filtering: texture is not taken
//!   for noise.
//! - Emission of lamps and sky that the camera sees directly is filtered separately if it is noisy.
//! - The share of the filtered colour in a pixel is computed from the pixel's surroundings, without
//!   the pixel itself (`candidate_mixture`). Where the whole picture would have more error than
//!   before, all shares are zero.
//!
//! The denoised picture is D = ½ Σ Pₕ, where Pₕ is the filtered half h. Pₕ is independent of xₕ′, the
//! opposite half. Let s² = ½ (x₁ − x₂)² be the sample variance of the halves. Then mean (Pₕ − xₕ′)² −
//! s² has the mean squared error of the Pₕ as its expectation. The squared error of their mean D is
//! less by their variance: the estimate is mean (Pₕ − xₕ′)² − s² − mean (Pₕ − D)². With the changes
//! aₕ = Pₕ − xₕ it is (½ Σ aₕ)² + ¼ (x₁ − x₂)² + ½ (x₁ − x₂) (a₁ − a₂). It needs no reference
//! picture. It assumes nothing about the filter, only that the halves are independent: the replicates
//! of a half may share a net. `error_estimate` derives an interval.
//!
//! A film of too few samples has a `sketch` instead, without an estimate.
//!
//! The bits of the result depend on the film alone: tiles have a fixed size, and sums are added row
//! by row. Pixels at the edge of a crop have fewer neighbours than in the whole picture.

mod block_errors;
mod candidate_mixture;
mod candidate_shares;
mod candidates;
mod error_estimate;
mod features;
mod filter;
mod filter_rows;
mod guide;
mod plane;
pub(crate) mod requirements;
mod row_kernels;
mod sketch;
#[cfg(test)]
mod tests;

use core::sync::atomic::{AtomicU64, Ordering};

use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use crate::film::{Film, FourReplicates, FourReplicatesError, Uncertainty};
use crate::observer::Observer;
use crate::picture::{Picture, PictureLayer};
use crate::settings::Aov;
use requirements::{CANDIDATES, PixelCandidates, REPLICATE_COUNT};
pub use requirements::{FEWEST_SAMPLES, REQUIRED_LAYERS, is_denoisable_sampling};
pub use sketch::sketch;

/// Width and height in pixels of the tiles that are filtered as units.
const TILE: [usize; 2] = [128, 64];

/// Ratio of the denoised and the noisy picture's estimated errors (root relMSE) beyond which a
/// picture stays noisy. Both estimates together are a fifth off by chance.
const HARMFUL_RATIO: f64 = 1.25;

/// Reason why a film cannot be denoised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DenoiseError {
    /// The picture has no random samples, and so no noise.
    #[error(
        "the picture was rendered without random samples, so it has no noise to remove; use the picture as it is"
    )]
    NoChance,
    /// The film lacks a layer that the denoiser needs.
    #[error(
        "the film has no layer `{0}`; the denoiser needs this layer to distinguish noise from detail: render the film with --denoise"
    )]
    Layer(&'static str),
    /// Some pixels have fewer than four replicates.
    #[error(
        "some pixels have fewer than four replicates (independent groups of samples); the denoiser compares four replicates to distinguish noise from detail: render with --denoise and at least 8 samples per pixel"
    )]
    Replicates,
    /// The observer cancelled denoising.
    #[error("denoising was interrupted, so the picture is not denoised; run the command again")]
    Cancelled,
}

impl From<FourReplicatesError> for DenoiseError {
    fn from(missing: FourReplicatesError) -> Self {
        match missing {
            FourReplicatesError::Layer(aov) => Self::Layer(
                Aov::ALL
                    .iter()
                    .find(|(_, known)| *known == aov)
                    .map_or("", |(name, _)| name),
            ),
            FourReplicatesError::Replicates => Self::Replicates,
        }
    }
}

/// Denoised picture with its error estimate.
#[derive(Clone, Debug)]
pub struct DenoiseOutput {
    /// Denoised colour with the film's coverage, without layers.
    pub picture: Picture,
    /// Root of the mean squared error (RMSE, bias included) of each pixel per channel, estimated
    /// from the pixel's neighbourhood of 21 by 21 pixels.
    pub standard_error: Vec<[f32; 3]>,
    /// Estimated error of the denoised picture, with its interval.
    pub error: Uncertainty,
    /// Estimated error of the picture before denoising; `None` if unknown.
    pub noisy_error: Option<Uncertainty>,
    /// Relative change of the picture's total radiance by denoising; negative if the picture became
    /// darker.
    pub light_change: f64,
}

impl DenoiseOutput {
    /// Whether the root relMSE of the denoised picture is at most `error`, in nine of ten renders. An
    /// interval of both sides would ask for twice the samples. A picture of less than two blocks has
    /// no interval; then the estimate itself decides. If the estimate is doubtful, the picture
    /// before denoising, `noisy`, must reach `error` too.
    pub fn reaches_error(&self, error: f64, noisy: &Uncertainty) -> bool {
        self.error.root_relmse.one_sided_bound() <= error
            && (self.error.doubt.is_none() || noisy.is_error_below(error))
    }

    /// Whether denoising clearly adds error, as where the filter spreads a single bright sample.
    fn is_harmful(&self) -> bool {
        self.noisy_error.is_some_and(|noisy| {
            self.error.root_relmse.value > HARMFUL_RATIO * noisy.root_relmse.value
        })
    }

    /// Returns the denoised colour and its standard errors, as layers for a picture of the same
    /// size.
    pub fn to_picture_layers(&self) -> Vec<PictureLayer> {
        const NAMES: [[&str; 3]; 2] = [
            ["denoised.R", "denoised.G", "denoised.B"],
            [
                "denoised.stderr.R",
                "denoised.stderr.G",
                "denoised.stderr.B",
            ],
        ];
        let layer = |of: &[[f32; 3]], i: usize, name: &str| PictureLayer {
            name: name.into(),
            samples: of.iter().map(|c| c[i]).collect(),
        };
        let all = [&self.picture.rgb, &self.standard_error]
            .into_iter()
            .zip(NAMES);
        all.flat_map(|(of, names)| (0..3).map(move |i| layer(of, i, names[i])))
            .collect()
    }
}

/// Denoises a film on the current thread pool and estimates the error of the denoised picture.
///
/// # Errors
/// See [`DenoiseError`].
pub fn denoise(film: &Film, observer: &dyn Observer) -> Result<DenoiseOutput, DenoiseError> {
    if !film.plan().random {
        return Err(DenoiseError::NoChance);
    }
    let four = film.merge_into_four_replicates()?;
    let [width, height] = film.size().map(|edge| edge as usize);
    let mut pixels = vec![PixelCandidates::default(); width * height];
    let (bands, done) = (
        pixels.par_chunks_mut(width * TILE[1]).enumerate(),
        AtomicU64::new(0),
    );
    bands.for_each(|(band, pixels)| {
        let count = pixels.len() as u64;
        candidates::compute_candidates_of_rows(
            &four,
            [width, height],
            band * TILE[1],
            pixels,
            observer,
        );
        observer.progress(
            done.fetch_add(count, Ordering::Relaxed) + count,
            (width * height) as u64,
        );
    });
    if observer.is_cancelled() {
        return Err(DenoiseError::Cancelled);
    }
    candidate_mixture::mix_candidates(&four, [width, height], &mut pixels);
    let estimate = |pixels: &[PixelCandidates]| {
        error_estimate::estimate_error(film, &four, film.mean_colours(), pixels)
    };
    let mut denoised = estimate(&pixels);
    if denoised.is_harmful() {
        candidate_mixture::remove_changes(&four, &mut pixels);
        denoised = estimate(&pixels);
    }
    film.finish_picture(&mut denoised.picture);
    Ok(denoised)
}
