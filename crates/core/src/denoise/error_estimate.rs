//! Error estimate of a denoised picture, from unbiased but noisy estimates of the squared error of
//! each pixel.
//!
//! The interval of the mean error comes from blocks of pixels (`block_errors`).
//!
//! A relative error needs the true colour, which is unknown. The picture's colour is correlated
//! with the error: the filter may spread light into a dark pixel, which then has a large error and
//! looks too bright. The true colour is assumed above or below the picture's colour by the root
//! mean squared error of the surroundings, and the relative errors for both are averaged. A quarter
//! of the difference between this average and the relative error by the picture's colour counts as
//! a further standard error, which does not shrink in larger pictures.
//!
//! A doubt about the noisy picture's error (`EstimateDoubt`) applies to the denoised picture too, because
//! light that no sample found is missing in both. The estimate is also doubtful if light is rare in
//! the noisy picture: two weightings of its relative error differ widely, even if other pixels
//! confirm the light.

use core::array::from_fn;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::block_errors::BlockErrorSums;
use super::features::{FLOOR, replicate_statistics};
use super::plane::PixelPlane;
use super::{DenoiseOutput, PixelCandidates, REPLICATE_COUNT};
use crate::film::{BRIGHTEST, EstimateDoubt, Film, FourReplicates, Uncertainty};
use crate::picture::Picture;

/// Distances in pixels over which a pixel's error, and the uncertainty of its true colour, are
/// averaged.
const REACH: usize = 10;
const NEAR: usize = 4;

/// Writes the denoised pixels into the picture and returns the picture with its error estimate.
pub(super) fn estimate_error(
    film: &Film,
    four: &FourReplicates<'_>,
    mut picture: Picture,
    pixels: &[PixelCandidates],
) -> DenoiseOutput {
    let size = film.size().map(|edge| edge as usize);
    let near: Vec<PixelPlane> = (0..3)
        .into_par_iter()
        .map(|i| local_mean(size, pixels, NEAR, &|pixel| pixel.error_terms[0][i]))
        .collect();
    let [mut absolute, mut relative, mut by_own] = [(); 3].map(|()| BlockErrorSums::new(size));
    let (mut before, mut change, mut noise) = (0.0, 0.0, 0.0);
    for (index, pixel) in pixels.iter().enumerate() {
        let [mean, _, variance] = replicate_statistics(four.radiance(index));
        let (mut sums, mut colour) = ([0.0; 3], [0.0; 3]);
        for i in 0..3 {
            let (added, error) = (
                f64::from(pixel.changes[0][i]),
                f64::from(pixel.error_terms[0][i]),
            );
            colour[i] = mean[i] + added;
            let (own, apart) = (
                colour[i].max(0.0),
                f64::from(near[i].values[index]).max(0.0).sqrt(),
            );
            let by = [
                1.0,
                relative_error_weight(own, apart),
                relative_error_weight(own, 0.0),
            ];
            sums = from_fn(|k| sums[k] + error * by[k] / 3.0);
            noise += variance[i] * by[2] / 3.0;
            before += mean[i];
            change += added;
        }
        let (x, y) = (index % size[0], index / size[0]);
        [&mut absolute, &mut relative, &mut by_own]
            .into_iter()
            .zip(sums)
            .for_each(|(of, sum)| of.add_error(x, y, sum));
        // Values beyond the range of pictures stay unchanged.
        if mean.iter().all(|mean| mean.abs() < BRIGHTEST) {
            picture.rgb[index] = colour.map(|c| c as f32);
        }
    }
    let off = (relative.mean_error() - by_own.mean_error()).abs() / 4.0;
    let is_unknown = relative.is_interval_meaningless(off, noise / relative.pixels);
    let (rmse, root_relmse) = (absolute.rms_interval(0.0), relative.rms_interval(off));
    let is_wide = is_unknown || root_relmse.is_meaningless();
    let doubt = film
        .estimate_by_replicates()
        .and_then(|(of, is_rare)| of.doubt.or(is_rare.then_some(EstimateDoubt::FewPixels)))
        .or(is_wide.then_some(EstimateDoubt::WideInterval));
    let error = Uncertainty {
        rmse,
        root_relmse,
        replicates: REPLICATE_COUNT as u32,
        doubt,
    };
    let brightened = if before > 0.0 { change / before } else { 0.0 };
    DenoiseOutput {
        standard_error: pixel_standard_errors(size, pixels),
        picture,
        error,
        noisy_error: film.estimate_uncertainty(),
        light_change: brightened,
    }
}

/// Returns the factor from a squared error to a relative squared error: the mean of 1/(c² + 0.01)
/// over the two possible true colours c = `colour` ± `apart`.
fn relative_error_weight(colour: f64, apart: f64) -> f64 {
    let over = |colour: f64| 1.0 / (colour.max(0.0).powi(2) + FLOOR);
    f64::midpoint(over(colour + apart), over(colour - apart))
}

/// Returns, for each pixel, the mean of a quantity over the square of 2 `reach` + 1 pixels around
/// it.
fn local_mean(
    [width, height]: [usize; 2],
    pixels: &[PixelCandidates],
    reach: usize,
    of: &(dyn Fn(&PixelCandidates) -> f32 + Sync),
) -> PixelPlane {
    PixelPlane {
        width,
        height,
        values: pixels.iter().map(of).collect(),
    }
    .box_mean(reach)
}

/// Returns the root mean squared error of each pixel and channel. Absolute and relative squared
/// errors are averaged over the neighbourhood, and the average that gives less is used. Beside a
/// lamp the absolute average is too large, because it includes the lamp's error. At a lamp the
/// relative average is too large, because the errors of dark neighbours are scaled to the lamp's
/// brightness.
fn pixel_standard_errors(size: [usize; 2], pixels: &[PixelCandidates]) -> Vec<[f32; 3]> {
    let near = |of: &(dyn Fn(&PixelCandidates) -> f32 + Sync)| local_mean(size, pixels, REACH, of);
    let channels: Vec<[PixelPlane; 2]> = (0..3)
        .into_par_iter()
        .map(|i| {
            [
                near(&|pixel| pixel.error_terms[0][i]),
                near(&|pixel| pixel.error_terms[0][i] / relative_error_denominator(pixel, i)),
            ]
        })
        .collect();
    let value_of = |(index, pixel): (usize, &PixelCandidates)| {
        from_fn(|i| {
            let [absolute, relative] = channels[i].each_ref().map(|plane| plane.values[index]);
            absolute
                .min(relative * relative_error_denominator(pixel, i))
                .max(0.0)
                .sqrt()
        })
    };
    pixels.iter().enumerate().map(value_of).collect()
}

/// Returns the denominator of a pixel's relative squared error in a channel: the product of its
/// denoised and its leave-one-out colour, plus 0.01.
fn relative_error_denominator(pixel: &PixelCandidates, channel: usize) -> f32 {
    pixel.changes[1][channel].max(0.0) * pixel.base_colour[channel].max(0.0) + FLOOR as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the true colour is assumed on both sides of the picture's own, and not below
    /// black.
    #[test]
    fn errors_are_relative_to_what_may_be_true() {
        assert!((relative_error_weight(0.5, 0.3) - (1.0 / 0.65 + 1.0 / 0.05) / 2.0).abs() < 1e-12);
        assert!((relative_error_weight(0.1, 0.3) - (1.0 / 0.17 + 1.0 / 0.01) / 2.0).abs() < 1e-12);
        assert_eq!(relative_error_weight(2.0, 0.0), 1.0 / 4.01);
    }

    /// Protects: a quarter of the difference to the estimate by the picture's own colour counts as
    /// a standard error, where blocks alone show none: for 0.5 with a squared error of 0.01
    /// everywhere.
    #[test]
    fn an_unknown_true_colour_widens_the_interval() {
        use crate::film::tests::{ReplicateSample, film_of};
        let sample = ReplicateSample {
            radiance: [0.5; 3],
            emission: [0.0; 3],
            albedo: [0.5; 3],
        };
        let film = film_of([32, 16], |_, _| sample);
        let mut pixel = PixelCandidates {
            base_colour: [0.5; 3],
            ..PixelCandidates::default()
        };
        (pixel.changes[1], pixel.error_terms[0]) = ([0.5; 3], [0.01; 3]);
        let four = film.merge_into_four_replicates().expect("all that is read");
        let found_estimate = estimate_error(&film, &four, film.mean_colours(), &[pixel; 32 * 16])
            .error
            .root_relmse;
        let (claim, by_own) = (0.005 * (1.0 / 0.37 + 1.0 / 0.17), 0.01 / 0.26);
        let off = (claim - by_own) / 4.0;
        assert!(
            (found_estimate.value.powi(2) - claim).abs() < 1e-6,
            "{found_estimate:?} for {claim}"
        );
        assert!(
            (found_estimate.low.powi(2) - (claim - 1.959_963_984_540_054 * off)).abs() < 1e-6
                && off > 1e-4,
            "{found_estimate:?}, {off}"
        );
    }

    /// Protects: a pixel's error is the lesser of the absolute and the relative error of its
    /// surroundings. A lamp of 100 among eight black pixels with squared errors of 0.9 and 0.09 has
    /// the mean absolute one, 0.18; they have the mean of the errors relative to 0.01.
    #[test]
    fn a_lamp_does_not_lend_its_error() {
        let pixel = |colour: f32, squared: f32| {
            let mut pixel = PixelCandidates {
                base_colour: [1.0; 3],
                ..PixelCandidates::default()
            };
            (pixel.changes[1], pixel.error_terms[0]) = ([colour; 3], [squared; 3]);
            pixel
        };
        let mut pixels = [pixel(0.0, 0.09); 9];
        pixels[4] = pixel(100.0, 0.9);
        pixels[4].base_colour = [100.0; 3];
        let errors = pixel_standard_errors([3, 3], &pixels);
        let relative = (8.0 * 9.0 + 0.9 / (100.0 * 100.0 + 0.01)) / 9.0;
        for (i, expected) in [(4, 0.18_f64), (0, 0.01 * relative), (7, 0.01 * relative)] {
            assert!(
                errors[i]
                    .iter()
                    .all(|e| (f64::from(e * e) / expected - 1.0).abs() < 1e-5),
                "{i}: {:?} for {expected}",
                errors[i]
            );
        }
    }

    /// Protects: the noisy picture's squared error decides whether an estimate is meaningful,
    /// whatever its value. Errors of 1 in every other column of blocks, or of a half and a negative
    /// half, have a standard error of 0.16 to 0.19. Replicates that are 0.25 or 0.05 from a mean of
    /// black have a variance of 2.1 or 0.083 relative to it.
    #[test]
    fn missing_claims_follow_from_the_noise() {
        use crate::film::tests::{ReplicateSample, film_of};
        let doubt = |noise: f64, below: f32| {
            let sample = |_: usize, replicate: usize| {
                let radiance = [if replicate < 2 { noise } else { -noise }; 3];
                ReplicateSample {
                    radiance,
                    emission: [0.0; 3],
                    albedo: [0.5; 3],
                }
            };
            let film = film_of([32, 16], sample);
            let mut pixels = [PixelCandidates::default(); 32 * 16];
            for (index, pixel) in pixels.iter_mut().enumerate() {
                // Relative to black, a squared error of 0.01 is 1.
                pixel.error_terms[0] =
                    [0.01 * (f32::from(u8::from(index % 32 / 8 % 2 == 1)) - below); 3];
            }
            let four = film.merge_into_four_replicates().expect("all that is read");
            estimate_error(&film, &four, film.mean_colours(), &pixels)
                .error
                .doubt
        };
        for below in [0.0, 0.5] {
            let [much, little] = [0.25, 0.05].map(|noise| doubt(noise, below));
            assert_eq!(
                (much, little),
                (None, Some(EstimateDoubt::WideInterval)),
                "{below}"
            );
        }
    }
}
