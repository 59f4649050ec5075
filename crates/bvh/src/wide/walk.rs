//! The walk: down to the nearest leaf, through the filter, and back to what waits.
//!
//! One source for every kernel, inlined as a whole into a function that may use the kernel's instructions.

use super::filter::{self, Lanes};
use super::setup::Setup;
use super::simd::{Exact, Simd};
use super::stack::Stack;
use super::{Child, Wide};
use crate::ray::{Interval, Ray};
use crate::scalar::Robust;
use crate::shapes::Probe;

/// What a query makes of what a walk meets.
pub(crate) trait Answer {
    /// Whether any hit will do. Then children are visited in no order.
    const ANY: bool;
    /// The greatest distance that still counts.
    fn far(&self) -> f32;
    /// A node is tested.
    fn node(&mut self);
    /// A block is tested.
    fn block(&mut self, block: usize);
    /// The lanes that matter, and those of which a hit ends the walk whatever it is.
    fn lanes(&self, block: usize) -> [u32; 2];
    /// These triangles are hit at some distance. True ends the walk.
    fn triangles(&mut self, block: usize, exact: &Exact) -> bool;
    /// Another primitive is met. True ends the walk.
    fn other(&mut self, place: usize) -> bool;
}

/// Where boxes end, and triangles.
#[derive(Clone, Copy)]
struct Far<S: Simd> {
    value: f32,
    last: f32,
    boxes: S::Floats,
    triangles: [S::Floats; 2],
}

impl<S: Simd> Far<S> {
    #[inline(always)]
    fn new(s: S, value: f32) -> Self {
        let last = Setup::last(value);
        Self { value, last, boxes: s.splat(last), triangles: [s.splat(last), s.splat(last.abs())] }
    }
}

/// The ray in all lanes, as boxes need it.
struct Slabs<S: Simd> {
    origin: [S::Floats; 3],
    inverse: [S::Floats; 3],
    widened: [S::Floats; 3],
    near: S::Floats,
    later: S::Floats,
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    fn new(s: S, setup: &Setup, lanes: &Lanes<S>) -> Self {
        let ([ix, iy, iz], [wx, wy, wz]) = (setup.inverse, setup.widened);
        Self {
            origin: lanes.origin,
            inverse: [s.splat(ix), s.splat(iy), s.splat(iz)],
            widened: [s.splat(wx), s.splat(wy), s.splat(wz)],
            near: lanes.near,
            later: s.splat(setup.later),
        }
    }

    #[inline(always)]
    fn entry(&self, s: S, planes: &[f32; 8], axis: usize) -> S::Floats {
        s.mul(s.sub(s.load(planes), self.origin[axis]), self.inverse[axis])
    }

    #[inline(always)]
    fn exit(&self, s: S, planes: &[f32; 8], axis: usize) -> S::Floats {
        s.mul_add(s.sub(s.load(planes), self.origin[axis]), self.widened[axis], self.later)
    }
}

/// Whether some answer ended the walk.
#[inline(always)]
pub(super) fn walk<S: Simd, A: Answer>(s: S, wide: &Wide, ray: &Ray<f32>, range: Interval<f32>, answer: &mut A) -> bool {
    let setup = Setup::new(ray, range);
    let lanes = Lanes::new(s, &setup);
    let slabs = Slabs::new(s, &setup, &lanes);
    let [sx, sy, sz] = setup.side;
    let mut far = Far::new(s, answer.far());
    let mut probe = None;
    let mut stack = Stack::new();
    let mut current = Child(0);
    loop {
        // Down to a leaf that has to be looked at. Nothing is called in here, so the ray keeps its registers.
        let left = loop {
            if !current.is_leaf() {
                let node = &wide.nodes[current.index()];
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
                    let base = stack.len();
                    s.push(&mut stack, &node.children, entry, entered);
                    if stack.len() - base == 2 {
                        let (a, b) = (stack[base], stack[base + 1]);
                        stack.truncate(base + 1);
                        stack[base].0 = a.0.max(b.0);
                        current = Child(a.0.min(b.0) as u32);
                        continue;
                    }
                    if !A::ANY {
                        s.sort(&mut stack, base);
                    }
                    if let Some(next) = stack.pop() {
                        current = next.child();
                        continue;
                    }
                }
            } else if current.is_block() {
                answer.block(current.index());
                let left = filter::left(s, &lanes, &wide.blocks[current.index()], far.triangles);
                if left.lanes != 0 {
                    let [wanted, ends] = answer.lanes(current.index());
                    if A::ANY && ends & filter::certain(s, &left, setup.near, far.value) != 0 {
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
                let Some(waiting) = stack.pop() else { return false };
                if waiting.entry() <= far.last {
                    break waiting.child();
                }
            };
        };
        let over = if left == 0 {
            answer.other(current.index())
        } else {
            let probe = probe.get_or_insert_with(|| Probe::<Robust>::new(*ray));
            let exact = s.exact(&wide.blocks[current.index()], left, probe);
            exact.hits != 0 && answer.triangles(current.index(), &exact)
        };
        if over {
            return true;
        }
        if !A::ANY && answer.far() != far.value {
            far = Far::new(s, answer.far());
        }
        current = loop {
            let Some(waiting) = stack.pop() else { return false };
            if waiting.entry() <= far.last {
                break waiting.child();
            }
        };
    }
}
