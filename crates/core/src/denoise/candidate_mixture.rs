//! Mixture of the candidate changes of each pixel (filtered light, filtered emission, dimmed
//! fireflies). Each candidate is applied with a share in 0..1. The shares minimise the squared
//! error of the pixel's surroundings, as estimated from the replicates.

use core::array::from_fn;

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::candidate_shares::solve_candidate_shares;
use super::features::{jackknife_colours, replicate_statistics};
use super::{CANDIDATES, FourReplicates, PixelCandidates, REPLICATE_COUNT};

/// Number of rows of pixels for which one task computes the shares.
const BAND: usize = 64;

/// Computes the shares of the candidates in all pixels and applies them.
pub(super) fn mix_candidates(
    four: &FourReplicates<'_>,
    [width, height]: [usize; 2],
    pixels: &mut [PixelCandidates],
) {
    let bands = (0..height.div_ceil(BAND)).into_par_iter();
    let rows = |band: usize| band * BAND..((band + 1) * BAND).min(height);
    let shares: Vec<Vec<[f32; CANDIDATES]>> = bands
        .map(|band| solve_candidate_shares(four, [width, height], pixels, rows(band)))
        .collect();
    pixels
        .par_chunks_mut(width * BAND)
        .zip(shares)
        .enumerate()
        .for_each(|(band, (pixels, shares))| {
            for (k, (pixel, shares)) in pixels.iter_mut().zip(shares).enumerate() {
                apply_shares_to_pixel(pixel, shares, four.radiance(band * BAND * width + k));
            }
        });
}

/// Removes the changes of all mixed pixels, which then have the colour and the error of the noisy
/// picture.
pub(super) fn remove_changes(four: &FourReplicates<'_>, pixels: &mut [PixelCandidates]) {
    for (index, pixel) in pixels.iter_mut().enumerate() {
        let [_, _, error] = replicate_statistics(four.radiance(index));
        pixel.changes[0] = [0.0; 3];
        pixel.error_terms[0] = error.map(|error| error as f32);
    }
}

/// Applies the shares to the candidates of a pixel. The pixel then holds its total change, its
/// clamped leave-one-out colour and its estimated squared error.
fn apply_shares_to_pixel(
    pixel: &mut PixelCandidates,
    shares: [f32; CANDIDATES],
    radiance: [[f64; 3]; REPLICATE_COUNT],
) {
    let [mean, _, error] = replicate_statistics(radiance);
    let sum = |of: &[[f32; 3]; CANDIDATES], i: usize| {
        of.iter()
            .zip(shares)
            .map(|(of, share)| f64::from(share) * f64::from(of[i]))
            .sum::<f64>()
    };
    let [whole, base] = jackknife_colours(mean, pixel);
    let added: [f64; 3] = from_fn(|i| sum(&pixel.changes, i));
    let error: [f64; 3] =
        from_fn(|i| added[i] * added[i] + 2.0 * sum(&pixel.error_terms, i) + error[i]);
    *pixel = PixelCandidates {
        base_colour: base.map(|base| base as f32),
        changes: [
            added.map(|added| added as f32),
            whole.map(|whole| whole as f32),
            [0.0; 3],
        ],
        error_terms: [error.map(|error| error as f32), [0.0; 3], [0.0; 3]],
    };
}
