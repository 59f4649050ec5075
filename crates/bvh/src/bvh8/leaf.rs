//! What a traversal asks of leaves, and of what is tested without nodes: triangles by the filter and then the exact test, spheres and planes in rows
//! by their own test ([`super::row`]), since what a filter in f32 would spare of those is less than it costs. Each says whether that ended the walk.

use super::filter;
use super::optimisation_barrier::in_memory;
use super::projected_ray::{ProjectedRay, Unsure};
use super::row::Row;
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::traverse::HitVisitor;
use super::triangle8::Triangle8;
use super::{Bvh8, Child, Lanes};
use crate::math::simd::Simd;
use crate::shapes::{PreparedRay, TriangleHit};
use crate::stats::TraversalCounter;

/// The lanes of a block that the exact test is asked about, with a far end as it is and as boxes use it. None where what the filter says ended the
/// walk.
#[inline(always)]
pub(super) fn candidates<S: Simd, A: HitVisitor>(
    s: S,
    bvh: &Bvh8,
    number: usize,
    aim: &LeafRay,
    [far, last]: [f32; 2],
    answer: &mut A,
) -> Option<u32> {
    answer.counter().primitives(|| bvh.facts[number].count.into());
    let found = filter::candidates(s, aim, &bvh.blocks[number], last);
    if found.lanes == 0 {
        return Some(0);
    }
    let [wanted, ends] = answer.lanes(&bvh.facts[number]);
    let over = A::ANY && ends & filter::certain(s, &found, aim.near, far) != 0;
    (!over).then_some(found.lanes & wanted)
}

/// The exact test of some triangles of a block.
#[inline(always)]
pub(super) fn triangles<S: TraversalSimd, A: HitVisitor>(
    s: S,
    bvh: &Bvh8,
    number: usize,
    lanes: u32,
    aim: &LeafRay,
    answer: &mut A,
) -> bool {
    let sight = if A::MAPPED { ProjectedRay::of(answer.prepared()) } else { ProjectedRay::new(aim.origin, aim.direction) };
    let (triangles, facts) = (&bvh.blocks[number], &bvh.facts[number]);
    for lane in Lanes(lanes) {
        let met = s.crossing(triangles, lane, in_memory(&sight)).unwrap_or_else(|Unsure| alone(triangles, lane, answer));
        if met.is_some_and(|met| answer.triangle(facts, lane, &met)) {
            return true;
        }
    }
    false
}

/// The test of single triangles.
#[inline(never)]
fn alone<A: HitVisitor>(block: &Triangle8, lane: usize, answer: &mut A) -> Option<TriangleHit> {
    block.triangle(lane).crossing(answer.prepared()).as_ref().map(TriangleHit::from)
}

#[inline(always)]
fn row<S: Simd, A: HitVisitor>(s: S, row: &Row, line: &PreparedRay, answer: &mut A) -> bool {
    answer.counter().primitives(|| row.facts.count.into());
    let found = row.hits(s, line, answer.range(), answer.culls());
    found.hits != 0 && answer.row(&row.facts, &found.stored(s))
}

/// A leaf of spheres.
#[inline(always)]
pub(super) fn spheres<S: Simd, A: HitVisitor>(
    s: S,
    bvh: &Bvh8,
    leaf: Child,
    aim: &LeafRay,
    line: &mut Option<PreparedRay>,
    answer: &mut A,
) -> bool {
    // Made for the first row that the ray meets.
    let line =
        line.get_or_insert_with(|| if A::MAPPED { *answer.prepared() } else { PreparedRay::in_world(aim.origin, aim.direction) });
    row(s, &bvh.rows[bvh.always + leaf.index()], line, answer)
}

/// The rows that every query meets.
#[inline(always)]
pub(super) fn rows<S: Simd, A: HitVisitor>(s: S, bvh: &Bvh8, line: &PreparedRay, answer: &mut A) -> bool {
    bvh.rows[..bvh.always].iter().any(|one| row(s, one, line, answer))
}

/// Each block, and then what comes in no block, where there are no nodes.
#[inline(always)]
pub(super) fn blocks<S: TraversalSimd, A: HitVisitor>(s: S, bvh: &Bvh8, aim: &LeafRay, answer: &mut A) -> bool {
    for number in 0..bvh.blocks.len() {
        let far = answer.far();
        match candidates(s, bvh, number, aim, [far, TraversalRay::last(far)], answer) {
            None => return true,
            Some(0) => {}
            Some(lanes) if s.settle(bvh, number, lanes, aim, answer) => return true,
            Some(_) => {}
        }
    }
    bvh.others.clone().any(|place| answer.other(place))
}
