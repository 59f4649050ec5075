//! Masks: a boolean in each SIMD lane, for selections.

use core::ops::{BitAnd, BitOr, Not};

use super::Mask;

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
