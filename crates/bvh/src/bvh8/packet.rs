//! Rays from one point, up to sixteen at a time: a pencil, as the rays of a pinhole camera are.
//!
//! Boxes are tested once for all of them, by the interval of their inverse directions: rounding
//! keeps order, so where the box test of any of them passes, this one does, and no later. What a
//! triangle has to do with the common origin is worked out once, eight triangles side by side; then
//! each triangle that the interval of directions may hit meets eight rays at a time. What
//! [`super::filter`] says of bounds holds here as it stands: U = e₂·(f64 × d) is (e₂ × f64)·d, with
//! as many roundings. W is also taken for the interval as (N − A − B)·d, of components that are
//! wrong by 23 u E R, so by 42 u E R |d|, of the same 46. What the filter leaves goes through the
//! exact test's own operations, eight rays at once in f64, so that a hit has the bits that the ray
//! alone would find.

#![expect(
    unsafe_code,
    reason = "the stack is read where it was written; each block says why"
)]

mod bundle;
mod triangles;

use glam::Vec3;

use self::bundle::Bundle;
use self::triangles::{Rays8, block};
use super::row::{RaysF64, Row};
use super::stack::Stack;
use super::traversal_ray::TraversalRay;
use super::traversal_simd::TraversalSimd;
use super::{Bvh8, Child, Lanes, WIDTH};
use crate::math::simd::Simd;
use crate::ray::Ray;

/// Vectors of rays in a pencil.
const GROUPS: usize = 2;
/// Rays of a pencil.
pub(crate) const RAYS: usize = GROUPS * WIDTH;
/// A direction that is nearer to a plane across an axis is not known to leave on one side of it.
const LEAST: f32 = 1e-30;

/// What a pencil asks, with what it has found so far.
pub(crate) struct PacketState {
    origin: [f32; 3],
    /// One array an axis; where there is no ray, the direction of the first.
    directions: [[f32; RAYS]; 3],
    /// How many rays there are.
    pub count: usize,
    /// The excluded lower end of distances.
    near: f32,
    /// The greatest distance that still counts of each ray: that of its hit where it has one.
    pub far: [f32; RAYS],
    /// The other numbers of its hit, and the slots.
    rest: [[f32; RAYS]; 2],
    slots: [[u32; RAYS]; 2],
    /// Whether the rays pass backs that are culled.
    culls: bool,
}

impl PacketState {
    /// No slot: nothing found.
    const NOTHING: u32 = u32::MAX;

    /// Of so many directions at most. `near` is excluded, `last` the greatest distance that counts.
    #[inline(always)]
    pub fn new(origin: Vec3, directions: &[Vec3], [near, last]: [f32; 2], culls: bool) -> Self {
        let count = directions.len().min(RAYS);
        let mut lanes = directions
            .first()
            .copied()
            .unwrap_or(Vec3::ONE)
            .to_array()
            .map(|d| [d; RAYS]);
        for (ray, direction) in directions.iter().take(RAYS).enumerate() {
            (lanes[0][ray], lanes[1][ray], lanes[2][ray]) = (direction.x, direction.y, direction.z);
        }
        let (mut far, slots) = ([f32::NEG_INFINITY; RAYS], [[Self::NOTHING; RAYS]; 2]);
        far[..count].fill(last);
        Self {
            origin: origin.to_array(),
            directions: lanes,
            count,
            near,
            far,
            rest: [[0.0; RAYS]; 2],
            slots,
            culls,
        }
    }

    /// What a ray has hit: the distance and the hit's other numbers, and both slots.
    #[inline(always)]
    pub fn hit(&self, ray: usize) -> Option<([f32; 3], [u32; 2])> {
        let ray = ray & (RAYS - 1);
        let found = self.slots[0][ray] != Self::NOTHING;
        found.then(|| {
            (
                [self.far[ray], self.rest[0][ray], self.rest[1][ray]],
                [self.slots[0][ray], self.slots[1][ray]],
            )
        })
    }

    /// A ray, at no time.
    pub fn ray(&self, ray: usize) -> Ray<f32> {
        let d = |axis: usize| self.directions[axis][ray & (RAYS - 1)];
        Ray::new(self.origin.into(), [d(0), d(1), d(2)].into())
    }

    /// Takes a hit within the range where it is nearer than what was found, or as near and lower in
    /// the order of ties.
    #[inline(always)]
    pub fn consider(
        &mut self,
        ray: usize,
        [t, u, v]: [f32; 3],
        [slot, inner]: [u32; 2],
        lower: impl FnOnce(u32, u32) -> bool,
    ) {
        let ray = ray & (RAYS - 1);
        let (best, found) = (self.far[ray], self.slots[0][ray]);
        if t < best || t == best && (found == Self::NOTHING || lower(slot, found)) {
            self.far[ray] = t;
            (self.rest[0][ray], self.rest[1][ray]) = (u, v);
            (self.slots[0][ray], self.slots[1][ray]) = (slot, inner);
        }
    }

    /// The lanes of a group that are rays.
    #[inline(always)]
    fn asked(&self, group: usize) -> u32 {
        let count = self.count.saturating_sub(group * WIDTH).min(WIDTH);
        (1 << count) - 1
    }

    /// The least and the greatest size of directions in each axis, with their sign; none where that
    /// is not one.
    #[inline(always)]
    fn spans(&self) -> Option<[[f32; 3]; 2]> {
        let mut spans = [[0.0; 3]; 2];
        for (axis, directions) in self.directions.iter().enumerate() {
            let (mut least, mut greatest) = (f32::INFINITY, f32::NEG_INFINITY);
            for &d in directions {
                least = if d < least { d } else { least };
                greatest = if d > greatest { d } else { greatest };
            }
            (spans[0][axis], spans[1][axis]) = match () {
                () if least > LEAST => (least, greatest),
                () if greatest < -LEAST => (greatest, least),
                () => return None,
            };
        }
        Some(spans)
    }
}

/// What whoever asks makes of what a pencil meets.
pub(crate) trait PacketVisitor {
    /// Whether the first slot comes before the second where both are hit at one distance.
    fn lower(&self, slot: u32, than: u32) -> bool;
    /// Another primitive is met, by some of the rays.
    fn other(&mut self, place: usize, pencil: &mut PacketState);
}

/// How asking rays together ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PacketResult {
    /// All is found that they meet.
    Whole,
    /// Each has its own way: it would take less to ask them one by one, and what they found so far
    /// is not all.
    Parted,
    /// They can't be asked together: directions differ too much. Nothing was done.
    Unfit,
}

/// Leaves that a pencil asks about before it is given up: as many as cost about what its rays cost
/// one by one. Measured: `../../../../benches/runs/2026-11-23-pencils.md`.
const MOST_LEAVES: u32 = 32;

/// Asks about all that the rays may meet.
#[inline(always)]
pub(super) fn walk<S: TraversalSimd>(
    s: S,
    bvh: &Bvh8,
    pencil: &mut PacketState,
    meets: &mut dyn PacketVisitor,
) -> PacketResult {
    let has_boxes = !(bvh.nodes.is_empty() && bvh.blocks.is_empty());
    let bundle = if has_boxes {
        Bundle::new(s, pencil)
    } else {
        None
    };
    if has_boxes && bundle.is_none() {
        return PacketResult::Unfit;
    }
    if bvh.always > 0 {
        rows_of_lanes(s, &bvh.rows[..bvh.always], pencil, meets);
    }
    if let Some(bundle) = bundle {
        let mut exact = None;
        if bvh.nodes.is_empty() {
            for number in 0..bvh.blocks.len() {
                block(s, bvh, number, &bundle, pencil, &mut exact, meets);
            }
        } else if !down(s, bvh, &bundle, pencil, &mut exact, meets) {
            return PacketResult::Parted;
        }
    }
    bvh.others
        .clone()
        .for_each(|place| meets.other(place, pencil));
    PacketResult::Whole
}

/// Spheres or planes, each asked about eight rays at a time.
#[inline(always)]
fn rows_of_lanes<S: Simd>(s: S, rows: &[Row], pencil: &mut PacketState, meets: &dyn PacketVisitor) {
    let origin = Vec3::from(pencil.origin).as_dvec3();
    for group in 0..GROUPS {
        let first = group * WIDTH;
        if first >= pencil.count {
            return;
        }
        let row = |axis: usize| -> [f32; WIDTH] {
            core::array::from_fn(|lane| pencil.directions[axis][first + lane])
        };
        let lines = RaysF64::new(s, origin, [&row(0), &row(1), &row(2)], pencil.culls);
        for row in rows {
            for lane in 0..usize::from(row.facts.count) {
                let far: [f32; WIDTH] = core::array::from_fn(|lane| pencil.far[first + lane]);
                let found = row.lane(s, lane, &lines, pencil.near, s.load(&far));
                if found.hits == 0 {
                    continue;
                }
                let roots = found.stored(s);
                for ray in Lanes(found.hits) {
                    let v = if roots.leaving >> ray & 1 == 0 {
                        0.0
                    } else {
                        1.0
                    };
                    let slots = [row.facts.first + lane as u32, u32::MAX];
                    pencil.consider(first + ray, [roots.t[ray], 0.0, v], slots, |a, b| {
                        meets.lower(a, b)
                    });
                }
            }
        }
    }
}

/// The greatest distance that still counts of any ray, as boxes use it.
#[inline(always)]
fn greatest_far(pencil: &PacketState) -> f32 {
    let mut far = f32::NEG_INFINITY;
    for &one in &pencil.far {
        far = if one > far { one } else { far };
    }
    TraversalRay::last(far)
}

/// Down the tree; whether to its end.
#[inline(always)]
fn down<S: TraversalSimd>(
    s: S,
    bvh: &Bvh8,
    bundle: &Bundle<S>,
    pencil: &mut PacketState,
    exact: &mut Option<[Rays8; GROUPS]>,
    meets: &mut dyn PacketVisitor,
) -> bool {
    let (mut far, mut leaves) = (greatest_far(pencil), 0);
    let (mut stack, mut top, mut current) = (Stack::new(), 0, Child(0));
    loop {
        if !current.is_leaf() {
            let node = &bvh.nodes[current.node()];
            let (entered, entry) = bundle.enter(s, node, s.splat(far));
            if entered != 0 {
                if entered & (entered - 1) == 0 {
                    current = node.children[entered.trailing_zeros() as usize & 7];
                    continue;
                }
                top = s.push_sorted(&mut stack, top, &node.children, entry, entered);
            }
        } else if current != Child::NONE {
            leaves += 1;
            if leaves > MOST_LEAVES {
                return false;
            }
            match () {
                () if current.is_block() => {
                    block(s, bvh, current.index(), bundle, pencil, exact, meets)
                }
                () if current.is_row() => {
                    let row = bvh.always + current.index();
                    rows_of_lanes(s, &bvh.rows[row..=row], pencil, meets);
                }
                () => meets.other(current.index(), pencil),
            }
            far = greatest_far(pencil);
        }
        // SAFETY: everything below the top was written.
        let Some(next) = (unsafe { stack.pop(&mut top, far) }) else {
            return true;
        };
        current = next;
    }
}
