//! Guide of a filter pass: the planes in which pixels are compared, and the tolerance of the
//! comparison.

use super::plane::{ColourPlanes, PixelPlane};

/// Tolerance with which a filter pass compares pixels.
#[derive(Clone, Copy)]
pub(super) struct FilterTolerance {
    /// Inverse of the tolerated squared difference, in units of the noise's variance.
    pub inverse_tolerance: f32,
    /// Share, 0 to 1, of a pixel's own squared difference. The mean difference over three by three
    /// pixels is raised to at least this share.
    pub own_share: f32,
}

/// Pictures in which a filter pass compares pixels, one plane per quantity.
pub(super) struct FilterGuide<'a> {
    pub colour: &'a ColourPlanes,
    /// Variance of the guide's colour at each pixel, summed over channels.
    pub variance: &'a PixelPlane,
    /// Variance of the noise in the filtered targets. A neighbour that is more than twice as noisy
    /// gets less weight.
    pub noise: &'a PixelPlane,
    /// Inverse of `noise`.
    pub inverse_noise: &'a PixelPlane,
    /// Features of the surfaces, each with the inverse of the tolerated squared difference.
    pub features: &'a [(PixelPlane, PixelPlane)],
    pub strictness: FilterTolerance,
}
