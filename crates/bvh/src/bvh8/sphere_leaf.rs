//! Leaves of up to eight spheres: these go through their own test in lanes of f64, as in [`super::row`], since what a filter in f32 would spare is less
//! than it costs.

use super::row::{RayF64, Row};
use super::traversal_ray::LeafRay;
use super::traverse::HitVisitor;
use super::triangle8::LeafHeader;
use super::{Bvh8, Child};
use crate::math::simd::Simd;

impl Bvh8 {
    /// Bytes of leaves of so many spheres, at most: of a sphere beside `others` of other kinds, few leaves are full.
    pub(super) fn most_bytes_of_leaves(spheres: u64, others: u64) -> u64 {
        let most = (spheres / 2).min((spheres / 5).saturating_mul(2).saturating_add(others).saturating_add(2));
        most.saturating_mul(size_of::<Row>() as u64)
    }

    /// Fills them; `row` makes one of some slots, of which the tree's begin at `first`.
    pub(crate) fn fill_rows(&mut self, first: usize, row: impl Fn(core::ops::Range<usize>) -> Row) {
        for at in self.always..self.rows.len() {
            let LeafHeader { first: place, count, .. } = self.rows[at].facts;
            let start = first + place as usize;
            self.rows[at] = row(start..start + usize::from(count));
        }
    }
}

/// All that is asked about a leaf of spheres. Whether that ended the walk.
#[inline(always)]
pub(super) fn spheres<S: Simd, A: HitVisitor>(
    s: S,
    bvh: &Bvh8,
    leaf: Child,
    aim: &LeafRay,
    line: &mut Option<RayF64>,
    answer: &mut A,
) -> bool {
    let row = &bvh.rows[bvh.always + leaf.index()];
    answer.several(row.facts.count.into());
    // Made for the first row that the ray meets.
    let line = line
        .get_or_insert_with(|| if A::MAPPED { RayF64::from(answer.prepared()) } else { RayF64::new(aim.origin, aim.direction) });
    let found = row.hits(s, line, answer.range(), answer.culls());
    found.hits != 0 && answer.row(&row.facts, &found.roots(s))
}
