//! Errors of a picture's pixel values: RMSE, relative MSE, PSNR, the worst pixel, and the share of
//! pixels above a threshold.

use raywright_bvh::scalar::Real;
use serde::Serialize;

use super::{MetricsError, check_sizes};
use crate::picture::Picture;

/// Constant added to the squared colour in the denominator of the relative error, so that the error
/// of dark pixels stays finite.
pub(crate) const RELATIVE_FLOOR: f64 = 0.01;
/// One in this many pixels, the worst, is omitted from the trimmed relative error.
const TRIM: usize = 1000;

/// Errors of a picture against a reference, over all pixels and three channels, in the units of the
/// pictures. A pixel that is not finite in one of the pictures is left out and counted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureErrors {
    /// Number of compared pixels.
    pub pixels: usize,
    /// Number of pixels left out because a channel is NaN or infinite.
    pub non_finite: usize,
    /// Root mean squared error.
    pub rmse: f64,
    /// Mean of (I − R)² / (R² + 0.01) for picture I and reference R.
    pub relmse: f64,
    /// `relmse` without the worst 0.1 % of the pixels (rounded down), so that a few fireflies do
    /// not dominate.
    pub relmse_trimmed: f64,
    /// Peak signal-to-noise ratio in decibels for a peak of 1; `None` for equal pictures.
    pub psnr: Option<f64>,
    /// Mean absolute error.
    pub mean_abs: f64,
    /// Largest absolute error of a channel.
    pub max_abs: f64,
    /// Pixel with the largest absolute error: the first of several, row by row. `None` for equal
    /// pictures.
    pub worst: Option<WorstPixel>,
}

/// Pixel with the largest error, with its colours in both pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WorstPixel {
    /// Column from the left.
    pub x: u32,
    /// Row from the top.
    pub y: u32,
    /// Colour in the picture.
    pub picture: [f32; 3],
    /// Colour in the reference.
    pub reference: [f32; 3],
}

/// Computes the errors of a picture against a reference of the same size.
///
/// # Errors
/// [`MetricsError::Size`] for different sizes, [`MetricsError::Pixels`] for an empty or
/// inconsistent picture.
pub(crate) fn picture_errors(
    picture: &Picture,
    reference: &Picture,
) -> Result<PictureErrors, MetricsError> {
    check_sizes(picture, reference)?;
    let (mut squares, mut absolutes, mut max_abs, mut worst) = (0.0, 0.0, 0.0_f64, None);
    let mut relative = Vec::with_capacity(picture.pixel_count());
    for (index, (image, truth)) in picture.rgb.iter().zip(&reference.rgb).enumerate() {
        if !is_finite(image) || !is_finite(truth) {
            continue;
        }
        let mut pixel = 0.0;
        for (&i, &r) in image.iter().zip(truth) {
            let (i, r) = (f64::from(i), f64::from(r));
            let error = i - r;
            squares += error * error;
            absolutes += error.abs();
            pixel += error * error / (r * r + RELATIVE_FLOOR);
            if error.abs() > max_abs {
                (max_abs, worst) = (error.abs(), Some(index));
            }
        }
        relative.push(pixel / 3.0);
    }
    let pixels = relative.len();
    let per_channel = |sum: f64| {
        if pixels == 0 {
            0.0
        } else {
            sum / (3 * pixels) as f64
        }
    };
    let mse = per_channel(squares);
    relative.sort_unstable_by(f64::total_cmp);
    Ok(PictureErrors {
        pixels,
        non_finite: picture.pixel_count() - pixels,
        rmse: mse.sqrt(),
        relmse: mean_or_zero(&relative),
        relmse_trimmed: mean_or_zero(&relative[..pixels - pixels / TRIM]),
        psnr: (mse > 0.0).then(|| -10.0 * Real::ln(mse) / core::f64::consts::LN_10),
        mean_abs: per_channel(absolutes),
        max_abs,
        worst: worst.map(|index| worst_pixel(picture, reference, index)),
    })
}

fn worst_pixel(picture: &Picture, reference: &Picture, index: usize) -> WorstPixel {
    let width = picture.width as usize;
    let (x, y) = ((index % width) as u32, (index / width) as u32);
    WorstPixel {
        x,
        y,
        picture: picture.rgb[index],
        reference: reference.rgb[index],
    }
}

fn mean_or_zero(values: &[f64]) -> f64 {
    if values.is_empty() {
        0.0
    } else {
        values.iter().sum::<f64>() / values.len() as f64
    }
}

fn is_finite(rgb: &[f32; 3]) -> bool {
    rgb.iter().all(|x| x.is_finite())
}

/// Returns, for each pixel, the largest absolute difference of its three channels, row by row. It
/// is infinite for a pixel that is not finite in one of the pictures.
///
/// # Errors
/// [`MetricsError::Size`] for different sizes, [`MetricsError::Pixels`] for an empty or
/// inconsistent picture.
pub fn max_channel_differences(
    picture: &Picture,
    reference: &Picture,
) -> Result<Vec<f32>, MetricsError> {
    check_sizes(picture, reference)?;
    let difference = |(image, truth): (&[f32; 3], &[f32; 3])| {
        if !is_finite(image) || !is_finite(truth) {
            return f32::INFINITY;
        }
        image
            .iter()
            .zip(truth)
            .map(|(i, r)| (i - r).abs())
            .fold(0.0, f32::max)
    };
    Ok(picture
        .rgb
        .iter()
        .zip(&reference.rgb)
        .map(difference)
        .collect())
}

/// Returns the share of the pixels, 0 to 1, whose difference is above a threshold. `differences`
/// comes from [`max_channel_differences`].
pub(crate) fn share_of_pixels_above(differences: &[f32], threshold: f64) -> f64 {
    let beyond = differences
        .iter()
        .filter(|&&difference| f64::from(difference) > threshold)
        .count();
    beyond as f64 / differences.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: u32, height: u32, value: f32) -> Picture {
        Picture {
            rgb: vec![[value; 3]; (width * height) as usize],
            ..Picture::new(width, height)
        }
    }

    /// Protects: a picture has zero error against itself, infinities and NaN apart.
    #[test]
    fn a_picture_equals_itself() {
        let picture = grey(3, 2, 0.7);
        let own_errors = picture_errors(&picture, &picture).unwrap();
        assert_eq!(
            (
                own_errors.rmse,
                own_errors.relmse,
                own_errors.max_abs,
                own_errors.psnr,
                own_errors.worst
            ),
            (0.0, 0.0, 0.0, None, None)
        );
        assert_eq!((own_errors.pixels, own_errors.non_finite), (6, 0));
    }

    /// Protects: every figure by hand, for one wrong channel in a 2 × 2 picture.
    #[test]
    fn figures_are_as_defined() {
        let reference = grey(2, 2, 0.5);
        let mut picture = reference.clone();
        picture.rgb[2][1] = 0.25;
        let e = picture_errors(&picture, &reference).unwrap();
        let mse = 0.0625 / 12.0;
        assert!((e.rmse - f64::sqrt(mse)).abs() < 1e-15);
        assert!((e.relmse - 0.0625 / (0.25 + 0.01) / 12.0).abs() < 1e-15);
        assert!((e.psnr.unwrap() + 10.0 * mse.log10()).abs() < 1e-12);
        assert_eq!((e.mean_abs, e.max_abs), (0.25 / 12.0, 0.25));
        let worst = WorstPixel {
            x: 0,
            y: 1,
            picture: [0.5, 0.25, 0.5],
            reference: [0.5; 3],
        };
        assert_eq!(e.worst, Some(worst));
        assert_eq!(e.relmse_trimmed, e.relmse, "four pixels have no 0.1 %");
    }

    /// Protects: the relative error uses the reference's denominator: swapping the pictures changes
    /// it.
    #[test]
    fn relative_error_is_relative_to_the_reference() {
        let (dark, bright) = (grey(1, 1, 0.0), grey(1, 1, 1.0));
        assert!((picture_errors(&bright, &dark).unwrap().relmse - 100.0).abs() < 1e-12);
        assert!((picture_errors(&dark, &bright).unwrap().relmse - 1.0 / 1.01).abs() < 1e-12);
    }

    /// Protects: trimming removes the worst 0.1 % of the pixels and divides by the number of the
    /// remaining ones.
    #[test]
    fn trimming_leaves_the_worst_pixels_out() {
        let reference = grey(50, 40, 0.0);
        let mut picture = grey(50, 40, 0.1);
        picture.rgb[7] = [100.0; 3];
        picture.rgb[8] = [90.0; 3];
        picture.rgb[9] = [1.0; 3];
        let e = picture_errors(&picture, &reference).unwrap();
        // 2 000 pixels: two are left out, the third of the wrong ones stays.
        assert!(
            (e.relmse_trimmed - (1997.0 + 100.0) / 1998.0).abs() < 1e-5,
            "{}",
            e.relmse_trimmed
        );
        assert!(e.relmse > 100.0);
    }

    /// Protects: F04: pixels that are not finite are counted, change no figure, and are above every
    /// threshold.
    #[test]
    fn f04_non_finite_pixels_are_counted_not_hidden() {
        let reference = grey(4, 1, 0.5);
        let mut picture = reference.clone();
        picture.rgb[0][2] = f32::NAN;
        picture.rgb[3][0] = f32::INFINITY;
        let e = picture_errors(&picture, &reference).unwrap();
        assert_eq!((e.pixels, e.non_finite, e.rmse), (2, 2, 0.0));
        let differences = max_channel_differences(&picture, &reference).unwrap();
        assert_eq!(share_of_pixels_above(&differences, 1e30), 0.5);
        let all = Picture {
            rgb: vec![[f32::NAN; 3]; 4],
            ..reference.clone()
        };
        assert_eq!(picture_errors(&all, &reference).unwrap().non_finite, 4);
    }

    /// Protects: the comparison with a threshold is strict, and a single channel suffices.
    #[test]
    fn thresholds_are_strict() {
        let reference = grey(2, 1, 0.0);
        let mut picture = reference.clone();
        picture.rgb[1][2] = -0.25;
        let differences = max_channel_differences(&picture, &reference).unwrap();
        assert_eq!(share_of_pixels_above(&differences, 0.25), 0.0);
        assert_eq!(share_of_pixels_above(&differences, 0.2499), 0.5);
    }

    /// Protects: pictures of different sizes and empty ones return errors that name the reason.
    #[test]
    fn sizes_must_agree() {
        let error = picture_errors(&grey(2, 3, 0.0), &grey(3, 2, 0.0)).unwrap_err();
        assert_eq!(error, MetricsError::Size(2, 3, 3, 2));
        assert!(error.to_string().contains("2 × 3 and 3 × 2 pixels"));
        assert_eq!(
            picture_errors(&grey(0, 3, 0.0), &grey(0, 3, 0.0)),
            Err(MetricsError::Pixels)
        );
        let short = Picture {
            rgb: vec![[0.0; 3]],
            ..Picture::new(2, 2)
        };
        assert_eq!(
            max_channel_differences(&grey(2, 2, 0.0), &short),
            Err(MetricsError::Pixels)
        );
    }
}
