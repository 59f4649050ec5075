//! Denoising with an error estimate: from a film to a picture and its error.
//!
//! Two passes of non-local means (Buades, Coll and Morel, "A Non-Local Algorithm for Image
//! Denoising", 2005), with features and variances as by Rousselle, Manzi and Zwicker ("Robust
//! Denoising Using Feature and Color Information", 2013). The four replicates of a film form two
//! halves, and the weights of each half filter the other. Reflected light is divided by the albedo
//! plus a tenth before filtering, so that texture is not taken for noise. Directly visible
//! emission, of lamps and sky, is filtered separately, if it is noisy at all. The share of the
//! filter in a pixel is solved from its surroundings without the pixel itself (`mixture`).
//!
//! So each of the four parts Pᵢ of the picture D = ¼ Σ Pᵢ is independent of one replicate, its
//! partner xᵢ′ in the same half, and mean (Pᵢ − xᵢ′)² − s² − mean (Pᵢ − D)² has the squared error
//! of D as its expectation, where s² is the sample variance of the four: the first two terms are
//! the mean error of the parts, and the error of a mean is less than that by the spread of its
//! parts. No reference is needed, and nothing is assumed of the filter, only that replicates are
//! independent (`claim` derives an interval).
//!
//! Bits depend on the film alone: tiles have a fixed size, and sums are taken row by row. Pixels at
//! the edge of a crop have fewer neighbours than in the whole picture.

mod candidates;
mod claim;
pub(crate) mod demand;
mod features;
mod filter;
mod guide;
mod loops;
mod mixture;
mod plane;
mod rows;
#[cfg(test)]
mod tests;

use core::sync::atomic::{AtomicU64, Ordering};

use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use crate::film::{ErrorEstimate, Film, QuadError, ReplicateQuad, Uncertainty};
use crate::observer::Observer;
use crate::picture::{Layer, Picture};
use crate::settings::Aov;
use demand::{CANDIDATES, CandidatePixel, FOUR};
pub use demand::{FEWEST_SAMPLES, LAYERS, is_possible};

/// Width and height of a tile, filtered as a unit.
const TILE: [usize; 2] = [128, 64];

/// Reason why a film can't be denoised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DenoiseError {
    /// A deterministic picture without noise.
    #[error("chance has no part in the picture, so that there is no noise")]
    NoChance,
    /// The film lacks a layer that the denoiser needs.
    #[error("it has no layer `{0}`, which tells noise from what is seen")]
    Layer(&'static str),
    /// Some pixels have fewer than four replicates.
    #[error("some pixels have fewer than four replicates, which tell noise from what is seen")]
    Replicates,
    /// The observer cancelled denoising.
    #[error("it was stopped")]
    Cancelled,
}

impl From<QuadError> for DenoiseError {
    fn from(missing: QuadError) -> Self {
        match missing {
            QuadError::Layer(aov) => Self::Layer(
                Aov::ALL
                    .iter()
                    .find(|(_, known)| *known == aov)
                    .map_or("", |(name, _)| name),
            ),
            QuadError::Replicates => Self::Replicates,
        }
    }
}

/// A denoised picture with its error estimate.
#[derive(Clone, Debug)]
pub struct DenoiseOutput {
    /// Colour, with the film's coverage and no layers.
    pub picture: Picture,
    /// Root of the expected squared error of each pixel, bias included, averaged over its
    /// neighbourhood of 21 by 21 pixels.
    pub standard_error: Vec<[f32; 3]>,
    /// Error of the picture.
    pub error: Uncertainty,
    /// Error of the noisy picture, if known.
    pub noisy: Option<Uncertainty>,
    /// Relative change of the picture's light by the filter; negative for a darker picture.
    pub brightened: f64,
}

impl DenoiseOutput {
    /// Whether the relative error is below `error`: by its interval, or, if the interval is
    /// doubtful, by the interval's upper end and the noisy picture's error together. A picture of
    /// less than two blocks has no interval, and its value counts.
    pub fn reaches(&self, error: f64, noisy: &Uncertainty) -> bool {
        let ErrorEstimate { value, high, .. } = self.error.root_relmse;
        let maximum = if high.is_finite() { high } else { value };
        maximum <= error && (self.error.doubt.is_none() || noisy.reaches(error))
    }

    /// The colour and the errors as layers of another picture.
    pub fn layers(&self) -> Vec<Layer> {
        const NAMES: [[&str; 3]; 2] = [
            ["denoised.R", "denoised.G", "denoised.B"],
            [
                "denoised.stderr.R",
                "denoised.stderr.G",
                "denoised.stderr.B",
            ],
        ];
        let layer = |of: &[[f32; 3]], i: usize, name: &str| Layer {
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

/// Denoises a film on the current thread pool and estimates the error of the result.
///
/// # Errors
/// See [`DenoiseError`].
pub fn denoise(film: &Film, observer: &dyn Observer) -> Result<DenoiseOutput, DenoiseError> {
    if !film.plan().random {
        return Err(DenoiseError::NoChance);
    }
    let four = film.replicate_quad()?;
    let [width, height] = film.size().map(|edge| edge as usize);
    let mut pixels = vec![CandidatePixel::default(); width * height];
    let (bands, done) = (
        pixels.par_chunks_mut(width * TILE[1]).enumerate(),
        AtomicU64::new(0),
    );
    bands.for_each(|(band, pixels)| {
        let count = pixels.len() as u64;
        candidates::fill_band(&four, [width, height], band * TILE[1], pixels, observer);
        observer.progress(
            done.fetch_add(count, Ordering::Relaxed) + count,
            (width * height) as u64,
        );
    });
    if observer.is_cancelled() {
        return Err(DenoiseError::Cancelled);
    }
    mixture::mix(&four, [width, height], &mut pixels);
    let mut denoised = claim::estimate(film, &four, film.colours(), &pixels);
    film.take_off_backdrop(&mut denoised.picture);
    Ok(denoised)
}
