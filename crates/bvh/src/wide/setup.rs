//! What all boxes and blocks ask of a ray, made once for it.

use super::block::LARGE;
use crate::ray::Ray;

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
    /// The excluded lower end of distances.
    pub near: f32,
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
    /// Bounds of [`super::filter`]: of a lane's reach, and factors of what it is made from.
    pub reach: f32,
    pub weight: f32,
    pub core: f32,
    pub least: f32,
    pub determinant: f32,
    pub distance: f32,
}

/// The greater one, the second where the first is not a number: one instruction, since whatever is not a number is tested exactly.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn greatest_of(v: [f32; 3]) -> f32 {
    greater(v[0].abs(), greater(v[1].abs(), v[2].abs()))
}

#[inline(always)]
fn least_of(v: [f32; 3]) -> f32 {
    let lesser = |a: f32, b: f32| if a < b { a } else { b };
    lesser(v[0].abs(), lesser(v[1].abs(), v[2].abs()))
}

impl Setup {
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], near: f32) -> Self {
        let inverse = direction.map(|d| 1.0 / d);
        let greatest = greatest_of(direction);
        // No less than the length, be that below one or above, and without a root: directions are of unit length but for rounding.
        let length =
            greater(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2], 1.0) * ROUNDED;
        let sane = greatest < LONG && greatest > 1.0 / LONG && greatest_of(origin) < LARGE;
        Self {
            origin,
            direction,
            inverse,
            widened: inverse.map(|i| i * (1.0 + 8.0 * U)),
            later: greater(-near, 0.0) * (16.0 * U),
            side: inverse.map(|i| usize::from(i < 0.0)),
            near,
            reach: if sane { 1e-30 } else { f32::INFINITY },
            weight: 50.0 * U * length,
            core: 105.0 * W * length,
            least: 512.0 * f32::MIN_POSITIVE,
            determinant: 14.0 * U * length,
            distance: 2.0 * ROUNDED * least_of(inverse),
        }
    }

    /// The ray, at no time.
    pub fn ray(&self) -> Ray<f32> {
        Ray::new(self.origin.into(), self.direction.into())
    }

    /// A far end as boxes use it, later by what the rounding of their distances may take.
    #[inline(always)]
    pub fn last(far: f32) -> f32 {
        far + far.abs() * (8.0 * U)
    }
}
