//! Packets of rays with a common origin, such as the rays of a pinhole camera. A packet's rays are
//! traced together. Each ray has the same hit as if it were traced alone.

use super::SlotHit;
use crate::bvh8::{MAX_RAYS, PacketResult, PacketState, PacketVisitor};
use crate::geometry::Geometry;
use crate::ray::{Hit, Interval, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::PreparedRay;

/// Least number of rays in a packet. Fewer rays are traced one by one.
const MIN_PACKET_RAYS: usize = 4;

/// Any number of rays with a common origin, such as the camera rays of a tile. They are traced
/// together, in packets of up to sixteen.
#[derive(Clone, Copy, Debug)]
#[doc(alias("RTCRayHit8", "ray stream"))]
pub struct RayPacket<'a, R: Real> {
    /// Common origin, in world units.
    pub origin: R::Vec3,
    /// Unit directions. Consecutive directions should be similar, since packets are formed of up to
    /// sixteen consecutive rays.
    pub directions: &'a [R::Vec3],
    /// Time of all rays, see [`Ray::time`].
    pub time: R,
    /// Whether these are camera rays, see [`Ray::is_camera_ray`].
    pub culls: bool,
    /// Open interval of accepted distances, for all rays.
    pub range: Interval<R>,
}

impl<R: Real> RayPacket<'_, R> {
    /// Creates the ray of this packet with the given direction.
    fn build_ray(&self, direction: R::Vec3) -> Ray<R> {
        Ray {
            is_camera_ray: self.culls,
            ..Ray::new(self.origin, direction).with_time(self.time)
        }
    }
}

/// Adaptive choice between packets and single rays, from the success of earlier packets.
///
/// If triangles are smaller than pixels, rays diverge in the tree, and single rays are faster.
/// After a failed packet, the next groups of up to sixteen rays are traced one by one. With each
/// further failure the number of these groups doubles. No hit depends on this choice.
#[derive(Clone, Copy, Debug, Default)]
pub struct PacketBackoff {
    /// Number of the next groups of rays that are traced one by one.
    single_turns: u32,
    /// Number of groups that are traced one by one after the last failure; zero after a success.
    pause: u32,
}

impl PacketBackoff {
    /// Upper limit of `pause`.
    const MAX_PAUSE: u32 = 64;

    /// Returns whether the next group of rays is traced as a packet, and counts that group.
    fn should_try_packet(&mut self) -> bool {
        let tries = self.single_turns == 0;
        self.single_turns = self.single_turns.saturating_sub(1);
        tries
    }

    /// Adapts the choice for the next groups to the outcome of a packet.
    fn record_packet_result(&mut self, packet_result: PacketResult) {
        match packet_result {
            PacketResult::Complete => self.pause = 0,
            PacketResult::Abandoned => {
                self.pause = (2 * self.pause).clamp(1, Self::MAX_PAUSE);
                self.single_turns = self.pause;
            }
            PacketResult::Unsuitable => {}
        }
    }
}

impl<R: Real> Geometry<R> {
    /// Finds the closest hit of each ray. Replaces the contents of `hits` by the results, in the
    /// order of the rays. Each result equals that of [`Geometry::closest`] bit for bit. Consecutive
    /// calls with similar rays should pass the same `backoff`.
    #[doc(alias("rtcIntersect8", "rtcIntersect16"))]
    pub fn closest_of_packet(
        &self,
        rays: &RayPacket<'_, R>,
        backoff: &mut PacketBackoff,
        hits: &mut Vec<Option<Hit<R>>>,
    ) {
        hits.clear();
        hits.reserve(rays.directions.len());
        for directions in rays.directions.chunks(MAX_RAYS) {
            let packet_result =
                if directions.len() >= MIN_PACKET_RAYS && backoff.should_try_packet() {
                    self.trace_packet(rays, directions, hits)
                } else {
                    PacketResult::Unsuitable
                };
            backoff.record_packet_result(packet_result);
            if packet_result != PacketResult::Complete {
                hits.extend(directions.iter().map(|&direction| {
                    self.closest(&rays.build_ray(direction), rays.range, &mut ())
                }));
            }
        }
    }

    /// Traces up to [`MAX_RAYS`] rays together. If the packet traversal completes, appends one
    /// result per ray to `hits`.
    #[inline(never)]
    fn trace_packet(
        &self,
        rays: &RayPacket<'_, R>,
        directions: &[R::Vec3],
        hits: &mut Vec<Option<Hit<R>>>,
    ) -> PacketResult {
        let Some(bvh) = self.simd_tree() else {
            return PacketResult::Unsuitable;
        };
        let mut stored = [glam::Vec3::ZERO; MAX_RAYS];
        stored
            .iter_mut()
            .zip(directions)
            .for_each(|(to, from)| *to = from.to_f32());
        let last = rays.range.max.next_down().to_f32();
        let mut packet_state = PacketState::new(
            rays.origin.to_f32(),
            &stored[..directions.len()],
            [rays.range.min.to_f32(), last],
            rays.culls,
        );
        let mut packet_query = PacketQuery {
            geometry: self,
            rays,
            directions,
        };
        let packet_result = bvh.visit_packet(&mut packet_state, &mut packet_query);
        if packet_result != PacketResult::Complete {
            return packet_result;
        }
        for slot in self.planes..self.unbounded {
            packet_query.test_slot_ray_by_ray(slot, &mut packet_state);
        }
        let number = R::from_f32;
        hits.extend((0..packet_state.count).map(|ray| {
            let ([t, u, v], [slot, inner]) = packet_state.hit(ray)?;
            Some(self.to_hit(&SlotHit {
                t: number(t),
                u: number(u),
                v: number(v),
                slot,
                inner,
            }))
        }));
        packet_result
    }
}

/// A packet query: the geometry and the rays for the primitive tests of a packet traversal.
struct PacketQuery<'a, 'r, R: Real> {
    geometry: &'a Geometry<R>,
    rays: &'a RayPacket<'r, R>,
    directions: &'a [R::Vec3],
}

impl<R: Real> PacketQuery<'_, '_, R> {
    /// Tests all rays of the packet, one by one, against a primitive that has no packet test.
    #[inline(never)]
    fn test_slot_ray_by_ray(&self, slot: usize, packet_state: &mut PacketState) {
        let geometry = self.geometry;
        for (ray, &direction) in self.directions.iter().enumerate() {
            let prepared_ray: PreparedRay = geometry.prepare_ray(self.rays.build_ray(direction));
            let range = Interval {
                min: self.rays.range.min,
                max: R::from_f32(packet_state.far[ray]).next_up(),
            };
            let own = (slot as u32, &geometry.primitives.slots[slot]);
            if let Some(SlotHit {
                t,
                u,
                v,
                slot,
                inner,
            }) = geometry.intersect_primitive_in_slot(own, &prepared_ray, range, &mut ())
            {
                packet_state.record_hit(ray, [t, u, v].map(Real::to_f32), [slot, inner], |a, b| {
                    self.wins_tie(a, b)
                });
            }
        }
    }
}

impl<R: Real> PacketVisitor for PacketQuery<'_, '_, R> {
    #[inline(always)]
    fn wins_tie(&self, slot: u32, than: u32) -> bool {
        let order = |slot: u32| self.geometry.primitives.slots[slot as usize].tie_order();
        order(slot) < order(than)
    }

    fn test_primitive_ray_by_ray(&mut self, index: usize, packet_state: &mut PacketState) {
        self.test_slot_ray_by_ray(self.geometry.unbounded + index, packet_state);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::AcceleratorKind;
    use crate::Visibility;
    use crate::primitive_set::PrimitiveSet;

    /// Protects: each failed packet doubles the number of groups traced one by one, up to 64. A
    /// completed packet resets the number, and a packet that was not traversed changes nothing.
    #[test]
    fn failed_packets_double_the_pause() {
        let mut backoff = PacketBackoff::default();
        for turns in [1, 2, 4, 8, 16, 32, 64, 64, 64] {
            assert!(backoff.should_try_packet());
            backoff.record_packet_result(PacketResult::Abandoned);
            for _ in 0..turns {
                assert!(!backoff.should_try_packet());
                backoff.record_packet_result(PacketResult::Unsuitable);
            }
        }
        assert!(backoff.should_try_packet());
        backoff.record_packet_result(PacketResult::Unsuitable);
        assert!(backoff.should_try_packet());
        backoff.record_packet_result(PacketResult::Complete);
        assert!(backoff.should_try_packet());
        backoff.record_packet_result(PacketResult::Abandoned);
        assert!([backoff.should_try_packet(), backoff.should_try_packet()] == [false, true]);
    }

    /// Protects: a packet of sixteen rays at sixteen distant triangles of a mesh is given up, but a
    /// packet at neighbouring triangles, or at a single triangle, is not. In all cases each ray
    /// finds the same hit as alone.
    #[test]
    fn only_rays_with_ways_of_their_own_part() {
        const SIDE: i32 = 200;
        let corner =
            |x: i32, z: i32| Vec3::new(x as f32, 0.3 * ((7 * x + 3 * z) % 5) as f32, z as f32);
        let faces = |i: i32| {
            let (x, z) = (i % SIDE, i / SIDE);
            let [a, b, c, d] = [
                corner(x, z),
                corner(x + 1, z),
                corner(x + 1, z + 1),
                corner(x, z + 1),
            ];
            [[a, c, b], [a, d, c]]
        };
        let mut group = PrimitiveSet::<f32>::default();
        group
            .add_mesh((0..SIDE * SIDE).flat_map(faces), Visibility::default())
            .unwrap();
        let ground = Geometry::new(group, AcceleratorKind::default());
        let origin = Vec3::new(-20.0, 500.0, -30.0);
        for (spacing, parts) in [(12.0, true), (0.7, false), (0.01, false)] {
            let target = |i: i32| {
                Vec3::new(
                    60.2 + spacing * (i % 4) as f32,
                    0.0,
                    70.3 + spacing * (i / 4) as f32,
                )
            };
            let directions: Vec<Vec3> = (0..16).map(|i| (target(i) - origin).normalize()).collect();
            let requested = RayPacket {
                origin,
                directions: &directions,
                time: 0.0,
                culls: false,
                range: Interval::positive(),
            };
            let (mut backoff, mut hits) = (PacketBackoff::default(), Vec::new());
            ground.closest_of_packet(&requested, &mut backoff, &mut hits);
            assert_eq!(backoff.pause > 0, parts, "{spacing} apart");
            let alone: Vec<_> = directions
                .iter()
                .map(|&d| ground.closest(&requested.build_ray(d), requested.range, &mut ()))
                .collect();
            assert!(hits == alone && hits.iter().all(Option::is_some));
        }
    }
}
