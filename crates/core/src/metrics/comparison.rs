//! Comparison of a picture with a reference, for the command `compare`.

use serde::Serialize;

use super::{
    DEFAULT_PIXELS_PER_DEGREE, MeanAndQuantiles, MetricsError, PictureErrors, check_sizes, flip,
    max_channel_differences, mean_and_quantiles, picture_errors, share_of_pixels_above,
};
use crate::display::{Display, curve};
use crate::picture::{Encoding, Picture};
use crate::scene::TransferCurve;

/// Thresholds in 255ths of the display range. For each threshold, the pixels with a larger
/// difference are counted.
const THRESHOLDS: [u32; 5] = [0, 1, 2, 8, 32];

/// One of the two pictures of [`compare`], with the encoding (linear or display) of its pixel
/// values.
#[derive(Clone, Copy, Debug)]
pub struct ComparedPicture<'a> {
    /// Picture to be compared.
    pub picture: &'a Picture,
    /// Encoding of the pixel values: linear or display.
    pub encoding: Encoding,
}

/// Result of the comparison of a picture with a reference. Additional layers of the pictures are
/// ignored. Coverage (alpha) is compared separately from colour.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Whether colours and coverage are equal everywhere, to the bit.
    pub identical: bool,
    /// Encoding in which `errors` were computed: linear radiance if both pictures are linear, else
    /// display values.
    pub encoding: Encoding,
    /// Numerical errors of the colours, in the units of `encoding`.
    pub errors: PictureErrors,
    /// For each of several thresholds, the share of the pixels whose display values differ by more
    /// than the threshold.
    pub beyond: Vec<ShareAboveThreshold>,
    /// Mean and quantiles over all pixels of the FLIP difference of display values, at
    /// [`DEFAULT_PIXELS_PER_DEGREE`].
    pub flip: MeanAndQuantiles,
    /// Largest difference of coverage, 0 to 1; `None` if neither picture has coverage. If only one
    /// picture has it, the other picture has the coverage 1 everywhere.
    pub coverage: Option<f64>,
    /// Errors of the coverage; `None` if neither picture has coverage.
    pub coverage_errors: Option<CoverageErrors>,
    /// FLIP difference of each pixel, row by row from the top.
    #[serde(skip)]
    pub flip_map: Vec<f32>,
}

/// Differences between the coverages (alpha) of two pictures, computed as for grey pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CoverageErrors {
    /// Number of pixels left out because a coverage is not finite.
    pub non_finite: usize,
    /// Root mean squared difference.
    pub rmse: f64,
    /// Mean of (A − B)² / (B² + 0.01) for coverage A and reference B.
    pub relmse: f64,
    /// `relmse` without the worst 0.1 % of the pixels.
    pub relmse_trimmed: f64,
    /// Peak signal-to-noise ratio in decibels for a peak of 1; `None` for equal coverages.
    pub psnr: Option<f64>,
    /// Mean FLIP difference, 0 to 1.
    pub flip: f64,
}

/// Share of the pixels in which some channel differs by more than a threshold or is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShareAboveThreshold {
    /// Threshold in 255ths of the display range.
    pub codes: u32,
    /// Share of all pixels, 0 to 1.
    pub share: f64,
}

/// Compares a picture with a reference of the same size. `display` converts linear pictures to
/// display values for FLIP and for the thresholds. If one picture holds display values and the
/// other is linear, the linear picture is converted for the numerical errors too.
///
/// # Errors
/// [`MetricsError::Size`] for different sizes, [`MetricsError::Pixels`] for an empty or
/// inconsistent picture.
pub fn compare(
    picture: ComparedPicture<'_>,
    reference: ComparedPicture<'_>,
    display: Display,
) -> Result<Comparison, MetricsError> {
    check_sizes(picture.picture, reference.picture)?;
    let both_linear =
        picture.encoding == Encoding::Linear && reference.encoding == Encoding::Linear;
    let sides = [picture, reference];
    let shown = sides.map(|side| match side.encoding {
        Encoding::Linear if both_linear => Some(display.to_display_values(side.picture)),
        // Display values are stored unassociated, linear values premultiplied.
        Encoding::Linear => Some(display.to_display_values(&side.picture.to_straight_alpha())),
        Encoding::Display => None,
    });
    let values = [0, 1].map(|i| shown[i].as_ref().unwrap_or(sides[i].picture));
    let numbers = if both_linear {
        [picture.picture, reference.picture]
    } else {
        values
    };
    let flip_map = flip(values[0], values[1], DEFAULT_PIXELS_PER_DEGREE)?;
    let differences = max_channel_differences(values[0], values[1])?;
    let beyond = THRESHOLDS.map(|codes| ShareAboveThreshold {
        codes,
        share: share_of_pixels_above(&differences, codes_to_display_threshold(codes)),
    });
    let coverage = max_coverage_difference(picture.picture, reference.picture);
    Ok(Comparison {
        width: picture.picture.width,
        height: picture.picture.height,
        identical: coverage.is_none_or(|difference| difference == 0.0)
            && has_same_bits(numbers[0], numbers[1]),
        encoding: if both_linear {
            Encoding::Linear
        } else {
            Encoding::Display
        },
        errors: picture_errors(numbers[0], numbers[1])?,
        beyond: beyond.to_vec(),
        flip: mean_and_quantiles(&flip_map),
        coverage,
        coverage_errors: coverage
            .map(|largest| coverage_errors(picture.picture, reference.picture, largest))
            .transpose()?,
        flip_map,
    })
}

/// Converts a threshold from 255ths to a display value. A threshold above zero is increased by
/// 1e-6. Without this margin, rounding could let a difference of exactly the threshold exceed it.
fn codes_to_display_threshold(codes: u32) -> f64 {
    if codes == 0 {
        0.0
    } else {
        f64::from(codes) / 255.0 + 1e-6
    }
}

fn has_same_bits(a: &Picture, b: &Picture) -> bool {
    a.rgb
        .iter()
        .zip(&b.rgb)
        .all(|(a, b)| a.map(f32::to_bits) == b.map(f32::to_bits))
}

/// Returns the largest difference of coverage over all pixels; `None` if neither picture has
/// coverage.
fn max_coverage_difference(a: &Picture, b: &Picture) -> Option<f64> {
    if a.alpha.is_none() && b.alpha.is_none() {
        return None;
    }
    let difference = |i| f64::from(coverage_at(a, i) - coverage_at(b, i)).abs();
    Some(
        (0..a.pixel_count())
            .map(difference)
            .fold(0.0, |largest, x| {
                if x > largest || x.is_nan() {
                    x
                } else {
                    largest
                }
            }),
    )
}

/// Returns the coverage of a pixel, 0 to 1; 1 for a picture without coverage.
fn coverage_at(picture: &Picture, pixel: usize) -> f32 {
    picture
        .alpha
        .as_ref()
        .and_then(|alpha| alpha.get(pixel))
        .copied()
        .unwrap_or(1.0)
}

/// Returns the differences between the coverages of two pictures. `largest` is their largest
/// difference.
fn coverage_errors(a: &Picture, b: &Picture, largest: f64) -> Result<CoverageErrors, MetricsError> {
    if largest == 0.0 {
        return Ok(CoverageErrors::default());
    }
    let grey = |picture: &Picture| Picture {
        rgb: (0..picture.pixel_count())
            .map(|pixel| [coverage_at(picture, pixel); 3])
            .collect(),
        ..Picture::new(picture.width, picture.height)
    };
    let (a, b) = (grey(a), grey(b));
    let PictureErrors {
        non_finite,
        rmse,
        relmse,
        relmse_trimmed,
        psnr,
        ..
    } = picture_errors(&a, &b)?;
    let flip = mean_and_quantiles(&flip(&a, &b, DEFAULT_PIXELS_PER_DEGREE)?).mean;
    Ok(CoverageErrors {
        non_finite,
        rmse,
        relmse,
        relmse_trimmed,
        psnr,
        flip,
    })
}

// Heat map: numbers shown as colours from black through purple and orange to pale yellow.

/// Colours of the scale as display values, at equal steps from 0 to 1. Their luminance increases,
/// so the map is readable in greyscale too.
const SCALE: [[f64; 3]; 8] = [
    [0.00, 0.00, 0.02],
    [0.14, 0.07, 0.32],
    [0.34, 0.09, 0.48],
    [0.58, 0.16, 0.47],
    [0.81, 0.27, 0.38],
    [0.95, 0.47, 0.29],
    [0.99, 0.72, 0.40],
    [0.99, 0.97, 0.76],
];

/// Returns a heat map of one number per pixel, row by row from the top. 0 is black; `full` and
/// greater numbers are pale yellow; NaN stays NaN. The picture is linear. It has the intended
/// colours under [`Display::PLAIN`](crate::display::Display::PLAIN).
pub fn heat_map(width: u32, height: u32, values: &[f32], full: f32) -> Picture {
    let colour = |value: &f32| {
        let rgb = heat_scale_colour(f64::from(value / full));
        rgb.map(|x| curve::decode_transfer(TransferCurve::Srgb, x) as f32)
    };
    let mut picture = Picture::new(width, height);
    for (rgb, value) in picture.rgb.iter_mut().zip(values) {
        *rgb = colour(value);
    }
    picture
}

fn heat_scale_colour(x: f64) -> [f64; 3] {
    let place = x.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let index = (place as usize).min(SCALE.len() - 2);
    let (low, high, share) = (SCALE[index], SCALE[index + 1], place - index as f64);
    [0, 1, 2].map(|c| low[c] + (high[c] - low[c]) * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ToneMap;

    fn ramp() -> Picture {
        let mut picture = Picture::new(16, 4);
        for (i, rgb) in picture.rgb.iter_mut().enumerate() {
            *rgb = [i as f32 / 40.0, 0.2, 1.0 - i as f32 / 64.0];
        }
        picture
    }

    fn linear(picture: &Picture) -> ComparedPicture<'_> {
        ComparedPicture {
            picture,
            encoding: Encoding::Linear,
        }
    }

    /// Protects: a picture compared with itself has zero error in every figure.
    #[test]
    fn a_picture_is_identical_to_itself() {
        let picture = ramp();
        let own = compare(linear(&picture), linear(&picture), Display::default()).unwrap();
        assert!(own.identical);
        assert_eq!(
            (own.errors.rmse, own.flip.maximum, own.coverage),
            (0.0, 0.0, None)
        );
        assert!(own.beyond.iter().all(|beyond| beyond.share == 0.0));
    }

    /// Protects: a linear picture against its own display picture is compared by display values,
    /// through the given display.
    #[test]
    fn unlike_encodings_meet_as_display_values() {
        let picture = ramp();
        let display = Display {
            tone_map: ToneMap::Aces,
            exposure_stops: -1.0,
            ..Display::default()
        };
        let shown = display.to_display_values(&picture);
        let side = ComparedPicture {
            picture: &shown,
            encoding: Encoding::Display,
        };
        let comparison = compare(linear(&picture), side, display).unwrap();
        assert_eq!(
            (comparison.encoding, comparison.identical),
            (Encoding::Display, true)
        );
        let wrong = compare(linear(&picture), side, Display::PLAIN).unwrap();
        assert!(wrong.errors.rmse > 0.01 && wrong.flip.mean > 0.01);
    }

    /// Protects: codes that differ by one are not above 1/255, whatever the rounding; codes that
    /// differ by two are; both count as different.
    #[test]
    fn counting_is_in_whole_codes() {
        let code = |k: u32| (f64::from(k) / 255.0) as f32;
        for k in 0..253 {
            let pictures = [0, 1, 2].map(|step| Picture {
                rgb: vec![[code(k + step), 0.5, 0.5]],
                ..Picture::new(1, 1)
            });
            let side = |i: usize| ComparedPicture {
                picture: &pictures[i],
                encoding: Encoding::Display,
            };
            let shares = |i| compare(side(0), side(i), Display::PLAIN).unwrap().beyond;
            assert_eq!((shares(1)[0].share, shares(1)[1].share), (1.0, 0.0), "{k}");
            assert_eq!((shares(2)[1].share, shares(2)[2].share), (1.0, 0.0), "{k}");
        }
        for apart in 0..64 {
            let [a, b] = [0, apart].map(|k| Picture {
                rgb: vec![[0.5, code(k), 0.5]],
                ..Picture::new(1, 1)
            });
            let side = |picture| ComparedPicture {
                picture,
                encoding: Encoding::Display,
            };
            let beyond = compare(side(&a), side(&b), Display::PLAIN).unwrap().beyond;
            let expected = [0, 1, 2, 8, 32].map(|codes| ShareAboveThreshold {
                codes,
                share: if apart > codes { 1.0 } else { 0.0 },
            });
            assert_eq!(beyond, expected, "{apart}");
        }
    }

    /// Protects: a difference in coverage alone is reported, and so is a single bit.
    #[test]
    fn coverage_and_single_bits_count() {
        let picture = ramp();
        let mut covered = picture.clone();
        covered.alpha = Some(vec![1.0; 64]);
        let compared =
            |other: &Picture| compare(linear(other), linear(&picture), Display::default()).unwrap();
        assert_eq!(
            (compared(&covered).identical, compared(&covered).coverage),
            (true, Some(0.0))
        );
        covered.alpha = Some([vec![1.0; 63], vec![0.5]].concat());
        assert_eq!(
            (compared(&covered).identical, compared(&covered).coverage),
            (false, Some(0.5))
        );
        let mut other = picture.clone();
        other.rgb[9][1] = other.rgb[9][1].next_up();
        assert!(!compared(&other).identical);
        assert_eq!(
            compared(&other)
                .errors
                .worst
                .map(|worst| (worst.x, worst.y)),
            Some((9, 0))
        );
    }

    /// Protects: different sizes are an error, not a crop.
    #[test]
    fn sizes_must_agree() {
        let (picture, other) = (ramp(), Picture::new(4, 16));
        let error = compare(linear(&picture), linear(&other), Display::default()).unwrap_err();
        assert_eq!(error, MetricsError::Size(16, 4, 4, 16));
    }
}

#[cfg(test)]
mod heat_tests {
    use super::*;
    use crate::display::{Display, NAN_MARKER};

    /// Protects: a larger value always has a higher luminance, so that the map is readable without
    /// its legend and in grey.
    #[test]
    fn luminance_rises_with_the_value() {
        let values: Vec<f32> = (0..=1000).map(|i| i as f32 / 500.0).collect();
        let picture = heat_map(1001, 1, &values, 2.0);
        let luminance: Vec<f64> = picture
            .rgb
            .iter()
            .map(|rgb| curve::luminance(rgb.map(f64::from)))
            .collect();
        assert!(luminance.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(luminance[0] < 0.01 && luminance[1000] > 0.85);
    }

    /// Protects: values beyond the scale get its end colours, and NaN gets no colour of the scale.
    #[test]
    fn ends_and_nan_are_defined() {
        let map = |value| {
            Display::PLAIN
                .build_map()
                .display_values(heat_map(1, 1, &[value], 0.5).rgb[0])
        };
        assert_eq!(map(-1.0), map(0.0));
        assert_eq!(map(0.5), map(f32::INFINITY));
        assert_ne!(map(0.25), map(0.5));
        assert_eq!(map(f32::NAN), NAN_MARKER);
    }
}
