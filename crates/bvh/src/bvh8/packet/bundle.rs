//! The intervals that contain the directions of a packet's rays, for box tests and for the filter
//! of triangles.

use super::PacketState;
use crate::bvh8::filter::splat_vector;
use crate::bvh8::traversal_ray::{LeafRay, TraversalRay};
use crate::bvh8::{Bvh8Node, WIDTH};
use crate::math::simd::Simd;

/// Bounds of all rays of a packet: on each axis, the interval of the direction components and that
/// of their inverses.
pub(super) struct RayBundle<S: Simd> {
    pub origin: [S::Floats; 3],
    inverse: [[S::Floats; 2]; 3],
    widened: [[S::Floats; 2]; 3],
    late: S::Floats,
    pub near: S::Floats,
    side: [usize; 3],
    /// For each axis, the direction component of least absolute value, and that of greatest.
    direction_bounds: [[S::Floats; 2]; 3],
    /// Terms of the filter's error bounds that hold for every ray of the packet.
    pub bounds: LeafRay,
}

/// Broadcasts each component of two vectors to all lanes. The result has, for each axis, the
/// component of `a` and that of `b`.
#[inline(always)]
fn splat_component_pairs<S: Simd>(s: S, a: [f32; 3], b: [f32; 3]) -> [[S::Floats; 2]; 3] {
    [
        [s.splat(a[0]), s.splat(b[0])],
        [s.splat(a[1]), s.splat(b[1])],
        [s.splat(a[2]), s.splat(b[2])],
    ]
}

impl<S: Simd> RayBundle<S> {
    #[inline(always)]
    pub fn new(s: S, packet_state: &PacketState) -> Option<Self> {
        let [least, most] = packet_state.direction_bounds()?;
        let (short, long) = (
            TraversalRay::new(packet_state.origin, least, packet_state.near),
            TraversalRay::new(packet_state.origin, most, packet_state.near),
        );
        Some(Self {
            origin: splat_vector(s, packet_state.origin),
            inverse: splat_component_pairs(s, short.box_ray.inverse, long.box_ray.inverse),
            widened: splat_component_pairs(
                s,
                short.box_ray.exit_inverse,
                long.box_ray.exit_inverse,
            ),
            late: s.splat(long.box_ray.exit_margin[0]),
            near: s.splat(packet_state.near),
            side: long.box_ray.side,
            direction_bounds: splat_component_pairs(s, least, most),
            // The longest direction's e_T holds for all rays. Its term 12 u E² R contains no
            // direction. Its other term is 14 u E² |d|² · 2R/|d|, or 14 u E² · 2R/|d| if |d| is
            // below one, which is at least twice as large for any |d|.
            bounds: LeafRay {
                reach: short.leaf_ray.reach.max(long.leaf_ray.reach),
                ..long.leaf_ray
            },
        })
    }

    /// Returns the mask of the children that some ray may enter at a distance of at most `far`, and
    /// a lower bound of the entry distance in each child's lane.
    #[inline(always)]
    pub fn intersect_child_boxes(&self, s: S, node: &Bvh8Node, far: S::Floats) -> (u32, S::Floats) {
        let (mut entry, mut exit) = (self.near, far);
        for axis in 0..3 {
            let (planes, side) = (&node.planes[axis], (self.side[axis] & 1) * WIDTH);
            let (near, far) = (
                s.load_from_index(planes, side),
                s.load_from_index(planes, WIDTH - side),
            );
            let (a, b) = (
                s.sub(near, self.origin[axis]),
                s.sub(far, self.origin[axis]),
            );
            let ([i, j], [k, l]) = (self.inverse[axis], self.widened[axis]);
            entry = s.max(s.min(s.mul(a, i), s.mul(a, j)), entry);
            exit = s.min(
                s.max(s.mul_add(b, k, self.late), s.mul_add(b, l, self.late)),
                exit,
            );
        }
        (s.at_most(entry, exit), entry)
    }

    /// Returns lower and upper bounds of v·d, for all directions d of the packet. Each lane has its
    /// own vector v.
    #[inline(always)]
    pub fn dot_product_bounds(&self, s: S, v: [S::Floats; 3]) -> [S::Floats; 2] {
        let [[xa, xb], [ya, yb], [za, zb]] = self.direction_bounds;
        let (xa, xb) = (s.mul(v[0], xa), s.mul(v[0], xb));
        let (ya, yb) = (s.mul(v[1], ya), s.mul(v[1], yb));
        let (za, zb) = (s.mul(v[2], za), s.mul(v[2], zb));
        [
            s.add(s.add(s.min(xa, xb), s.min(ya, yb)), s.min(za, zb)),
            s.add(s.add(s.max(xa, xb), s.max(ya, yb)), s.max(za, zb)),
        ]
    }
}
