//! Traversal by packets of up to sixteen rays with a common origin, such as the rays of a pinhole
//! camera.
//!
//! Boxes are tested once for the whole packet, by the intervals of the inverse directions. Rounding
//! is monotonic. So if a box test passes for any ray of the packet, it passes for the packet too.
//! The packet's entry distance is then not greater than the ray's.
//!
//! For a block of eight triangles, the terms that depend only on the common origin are computed
//! once, in lanes. Each triangle that the intervals of directions may hit is then tested against
//! eight rays at a time. The error bounds of [`super::filter`] also hold for these tests. In its
//! symbols, with C the first corner relative to the origin, U = e₂·(C × d) is computed as (e₂ ×
//! C)·d, with as many roundings. For the intervals, W is computed as (N − A − B)·d, with U = A·d
//! and V = B·d. The components of that vector have errors of 23 u E R. So W has an error of 42 u E
//! R |d|, within the bound of 46 u E R |d|.
//!
//! The remaining triangles go through the operations of the exact test, for eight rays at once in
//! f64. So each ray has the same hit, to the bit, as in a traversal by this ray alone.

#![expect(
    unsafe_code,
    reason = "entries of the stack are read without a check; each block states why they were written"
)]

mod bundle;
mod triangles;

use glam::Vec3;

use self::bundle::RayBundle;
use self::triangles::{PreparedRays8, intersect_triangle_block};
use super::row::{CommonOriginRays8, PrimitiveRow};
use super::stack::TraversalStack;
use super::traversal_ray::TraversalRay;
use super::traversal_simd::TraversalSimd;
use super::{Bvh8, ChildRef, MaskLanes, WIDTH};
use crate::math::simd::Simd;
use crate::ray::Ray;

/// Number of groups of eight rays in a packet.
const GROUPS: usize = 2;
/// Greatest number of rays in a packet.
pub(crate) const MAX_RAYS: usize = GROUPS * WIDTH;
/// Least absolute value of a direction component in a packet, itself excluded. A packet with a
/// smaller component is not traversed, since its inverse directions might have both signs.
const MIN_COMPONENT: f32 = 1e-30;

/// A packet of rays, with the hits found so far.
pub(crate) struct PacketState {
    origin: [f32; 3],
    /// Directions, one array per axis. Unused lanes repeat the first direction.
    directions: [[f32; MAX_RAYS]; 3],
    /// Number of rays in the packet.
    pub count: usize,
    /// Lower end of the accepted distances for all rays, itself excluded.
    near: f32,
    /// Greatest accepted distance of each ray. For a ray with a hit, it is the distance of that
    /// hit.
    pub far: [f32; MAX_RAYS],
    /// Shape-specific numbers `u` and `v` of each hit, see [`crate::Hit`].
    uv: [[f32; MAX_RAYS]; 2],
    /// Slots (records in the primitive set) of each hit, as `slots[level][ray]`. Level 0 is the
    /// slot in the set itself. For a hit of an instance, level 1 is the slot in the instanced
    /// geometry.
    slots: [[u32; MAX_RAYS]; 2],
    /// Whether the rays are camera rays, which pass through the inside of culled surfaces.
    culls: bool,
}

impl PacketState {
    /// Slot value of a ray without a hit.
    const NO_SLOT: u32 = u32::MAX;

    /// Creates a packet from the first [`MAX_RAYS`] directions, or fewer. A distance t is accepted
    /// if `near < t <= last`.
    #[inline(always)]
    pub fn new(origin: Vec3, directions: &[Vec3], [near, last]: [f32; 2], culls: bool) -> Self {
        let count = directions.len().min(MAX_RAYS);
        let mut lanes = directions
            .first()
            .copied()
            .unwrap_or(Vec3::ONE)
            .to_array()
            .map(|d| [d; MAX_RAYS]);
        for (ray, direction) in directions.iter().take(MAX_RAYS).enumerate() {
            (lanes[0][ray], lanes[1][ray], lanes[2][ray]) = (direction.x, direction.y, direction.z);
        }
        let (mut far, slots) = (
            [f32::NEG_INFINITY; MAX_RAYS],
            [[Self::NO_SLOT; MAX_RAYS]; 2],
        );
        far[..count].fill(last);
        Self {
            origin: origin.to_array(),
            directions: lanes,
            count,
            near,
            far,
            uv: [[0.0; MAX_RAYS]; 2],
            slots,
            culls,
        }
    }

    /// Returns the hit of a ray: its distance, `u` and `v`, then its two slots. `None` without a
    /// hit.
    #[inline(always)]
    pub fn hit(&self, ray: usize) -> Option<([f32; 3], [u32; 2])> {
        let ray = ray & (MAX_RAYS - 1);
        let found = self.slots[0][ray] != Self::NO_SLOT;
        found.then(|| {
            (
                [self.far[ray], self.uv[0][ray], self.uv[1][ray]],
                [self.slots[0][ray], self.slots[1][ray]],
            )
        })
    }

    /// Returns the ray with the given index, at time 0.
    pub fn ray(&self, ray: usize) -> Ray<f32> {
        let d = |axis: usize| self.directions[axis][ray & (MAX_RAYS - 1)];
        Ray::new(self.origin.into(), [d(0), d(1), d(2)].into())
    }

    /// Records a hit of a ray if it is nearer than the ray's recorded hit. Of two equally distant
    /// hits, `lower` returns whether the first slot, that of the new hit, is preferred to the
    /// second.
    #[inline(always)]
    pub fn record_hit(
        &mut self,
        ray: usize,
        [t, u, v]: [f32; 3],
        [slot, inner]: [u32; 2],
        lower: impl FnOnce(u32, u32) -> bool,
    ) {
        let ray = ray & (MAX_RAYS - 1);
        let (best, found) = (self.far[ray], self.slots[0][ray]);
        if t < best || t == best && (found == Self::NO_SLOT || lower(slot, found)) {
            self.far[ray] = t;
            (self.uv[0][ray], self.uv[1][ray]) = (u, v);
            (self.slots[0][ray], self.slots[1][ray]) = (slot, inner);
        }
    }

    /// Returns the mask of the lanes in a group of eight that hold rays of the packet.
    #[inline(always)]
    fn ray_mask(&self, group: usize) -> u32 {
        let count = self.count.saturating_sub(group * WIDTH).min(WIDTH);
        (1 << count) - 1
    }

    /// Returns two vectors: for each axis, the direction component of least absolute value, and
    /// that of greatest. `None` if on some axis the components have both signs, or one is close to
    /// zero.
    #[inline(always)]
    fn direction_bounds(&self) -> Option<[[f32; 3]; 2]> {
        let mut spans = [[0.0; 3]; 2];
        for (axis, directions) in self.directions.iter().enumerate() {
            let (mut minimum, mut greatest) = (f32::INFINITY, f32::NEG_INFINITY);
            for &d in directions {
                minimum = if d < minimum { d } else { minimum };
                greatest = if d > greatest { d } else { greatest };
            }
            (spans[0][axis], spans[1][axis]) = match () {
                () if minimum > MIN_COMPONENT => (minimum, greatest),
                () if greatest < -MIN_COMPONENT => (greatest, minimum),
                () => return None,
            };
        }
        Some(spans)
    }
}

/// Receiver of the primitives that a packet traversal does not test itself.
pub(crate) trait PacketVisitor {
    /// Whether a hit of the primitive in `slot` is preferred to an equally distant hit in the slot
    /// `than`.
    fn wins_tie(&self, slot: u32, than: u32) -> bool;
    /// Tests all rays of the packet against a primitive that has no packet test. `index` is the
    /// position of the primitive in the tree's order.
    fn test_primitive_ray_by_ray(&mut self, index: usize, packet_state: &mut PacketState);
}

/// Outcome of a packet traversal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PacketResult {
    /// The traversal completed, and all hits are found.
    Complete,
    /// The traversal stopped early, since the rays diverge and single rays would cost less. The
    /// recorded hits are incomplete.
    Abandoned,
    /// The tree was not traversed. On some axis the directions have both signs, or one is close to
    /// zero.
    Unsuitable,
}

/// Number of tested leaves after which a packet traversal stops. So many tests cost about as much
/// as tracing all rays of the packet one by one. Measured:
/// `../../../../benches/runs/2026-11-23-pencils.md`.
const MAX_LEAVES: u32 = 32;

/// Traverses the tree with a packet. The hits are complete only for [`PacketResult::Complete`].
#[inline(always)]
pub(super) fn traverse_packet<S: TraversalSimd>(
    s: S,
    bvh: &Bvh8,
    packet_state: &mut PacketState,
    visitor: &mut dyn PacketVisitor,
) -> PacketResult {
    let has_boxes = !(bvh.nodes.is_empty() && bvh.blocks.is_empty());
    let bundle = if has_boxes {
        RayBundle::new(s, packet_state)
    } else {
        None
    };
    if has_boxes && bundle.is_none() {
        return PacketResult::Unsuitable;
    }
    if bvh.always_row_count > 0 {
        intersect_primitive_rows(s, &bvh.rows[..bvh.always_row_count], packet_state, visitor);
    }
    if let Some(bundle) = bundle {
        let mut exact = None;
        if bvh.nodes.is_empty() {
            for number in 0..bvh.blocks.len() {
                intersect_triangle_block(
                    s,
                    bvh,
                    number,
                    &bundle,
                    packet_state,
                    &mut exact,
                    visitor,
                );
            }
        } else if !traverse_nodes(s, bvh, &bundle, packet_state, &mut exact, visitor) {
            return PacketResult::Abandoned;
        }
    }
    bvh.single_positions
        .clone()
        .for_each(|index| visitor.test_primitive_ray_by_ray(index, packet_state));
    PacketResult::Complete
}

/// Intersects a packet with rows of spheres or planes. Each primitive is tested against eight rays
/// at a time.
#[inline(always)]
fn intersect_primitive_rows<S: Simd>(
    s: S,
    rows: &[PrimitiveRow],
    packet_state: &mut PacketState,
    visitor: &dyn PacketVisitor,
) {
    let origin = Vec3::from(packet_state.origin).as_dvec3();
    for group in 0..GROUPS {
        let first = group * WIDTH;
        if first >= packet_state.count {
            return;
        }
        let row = |axis: usize| -> [f32; WIDTH] {
            core::array::from_fn(|lane| packet_state.directions[axis][first + lane])
        };
        let rays =
            CommonOriginRays8::new(s, origin, [&row(0), &row(1), &row(2)], packet_state.culls);
        for row in rows {
            for lane in 0..usize::from(row.leaf_header.count) {
                let far: [f32; WIDTH] = core::array::from_fn(|lane| packet_state.far[first + lane]);
                let row_hits = row.intersect_primitive_in_lane(
                    s,
                    lane,
                    &rays,
                    packet_state.near,
                    s.load(&far),
                );
                if row_hits.hits == 0 {
                    continue;
                }
                let stored_row_hits = row_hits.store_lanes(s);
                for ray in MaskLanes(row_hits.hits) {
                    let v = if stored_row_hits.exits >> ray & 1 == 0 {
                        0.0
                    } else {
                        1.0
                    };
                    let slots = [row.leaf_header.first + lane as u32, u32::MAX];
                    packet_state.record_hit(
                        first + ray,
                        [stored_row_hits.t[ray], 0.0, v],
                        slots,
                        |a, b| visitor.wins_tie(a, b),
                    );
                }
            }
        }
    }
}

/// Returns the greatest accepted distance of any ray, plus the rounding error of box tests. So box
/// tests miss no hit up to the accepted distance.
#[inline(always)]
fn max_far_distance(packet_state: &PacketState) -> f32 {
    let mut far = f32::NEG_INFINITY;
    for &one in &packet_state.far {
        far = if one > far { one } else { far };
    }
    TraversalRay::widen_far_distance(far)
}

/// Traverses the nodes of the tree. Returns false if the traversal stopped after [`MAX_LEAVES`]
/// leaves. `exact` is set at the first triangle that needs the exact test.
#[inline(always)]
fn traverse_nodes<S: TraversalSimd>(
    s: S,
    bvh: &Bvh8,
    bundle: &RayBundle<S>,
    packet_state: &mut PacketState,
    exact: &mut Option<[PreparedRays8; GROUPS]>,
    visitor: &mut dyn PacketVisitor,
) -> bool {
    let (mut far, mut leaves) = (max_far_distance(packet_state), 0);
    let (mut stack, mut top, mut current) = (TraversalStack::new(), 0, ChildRef(0));
    loop {
        if !current.is_leaf() {
            let node = &bvh.nodes[current.node_index()];
            let (entered, entry) = bundle.intersect_child_boxes(s, node, s.splat(far));
            if entered != 0 {
                if entered & (entered - 1) == 0 {
                    current = node.children[entered.trailing_zeros() as usize & 7];
                    continue;
                }
                top = s.push_children_sorted(&mut stack, top, &node.children, entry, entered);
            }
        } else if current != ChildRef::NONE {
            leaves += 1;
            if leaves > MAX_LEAVES {
                return false;
            }
            match () {
                () if current.is_triangle_block() => intersect_triangle_block(
                    s,
                    bvh,
                    current.leaf_index(),
                    bundle,
                    packet_state,
                    exact,
                    visitor,
                ),
                () if current.is_sphere_row() => {
                    let row = bvh.always_row_count + current.leaf_index();
                    intersect_primitive_rows(s, &bvh.rows[row..=row], packet_state, visitor);
                }
                () => visitor.test_primitive_ray_by_ray(current.leaf_index(), packet_state),
            }
            far = max_far_distance(packet_state);
        }
        // SAFETY: every entry below the top was written.
        let Some(next) = (unsafe { stack.pop(&mut top, far) }) else {
            return true;
        };
        current = next;
    }
}
