//! Guide of a filter pass: the planes by which pixels are compared, and the tolerance of the
//! comparison.

use super::plane::{ColourPlanes, PixelPlane};

/// Planes by which a filter pass compares pixels.
pub(super) struct FilterGuide<'a> {
    pub colour: &'a ColourPlanes,
    /// Variance of the guide's colour in each pixel, summed over channels.
    pub variance: &'a PixelPlane,
    /// Variance of the noise in the filtered targets. A neighbour more than twice as noisy as the
    /// pixel has less weight.
    pub noise: &'a PixelPlane,
    /// Inverse of `noise`.
    pub inverse_noise: &'a PixelPlane,
    /// Surface features, each with the inverse of its tolerated squared difference.
    pub features: &'a [(PixelPlane, PixelPlane)],
    /// Inverse of the tolerated squared difference of colours, which is measured in units of the
    /// noise's variance.
    pub inverse_tolerance: f32,
}
