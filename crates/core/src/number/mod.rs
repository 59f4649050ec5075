//! Number types for shading: a single number, or numbers side by side in several lanes, one for
//! each path. Generic code serves a single path and also several paths that hit surfaces of the
//! same kind.
//!
//! `f32` and `f64` have one lane; [`Lanes`] has several lanes of `f32`. Every operation in a lane
//! has the same order as for a single number and gives the same bits, so tests compare lanes with
//! single numbers. Generic code does not branch on values that differ by lane: a comparison returns
//! a mask, and a mask selects between two values.
//!
//! [`Number`] is not a supertrait of [`Real`], though every `Real` implements [`Number`]. Otherwise
//! code that names a constant of a `Real` would have to import both traits.

/// Evaluates an expression for each of at most 16 lanes, without a loop.
macro_rules! each_lane {
    ($lanes:expr, $lane:ident, $body:expr) => {
        each_lane!(@ $lanes, $lane, $body, 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15)
    };
    (@ $lanes:expr, $lane:ident, $body:expr, $($k:literal)*) => {
        $(if $k < $lanes {
            let $lane: usize = $k;
            $body;
        })*
    };
}

mod angles;
mod lanes;
mod logarithms;
#[cfg(test)]
mod tests;

use core::fmt::Debug;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

pub(crate) use angles::{angle_above_axis, sines_and_cosines};
use glam::DVec3;
pub use lanes::{LaneMask, Lanes, Vec3Lanes};
pub(crate) use logarithms::{exp, expm1, log1p};
use raywright_bvh::{Real, Vector};

/// A number in each of [`Self::LANES`] lanes. Each lane shades one path.
pub trait Number:
    Copy
    + Debug
    + PartialEq
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Vector of three numbers.
    type Vec3: Vector3<Self>;
    /// A boolean in each lane.
    type Mask: Mask;
    /// An `f64` in each lane, for computations that lose digits by cancellation.
    type Exact: Copy + Debug + PartialEq + Send + Sync + 'static;
    /// Number of lanes.
    const LANES: usize;
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// Returns the value nearest to `x`, in every lane.
    fn from_f64(x: f64) -> Self;
    /// Returns the value nearest to `value(lane)` in each lane.
    fn from_lanes(value: impl FnMut(usize) -> f64) -> Self;
    /// Returns the value of a lane, exactly.
    fn lane(self, index: usize) -> f64;
    /// Returns `value(lane)` in each lane, exactly.
    fn f64_from_lanes(value: impl FnMut(usize) -> f64) -> Self::Exact;
    /// Returns the value of a lane.
    fn f64_lane(exact: Self::Exact, index: usize) -> f64;
    /// Returns whether this number is greater than another, by lane; false for NaN.
    fn greater_than(self, other: Self) -> Self::Mask;
    /// Returns `yes` in lanes where the mask is set, `no` in the others.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Returns the maximum by lane; of a number and NaN, the number.
    fn max(self, other: Self) -> Self;
    /// Returns the minimum by lane; of a number and NaN, the number.
    fn min(self, other: Self) -> Self;
    /// Returns this magnitude with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// Returns the square root, correctly rounded; NaN below zero.
    fn sqrt(self) -> Self;
    /// Returns the power with an integer exponent, by repeated squaring.
    fn powi(self, exponent: u32) -> Self;
    /// Returns the cosine and the sine of an angle in turns, from 0 to 1.
    fn sin_cos_turns(self) -> [Self; 2];
    /// Returns the natural exponential.
    fn exp(self) -> Self;
}

/// A vector of three numbers in each lane. The product of two vectors is componentwise.
pub trait Vector3<N: Number>:
    Copy
    + Debug
    + PartialEq
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<N, Output = Self>
    + Div<N, Output = Self>
    + Neg<Output = Self>
    + AddAssign
{
    /// Zero in every component.
    const ZERO: Self;
    /// One in every component.
    const ONE: Self;
    /// Creates a vector from components.
    fn new(x: N, y: N, z: N) -> Self;
    /// Creates a vector with three equal components.
    fn splat(value: N) -> Self;
    /// Returns the vector nearest to `value(lane)` in each lane.
    fn from_lanes(value: impl FnMut(usize) -> DVec3) -> Self;
    /// Returns the value of a lane, exactly.
    fn lane(self, index: usize) -> DVec3;
    /// Returns the first component.
    fn x(self) -> N;
    /// Returns the second component.
    fn y(self) -> N;
    /// Returns the third component.
    fn z(self) -> N;
    /// Returns the scalar product.
    fn dot(self, other: Self) -> N;
    /// Returns the vector product.
    fn cross(self, other: Self) -> Self;
    /// Returns the vector scaled to length 1.
    fn normalize(self) -> Self;
    /// Returns the componentwise minimum.
    fn min(self, other: Self) -> Self;
    /// Returns the componentwise maximum.
    fn max(self, other: Self) -> Self;
    /// Returns the largest component.
    fn max_element(self) -> N;
    /// Returns `yes` in lanes where the mask is set, `no` in the others.
    fn select(mask: N::Mask, yes: Self, no: Self) -> Self;
}

/// A boolean in each lane.
pub trait Mask:
    Copy
    + Debug
    + PartialEq
    + Default
    + Send
    + Sync
    + 'static
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + Not<Output = Self>
{
    /// Whether any lane is set.
    fn any_lane(self) -> bool;
    /// Returns the value of a lane.
    fn lane(self, index: usize) -> bool;
    /// Sets the boolean of one lane.
    fn set_lane(&mut self, index: usize);
}

impl<R: Real> Number for R {
    type Vec3 = R::Vec3;
    type Mask = bool;
    type Exact = f64;
    const LANES: usize = 1;
    const ZERO: Self = R::ZERO;
    const ONE: Self = R::ONE;
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        Real::from_f64(x)
    }
    #[inline(always)]
    fn from_lanes(mut value: impl FnMut(usize) -> f64) -> Self {
        Real::from_f64(value(0))
    }
    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self.to_f64()
    }
    #[inline(always)]
    fn f64_from_lanes(mut value: impl FnMut(usize) -> f64) -> f64 {
        value(0)
    }
    #[inline(always)]
    fn f64_lane(exact: f64, _: usize) -> f64 {
        exact
    }
    #[inline(always)]
    fn greater_than(self, other: Self) -> bool {
        self > other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Real::max(self, other)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Real::min(self, other)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Real::copysign(self, sign)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Real::sqrt(self)
    }
    #[inline(always)]
    fn powi(self, exponent: u32) -> Self {
        Real::powi(self, exponent)
    }
    #[inline(always)]
    fn sin_cos_turns(self) -> [Self; 2] {
        Real::sin_cos_turns(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Real::exp(self)
    }
}

impl<R: Real, V: Vector<R>> Vector3<R> for V {
    const ZERO: Self = V::ZERO;
    const ONE: Self = V::ONE;
    #[inline(always)]
    fn new(x: R, y: R, z: R) -> Self {
        Vector::new(x, y, z)
    }
    #[inline(always)]
    fn splat(value: R) -> Self {
        Vector::splat(value)
    }
    #[inline(always)]
    fn from_lanes(mut value: impl FnMut(usize) -> DVec3) -> Self {
        Vector::from_f64(value(0))
    }
    #[inline(always)]
    fn lane(self, _: usize) -> DVec3 {
        self.to_f64()
    }
    #[inline(always)]
    fn x(self) -> R {
        Vector::x(self)
    }
    #[inline(always)]
    fn y(self) -> R {
        Vector::y(self)
    }
    #[inline(always)]
    fn z(self) -> R {
        Vector::z(self)
    }
    #[inline(always)]
    fn dot(self, other: Self) -> R {
        Vector::dot(self, other)
    }
    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        Vector::cross(self, other)
    }
    #[inline(always)]
    fn normalize(self) -> Self {
        Vector::normalize(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Vector::min(self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Vector::max(self, other)
    }
    #[inline(always)]
    fn max_element(self) -> R {
        Vector::max_element(self)
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

impl Mask for bool {
    #[inline(always)]
    fn any_lane(self) -> bool {
        self
    }
    #[inline(always)]
    fn lane(self, _: usize) -> bool {
        self
    }
    #[inline(always)]
    fn set_lane(&mut self, _: usize) {
        *self = true;
    }
}
