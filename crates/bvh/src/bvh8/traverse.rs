//! The walk: down to the nearest leaf, through the filter, and back to what waits.
//!
//! One source for every kernel, inlined as a whole into a function that may use the kernel's instructions.
#![expect(unsafe_code, reason = "the stack is read where it was written; each block says why")]

use core::marker::PhantomData;

use super::filter;
use super::optimisation_barrier::in_memory;
use super::projected_ray::TriangleHit;
use super::row::SphereHits;
use super::stack::{Stack, Waiting};
use super::traversal_ray::{RoughRay, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::triangle8::{LeafHeader, Triangle8};
use super::{Bvh8, Child, Node};
use crate::aabb::BoundingSphere;
use crate::instance::RoughInverse;
use crate::math::simd::Simd;
use crate::ray::Interval;
use crate::shapes::PreparedRay;

/// What a query makes of what a walk meets.
pub(crate) trait HitVisitor {
    /// Whether any hit will do. Then children are visited in no order.
    const ANY: bool;
    /// Whether the ray of the walk was rounded, see [`TraversalRay::mapped`]: then the exact tests take [`HitVisitor::prepared`].
    const MAPPED: bool;
    /// The walk counts distances from here on.
    fn starts(&mut self, at: f32);
    /// The ray as exact tests have it, made when the first one asks.
    fn prepared(&mut self) -> &PreparedRay;
    /// The greatest distance that still counts.
    fn far(&self) -> f32;
    /// Where hits count.
    fn range(&self) -> Interval<f32>;
    /// Whether the ray passes backs that are culled.
    fn culls(&self) -> bool;
    /// A node is tested.
    fn node(&mut self);
    /// So many of a row are tested.
    fn several(&mut self, count: u64);
    /// A block is tested.
    fn block(&mut self, block: usize);
    /// The lanes that matter, and those of which a hit within the range counts whatever it is: it ends a walk that any hit ends.
    fn lanes(&self, block: usize) -> [u32; 2];
    /// A triangle is hit at some distance. True ends the walk.
    fn triangle(&mut self, block: usize, lane: usize, met: &TriangleHit) -> bool;
    /// These of a row are hit within the range. True ends the walk.
    fn row(&mut self, facts: &LeafHeader, roots: &SphereHits) -> bool;
    /// Another primitive is met. True ends the walk.
    fn other(&mut self, place: usize) -> bool;
}

/// Where boxes end, and triangles.
#[derive(Clone, Copy)]
struct Far<S: Simd> {
    value: f32,
    last: f32,
    boxes: S::Floats,
}

impl<S: Simd> Far<S> {
    #[inline(always)]
    fn new(s: S, value: f32) -> Self {
        let last = TraversalRay::last(value);
        Self { value, last, boxes: s.splat(last) }
    }
}

/// The ray in all lanes, as boxes need it.
struct Slabs<S: Simd, A> {
    origin: [S::Floats; 3],
    inverse: [S::Floats; 3],
    widened: [S::Floats; 3],
    early: [S::Floats; 3],
    late: [S::Floats; 3],
    near: S::Floats,
    visitor: PhantomData<A>,
}

impl<S: Simd, A: HitVisitor> Slabs<S, A> {
    #[inline(always)]
    fn new(s: S, setup: &TraversalRay) -> Self {
        let TraversalRay { slopes, aim } = setup;
        let ([ex, ey, ez], [lx, ly, lz]) = (slopes.early, slopes.late);
        let ([ox, oy, oz], [ix, iy, iz], [wx, wy, wz]) = (aim.origin, slopes.inverse, slopes.widened);
        Self {
            origin: [s.splat(ox), s.splat(oy), s.splat(oz)],
            inverse: [s.splat(ix), s.splat(iy), s.splat(iz)],
            widened: [s.splat(wx), s.splat(wy), s.splat(wz)],
            early: [s.splat(ex), s.splat(ey), s.splat(ez)],
            late: [s.splat(lx), s.splat(ly), s.splat(lz)],
            near: s.splat(aim.near),
            visitor: PhantomData,
        }
    }

    #[inline(always)]
    fn entry(&self, s: S, planes: &[f32; 8], axis: usize) -> S::Floats {
        let offset = s.sub(s.load(planes), self.origin[axis]);
        if A::MAPPED { s.mul_sub(offset, self.inverse[axis], self.early[axis]) } else { s.mul(offset, self.inverse[axis]) }
    }

    #[inline(always)]
    fn exit(&self, s: S, planes: &[f32; 8], axis: usize) -> S::Floats {
        s.mul_add(s.sub(s.load(planes), self.origin[axis]), self.widened[axis], self.late[if A::MAPPED { axis } else { 0 }])
    }
}

/// Has brought near what a child is read from that waits while its nearer sibling is visited: all of a node, most of a block.
#[inline(always)]
fn fetch<S: TraversalSimd>(s: S, bvh: &Bvh8, child: Child) {
    let (start, bytes) = match () {
        () if !child.is_leaf() => (bvh.nodes.as_ptr().cast::<u8>(), size_of::<Node>()),
        () if child.is_block() => (bvh.blocks.as_ptr().cast::<u8>(), size_of::<Triangle8>()),
        () => return,
    };
    let start = start.wrapping_add(child.index() * bytes);
    s.prefetch(start);
    s.prefetch(start.wrapping_add(64));
    s.prefetch(start.wrapping_add(128));
    s.prefetch(start.wrapping_add(192));
}

/// The walk of a ray of the world through the tree of what an instance shows; none where f32 can't tell it well enough.
#[inline(always)]
pub(super) fn traverse_instance<S: TraversalSimd, A: HitVisitor>(
    s: S,
    bvh: &Bvh8,
    inverse: &RoughInverse,
    bounds: &BoundingSphere,
    ray: &PreparedRay,
    answer: &mut A,
) -> Option<bool> {
    let (setup, start) = match TraversalRay::roughly_mapped(inverse, ray, answer.range().min, bounds) {
        RoughRay::Misses => return Some(false),
        RoughRay::Meets(setup, start) => (setup, start),
        RoughRay::TooRough => return None,
    };
    answer.starts(start);
    Some(traverse(s, bvh, &setup, answer))
}

/// Whether some answer ended the walk.
#[inline(always)]
pub(super) fn traverse<S: TraversalSimd, A: HitVisitor>(s: S, bvh: &Bvh8, setup: &TraversalRay, answer: &mut A) -> bool {
    let slabs = Slabs::<S, A>::new(s, setup);
    let [sx, sy, sz] = setup.slopes.side.map(|side| side & 1);
    // Apart from the slopes, which need no place in memory.
    let aim = setup.aim;
    let mut far = Far::new(s, answer.far());
    let (mut stack, mut line) = (Stack::new(), None);
    let mut top = 0;
    let mut current = Child(0);
    loop {
        // Down to a leaf that has to be looked at. Nothing is called in here, so the ray keeps its registers.
        let left = loop {
            if !current.is_leaf() {
                let node = &bvh.nodes[current.node()];
                answer.node();
                let [[x0, y0, z0], [x1, y1, z1]] = [
                    [&node.planes[0][sx], &node.planes[1][sy], &node.planes[2][sz]],
                    [&node.planes[0][1 - sx], &node.planes[1][1 - sy], &node.planes[2][1 - sz]],
                ];
                let entry = s.max(s.max(slabs.entry(s, x0, 0), slabs.entry(s, y0, 1)), s.max(slabs.entry(s, z0, 2), slabs.near));
                let exit = s.min(s.min(slabs.exit(s, x1, 0), slabs.exit(s, y1, 1)), s.min(slabs.exit(s, z1, 2), far.boxes));
                let entered = s.at_most(entry, exit);
                if entered & entered.wrapping_sub(1) == 0 {
                    if entered != 0 {
                        current = node.children[entered.trailing_zeros() as usize & 7];
                        continue;
                    }
                } else {
                    if entered.count_ones() == 2 {
                        let [a, b] = s.two(&node.children, entry, entered);
                        stack.set(top, Waiting(a.0.max(b.0)));
                        top += 1;
                        current = Child(a.0.min(b.0) as u32);
                        // The nearer one is read at once.
                        fetch(s, bvh, Child(a.0.max(b.0) as u32));
                        continue;
                    }
                    top = if A::ANY {
                        s.push(&mut stack, top, &node.children, entry, entered)
                    } else {
                        s.push_sorted(&mut stack, top, &node.children, entry, entered)
                    };
                    top -= 1;
                    // SAFETY: more than one was just written.
                    current = unsafe { stack.get(top) }.child();
                    // SAFETY: as before.
                    fetch(s, bvh, unsafe { stack.get(top - 1) }.child());
                    continue;
                }
            } else if current.is_block() {
                answer.block(current.index());
                s.prefetch(bvh.facts.as_ptr().wrapping_add(current.index()));
                let block = &bvh.blocks[current.index()];
                let left = filter::left(s, in_memory(&aim), block, far.last);
                if left.lanes != 0 {
                    let [wanted, ends] = answer.lanes(current.index());
                    if A::ANY && ends & filter::certain(s, &left, aim.near, far.value) != 0 {
                        return true;
                    }
                    if left.lanes & wanted != 0 {
                        break left.lanes & wanted;
                    }
                }
            } else if current != Child::NONE {
                break 0;
            }
            current = loop {
                if top == 0 {
                    return false;
                }
                top -= 1;
                // SAFETY: everything below the top was written.
                let waiting = unsafe { stack.get(top) };
                if waiting.entry() <= far.last {
                    break waiting.child();
                }
            };
        };
        let over = match left {
            0 if current.is_row() => s.spheres(bvh, current, &aim, &mut line, answer),
            0 => answer.other(current.index()),
            lanes => s.settle(&bvh.blocks[current.index()], [current.index(), lanes as usize], &aim, answer),
        };
        if over {
            return true;
        }
        if !A::ANY && answer.far() != far.value {
            far = Far::new(s, answer.far());
        }
        current = loop {
            if top == 0 {
                return false;
            }
            top -= 1;
            // SAFETY: everything below the top was written.
            let waiting = unsafe { stack.get(top) };
            if waiting.entry() <= far.last {
                break waiting.child();
            }
        };
    }
}
