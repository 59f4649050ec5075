//! Several `f32` side by side in arrays, which the compiler maps to vector registers.
//!
//! A vector is three arrays (structure of arrays). The exponential calls `libm` lane by lane: a
//! polynomial over all lanes would give other bits than the exponential of a single number. The
//! macro `each_lane` unrolls operations and writes no loop. A formula has hundreds of operations,
//! and the compiler's loop analysis takes time quadratic in the number of loops.

use core::array::from_fn;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use glam::DVec3;
use raywright_bvh::Real;

use super::{Mask, Number, Vector3};

/// An `f32` in each of `N` SIMD lanes. A lane is one of several paths shaded side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes<const N: usize>(pub [f32; N]);

/// A vector of three `f32` in each of `N` SIMD lanes. A lane is one of several paths shaded side by
/// side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3Lanes<const N: usize> {
    /// First components of all lanes.
    pub x: Lanes<N>,
    /// Second components of all lanes.
    pub y: Lanes<N>,
    /// Third components of all lanes.
    pub z: Lanes<N>,
}

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let mut out = self;
        each_lane!(N, i, out.0[i] = f(self.0[i]));
        out
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = self;
        each_lane!(N, i, out.0[i] = f(self.0[i], other.0[i]));
        out
    }

    /// Returns the greater number in each lane, or `other` if either number is NaN, as the vector
    /// instructions of a single lane do.
    #[inline(always)]
    fn max_or_second(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
}

impl<const N: usize> Vec3Lanes<N> {
    #[inline(always)]
    fn map(self, f: impl Fn(Lanes<N>) -> Lanes<N>) -> Self {
        Self {
            x: f(self.x),
            y: f(self.y),
            z: f(self.z),
        }
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(Lanes<N>, Lanes<N>) -> Lanes<N>) -> Self {
        Self {
            x: f(self.x, other.x),
            y: f(self.y, other.y),
            z: f(self.z, other.z),
        }
    }
}

/// Implements operators lane by lane and component by component.
macro_rules! operators {
    ($($operator:ident $name:ident),*) => {$(
        impl<const N: usize> $operator for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                self.zip(other, |a, b| a.$name(b))
            }
        }

        impl<const N: usize> $operator for Vec3Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                self.zip(other, |a, b| a.$name(b))
            }
        }

        impl<const N: usize> $operator<Lanes<N>> for Vec3Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Lanes<N>) -> Self {
                self.map(|a| a.$name(other))
            }
        }
    )*};
}
operators!(Add add, Sub sub, Mul mul, Div div);

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const N: usize> Neg for Vec3Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const N: usize> AddAssign for Vec3Lanes<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> Number for Lanes<N> {
    type Vec3 = Vec3Lanes<N>;
    type Mask = LaneMask<N>;
    type Exact = [f64; N];
    const LANES: usize = N;
    const ZERO: Self = Self([0.0; N]);
    const ONE: Self = Self([1.0; N]);
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        Self([x as f32; N])
    }
    #[inline(always)]
    fn from_lanes(mut value: impl FnMut(usize) -> f64) -> Self {
        // `from_fn` is avoided, because its closure is not always inlined.
        let mut out = [0.0; N];
        each_lane!(N, i, out[i] = value(i) as f32);
        Self(out)
    }
    #[inline(always)]
    fn lane(self, index: usize) -> f64 {
        self.0[index].into()
    }
    #[inline(always)]
    fn f64_from_lanes(value: impl FnMut(usize) -> f64) -> [f64; N] {
        from_fn(value)
    }
    #[inline(always)]
    fn f64_lane(exact: [f64; N], index: usize) -> f64 {
        exact[index]
    }
    #[inline(always)]
    fn greater_than(self, other: Self) -> LaneMask<N> {
        LaneMask::from_lanes(|i| self.0[i] > other.0[i])
    }
    #[inline(always)]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        let mut out = yes;
        each_lane!(
            N,
            i,
            out.0[i] = f32::from_bits(mask.select_bits(i, yes.0[i].to_bits(), no.0[i].to_bits()))
        );
        out
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, f32::max)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, f32::min)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.zip(sign, f32::copysign)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }
    #[inline(always)]
    fn powi(self, exponent: u32) -> Self {
        // The algorithm of `Real::powi`, in all lanes at once.
        if exponent == 0 {
            return Self::ONE;
        }
        let (mut base, mut rest) = (self, exponent >> exponent.trailing_zeros());
        for _ in 0..exponent.trailing_zeros() {
            base = base * base;
        }
        let mut result = base;
        while rest > 1 {
            base = base * base;
            rest >>= 1;
            if rest & 1 == 1 {
                result = result * base;
            }
        }
        result
    }
    #[inline(always)]
    fn sin_cos_turns(self) -> [Self; 2] {
        // A loop: of so many operations in a row, the compiler joins few.
        let (mut cos, mut sin) = (self, self);
        for i in 0..N {
            [cos.0[i], sin.0[i]] = Real::sin_cos_turns(self.0[i]);
        }
        [cos, sin]
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.map(Real::exp)
    }
}

impl<const N: usize> Vector3<Lanes<N>> for Vec3Lanes<N> {
    const ZERO: Self = Self {
        x: Lanes::ZERO,
        y: Lanes::ZERO,
        z: Lanes::ZERO,
    };
    const ONE: Self = Self {
        x: Lanes::ONE,
        y: Lanes::ONE,
        z: Lanes::ONE,
    };
    #[inline(always)]
    fn new(x: Lanes<N>, y: Lanes<N>, z: Lanes<N>) -> Self {
        Self { x, y, z }
    }
    #[inline(always)]
    fn splat(value: Lanes<N>) -> Self {
        Self {
            x: value,
            y: value,
            z: value,
        }
    }
    #[inline(always)]
    fn from_lanes(mut value: impl FnMut(usize) -> DVec3) -> Self {
        let mut out = <Self as Vector3<Lanes<N>>>::ZERO;
        each_lane!(N, i, {
            let v = value(i);
            (out.x.0[i], out.y.0[i], out.z.0[i]) = (v.x as f32, v.y as f32, v.z as f32);
        });
        out
    }
    #[inline(always)]
    fn lane(self, index: usize) -> DVec3 {
        DVec3::new(self.x.lane(index), self.y.lane(index), self.z.lane(index))
    }
    #[inline(always)]
    fn x(self) -> Lanes<N> {
        self.x
    }
    #[inline(always)]
    fn y(self) -> Lanes<N> {
        self.y
    }
    #[inline(always)]
    fn z(self) -> Lanes<N> {
        self.z
    }
    #[inline(always)]
    fn dot(self, other: Self) -> Lanes<N> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }
    #[inline(always)]
    fn normalize(self) -> Self {
        self * (Lanes::ONE / self.dot(self).sqrt())
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| a.zip(b, |a, b| if a < b { a } else { b }))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, Lanes::max_or_second)
    }
    #[inline(always)]
    fn max_element(self) -> Lanes<N> {
        self.x.max_or_second(self.y.max_or_second(self.z))
    }
    #[inline(always)]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        yes.zip(no, |yes, no| Lanes::select(mask, yes, no))
    }
}

// Masks: a boolean in each SIMD lane, for selections.

/// A boolean in each of `N` SIMD lanes. All bits of a lane are equal: a selection is a bitwise
/// operation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct LaneMask<const N: usize>([u32; N]);

impl<const N: usize> LaneMask<N> {
    /// Creates a mask from a function of the lane's index.
    #[inline(always)]
    pub(super) fn from_lanes(yes: impl Fn(usize) -> bool) -> Self {
        let mut out = Self::default();
        each_lane!(N, i, out.0[i] = if yes(i) { u32::MAX } else { 0 });
        out
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(u32, u32) -> u32) -> Self {
        let mut out = self;
        each_lane!(N, i, out.0[i] = f(self.0[i], other.0[i]));
        out
    }

    /// Returns `yes` if the mask is set in a lane, else `no`.
    #[inline(always)]
    pub(super) fn select_bits(&self, lane: usize, yes: u32, no: u32) -> u32 {
        yes & self.0[lane] | no & !self.0[lane]
    }
}

impl<const N: usize> Default for LaneMask<N> {
    /// The empty mask.
    #[inline(always)]
    fn default() -> Self {
        Self([0; N])
    }
}

impl<const N: usize> BitAnd for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        self.zip(other, |a, b| a & b)
    }
}

impl<const N: usize> BitOr for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        self.zip(other, |a, b| a | b)
    }
}

impl<const N: usize> Not for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self.zip(self, |bits, _| !bits)
    }
}

impl<const N: usize> Mask for LaneMask<N> {
    #[inline(always)]
    fn any_lane(self) -> bool {
        let mut some = 0;
        each_lane!(N, i, some |= self.0[i]);
        some != 0
    }
    #[inline(always)]
    fn lane(self, index: usize) -> bool {
        self.0[index] != 0
    }
    #[inline(always)]
    fn set_lane(&mut self, index: usize) {
        self.0[index] = u32::MAX;
    }
}
