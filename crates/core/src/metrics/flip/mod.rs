//! FLIP: visibility of the difference between two pictures that are shown alternately in the same
//! place.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator
//! for Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques
//! 3(2), 2020. Section numbers in this module refer to that paper. The implementation follows the
//! paper, for low-dynamic-range pictures; every filter is a sum of separable filters.

mod colour;
mod filters;

use rayon::prelude::*;
use raywright_bvh::scalar::Real;

use self::colour::{hyab, srgb_to_ycxcz, to_hunt_lab};
use self::filters::{ContrastFilters, ScalarImage, feature_differences};
use super::{MetricsError, check_sizes};
use crate::picture::Picture;

/// Pixels per degree of the paper's viewing condition: a screen 0.7 m wide with 3840 pixels, seen
/// from 0.7 m.
pub const DEFAULT_PIXELS_PER_DEGREE: f64 = 3840.0 * core::f64::consts::PI / 180.0;

/// Exponent applied to HyAB distances of colours (section 4.1.3 of the FLIP paper).
const COLOUR_EXPONENT: f32 = 0.7;
/// Bend of the piecewise linear map from colour differences to 0..1 (section 4.1.3 of the FLIP
/// paper). The largest difference times this factor is mapped to [`SPREAD_TO`].
const SPREAD_FROM: f32 = 0.4;
const SPREAD_TO: f32 = 0.95;

/// Returns the FLIP difference of each pixel, 0 (equal) to 1, row by row from the top. Both
/// pictures hold sRGB display values in 0..1. Values outside are clipped, and a pixel with a NaN
/// counts as [`NAN_MARKER`](crate::display::NAN_MARKER). `pixels_per_degree` is the viewing
/// condition, usually [`DEFAULT_PIXELS_PER_DEGREE`].
///
/// # Errors
/// [`MetricsError::Size`] for different sizes, [`MetricsError::Pixels`] for an empty or
/// inconsistent picture, [`MetricsError::PixelsPerDegree`] outside 1 to 1000.
pub fn flip(
    picture: &Picture,
    reference: &Picture,
    pixels_per_degree: f64,
) -> Result<Vec<f32>, MetricsError> {
    check_sizes(picture, reference)?;
    if !(1.0..=1000.0).contains(&pixels_per_degree) {
        return Err(MetricsError::PixelsPerDegree(pixels_per_degree));
    }
    let [picture, reference] = [picture, reference].map(srgb_to_ycxcz);
    let spatial = ContrastFilters::new(pixels_per_degree);
    let seen = [&picture, &reference].map(|planes| to_hunt_lab(&spatial.filter(planes)));
    let features = feature_differences(&picture[0], &reference[0], pixels_per_degree);
    let redistribution = ColourErrorMapping::new();
    let pixels = (seen[0].par_iter(), seen[1].par_iter(), features.par_iter());
    let combine = |(a, b, feature): (&[f32; 3], &[f32; 3], &f32)| {
        // A feature difference amplifies the colour difference (4.3).
        Real::powf(redistribution.apply(hyab(*a, *b)), 1.0 - feature).clamp(0.0, 1.0)
    };
    Ok(pixels.into_par_iter().map(combine).collect())
}

/// Map of HyAB colour distances to colour errors in 0..1 (section 4.1.3 of the FLIP paper).
struct ColourErrorMapping {
    max_distance: f32,
}

impl ColourErrorMapping {
    fn new() -> Self {
        // Green and blue are the corners of the gamut with the largest distance.
        let corner = |rgb: [f32; 3]| {
            let picture = Picture {
                rgb: vec![rgb],
                ..Picture::new(1, 1)
            };
            to_hunt_lab(&srgb_to_ycxcz(&picture))[0]
        };
        let distance = hyab(corner([0.0, 1.0, 0.0]), corner([0.0, 0.0, 1.0]));
        Self {
            max_distance: Real::powf(distance, COLOUR_EXPONENT),
        }
    }

    /// Returns the colour error, 0 to 1, for a HyAB colour distance.
    fn apply(&self, distance: f32) -> f32 {
        let power = Real::powf(distance, COLOUR_EXPONENT);
        let joint = SPREAD_FROM * self.max_distance;
        if power < joint {
            power / joint * SPREAD_TO
        } else {
            SPREAD_TO + (power - joint) / (self.max_distance - joint) * (1.0 - SPREAD_TO)
        }
    }
}

/// Picture in an opponent colour space, with one plane per channel.
type OpponentImage = [ScalarImage; 3];

#[cfg(test)]
mod tests;
