//! Guide of a filter pass: the planes in which pixels are compared, and the tolerance of the
//! comparison.

use super::plane::{ColourPlanes, PixelPlane};

/// Tolerance of a comparison of pixels: `inverse_tolerance` is the inverse of the squared tolerance in units
/// of noise. `own_share` is the share of a pixel's own squared difference below which the mean over three
/// by three pixels cannot fall.
#[derive(Clone, Copy)]
pub(super) struct FilterTolerance {
    pub inverse_tolerance: f32,
    pub own_share: f32,
}

/// Planes in which a filter pass compares pixels.
pub(super) struct Guide<'a> {
    pub colour: &'a ColourPlanes,
    /// Variance of the guide's colour at each pixel, summed over channels.
    pub variance: &'a PixelPlane,
    /// Variance of the filtered targets, and its inverse. A neighbour that is more than twice as
    /// noisy gets less weight.
    pub noise: &'a PixelPlane,
    pub inverse_noise: &'a PixelPlane,
    /// Features of the surfaces, each with the inverse of the tolerated squared difference.
    pub features: &'a [(PixelPlane, PixelPlane)],
    pub strictness: FilterTolerance,
}
