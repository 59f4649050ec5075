//! A picture with less noise, and how wrong it is: film in, picture and claim out.
//!
//! Two passes of non-local means (Buades, Coll and Morel, "A Non-Local Algorithm for Image
//! Denoising", 2005), with features and variances as by Rousselle, Manzi and Zwicker ("Robust
//! Denoising Using Feature and Color Information", 2013). The four replicates of a film are two
//! halves, and the weights of each half filter the other. What is filtered is light over the albedo
//! and a tenth: texture is no noise. What camera rays see by themselves, lamps and sky, is filtered
//! apart, where it is noisy at all. How much of the filter a pixel takes is solved from its
//! surroundings without itself (`mixture`).
//!
//! So each of the four parts Pᵢ of the picture D = ¼ Σ Pᵢ knows nothing of one replicate, its
//! partner xᵢ′ in the same half, and mean (Pᵢ − xᵢ′)² − s² − mean (Pᵢ − D)² has the squared error
//! of D for a mean, s² being the sample variance of the four: the first two terms are the mean
//! error of the parts, and a mean's error is less than that by its parts' spread. No reference is
//! needed, and nothing is assumed of the filter; what it takes is that replicates are independent
//! (`claim` says how an interval comes of it).
//!
//! Bits depend on the film alone: tiles here are of one size, and sums are taken row by row. Pixels
//! at the edge of a crop have fewer neighbours than the whole picture's.

mod candidates;
mod claim;
pub(crate) mod demand;
mod features;
mod filter;
mod mixture;
mod plane;
#[cfg(test)]
mod tests;

use core::sync::atomic::{AtomicU64, Ordering};

use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use crate::film::{Estimate, Film, QuadError, ReplicateQuad, Uncertainty};
use crate::observer::Observer;
use crate::picture::{Layer, Picture};
use crate::settings::Aov;
use demand::{CANDIDATES, CandidatePixel, FOUR};
pub use demand::{FEWEST_SAMPLES, LAYERS, is_possible};

/// Pixels of a tile, which are filtered together.
const TILE: [usize; 2] = [128, 64];

/// Why a film can't be denoised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DenoiseError {
    /// There is no noise.
    #[error("chance has no part in the picture, so that there is no noise")]
    NoChance,
    /// The film was rendered without a layer that the denoiser reads.
    #[error("it has no layer `{0}`, which tells noise from what is seen")]
    Layer(&'static str),
    /// Some pixels have no four replicates.
    #[error("some pixels have fewer than four replicates, which tell noise from what is seen")]
    Replicates,
    /// The observer stopped it.
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

/// A denoised picture with what is claimed of it.
#[derive(Clone, Debug)]
pub struct Denoised {
    /// Colour, with the film's coverage and no layers.
    pub picture: Picture,
    /// Root of the squared error to be expected in each pixel, bias included, as its neighbourhood
    /// of 21 by 21 says it.
    pub standard_error: Vec<[f32; 3]>,
    /// How far the picture is from the true one.
    pub error: Uncertainty,
    /// What the filter did to the picture's light, as a share of it: less than zero where it is
    /// darker.
    pub brightened: f64,
}

impl Denoised {
    /// Whether its relative error is below another one: where its own interval says so, or says
    /// little but ends below and the noisy picture's error is below, too. A picture of less than
    /// two blocks has no interval, and then its value counts.
    pub fn reaches(&self, error: f64, noisy: &Uncertainty) -> bool {
        let Estimate { value, high, .. } = self.error.root_relmse;
        let most = if high.is_finite() { high } else { value };
        most <= error && (self.error.doubt.is_none() || noisy.reaches(error))
    }

    /// Its colour and its errors as layers of another picture.
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

/// Denoises a film on the current thread pool, and tells how wrong the result is.
///
/// # Errors
/// See [`DenoiseError`].
pub fn denoise(film: &Film, observer: &dyn Observer) -> Result<Denoised, DenoiseError> {
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
    if observer.cancelled() {
        return Err(DenoiseError::Cancelled);
    }
    mixture::mix(&four, [width, height], &mut pixels);
    let mut denoised = claim::estimate(film, &four, film.colours(), &pixels);
    film.take_off_backdrop(&mut denoised.picture);
    Ok(denoised)
}
