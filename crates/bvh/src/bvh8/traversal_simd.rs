//! Traversal operations of an instruction set, in addition to the arithmetic of [`Simd`]: writes to
//! the traversal stack, the exact test of a triangle in one lane, and leaf tests as separate
//! functions.

use super::projected_ray::{ProjectedRay, UncertainSign};
use super::query::{HitVisitor, TraversalMode, TraversalQuery};
use super::stack::{StackEntry, TraversalStack};
use super::traversal_ray::LeafRay;
use super::triangle8::Triangle8;
use super::{Bvh8, ChildRef, MaskLanes, WIDTH};
use crate::math::simd::Simd;
use crate::shapes::{PreparedRay, TriangleHit};

/// Traversal operations of an instruction set. A value of an implementing type proves that the
/// processor has the instructions.
pub(super) trait TraversalSimd: Simd {
    /// Returns the stack entries of the two children whose bits are set in `mask`. `entries` are
    /// the entry distances of all eight children.
    #[inline(always)]
    fn two_stack_entries(
        self,
        children: &[ChildRef; WIDTH],
        entries: Self::Floats,
        mask: u32,
    ) -> [StackEntry; 2] {
        let entries = self.to_array(entries);
        let (a, b) = (
            mask.trailing_zeros() as usize & 7,
            (mask & mask.wrapping_sub(1)).trailing_zeros() as usize & 7,
        );
        [
            StackEntry::new(children[a], entries[a]),
            StackEntry::new(children[b], entries[b]),
        ]
    }
    /// Writes stack entries, in any order, for the children whose bits are set in `mask`. The first
    /// is written at index `top`. Returns the new number of entries.
    #[inline(always)]
    fn push_children(
        self,
        stack: &mut TraversalStack,
        mut top: usize,
        children: &[ChildRef; WIDTH],
        entries: Self::Floats,
        mask: u32,
    ) -> usize {
        let entries = self.to_array(entries);
        for lane in MaskLanes(mask) {
            stack.set_entry(top, StackEntry::new(children[lane], entries[lane]));
            top += 1;
        }
        top
    }
    /// Writes stack entries for the children whose bits are set in `mask`, the nearest child last.
    /// The first is written at index `base`. Returns the new number of entries.
    #[inline(always)]
    fn push_children_sorted(
        self,
        stack: &mut TraversalStack,
        base: usize,
        children: &[ChildRef; WIDTH],
        entries: Self::Floats,
        mask: u32,
    ) -> usize {
        stack.push_sorted(base, children, &self.to_array(entries), mask)
    }
    /// Intersects the triangle in a lane by the exact test of this instruction set. Returns
    /// [`UncertainSign`] if the scalar test must decide. An instruction set without an exact test
    /// of its own always returns it.
    fn intersect_triangle_in_lane(
        self,
        block: &Triangle8,
        lane: usize,
        projected_ray: &ProjectedRay,
    ) -> Result<Option<TriangleHit>, UncertainSign>;
    /// Runs [`super::leaf::intersect_triangles`], compiled for this instruction set as a separate
    /// function. So the test occupies no registers of the traversal.
    fn intersect_triangles<M: TraversalMode>(
        self,
        bvh: &Bvh8,
        number: usize,
        lanes: u32,
        leaf_ray: &LeafRay,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> bool;
    /// Runs [`super::leaf::intersect_sphere_leaf`], compiled for this instruction set as a separate
    /// function.
    fn intersect_sphere_leaf<M: TraversalMode>(
        self,
        bvh: &Bvh8,
        leaf: ChildRef,
        leaf_ray: &LeafRay,
        prepared_ray: &mut Option<PreparedRay>,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> bool;
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::math::simd::Avx2;
    use crate::ray::Ray;
    use crate::shapes::PreparedRay;

    /// Next 64 random bits (Xorshift).
    fn next_random_bits(state: &mut u64) -> u64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        *state
    }

    /// Direction of the rays. Its largest component is one, so the projection does not change
    /// corners. Corners are integers of 24 bits, and their products have 47 bits.
    const ALONG: Vec3 = Vec3::new(0.0, 0.0, 1.0);

    /// Creates a triangle whose first edge passes through the origin in the x-y plane. The edge
    /// misses the origin by at most one rounding step of each coordinate. In a quarter of the
    /// triangles the third corner is on the line of that edge too. Such a triangle is edge-on for a
    /// ray along z.
    fn create_triangle_through_ray(state: &mut u64) -> [Vec3; 3] {
        let mut corner = || ((next_random_bits(state) >> 41) as i64 - (1 << 22)) as f32;
        let (a, c, scale) = (
            [corner(), corner()],
            [corner(), corner()],
            [-0.5, -1.0, -2.0, -4.0][(next_random_bits(state) % 4) as usize],
        );
        let nudged = |x: f32, state: &mut u64| {
            [x, x.next_up(), x.next_down()][(next_random_bits(state) % 3) as usize]
        };
        let b = [nudged(a[0] * scale, state), nudged(a[1] * scale, state)];
        let c = if next_random_bits(state).is_multiple_of(4) {
            [nudged(a[0] * 3.0, state), nudged(a[1] * 3.0, state)]
        } else {
            c
        };
        let mut depth = || (next_random_bits(state) >> 50) as f32;
        [
            Vec3::new(a[0], a[1], depth()),
            Vec3::new(b[0], b[1], depth()),
            Vec3::new(c[0], c[1], depth()),
        ]
    }

    /// Creates a triangle, and the origin of a ray that passes close to one of its edges. The edge
    /// function is a few rounding units of its two products, which have 42 bits. The corners of
    /// that edge are integers. The origin has twenty binary places.
    ///
    /// Let D be the direction of the edge, u a vector with u × D = 1, and k a small integer. The
    /// edge ends at k u + m D for two values of m. The origin is (k + 2⁻²⁰ r) u + n D. The edge
    /// functions are then 2⁻²⁰ r times an integer.
    fn create_triangle_beside_ray(state: &mut u64) -> ([Vec3; 3], Vec3) {
        let mut below = |maximum: u64| (next_random_bits(state) % maximum) as i64;
        let (d, u) = loop {
            let d = [below(1 << 16) - (1 << 15), below(1 << 16) - (1 << 15)];
            // Extended Euclidean algorithm: each remainder is s·d₀ + t·d₁, with the factors s and
            // t.
            let (mut rests, mut factors) = (d, [[1, 0], [0, 1]]);
            while rests[1] != 0 {
                let q = rests[0] / rests[1];
                rests = [rests[1], rests[0] - q * rests[1]];
                factors = [
                    factors[1],
                    [
                        factors[0][0] - q * factors[1][0],
                        factors[0][1] - q * factors[1][1],
                    ],
                ];
            }
            if rests[0].abs() == 1 {
                break (d, [factors[0][1] * rests[0], -factors[0][0] * rests[0]]);
            }
        };
        let digits = below(12);
        let (k, r) = (1 + below(8), below(1 << digits) * (below(3) - 1));
        let ends = [1 + below(60), -1 - below(60)].map(|m| [0, 1].map(|i| k * u[i] + m * d[i]));
        let far = ((k << 20) + r) as i128;
        let along =
            far * i128::from(u[0] * d[0] + u[1] * d[1]) / i128::from(d[0] * d[0] + d[1] * d[1]);
        let origin = [0, 1]
            .map(|i| (far * i128::from(u[i]) - along * i128::from(d[i])) as f32 / 1_048_576.0);
        let third = [below(1 << 22) - (1 << 21), below(1 << 22) - (1 << 21)];
        let corners = [ends[0], ends[1], third]
            .map(|p| Vec3::new(p[0] as f32, p[1] as f32, below(1024) as f32));
        (corners, Vec3::new(origin[0], origin[1], 0.0))
    }

    /// Protects: the exact triangle test in SIMD registers has the result of the scalar test, equal
    /// to the bit, or leaves the decision to the scalar test. The largest component of the
    /// direction is on each axis in turn. Triangles are
    ///
    /// - those with an edge function that is zero, or whose sign rounding could change;
    /// - edge-on triangles;
    /// - ordinary triangles.
    #[test]
    fn registers_are_as_exact_as_single_triangles() {
        let Some(avx2) = Avx2::detect() else { return };
        let (state, mut hits, mut missed, mut left) = (&mut 88_172_645_463_325_252, 0, 0, 0);
        for round in 0..60_000 {
            let turn = |v: Vec3| [v, Vec3::new(v.z, v.x, v.y), Vec3::new(v.y, v.z, v.x)][round % 3];
            let mut block = Triangle8::EMPTY;
            let (corners, origin) = if round % 4 < 2 {
                (create_triangle_through_ray(state), Vec3::ZERO)
            } else {
                create_triangle_beside_ray(state)
            };
            block.set_triangle(round % WIDTH, corners.map(turn));
            let tilt = Vec3::new(
                next_random_bits(state) as f32,
                next_random_bits(state) as f32,
                0.0,
            ) * [0.0, 1e-20][round % 2];
            let (origin, direction) = (
                turn(origin),
                turn((ALONG + tilt) * [1.0, -1.0][round / 4 % 2]),
            );
            let alone = block
                .triangle(round % WIDTH)
                .intersect_watertight(&PreparedRay::new(Ray::<f32>::new(origin, direction)));
            let projected_ray = ProjectedRay::new(origin.to_array(), direction.to_array());
            let Ok(triangle_hit) =
                avx2.intersect_triangle_in_lane(&block, round % WIDTH, &projected_ray)
            else {
                left += 1;
                continue;
            };
            let bits = |triangle_hit: TriangleHit| {
                (
                    [
                        triangle_hit.t,
                        triangle_hit.weights[0],
                        triangle_hit.weights[1],
                    ]
                    .map(f32::to_bits),
                    triangle_hit.from_outside,
                )
            };
            assert_eq!(
                triangle_hit.map(bits),
                alone
                    .as_ref()
                    .map(|crossing| bits(TriangleHit::from(crossing))),
                "{block:?}, {direction}"
            );
            hits += u32::from(triangle_hit.is_some());
            missed += u32::from(triangle_hit.is_none());
        }
        assert!(
            hits > 1000 && missed > 1000 && left > 1000,
            "{hits} hits, {missed} missed, {left} left"
        );
    }
}
