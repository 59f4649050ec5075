//! Leaf tests of a traversal, also for primitives outside nodes. Triangles go through the filter
//! and then the exact test. Spheres and planes in rows go through their own test ([`super::row`])
//! at once, since a filter in f32 would cost more than it saves. Each function returns whether a
//! hit ended the traversal.

use super::filter;
use super::optimisation_barrier::in_memory;
use super::projected_ray::{ProjectedRay, Unsure};
use super::query::{HitVisitor, TraversalMode, TraversalQuery};
use super::row::Row;
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::triangle8::Triangle8;
use super::{Bvh8, Child, Lanes};
use crate::math::simd::Simd;
use crate::shapes::{PreparedRay, TriangleHit};

/// Lanes of a block that need the exact test, for a far end as it is and as boxes use it. `None` if
/// a certain hit ended the traversal.
#[inline(always)]
pub(super) fn candidates<S: Simd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    number: usize,
    aim: &LeafRay,
    [far, last]: [f32; 2],
    query: &mut TraversalQuery<'_>,
) -> Option<u32> {
    query.count_leaf::<M>(|| bvh.facts[number].count);
    let found = filter::candidates(s, aim, &bvh.blocks[number], last);
    if found.lanes == 0 {
        return Some(0);
    }
    let [wanted, ends] = query.lanes::<M>(&bvh.facts[number]);
    let over = M::ANY && ends & filter::certain(s, &found, aim.near, far) != 0;
    (!over).then_some(found.lanes & wanted)
}

/// The exact test of some triangles of a block.
#[inline(always)]
pub(super) fn triangles<S: TraversalSimd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    number: usize,
    lanes: u32,
    aim: &LeafRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    let sight = if M::MAPPED {
        ProjectedRay::of(query.prepared())
    } else {
        ProjectedRay::new(aim.origin, aim.direction)
    };
    let (triangles, facts) = (&bvh.blocks[number], &bvh.facts[number]);
    for lane in Lanes(lanes) {
        let met = s
            .crossing(triangles, lane, in_memory(&sight))
            .unwrap_or_else(|Unsure| alone(triangles, lane, query));
        if met.is_some_and(|met| query.triangle::<M>(facts, lane, &met, visitor)) {
            return true;
        }
    }
    false
}

/// The single-triangle test.
#[inline(never)]
fn alone(block: &Triangle8, lane: usize, query: &mut TraversalQuery<'_>) -> Option<TriangleHit> {
    block
        .triangle(lane)
        .crossing(query.prepared())
        .as_ref()
        .map(TriangleHit::from)
}

#[inline(always)]
fn row<S: Simd, M: TraversalMode>(
    s: S,
    row: &Row,
    line: &PreparedRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    query.count_leaf::<M>(|| row.facts.count);
    let found = row.hits(s, line, query.range, query.culls);
    found.hits != 0 && query.row::<M>(&row.facts, &found.stored(s), visitor)
}

/// A leaf of spheres.
#[inline(always)]
pub(super) fn spheres<S: Simd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    leaf: Child,
    aim: &LeafRay,
    line: &mut Option<PreparedRay>,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    // Prepared for the first row that the ray reaches.
    let line = line.get_or_insert_with(|| {
        if M::MAPPED {
            *query.prepared()
        } else {
            PreparedRay::in_world(aim.origin, aim.direction)
        }
    });
    row::<S, M>(
        s,
        &bvh.rows[bvh.always + leaf.index()],
        line,
        query,
        visitor,
    )
}

/// The rows that every query tests.
#[inline(always)]
pub(super) fn rows<S: Simd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    line: &PreparedRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    bvh.rows[..bvh.always]
        .iter()
        .any(|one| row::<S, M>(s, one, line, query, visitor))
}

/// All blocks, then all single primitives, for a structure without nodes.
#[inline(always)]
pub(super) fn blocks<S: TraversalSimd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    aim: &LeafRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    for number in 0..bvh.blocks.len() {
        let far = query.far::<M>();
        match candidates::<S, M>(s, bvh, number, aim, [far, TraversalRay::last(far)], query) {
            None => return true,
            Some(0) => {}
            Some(lanes) if s.settle::<M>(bvh, number, lanes, aim, query, visitor) => return true,
            Some(_) => {}
        }
    }
    bvh.others.clone().any(|place| visitor.other(query, place))
}
