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

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::ray::Ray;
    use crate::wide::portable::Portable;
    use crate::wide::x86::{Avx2, Avx512};

    /// Xorshift.
    fn next(state: &mut u64) -> u64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        *state
    }

    /// A triangle whose projection by [`probe`] has an edge that passes the ray by less than the rounding of a product, or by
    /// nothing; one in four has its third corner there too, so that it is seen edge-on.
    fn triangle(state: &mut u64) -> [Vec3; 3] {
        let mut corner = || (next(state) >> 17) as i64 - (1 << 46);
        let (xa, xc) = (corner(), corner());
        let mut level = || (next(state) >> 41) as i64 + 1;
        let (ya, yb, yc) = (level(), -level(), level());
        let jitter = (next(state) % 5) as i64 - 2;
        let beside = |y: i64| (i128::from(xa) * i128::from(y) / i128::from(ya)) as i64 + jitter;
        let (xb, xc) = (beside(yb), if next(state).is_multiple_of(4) { beside(yc).clamp(-(1 << 47), 1 << 47) } else { xc });
        [(xa, ya), (xb.clamp(-(1 << 47), 1 << 47), yb), (xc, yc)].map(|(x, y)| {
            let (high, low) = (x >> 24, x & ((1 << 24) - 1));
            Vec3::new(low as f32, high as f32, y as f32)
        })
    }

    /// Projects a corner to two whole numbers, of 47 bits and of 24.
    fn probe() -> Probe<Robust> {
        let ray = Ray::new(Vec3::ZERO, Vec3::new(0.6, 0.0, 0.8));
        Probe { across: [DVec3::new(1.0, f64::from(1 << 24), 0.0), DVec3::Z], ..Probe::new(ray) }
    }

    /// Protects: the exact test in lanes is that of single triangles to the bit, where rounding alone would turn the sign of an
    /// edge and elsewhere.
    #[test]
    fn lanes_are_as_exact_as_single_triangles() {
        let (state, probe) = (&mut 88_172_645_463_325_252, probe());
        let (mut hits, mut missed, mut edge_on) = (0, 0, 0);
        for _ in 0..20_000 {
            let mut block = Block::EMPTY;
            (0..WIDTH).for_each(|lane| block.set(lane, triangle(state)));
            let one_by_one = Portable.exact(&block, 0xff, &probe);
            let seen = |exact: &Exact| {
                let of = |lane: usize| {
                    (exact.hits >> lane & 1 != 0).then(|| {
                        let numbers = [exact.t[lane], exact.weights[0][lane], exact.weights[1][lane]].map(f32::to_bits);
                        (exact.from_outside >> lane & 1, numbers)
                    })
                };
                core::array::from_fn::<_, WIDTH, _>(of)
            };
            let together =
                [Avx2::detect().map(|s| s.exact(&block, 0xff, &probe)), Avx512::detect().map(|s| s.exact(&block, 0xff, &probe))];
            for exact in together.into_iter().flatten() {
                assert_eq!(seen(&exact), seen(&one_by_one), "{block:?}");
            }
            hits += one_by_one.hits.count_ones();
            missed += one_by_one.hits.count_zeros();
            edge_on += (0..WIDTH).filter_map(|lane| block.triangle(lane).crossing(&probe)).filter(|met| met.edge_on).count();
        }
        assert!(hits > 1000 && missed > 1000 && edge_on > 1000, "{hits} hits, {missed} missed, {edge_on} edge-on");
    }
}
