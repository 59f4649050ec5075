//! The traversal loop: it descends to the nearest leaf, filters the leaf, and continues from the
//! stack.
//!
//! One source serves every kernel. It is inlined as a whole into a function compiled for the
//! kernel's instructions.
#![expect(
    unsafe_code,
    reason = "entries of the stack are read without a check; each block states why they were written"
)]

use core::marker::PhantomData;

use super::filter::splat_vector;
use super::leaf::find_lanes_for_exact_test;
use super::optimisation_barrier::keep_in_memory;
use super::query::{HitVisitor, TraversalMode, TraversalQuery};
use super::stack::{StackEntry, TraversalStack};
use super::traversal_ray::{RayReparametrisation, RayRoundingResult, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::{Bvh8, Bvh8Node, ChildRef, WIDTH};
use crate::aabb::BoundingSphere;
use crate::math::simd::Simd;
use crate::processor::prefetch_line;
use crate::shapes::{PreparedRay, Transform};

/// Greatest accepted distance: `value` for triangles, `box_value` for box tests, which is raised by
/// the rounding of box distances, and `box_lanes` with `box_value` in all lanes.
#[derive(Clone, Copy)]
struct MaxDistance<S: Simd> {
    value: f32,
    box_value: f32,
    box_lanes: S::Floats,
}

impl<S: Simd> MaxDistance<S> {
    #[inline(always)]
    fn new(s: S, value: f32) -> Self {
        let last = TraversalRay::widen_far_distance(value);
        Self {
            value,
            box_value: last,
            box_lanes: s.splat(last),
        }
    }
}

/// Values of the ray for box tests, in all lanes. The origin is negated, since an addition can take
/// its second operand from memory.
struct SlabTest<S: Simd, M> {
    minus_origin: [S::Floats; 3],
    inverse: [S::Floats; 3],
    widened: [S::Floats; 3],
    early: [S::Floats; 3],
    late: [S::Floats; 3],
    near: S::Floats,
    mode: PhantomData<M>,
}

impl<S: Simd, M: TraversalMode> SlabTest<S, M> {
    #[inline(always)]
    fn new(s: S, traversal_ray: &TraversalRay) -> Self {
        let TraversalRay { box_ray, leaf_ray } = traversal_ray;
        let [ox, oy, oz] = leaf_ray.origin;
        Self {
            minus_origin: splat_vector(s, [-ox, -oy, -oz]),
            inverse: splat_vector(s, box_ray.inverse),
            widened: splat_vector(s, box_ray.exit_inverse),
            early: splat_vector(s, box_ray.entry_margin),
            late: splat_vector(s, box_ray.exit_margin),
            near: s.splat(leaf_ray.near),
            mode: PhantomData,
        }
    }

    /// Returns the differences, along an axis, between the ray's origin and eight planes of a node
    /// from `index` on.
    #[inline(always)]
    fn plane_offsets(&self, s: S, node: &Bvh8Node, axis: usize, index: usize) -> S::Floats {
        s.add(
            self.minus_origin[axis],
            s.load_from_index(&node.planes[axis], index),
        )
    }

    /// Distances along the ray at which it enters the slabs of eight children.
    #[inline(always)]
    fn entry_distances(&self, s: S, node: &Bvh8Node, axis: usize, index: usize) -> S::Floats {
        let offset = self.plane_offsets(s, node, axis, index);
        if M::IS_RAY_ROUNDED {
            s.mul_sub(offset, self.inverse[axis], self.early[axis])
        } else {
            s.mul(offset, self.inverse[axis])
        }
    }

    /// Distances along the ray at which it leaves the slabs of eight children.
    #[inline(always)]
    fn exit_distances(&self, s: S, node: &Bvh8Node, axis: usize, index: usize) -> S::Floats {
        let late = self.late[if M::IS_RAY_ROUNDED { axis } else { 0 }];
        s.mul_add(
            self.plane_offsets(s, node, axis, index),
            self.widened[axis],
            late,
        )
    }
}

/// Prefetches a child that is visited after its nearer sibling: a node entirely, a block for the
/// most part.
#[inline(always)]
fn prefetch_child(bvh: &Bvh8, child: ChildRef) {
    let lines =
        |start: *const u8| (0..4).for_each(|line| prefetch_line(start.wrapping_add(64 * line)));
    if !child.is_leaf() {
        lines(bvh.nodes.as_ptr().wrapping_add(child.node_index()).cast());
    } else if child.is_triangle_block() {
        lines(bvh.blocks.as_ptr().wrapping_add(child.leaf_index()).cast());
    }
}

/// Traverses the tree of an instance with a world-space ray. Returns whether a hit ended the
/// traversal; `None` if f32 is too imprecise to map the ray.
#[inline(always)]
pub(super) fn traverse_instance<S: TraversalSimd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    transform: &Transform,
    bounds: &BoundingSphere,
    ray: &PreparedRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> Option<bool> {
    let (traversal_ray, start) =
        match TraversalRay::from_mapped_ray(transform.map_ray(ray), query.range.min, bounds) {
            RayRoundingResult::Miss => return Some(false),
            RayRoundingResult::Hit(traversal_ray, start) => (traversal_ray, start),
            RayRoundingResult::Imprecise => return None,
        };
    query.reparametrisation = RayReparametrisation {
        start: start.into(),
        scale: 1.0,
    };
    Some(traverse::<S, M>(s, bvh, &traversal_ray, query, visitor))
}

/// Traverses the tree by a ray, and passes hits to the visitor. Returns whether a hit ended the
/// traversal.
#[inline(always)]
pub(super) fn traverse<S: TraversalSimd, M: TraversalMode>(
    s: S,
    bvh: &Bvh8,
    traversal_ray: &TraversalRay,
    query: &mut TraversalQuery<'_>,
    visitor: &mut dyn HitVisitor,
) -> bool {
    let slabs = SlabTest::<S, M>::new(s, traversal_ray);
    // Offsets of the entry planes of each axis in a node, see [`Bvh8Node`].
    let [sx, sy, sz] = traversal_ray.box_ray.side.map(|side| (side & 1) * WIDTH);
    // Only the values for leaves are copied to memory. The values for boxes stay in registers.
    let leaf_ray = traversal_ray.leaf_ray;
    let mut far = MaxDistance::new(s, query.max_distance::<M>());
    let (mut stack, mut prepared_ray) = (TraversalStack::new(), None);
    let (mut top, mut current) = (0, ChildRef(0));
    loop {
        // Descends to a leaf with triangles that need the exact test, or with other primitives.
        // This loop contains no call, so the ray keeps its registers.
        let candidate_lanes = loop {
            if !current.is_leaf() {
                let node = &bvh.nodes[current.node_index()];
                query.count_node::<M>();
                let entry = s.max(
                    s.max(
                        slabs.entry_distances(s, node, 0, sx),
                        slabs.entry_distances(s, node, 1, sy),
                    ),
                    s.max(slabs.entry_distances(s, node, 2, sz), slabs.near),
                );
                let exit = s.min(
                    s.min(
                        slabs.exit_distances(s, node, 0, WIDTH - sx),
                        slabs.exit_distances(s, node, 1, WIDTH - sy),
                    ),
                    s.min(slabs.exit_distances(s, node, 2, WIDTH - sz), far.box_lanes),
                );
                let entered = s.at_most(entry, exit);
                if entered & entered.wrapping_sub(1) == 0 {
                    if entered != 0 {
                        current = node.children[entered.trailing_zeros() as usize & 7];
                        continue;
                    }
                } else {
                    if entered.count_ones() == 2 {
                        let [a, b] = s.two_stack_entries(&node.children, entry, entered);
                        stack.set_entry(top, StackEntry(a.0.max(b.0)));
                        top += 1;
                        current = ChildRef(a.0.min(b.0) as u32);
                        // Only the farther child is prefetched, since the nearer child is read
                        // next.
                        prefetch_child(bvh, ChildRef(a.0.max(b.0) as u32));
                        continue;
                    }
                    top = if M::ANY {
                        s.push_children(&mut stack, top, &node.children, entry, entered)
                    } else {
                        s.push_children_sorted(&mut stack, top, &node.children, entry, entered)
                    };
                    // SAFETY: at least two entries were just written.
                    let [next, nearest] = unsafe { stack.top_two_children(top) };
                    (current, top) = (nearest, top - 1);
                    prefetch_child(bvh, next);
                    continue;
                }
            } else if current.is_triangle_block() {
                // The tree's pointers are reloaded for each block: the traversal has no registers
                // left for them.
                let bvh = keep_in_memory(bvh);
                prefetch_line(bvh.leaf_headers.as_ptr().wrapping_add(current.leaf_index()));
                match find_lanes_for_exact_test::<S, M>(
                    s,
                    bvh,
                    current.leaf_index(),
                    keep_in_memory(&leaf_ray),
                    [far.value, far.box_value],
                    query,
                ) {
                    None => return true,
                    Some(0) => {}
                    Some(lanes) => break lanes,
                }
            } else if current != ChildRef::NONE {
                break 0;
            }
            // SAFETY: every entry below the top was written.
            let Some(next) = (unsafe { stack.pop(&mut top, far.box_value) }) else {
                return false;
            };
            current = next;
        };
        let ended = match candidate_lanes {
            0 if current.is_sphere_row() => s.intersect_sphere_leaf::<M>(
                bvh,
                current,
                &leaf_ray,
                &mut prepared_ray,
                query,
                visitor,
            ),
            0 => visitor.visit_single_primitive(query, current.leaf_index()),
            lanes => s.intersect_triangles::<M>(
                bvh,
                current.leaf_index(),
                lanes,
                &leaf_ray,
                query,
                visitor,
            ),
        };
        if ended {
            return true;
        }
        if !M::ANY && query.max_distance::<M>() != far.value {
            far = MaxDistance::new(s, query.max_distance::<M>());
        }
        // SAFETY: every entry below the top was written.
        let Some(next) = (unsafe { stack.pop(&mut top, far.box_value) }) else {
            return false;
        };
        current = next;
    }
}
