//! The narrow interface: closest hit and any hit over a set of primitives, whatever structure answers, with the same bits.
//!
//! Queries are functions of their own, one set for each scalar, so that whoever asks has a call in its loop and not a copy of every
//! primitive's test. While they look, a hit is known by its slot; it gets its names once it is the answer.

mod packet;
mod visitor;

pub use packet::{FromOnePoint, Patience};

use core::ops::Range;

use crate::accelerator::Accelerator;
use crate::geometry::Geometry;
use crate::group::{Kind, Slot};
use crate::ray::{Hit, Interval, Occlusion, Query, Ray};
use crate::scalar::Real;
use crate::shapes::{PreparedRay, Shape, ShapeHit};
use crate::tally::Tally;

use self::visitor::{Any, Each, Mailbox};

/// No slot of a part: the hit lies in the scene's own set.
const NO_PART: u32 = u32::MAX;

/// A hit by its slot, and in an instance by the slot in what that shows.
#[derive(Clone, Copy)]
struct Found<R> {
    t: R,
    u: R,
    v: R,
    slot: u32,
    inner: u32,
}

impl<R: Real> Geometry<R> {
    /// The nearest hit with `range.min < t < range.max`; of hits at the same distance the one of the lowest object, and of
    /// those the lowest primitive.
    #[inline(never)]
    pub fn closest<T: Tally>(&self, ray: &Ray<R>, range: Interval<R>, tally: &mut T) -> Option<Hit<R>> {
        let found = match &self.accelerator {
            Accelerator::Bvh8(bvh) if R::IS_SINGLE => self.nearest_as_stored(bvh, ray, range, tally),
            _ => self.nearest_as_prepared(ray, range, tally),
        };
        found.map(|found| self.named(&found))
    }

    /// The nearest hit of a ray that is prepared first: by a scan, and of what is stored in f64. Apart, since what it needs of the machine's
    /// stack differs by far.
    #[inline(never)]
    fn nearest_as_prepared<T: Tally>(&self, ray: &Ray<R>, range: Interval<R>, tally: &mut T) -> Option<Found<R>> {
        let ray = self.prepare(*ray);
        let nearest = self.nearest(&ray, range, tally);
        let found = nearest.found?;
        Some(if nearest.is_contested { self.first_of_equals(&ray, nearest.range, found, tally) } else { found })
    }

    /// Of the hits in what is left of a range that was searched for the nearest, that of the lowest object: they are as far as that one but for
    /// the rounding of their distances.
    #[cold]
    fn first_of_equals<T: Tally>(&self, ray: &PreparedRay, range: Interval<R>, nearest: Found<R>, tally: &mut T) -> Found<R> {
        let order = |found: &Found<R>| self.group.slots[found.slot as usize].order();
        let mut first = nearest;
        let mut consider = |found: Found<R>| {
            first = if order(&found) < order(&first) { found } else { first };
            false
        };
        self.any_of(ray, range, &mut consider, tally);
        first
    }

    /// The nearest hit of each query, in their order, in place of what `hits` held.
    #[inline(never)]
    pub fn closest_each(&self, queries: &[Query<R>], hits: &mut Vec<Option<Hit<R>>>) {
        hits.clear();
        hits.extend(queries.iter().map(|query| self.closest(&query.ray, query.range, &mut ())));
    }

    /// Whether something lies in the way: a hit with `range.min < t < range.max` of an opaque object, or one that `ask` says
    /// yes to of an object about which it is asked. The order of calls is free; a hit that is refused does not stop the
    /// search. A primitive of the scene's own set is shown once, at its nearest hit; of an instance, each primitive in it.
    #[inline(never)]
    pub fn any<T: Tally>(&self, ray: &Ray<R>, range: Interval<R>, ask: &mut dyn FnMut(&Hit<R>) -> bool, tally: &mut T) -> bool {
        match &self.accelerator {
            Accelerator::Bvh8(bvh) if R::IS_SINGLE => {
                let unbounded = self.unbounded > self.planes && self.any_unbounded(ray, range, ask, tally);
                unbounded || self.any_as_stored(bvh, ray, range, ask, tally)
            }
            _ => self.any_as_prepared(ray, range, ask, tally),
        }
    }

    #[inline(never)]
    fn any_as_prepared<T: Tally>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        ask: &mut dyn FnMut(&Hit<R>) -> bool,
        tally: &mut T,
    ) -> bool {
        let ray = self.prepare(*ray);
        self.visit_all(&ray, Any { range, ask, mailbox: Mailbox::default() }, tally).0
    }

    #[inline(never)]
    fn any_unbounded<T: Tally>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        ask: &mut dyn FnMut(&Hit<R>) -> bool,
        tally: &mut T,
    ) -> bool {
        let ray = self.prepare(*ray);
        self.unbounded().any(|slot| self.blocks(slot, &ray, range, ask, tally))
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

    /// The running answer once all is searched.
    fn nearest<T: Tally>(&self, ray: &PreparedRay, range: Interval<R>, tally: &mut T) -> Nearest<R> {
        let origin = R::from_f64(ray.origin.abs().max_element());
        self.visit_all(ray, Nearest { origin, ..Nearest::new(range) }, tally).1
    }

    /// Shows hits until one counts. Whether one did.
    fn any_of<T: Tally>(
        &self,
        ray: &PreparedRay,
        range: Interval<R>,
        counts: &mut dyn FnMut(Found<R>) -> bool,
        tally: &mut T,
    ) -> bool {
        self.visit_all(ray, Each { range, counts, mailbox: Mailbox::default() }, tally).0
    }

    /// The nearest hit of one primitive.
    #[inline(always)]
    fn test<T: Tally>(
        &self,
        (slot, own): (u32, &Slot),
        ray: &PreparedRay,
        range: Interval<R>,
        tally: &mut T,
    ) -> Option<Found<R>> {
        let (index, side) = (own.index as usize, own.visibility.side.to(ray.culls));
        tally.primitive();
        let hit = match own.kind {
            Kind::Sphere => self.group.spheres[index].intersect(ray, range, side),
            Kind::Triangle => self.triangle(index).intersect(ray, range, side),
            Kind::Plane => self.group.planes[index].intersect(ray, range, side),
            Kind::Shape => self.group.shapes[index].intersect(ray, range, side),
            Kind::Placed => self.group.placed[index].intersect(ray, range, side),
            Kind::Instance => {
                let found = self.nearest_in(index, ray, range, tally)?;
                return Some(Found { slot, inner: found.slot, ..found });
            }
        };
        let ShapeHit { t, u, v } = hit?;
        Some(Found { t, u, v, slot, inner: NO_PART })
    }

    /// The nearest hit in an instance.
    #[inline(never)]
    fn nearest_in<T: Tally>(&self, instance: usize, ray: &PreparedRay, range: Interval<R>, tally: &mut T) -> Option<Found<R>> {
        let (instance, mut room) = (&self.group.instances[instance], None);
        let ray = self.group.transform(instance, ray.time, &mut room).probe_to_object(ray);
        self.group.parts[instance.part as usize].nearest(&ray, range, tally).found
    }

    /// A ray with what the tests of these primitives need.
    #[inline(always)]
    pub(crate) fn prepare(&self, ray: Ray<R>) -> PreparedRay {
        PreparedRay::of(ray, self.faces)
    }

    /// Whether one primitive ends an any-hit query.
    #[inline(always)]
    fn blocks<T: Tally>(
        &self,
        (slot, own): (u32, &Slot),
        ray: &PreparedRay,
        range: Interval<R>,
        ask: &mut dyn FnMut(&Hit<R>) -> bool,
        tally: &mut T,
    ) -> bool {
        let opaque = match own.visibility.occlusion {
            Occlusion::None => return false,
            Occlusion::Opaque => true,
            Occlusion::Ask => false,
        };
        let mut counts = |found: &Found<R>| opaque || ask(&self.named(found));
        if own.kind == Kind::Instance {
            let mut counts = |found: Found<R>| counts(&Found { slot, inner: found.slot, ..found });
            return self.any_in(own.index as usize, ray, range, &mut counts, tally);
        }
        self.test((slot, own), ray, range, tally).is_some_and(|found| counts(&found))
    }

    /// Shows the hits in an instance until one counts.
    #[inline(never)]
    fn any_in<T: Tally>(
        &self,
        instance: usize,
        ray: &PreparedRay,
        range: Interval<R>,
        counts: &mut dyn FnMut(Found<R>) -> bool,
        tally: &mut T,
    ) -> bool {
        let (instance, mut room) = (&self.group.instances[instance], None);
        let ray = self.group.transform(instance, ray.time, &mut room).probe_to_object(ray);
        self.group.parts[instance.part as usize].any_of(&ray, range, counts, tally)
    }

    /// The hit with its names.
    #[inline(always)]
    fn named(&self, &Found { t, u, v, slot, inner }: &Found<R>) -> Hit<R> {
        let own = &self.group.slots[slot as usize];
        let slots = [slot, inner];
        if inner == NO_PART {
            let (object, primitive) = own.order();
            return Hit { t, u, v, object, primitive, instance: Hit::<R>::NO_INSTANCE, slots };
        }
        let part = &self.group.parts[self.group.instances[own.index as usize].part as usize];
        let (object, primitive) = part.group.slots[inner as usize].order();
        Hit { t, u, v, object, primitive, instance: own.object, slots }
    }
}

/// The running answer of a closest-hit query. `range.max` is kept one step above the best distance, so that a hit at exactly
/// the same distance is still seen and the lower one can win.
///
/// Distances that are rounded to f32 are equal of themselves where surfaces lie in one place. In f64 each shape's test leaves last digits of
/// its own, and now the one would win and now the other. There `range.max` is kept as far beyond as rounding may reach, and whether
/// another hit came so close is kept too.
struct Nearest<R: Real> {
    range: Interval<R>,
    found: Option<Found<R>>,
    /// Greatest coordinate of the ray's origin, where equal distances may differ.
    origin: R,
    is_contested: bool,
}

impl<R: Real> Nearest<R> {
    /// Of what distances and coordinates are, what equal distances differ by at most: some hundred roundings of f64, which a ray within two
    /// degrees of a surface makes of a test's ten.
    const EQUAL: f64 = 1.0 / (1_u64 << 44) as f64;

    #[inline(always)]
    fn new(range: Interval<R>) -> Self {
        Self { range, found: None, origin: R::ZERO, is_contested: false }
    }

    /// What distances that are equal but for rounding differ by.
    #[inline(always)]
    fn slack(&self, t: R) -> R {
        (self.origin + t.abs()) * R::from_f64(Self::EQUAL)
    }

    #[inline(always)]
    fn consider(&mut self, geometry: &Geometry<R>, candidate: Found<R>) {
        let order = |found: &Found<R>| geometry.group.slots[found.slot as usize].order();
        // Whether distances are not rounded to f32.
        let is_exact = !R::IS_SINGLE;
        if is_exact && let Some(best) = &self.found {
            self.is_contested |= (candidate.t - best.t).abs() <= self.slack(best.t);
        }
        let better = match &self.found {
            None => true,
            Some(best) => candidate.t < best.t || (candidate.t == best.t && order(&candidate) < order(best)),
        };
        if better {
            let equal = if is_exact { candidate.t + self.slack(candidate.t) } else { candidate.t };
            self.range.max = if is_exact { self.range.max.min(equal.next_up()) } else { equal.next_up() };
            self.found = Some(candidate);
        }
    }
}
