//! What a kernel asks of a processor's registers: eight numbers of f32 side by side, and the exact test of some lanes.
#![expect(unsafe_code, reason = "a sort of what was written")]

use super::block::Block;
use super::stack::{Stack, Waiting};
use super::{Child, WIDTH};
use crate::scalar::Robust;
use crate::shapes::{Probe, Triangle};

/// Eight lanes of f32. A minimum or maximum is its second operand unless the first one is less or greater, so that what is not a
/// number bounds nothing, and comparisons with such are never true.
pub(super) trait Simd: Copy {
    type Floats: Copy;
    fn splat(self, value: f32) -> Self::Floats;
    fn load(self, values: &[f32; WIDTH]) -> Self::Floats;
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// a·b + c, rounded once or twice: for what has error bounds of its own.
    fn mul_add(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;
    /// a·b − c.
    fn mul_sub(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn abs(self, a: Self::Floats) -> Self::Floats;
    fn negate(self, a: Self::Floats) -> Self::Floats;
    /// `a` with its sign turned where that of `b` is set.
    fn signed_by(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// A bit a lane.
    fn less(self, a: Self::Floats, b: Self::Floats) -> u32;
    fn at_most(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// The two children of a mask of two bits.
    fn two(self, children: &[Child; WIDTH], entries: Self::Floats, mask: u32) -> [Waiting; 2];
    /// Writes the children of a mask from `top` on. Returns the new top.
    fn push(self, stack: &mut Stack, top: usize, children: &[Child; WIDTH], entries: Self::Floats, mask: u32) -> usize;
    /// Sorts the entries from `base` up to `top`, eight at most, the nearest last.
    ///
    /// # Safety
    /// They were written.
    unsafe fn sort(self, stack: &mut Stack, base: usize, top: usize);
    /// The exact test of the lanes of a mask.
    fn exact(self, block: &Block, lanes: u32, probe: &Probe<Robust>) -> Exact;
}

/// What the exact test says of a block: which lanes are hit at any distance, which of those from outside, and where.
#[derive(Clone, Copy)]
pub(crate) struct Exact {
    pub hits: u8,
    pub from_outside: u8,
    pub t: [f32; WIDTH],
    /// Weights of the second and third corners.
    pub weights: [[f32; WIDTH]; 2],
}

impl Exact {
    pub(super) const NOTHING: Self = Self { hits: 0, from_outside: 0, t: [0.0; WIDTH], weights: [[0.0; WIDTH]; 2] };

    /// Tests one lane by the test of single triangles.
    #[inline(always)]
    pub(super) fn test(&mut self, block: &Block, lane: usize, probe: &Probe<Robust>) {
        self.hits &= !(1 << lane);
        if let Some(crossing) = Triangle::crossing(&block.triangle(lane), probe) {
            self.hits |= 1 << lane;
            self.from_outside = self.from_outside & !(1 << lane) | u8::from(crossing.from_outside) << lane;
            self.t[lane] = crossing.t;
            self.weights[0][lane] = crossing.weights[0] as f32;
            self.weights[1][lane] = crossing.weights[1] as f32;
        }
    }
}
