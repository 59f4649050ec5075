//! Comparison of a picture with a reference: numerical errors, visible differences (FLIP),
//! differences that noise does not explain, and heat maps.

mod comparison;
mod errors;
mod flip;
mod noise;
mod statistics;

pub use comparison::{
    ComparedPicture, Comparison, CoverageErrors, ShareAboveThreshold, compare, heat_map,
};
pub use errors::{PictureErrors, WorstPixel, max_channel_differences};
pub(crate) use errors::{RELATIVE_FLOOR, picture_errors, share_of_pixels_above};
pub use flip::{DEFAULT_PIXELS_PER_DEGREE, flip};
pub use noise::{NoiseTestResult, PictureWithErrors, TestedBlock, test_against_noise};
pub use statistics::{MeanAndQuantiles, mean_and_quantiles, student_factor_95};

use crate::picture::Picture;

/// Reason why two pictures cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// The two pictures differ in size.
    #[error(
        "the pictures have different sizes, {0} × {1} and {2} × {3} pixels; only pictures of the same size can be compared"
    )]
    Size(u32, u32, u32, u32),
    /// A picture has no pixels, or a buffer does not match the picture's size.
    #[error(
        "a picture has no pixels, or a buffer whose length does not match its width and height"
    )]
    Pixels,
    /// The pixels per degree of FLIP are outside 1 to 1000.
    #[error("{0} pixels per degree are out of range: FLIP needs a number from 1 to 1000")]
    PixelsPerDegree(f64),
}

/// Checks that two pictures have the same size, at least one pixel, and a colour for every pixel.
fn check_sizes(picture: &Picture, reference: &Picture) -> Result<(), MetricsError> {
    if (picture.width, picture.height) != (reference.width, reference.height) {
        return Err(MetricsError::Size(
            picture.width,
            picture.height,
            reference.width,
            reference.height,
        ));
    }
    let n = picture.pixel_count();
    if n == 0 || picture.rgb.len() != n || reference.rgb.len() != n {
        return Err(MetricsError::Pixels);
    }
    Ok(())
}
