//! What all boxes and blocks ask of a ray, made once for it.

use super::block::LARGE;
use crate::ray::{Interval, Ray};

/// Directions as long as this or longer, or shorter than its inverse, might leave the range of f32: everything is then tested exactly.
const LONG: f32 = (1 << 20) as f32;
/// 2⁻²⁴ and 2⁻⁵³.
const U: f32 = 5.960_464_5e-8;
const W: f32 = 1.110_223e-16;
/// More than what rounding may take from a bound while it is computed.
const ROUNDED: f32 = 1.000_01;

/// A ray as the kernels know it, all in f32.
#[derive(Clone, Copy)]
pub(super) struct Setup {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub inverse: [f32; 3],
    /// The same, widened for the planes through which the ray leaves.
    pub widened: [f32; 3],
    /// By how much exits are later besides: something only where distances below zero count, which widening would make less.
    pub later: f32,
    /// The side of each axis through which the ray enters: from the sign of the inverse actually used, so that −0 is treated as
    /// what it does.
    pub side: [usize; 3],
    /// The excluded lower end of distances.
    pub near: f32,
    /// Bounds of [`super::filter`]: of a lane's reach, and factors of what it is made from.
    pub reach: f32,
    pub weight: f32,
    pub core: f32,
    pub least: f32,
    pub determinant: f32,
    pub distance: f32,
}

impl Setup {
    #[inline(always)]
    pub fn new(ray: &Ray<f32>, range: Interval<f32>) -> Self {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let inverse = direction.map(|d| 1.0 / d);
        let greatest = ray.direction.abs().max_element();
        let length = ray.direction.length() * ROUNDED;
        let sane = greatest < LONG && greatest > 1.0 / LONG && ray.origin.abs().max_element() < LARGE;
        Self {
            origin,
            direction,
            inverse,
            widened: inverse.map(|i| i * (1.0 + 8.0 * U)),
            later: (-range.min).max(0.0) * (16.0 * U),
            side: inverse.map(|i| usize::from(i < 0.0)),
            near: range.min,
            reach: if sane { 1e-30 } else { f32::INFINITY },
            weight: 50.0 * U * length,
            core: 105.0 * W * length,
            least: 512.0 * f32::MIN_POSITIVE,
            determinant: 14.0 * U * length,
            distance: 2.0 * ROUNDED / greatest,
        }
    }

    /// A far end as boxes use it, later by what the rounding of their distances may take.
    #[inline(always)]
    pub fn last(far: f32) -> f32 {
        far + far.abs() * (8.0 * U)
    }
}
