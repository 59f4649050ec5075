//! Type parameters for the precision of stored geometry: one source serves f32 and f64, the two
//! values of `--precision`. Intersections are computed in f64 for both.
//!
//! glam has no generic vectors. So [`Real`] names the vector type of a scalar, and [`Vector`] lists
//! the few operations that geometry and shading need. Both traits are sealed.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};
use glam::{DVec3, DVec4, Vec3, Vec4};

pub use crate::math::FourLanes;
use crate::math::angles;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
    impl Sealed for glam::Vec3 {}
    impl Sealed for glam::DVec3 {}
}

/// A floating-point scalar with its glam vector: `f32` with [`Vec3`], `f64` with [`DVec3`].
///
/// Transcendental functions come from the crate `libm`, so that pictures do not depend on the
/// platform's math library.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// The three-component vector of this scalar.
    type Vec3: Vector<Self>;
    /// Vector of four numbers of this scalar.
    type Four: FourLanes<Self>;
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// Positive infinity.
    const INFINITY: Self;
    /// Unit roundoff u: half the distance from 1.0 to the next greater number (2⁻²⁴ for f32, 2⁻⁵³
    /// for f64).
    const ROUNDOFF: Self;
    /// Whether the scalar is f32. If so, the f64 arithmetic of intersections has more than twice
    /// the scalar's digits.
    const IS_SINGLE: bool;
    /// Rounds `x` to the nearest value.
    fn from_f64(x: f64) -> Self;
    /// Converts `x` exactly.
    fn from_f32(x: f32) -> Self;
    /// Converts to f64 exactly.
    fn to_f64(self) -> f64;
    /// Rounds to the nearest f32.
    fn to_f32(self) -> f32;
    /// Square root, correctly rounded; NaN below zero.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The larger number; if one number is NaN, the other number.
    fn max(self, other: Self) -> Self;
    /// The smaller number; if one number is NaN, the other number.
    fn min(self, other: Self) -> Self;
    /// The magnitude of `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// Whether the number is neither NaN nor infinite.
    fn is_finite(self) -> bool;
    /// Whether the number is NaN.
    fn is_nan(self) -> bool;
    /// The least number greater than `self`.
    fn next_up(self) -> Self;
    /// The greatest number less than `self`.
    fn next_down(self) -> Self;
    /// The adjacent number in the direction of `sign`, computed without a branch. Returns `self` if
    /// `sign` is zero or NaN, or if `self` is not finite.
    fn next_towards(self, sign: Self) -> Self;
    /// Sine of radians.
    fn sin(self) -> Self;
    /// Cosine of radians.
    fn cos(self) -> Self;
    /// Tangent of radians.
    fn tan(self) -> Self;
    /// Inverse sine, radians; the argument is clamped to [−1, 1].
    fn asin(self) -> Self;
    /// Inverse cosine, radians; the argument is clamped to [−1, 1].
    fn acos(self) -> Self;
    /// Inverse tangent, radians in (−π/2, π/2).
    fn atan(self) -> Self;
    /// Angle of the point (x, self), radians in (−π, π].
    fn atan2(self, x: Self) -> Self;
    /// Angle of the point (x, self) as [`Self::atan2`], for finite numbers; 0 if both are zero. In
    /// f32 it uses arithmetic alone, so that loops vectorise, with an error of at most three units
    /// of rounding.
    fn angle(self, x: Self) -> Self;
    /// Cosine and sine of a fraction of a full turn, in [0, 1]. In f32 it uses arithmetic alone, so
    /// that loops vectorise, with an error of at most 1.5e-7.
    fn sin_cos_turns(self) -> [Self; 2];
    /// Natural exponential.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// The base `self` raised to a real exponent.
    fn powf(self, exponent: Self) -> Self;

    /// The base `self` raised to an integer exponent, by repeated squaring: the same operations in
    /// the same order on every machine.
    #[inline(always)]
    fn powi(self, mut exponent: u32) -> Self {
        if exponent == 0 {
            return Self::ONE;
        }
        // Most exponents are powers of two: up to the lowest set bit only squaring is needed,
        // without a branch to predict.
        let mut base = self;
        for _ in 0..exponent.trailing_zeros() {
            base *= base;
        }
        exponent >>= exponent.trailing_zeros();
        let mut result = base;
        while exponent > 1 {
            base *= base;
            exponent >>= 1;
            if exponent & 1 == 1 {
                result *= base;
            }
        }
        result
    }

    /// The largest integer not above `self`; never −0. It is written out in arithmetic, since the
    /// library function is a call on processors that may lack the instruction.
    #[inline(always)]
    fn floor(self) -> Self {
        // Every f32 from 2²³ on is an integer, and every f64 from 2⁵² on. Adding that power of two
        // to a smaller number rounds the number to an integer.
        let all_whole = Self::from_f64(0.5) / Self::ROUNDOFF;
        let magnitude = self.abs();
        let nearest = ((magnitude + all_whole) - all_whole).copysign(self);
        let below = if nearest > self {
            nearest - Self::ONE
        } else {
            nearest
        };
        if magnitude < all_whole {
            below + Self::ZERO
        } else {
            self
        }
    }

    /// Clamps `self` to the range from `min` to `max`.
    #[inline(always)]
    fn clamp(self, min: Self, max: Self) -> Self {
        Self::min(Self::max(self, min), max)
    }
}

/// Operations of a three-component vector that geometry and shading need. Products of two vectors
/// are componentwise.
pub trait Vector<R: Real>:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialEq
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<R, Output = Self>
    + Div<R, Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + MulAssign<R>
{
    /// Zero in every component.
    const ZERO: Self;
    /// One in every component.
    const ONE: Self;
    /// Creates a vector from its components.
    fn new(x: R, y: R, z: R) -> Self;
    /// Creates a vector with the same number in every component.
    fn splat(value: R) -> Self;
    /// First component.
    fn x(self) -> R;
    /// Second component.
    fn y(self) -> R;
    /// Third component.
    fn z(self) -> R;
    /// Component with the index 0, 1 or 2.
    fn component(self, index: usize) -> R;
    /// Dot product.
    fn dot(self, other: Self) -> R;
    /// Cross product.
    fn cross(self, other: Self) -> Self;
    /// Euclidean length.
    fn length(self) -> R;
    /// The vector scaled to unit length. NaN or infinite if the squared length leaves the range of
    /// the scalar.
    fn normalize(self) -> Self;
    /// Componentwise minimum.
    fn min(self, other: Self) -> Self;
    /// Componentwise maximum.
    fn max(self, other: Self) -> Self;
    /// Componentwise absolute value.
    fn abs(self) -> Self;
    /// Largest component.
    fn max_element(self) -> R;
    /// Whether no component is NaN or infinite.
    fn is_finite(self) -> bool;
    /// Rounds each component of `v` to the nearest scalar.
    fn from_f64(v: DVec3) -> Self;
    /// Converts each component to f64 exactly.
    fn to_f64(self) -> DVec3;
    /// Rounds each component to the nearest f32.
    fn to_f32(self) -> Vec3;
}

/// Defines functions that are always inlined.
macro_rules! inlined {
    ($(fn $name:ident($($argument:tt)*) -> $out:ty $body:block)*) => { $(
        #[inline(always)]
        fn $name($($argument)*) -> $out $body
    )* };
}

macro_rules! real {
    ($t:ident, $v:ident, $four:ident, $u:expr, $angle:path, $turns:path, $($libm:ident => $f:ident),*) => {
        impl Real for $t {
            type Vec3 = $v;
            type Four = $four;
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const INFINITY: Self = $t::INFINITY;
            const ROUNDOFF: Self = $u;
            const IS_SINGLE: bool = size_of::<$t>() == 4;
            inlined! {
                fn from_f64(x: f64) -> Self { x as $t }
                fn from_f32(x: f32) -> Self { $t::from(x) }
                fn to_f64(self) -> f64 { f64::from(self) }
                fn to_f32(self) -> f32 { self as f32 }
                fn sqrt(self) -> Self { $t::sqrt(self) }
                fn abs(self) -> Self { $t::abs(self) }
                fn max(self, other: Self) -> Self { $t::max(self, other) }
                fn min(self, other: Self) -> Self { $t::min(self, other) }
                fn copysign(self, sign: Self) -> Self { $t::copysign(self, sign) }
                fn is_finite(self) -> bool { $t::is_finite(self) }
                fn is_nan(self) -> bool { $t::is_nan(self) }
                // The common case, positive and finite, is tested on the bits. For a test on the
                // number, the compiler would generate five comparisons.
                fn next_up(self) -> Self {
                    let is_usual = self.to_bits().wrapping_sub(1) < $t::INFINITY.to_bits() - 1;
                    if is_usual { $t::from_bits(self.to_bits() + 1) } else { $t::next_up(self) }
                }
                fn next_down(self) -> Self { if self > 0.0 { $t::from_bits(self.to_bits() - 1) } else { $t::next_down(self) } }
                fn next_towards(self, sign: Self) -> Self {
                    let bits = self.to_bits();
                    let away = (self > 0.0) == (sign > 0.0);
                    let next = $t::from_bits(if away { bits.wrapping_add(1) } else { bits.wrapping_sub(1) });
                    let next = if self == 0.0 { $t::from_bits(1).copysign(sign) } else { next };
                    if ((sign > 0.0) | (sign < 0.0)) & ($t::abs(self) < $t::INFINITY) { next } else { self }
                }
                fn angle(self, x: Self) -> Self { $angle(self, x) }
                fn sin_cos_turns(self) -> [Self; 2] { $turns(self) }
            }
            $(real!(@fn $libm $f);)*
        }

        impl Vector<$t> for $v {
            const ZERO: Self = $v::ZERO;
            const ONE: Self = $v::ONE;
            inlined! {
                fn new(x: $t, y: $t, z: $t) -> Self { $v::new(x, y, z) }
                fn splat(value: $t) -> Self { $v::splat(value) }
                fn x(self) -> $t { self.x }
                fn y(self) -> $t { self.y }
                fn z(self) -> $t { self.z }
                fn component(self, index: usize) -> $t { self[index] }
                fn dot(self, other: Self) -> $t { $v::dot(self, other) }
                fn cross(self, other: Self) -> Self { $v::cross(self, other) }
                fn length(self) -> $t { $v::length(self) }
                fn normalize(self) -> Self { self * (1.0 / $v::length(self)) }
                fn min(self, other: Self) -> Self { $v::min(self, other) }
                fn max(self, other: Self) -> Self { $v::max(self, other) }
                fn abs(self) -> Self { $v::abs(self) }
                fn max_element(self) -> $t { $v::max_element(self) }
                fn is_finite(self) -> bool { $v::is_finite(self) }
                fn from_f64(v: DVec3) -> Self { Self::new(v.x as $t, v.y as $t, v.z as $t) }
                fn to_f64(self) -> DVec3 { DVec3::new(self.x.into(), self.y.into(), self.z.into()) }
                fn to_f32(self) -> Vec3 { Vec3::new(self.x as f32, self.y as f32, self.z as f32) }
            }
        }
    };
    (@fn $libm:ident asin) => { #[inline] fn asin(self) -> Self { libm::$libm(Real::clamp(self, -1.0, 1.0)) } };
    (@fn $libm:ident acos) => { #[inline] fn acos(self) -> Self { libm::$libm(Real::clamp(self, -1.0, 1.0)) } };
    (@fn $libm:ident atan2) => { #[inline] fn atan2(self, x: Self) -> Self { libm::$libm(self, x) } };
    (@fn $libm:ident powf) => { #[inline] fn powf(self, exponent: Self) -> Self { libm::$libm(self, exponent) } };
    (@fn $libm:ident $f:ident) => { #[inline] fn $f(self) -> Self { libm::$libm(self) } };
}

real!(f32, Vec3, Vec4, 5.960_464_5e-8, angles::angle, angles::sin_cos_turns, sinf => sin, cosf => cos, tanf => tan, asinf => asin, acosf => acos, atanf => atan, atan2f => atan2, expf => exp, logf => ln, powf => powf);
real!(f64, DVec3, DVec4, 1.110_223_024_625_156_5e-16, libm::atan2, angles::sin_cos_turns_f64, sin => sin, cos => cos, tan => tan, asin => asin, acos => acos, atan => atan, atan2 => atan2, exp => exp, log => ln, pow => powf);
