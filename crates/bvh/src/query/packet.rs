//! Rays that leave one point, as those of a pinhole camera do: asked together, they find what each
//! would find alone.

use super::SlotHit;
use crate::bvh8::{PacketResult, PacketState, PacketVisitor, RAYS};
use crate::geometry::Geometry;
use crate::ray::{Hit, Interval, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::PreparedRay;

/// Fewer rays are asked one by one.
const FEWEST: usize = 4;

/// Rays from one point.
#[derive(Clone, Copy, Debug)]
pub struct RayPacket<'a, R: Real> {
    /// Where all of them start, in world units.
    pub origin: R::Vec3,
    /// Unit directions. Those that follow one another should be near one another: up to sixteen are
    /// asked together.
    pub directions: &'a [R::Vec3],
    /// When they are asked, see [`Ray::time`].
    pub time: R,
    /// Whether they are a camera's, see [`Ray::culls`].
    pub culls: bool,
    /// Where hits count.
    pub range: Interval<R>,
}

impl<R: Real> RayPacket<'_, R> {
    fn ray(&self, direction: R::Vec3) -> Ray<R> {
        Ray {
            culls: self.culls,
            ..Ray::new(self.origin, direction).at_time(self.time)
        }
    }
}

/// How rays that were asked together have fared. Where triangles are smaller than pixels each ray
/// has its own way, and they are better asked one by one: the next few, and twice as many each time
/// that they have still parted. Nothing that is found depends on it.
#[derive(Clone, Copy, Debug, Default)]
pub struct PacketBackoff {
    /// Turns that are still to be taken one by one.
    alone: u32,
    /// How many these were.
    pause: u32,
}

impl PacketBackoff {
    /// Turns taken one by one at most before rays are asked together again.
    const LONGEST: u32 = 64;

    /// Whether rays are asked together this turn.
    fn tries(&mut self) -> bool {
        let tries = self.alone == 0;
        self.alone = self.alone.saturating_sub(1);
        tries
    }

    /// Learns how that ended.
    fn learn(&mut self, asked: PacketResult) {
        match asked {
            PacketResult::Whole => self.pause = 0,
            PacketResult::Parted => {
                self.pause = (2 * self.pause).clamp(1, Self::LONGEST);
                self.alone = self.pause;
            }
            PacketResult::Unfit => {}
        }
    }
}

impl<R: Real> Geometry<R> {
    /// The nearest hit of each ray, in their order, in place of what `hits` held: those of
    /// [`Geometry::closest`], bit for bit. `patience` is to be handed from one call to the next
    /// where their rays are near one another.
    pub fn closest_from(
        &self,
        rays: &RayPacket<'_, R>,
        patience: &mut PacketBackoff,
        hits: &mut Vec<Option<Hit<R>>>,
    ) {
        hits.clear();
        hits.reserve(rays.directions.len());
        for some in rays.directions.chunks(RAYS) {
            let asked = if some.len() >= FEWEST && patience.tries() {
                self.together(rays, some, hits)
            } else {
                PacketResult::Unfit
            };
            patience.learn(asked);
            if asked != PacketResult::Whole {
                hits.extend(
                    some.iter()
                        .map(|&direction| self.closest(&rays.ray(direction), rays.range, &mut ())),
                );
            }
        }
    }

    /// Up to [`RAYS`] of them at once. Only where that has gone to its end are there more hits than
    /// before.
    #[inline(never)]
    fn together(
        &self,
        rays: &RayPacket<'_, R>,
        directions: &[R::Vec3],
        hits: &mut Vec<Option<Hit<R>>>,
    ) -> PacketResult {
        let Some(bvh) = self.lanes() else {
            return PacketResult::Unfit;
        };
        let mut stored = [glam::Vec3::ZERO; RAYS];
        stored
            .iter_mut()
            .zip(directions)
            .for_each(|(to, from)| *to = from.to_f32());
        let last = rays.range.max.next_down().to_f32();
        let mut pencil = PacketState::new(
            rays.origin.to_f32(),
            &stored[..directions.len()],
            [rays.range.min.to_f32(), last],
            rays.culls,
        );
        let mut asking = PacketQuery {
            geometry: self,
            rays,
            directions,
        };
        let asked = bvh.visit_packet(&mut pencil, &mut asking);
        if asked != PacketResult::Whole {
            return asked;
        }
        for slot in self.planes..self.unbounded {
            asking.one_by_one(slot, &mut pencil);
        }
        let number = R::from_f32;
        hits.extend((0..pencil.count).map(|ray| {
            let ([t, u, v], [slot, inner]) = pencil.hit(ray)?;
            Some(self.named(&SlotHit {
                t: number(t),
                u: number(u),
                v: number(v),
                slot,
                inner,
            }))
        }));
        asked
    }
}

/// What a pencil asks of a geometry.
struct PacketQuery<'a, 'r, R: Real> {
    geometry: &'a Geometry<R>,
    rays: &'a RayPacket<'r, R>,
    directions: &'a [R::Vec3],
}

impl<R: Real> PacketQuery<'_, '_, R> {
    /// What has no test for several rays.
    #[inline(never)]
    fn one_by_one(&self, slot: usize, pencil: &mut PacketState) {
        let geometry = self.geometry;
        for (ray, &direction) in self.directions.iter().enumerate() {
            let probe: PreparedRay = geometry.prepare(self.rays.ray(direction));
            let range = Interval {
                min: self.rays.range.min,
                max: R::from_f32(pencil.far[ray]).next_up(),
            };
            let own = (slot as u32, &geometry.group.slots[slot]);
            if let Some(SlotHit {
                t,
                u,
                v,
                slot,
                inner,
            }) = geometry.test(own, &probe, range, &mut ())
            {
                pencil.consider(ray, [t, u, v].map(Real::to_f32), [slot, inner], |a, b| {
                    self.lower(a, b)
                });
            }
        }
    }
}

impl<R: Real> PacketVisitor for PacketQuery<'_, '_, R> {
    #[inline(always)]
    fn lower(&self, slot: u32, than: u32) -> bool {
        let order = |slot: u32| self.geometry.group.slots[slot as usize].order();
        order(slot) < order(than)
    }

    fn other(&mut self, place: usize, pencil: &mut PacketState) {
        self.one_by_one(self.geometry.unbounded + place, pencil);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::AcceleratorKind;
    use crate::Visibility;
    use crate::primitive_set::PrimitiveSet;

    /// Protects: each time that rays part twice as many turns are taken one by one, up to 64; one
    /// that stays together ends that, and one that can't be asked changes nothing.
    #[test]
    fn those_that_part_are_asked_one_by_one_for_a_while() {
        let mut patience = PacketBackoff::default();
        for turns in [1, 2, 4, 8, 16, 32, 64, 64, 64] {
            assert!(patience.tries());
            patience.learn(PacketResult::Parted);
            for _ in 0..turns {
                assert!(!patience.tries());
                patience.learn(PacketResult::Unfit);
            }
        }
        assert!(patience.tries());
        patience.learn(PacketResult::Unfit);
        assert!(patience.tries());
        patience.learn(PacketResult::Whole);
        assert!(patience.tries());
        patience.learn(PacketResult::Parted);
        assert!([patience.tries(), patience.tries()] == [false, true]);
    }

    /// Protects: sixteen rays that fall on sixteen faces far from each other among many are found
    /// to part, on neighbours and on one they are not, and all find what each finds alone.
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
            .mesh((0..SIDE * SIDE).flat_map(faces), Visibility::default())
            .unwrap();
        let ground = Geometry::new(group, AcceleratorKind::default());
        let origin = Vec3::new(-20.0, 500.0, -30.0);
        for (spacing, parts) in [(12.0, true), (0.7, false), (0.01, false)] {
            let aim = |i: i32| {
                Vec3::new(
                    60.2 + spacing * (i % 4) as f32,
                    0.0,
                    70.3 + spacing * (i / 4) as f32,
                )
            };
            let directions: Vec<Vec3> = (0..16).map(|i| (aim(i) - origin).normalize()).collect();
            let asked = RayPacket {
                origin,
                directions: &directions,
                time: 0.0,
                culls: false,
                range: Interval::positive(),
            };
            let (mut patience, mut hits) = (PacketBackoff::default(), Vec::new());
            ground.closest_from(&asked, &mut patience, &mut hits);
            assert_eq!(patience.pause > 0, parts, "{spacing} apart");
            let alone: Vec<_> = directions
                .iter()
                .map(|&d| ground.closest(&asked.ray(d), asked.range, &mut ()))
                .collect();
            assert!(hits == alone && hits.iter().all(Option::is_some));
        }
    }
}
