//! The narrow interface: closest hit and any hit over a set of primitives, whatever structure
//! answers, with the same bits.
//!
//! Queries are functions of their own, one set for each scalar, so that whoever asks has a call in
//! its loop and not a copy of every primitive's test. While they look, a hit is known by its slot;
//! it gets its names once it is the answer.

mod packet;
mod visitor;

pub use packet::{PacketBackoff, RayPacket};

use core::ops::Range;

use crate::geometry::Geometry;
use crate::ray::{Hit, Interval, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::{PreparedRay, Shape, ShapeHit};
use crate::slot::{Kind, Slot};
use crate::stats::{TraversalCounter, TraversalStats};

use self::visitor::{AnyHit, ClosestHit, QueryKind, Visitor};

/// No slot of a part: the hit lies in the scene's own set.
const NO_PART: u32 = u32::MAX;

/// A hit by its slot, and in an instance by the slot in what that shows.
#[derive(Clone, Copy)]
struct SlotHit<R> {
    t: R,
    u: R,
    v: R,
    slot: u32,
    inner: u32,
}

/// Whether all numbers of a ray are finite, and so is their sum. One of NaN enters every box, and
/// would hit nothing for the price of a scan.
#[inline(always)]
fn is_sound<R: Real>(ray: &Ray<R>) -> bool {
    let sums = ray.origin + ray.direction;
    (sums.x() + sums.y() + sums.z()).abs() < R::INFINITY
}

impl<R: Real> Geometry<R> {
    /// The nearest hit with `range.min < t < range.max`; of hits at the same distance the one of
    /// the lowest object, and of those the lowest primitive.
    #[inline(never)]
    pub fn closest<T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        tally: &mut T,
    ) -> Option<Hit<R>> {
        if !is_sound(ray) {
            return None;
        }
        let Some(bvh) = self.lanes() else {
            return self
                .closest_prepared(ray, range, tally)
                .map(|found| self.named(&found));
        };
        let mut visitor = Visitor {
            geometry: self,
            query: ClosestHit::new(range),
            tally,
        };
        self.visit_stored(bvh, ray, &mut visitor);
        visitor.query.found.as_ref().map(|found| self.named(found))
    }

    /// The nearest hit of a ray that is prepared first: by a scan, and of what is stored in f64.
    /// Apart, since what it needs of the machine's stack differs by far.
    #[inline(never)]
    fn closest_prepared<T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        tally: &mut T,
    ) -> Option<SlotHit<R>> {
        let ray = self.prepare(*ray);
        let closest = self
            .visit_all(&ray, ClosestHit::new(range).in_space_of(&ray), tally)
            .1;
        let found = closest.found?;
        Some(if closest.is_contested {
            self.first_of_equals(&ray, closest.range, found, tally)
        } else {
            found
        })
    }

    /// Of the hits in what is left of a range that was searched for the nearest, that of the lowest
    /// object: they are as far as that one but for the rounding of their distances.
    #[cold]
    fn first_of_equals<T: TraversalCounter>(
        &self,
        ray: &PreparedRay,
        range: Interval<R>,
        nearest: SlotHit<R>,
        tally: &mut T,
    ) -> SlotHit<R> {
        let order = |found: &SlotHit<R>| self.group.slots[found.slot as usize].order();
        let mut first = nearest;
        let mut consider = |found: SlotHit<R>| {
            first = if order(&found) < order(&first) {
                found
            } else {
                first
            };
            false
        };
        self.visit_all(
            ray,
            AnyHit::<_, false> {
                range,
                accept: &mut consider,
            },
            tally,
        );
        first
    }

    /// Whether something lies in the way: a hit with `range.min < t < range.max` of an opaque
    /// object, or one that `ask` says yes to of an object about which it is asked. The order of
    /// calls is free; a hit that is refused does not stop the search. A primitive of the scene's
    /// own set is shown once, at its nearest hit; of an instance, each primitive in it.
    #[inline(never)]
    pub fn any<T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        ask: &mut dyn FnMut(&Hit<R>) -> bool,
        tally: &mut T,
    ) -> bool {
        if !is_sound(ray) {
            return false;
        }
        let mut accept = |found: SlotHit<R>| ask(&self.named(&found));
        let query = AnyHit::<_, true> {
            range,
            accept: &mut accept,
        };
        match self.lanes() {
            Some(bvh) => self.visit_stored(
                bvh,
                ray,
                &mut Visitor {
                    geometry: self,
                    query,
                    tally,
                },
            ),
            None => self.visit_prepared(ray, query, tally),
        }
    }

    /// Whether anything that a ray meets, which is prepared first, ends a query.
    #[inline(never)]
    fn visit_prepared<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        query: Q,
        tally: &mut T,
    ) -> bool {
        self.visit_all(&self.prepare(*ray), query, tally).0
    }

    /// The slots that every query tests one by one.
    #[inline(always)]
    fn unbounded(&self) -> impl Iterator<Item = (u32, &Slot)> {
        (self.planes as u32..).zip(&self.group.slots[self.planes..self.unbounded])
    }

    /// The slots of the accelerator's places.
    #[inline(always)]
    fn bounded(&self, places: Range<usize>) -> impl Iterator<Item = (u32, &Slot)> {
        let range = self.unbounded + places.start..self.unbounded + places.end;
        (range.start as u32..).zip(&self.group.slots[range])
    }

    /// The nearest hit of one primitive.
    #[inline(always)]
    fn test<T: TraversalCounter>(
        &self,
        (slot, own): (u32, &Slot),
        ray: &PreparedRay,
        range: Interval<R>,
        tally: &mut T,
    ) -> Option<SlotHit<R>> {
        let (index, side) = (own.index as usize, own.visibility.side.to(ray.culls));
        tally.count(TraversalStats::ONE);
        let hit = match own.kind {
            Kind::Sphere => self.group.spheres[index].intersect(ray, range, side),
            Kind::Triangle => self.triangle(index).intersect(ray, range, side),
            Kind::Plane => self.group.planes[index].intersect(ray, range, side),
            Kind::Shape => self.group.shapes[index].intersect(ray, range, side),
            Kind::TransformedShape => self.group.placed[index].intersect(ray, range, side),
            Kind::Instance => {
                let found = self
                    .visit_instance(index, ray, ClosestHit::new(range), tally)
                    .1
                    .found?;
                return Some(SlotHit {
                    slot,
                    inner: found.slot,
                    ..found
                });
            }
        };
        let ShapeHit { t, u, v } = hit?;
        Some(SlotHit {
            t,
            u,
            v,
            slot,
            inner: NO_PART,
        })
    }

    /// A ray with what the tests of these primitives need.
    #[inline(always)]
    pub(crate) fn prepare(&self, ray: Ray<R>) -> PreparedRay {
        PreparedRay::of(ray, self.faces)
    }

    /// The hit with its names.
    #[inline(always)]
    fn named(
        &self,
        &SlotHit {
            t,
            u,
            v,
            slot,
            inner,
        }: &SlotHit<R>,
    ) -> Hit<R> {
        let own = &self.group.slots[slot as usize];
        let slots = [slot, inner];
        if inner == NO_PART {
            let (object, primitive) = own.order();
            return Hit {
                t,
                u,
                v,
                object,
                primitive,
                instance: Hit::<R>::NO_INSTANCE,
                slots,
            };
        }
        let part = &self.group.parts[self.group.instances[own.index as usize].part as usize];
        let (object, primitive) = part.group.slots[inner as usize].order();
        Hit {
            t,
            u,
            v,
            object,
            primitive,
            instance: own.object,
            slots,
        }
    }
}
