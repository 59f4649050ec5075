//! The guide of a filter pass: planes by which pixels are compared, and how strictly.

use super::plane::{ColourPlanes, PixelPlane};

/// Strictness of the comparison: inverse of the squared tolerance in units of noise, and the least
/// share of a pixel's own difference in the mean over its neighbours.
#[derive(Clone, Copy)]
pub(super) struct Strictness {
    pub inverse: f32,
    pub own: f32,
}

/// Guide for comparing pixels.
pub(super) struct Guide<'a> {
    pub colour: &'a ColourPlanes,
    /// Variance of the guide, summed over channels.
    pub variance: &'a PixelPlane,
    /// Variance of the targets, and its inverse: much noisier pixels get less weight.
    pub noise: &'a PixelPlane,
    pub inverse_noise: &'a PixelPlane,
    /// Features, each with the inverse of the tolerated squared difference.
    pub features: &'a [(PixelPlane, PixelPlane)],
    pub strictness: Strictness,
}
