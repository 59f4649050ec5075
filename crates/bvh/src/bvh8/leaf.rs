//! Leaf tests of a traversal, and the same tests for primitives outside nodes. Triangles go through
//! the filter and then the exact test. Rows of spheres and planes have no filter, since an f32
//! filter would cost more than it saves ([`super::row`]). Each function that takes a visitor
//! returns whether a hit ended the traversal.

use super::filter;
use super::optimisation_barrier::{align_stack, keep_in_memory};
use super::projected_ray::{ProjectedRay, UncertainSign};
use super::query::{HitVisitor, TraversalMode, TraversalQuery};
use super::row::PrimitiveRow;
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::triangle8::Triangle8;
use super::{Bvh8, ChildRef, MaskLanes};
use crate::math::simd::Simd;
use crate::shapes::{PreparedRay, TriangleHit};

/// Filters a block of triangles. Returns the mask of the lanes that need the exact test; `None` if
/// a certain hit ended the traversal. `far` is the greatest accepted distance, and `last` is `far`
/// plus the rounding error of box tests.
#[inline(always)]
pub(super) fn find_lanes_for_exact_test<S: Simd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    number: usize,
    leaf_ray: &LeafRay,
    [far, last]: [f32; 2],
    query: &mut TraversalQuery<'_>,
) -> Option<u32> {
    query.count_leaf::<M>(|| bvh.leaf_headers[number].count);
    let found = filter::filter_triangle_block(s, leaf_ray, &bvh.blocks[number], last);
    if found.lanes == 0 {
        return Some(0);
    }
    let leaf_header = &bvh.leaf_headers[number];
    let [requested, ends] = query.block_lane_masks::<M>(leaf_header);
    let ended = M::ANY && ends & filter::find_certain_hits(s, &found, leaf_ray.near, far) != 0;
    (!ended).then(|| {
        found.lanes & requested & !(query.ray_end_lanes::<M>(leaf_header) & found.is_signed)
    })
}

/// Intersects those triangles of a block whose bits are set in the mask `lanes`, by the exact test.
#[inline(always)]
pub(super) fn intersect_triangles<S: TraversalSimd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    number: usize,
    lanes: u32,
    leaf_ray: &LeafRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    let projected_ray = if M::IS_RAY_ROUNDED {
        ProjectedRay::from_prepared(query.prepared_ray())
    } else {
        ProjectedRay::new(leaf_ray.origin, leaf_ray.direction)
    };
    let (triangles, leaf_header) = (&bvh.blocks[number], &bvh.leaf_headers[number]);
    for lane in MaskLanes(lanes) {
        let triangle_hit = s
            .intersect_triangle_in_lane(triangles, lane, keep_in_memory(&projected_ray))
            .unwrap_or_else(|UncertainSign| intersect_single_triangle(triangles, lane, query));
        if triangle_hit.is_some_and(|triangle_hit| {
            query.visit_triangle_hit::<M>(leaf_header, lane, &triangle_hit, visitor)
        }) {
            return true;
        }
    }
    false
}

/// Intersects the triangle in one lane of a block by
/// [`Triangle::intersect_watertight`](crate::shapes::Triangle::intersect_watertight), the test for
/// a single triangle.
#[inline(never)]
fn intersect_single_triangle(
    block: &Triangle8,
    lane: usize,
    query: &mut TraversalQuery<'_>,
) -> Option<TriangleHit> {
    block
        .triangle(lane)
        .intersect_watertight(query.prepared_ray())
        .as_ref()
        .map(TriangleHit::from)
}

/// Intersects one row of spheres or planes.
#[inline(always)]
fn intersect_primitive_row<S: Simd, M: TraversalMode>(
    s: S,
    row: &PrimitiveRow,
    prepared_ray: &PreparedRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    query.count_leaf::<M>(|| row.leaf_header.count);
    let row_hits = row.intersect(s, prepared_ray, query.range, query.is_camera_ray);
    row_hits.hits != 0
        && query.visit_row_hits::<M>(&row.leaf_header, &row_hits.store_lanes(s), visitor)
}

/// Intersects a leaf that is a row of spheres. `prepared_ray` is set at the first such leaf.
#[inline(always)]
pub(super) fn intersect_sphere_leaf<S: Simd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    leaf: ChildRef,
    leaf_ray: &LeafRay,
    prepared_ray: &mut Option<PreparedRay>,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    align_stack();
    // Prepared at the first row that the ray reaches.
    let prepared_ray = prepared_ray.get_or_insert_with(|| {
        if M::IS_RAY_ROUNDED {
            *query.prepared_ray()
        } else {
            PreparedRay::from_world_ray(leaf_ray.origin, leaf_ray.direction)
        }
    });
    intersect_primitive_row::<S, M>(
        s,
        &bvh.rows[bvh.always_row_count + leaf.leaf_index()],
        prepared_ray,
        query,
        visitor,
    )
}

/// Intersects the rows that every query tests, outside the tree's nodes.
#[inline(always)]
pub(super) fn intersect_rows_outside_tree<S: Simd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    prepared_ray: &PreparedRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    align_stack();
    bvh.rows[..bvh.always_row_count]
        .iter()
        .any(|one| intersect_primitive_row::<S, M>(s, one, prepared_ray, query, visitor))
}

/// Intersects all triangle blocks and then all single primitives of a structure without nodes.
#[inline(always)]
pub(super) fn intersect_all_triangle_blocks<S: TraversalSimd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    leaf_ray: &LeafRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    for number in 0..bvh.blocks.len() {
        let far = query.max_distance::<M>();
        match find_lanes_for_exact_test::<S, M>(
            s,
            bvh,
            number,
            leaf_ray,
            [far, TraversalRay::widen_far_distance(far)],
            query,
        ) {
            None => return true,
            Some(0) => {}
            Some(lanes)
                if s.intersect_triangles::<M>(bvh, number, lanes, leaf_ray, query, visitor) =>
            {
                return true;
            }
            Some(_) => {}
        }
    }
    bvh.single_positions
        .clone()
        .any(|index| visitor.visit_single_primitive(query, index))
}
