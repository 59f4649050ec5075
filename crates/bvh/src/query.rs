//! The narrow interface: closest hit and any hit over a set of primitives, whatever structure answers, with the same bits.
//!
//! Queries are functions of their own, one set a precision, so that whoever asks has a call in its loop and not a copy of every
//! primitive's test. While they look, a hit is known by its slot; it gets its names once it is the answer.

mod pencil;
mod wide;

pub use pencil::{FromOnePoint, Patience};

use core::ops::{ControlFlow, Range};

use crate::accelerator::{Accelerator, Walked};
use crate::admission::admitted;
use crate::geometry::Geometry;
use crate::group::{Kind, Slot};
use crate::ray::{Hit, Interval, Occlusion, Query, Ray};
use crate::scalar::{Precision, Real, Vector, convert};
use crate::shapes::{Probe, Shape, ShapeHit, has_wider_core};
use crate::tally::Tally;

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

impl<P: Precision> Geometry<P> {
    /// The nearest hit with `range.min < t < range.max`; of hits at the same distance the one of the lowest object, and of
    /// those the lowest primitive.
    #[inline(never)]
    pub fn closest<T: Tally>(&self, ray: &Ray<P::Real>, range: Interval<P::Real>, tally: &mut T) -> Option<Hit<P::Real>> {
        match &self.accelerator {
            Accelerator::Wide(wide, _) => self.nearest_wide(wide, ray, range, tally).map(|found| self.named(&found)),
            Accelerator::Walked(walked) => self.closest_walked(walked, ray, range, tally),
        }
    }

    /// The same where there is no wide tree, apart from it: what each of them needs of the machine's stack differs by far.
    #[inline(never)]
    fn closest_walked<T: Tally>(
        &self,
        walked: &Walked,
        ray: &Ray<P::Real>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Option<Hit<P::Real>> {
        let probe = self.probe(*ray);
        let nearest = self.nearest::<T, false>(walked, &probe, range, tally);
        let found = nearest.found?;
        let found = if nearest.is_contested { self.first_of_equals(walked, &probe, nearest.range, found, tally) } else { found };
        Some(self.named(&found))
    }

    /// Of the hits in what is left of a range that was searched for the nearest, that of the lowest object: they are as far as that one but for
    /// the rounding of their distances.
    #[cold]
    fn first_of_equals<T: Tally>(
        &self,
        walked: &Walked,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        nearest: Found<P::Real>,
        tally: &mut T,
    ) -> Found<P::Real> {
        let mut first = nearest;
        let order = |found: &Found<P::Real>| self.group.slots[found.slot as usize].order();
        let mut consider = |slot: (u32, &Slot), tally: &mut T| {
            if let Some(found) = self.test::<T, false>(slot, probe, range, tally).filter(|found| order(found) < order(&first)) {
                first = found;
            }
        };
        self.unbounded().for_each(|slot| consider(slot, tally));
        walked.walk(&probe.ray, range, tally, |places, far, tally| {
            self.bounded(places).for_each(|slot| consider(slot, tally));
            ControlFlow::Continue(far)
        });
        first
    }

    /// The nearest hit of each query, in their order, in place of what `hits` held.
    #[inline(never)]
    pub fn closest_each(&self, queries: &[Query<P::Real>], hits: &mut Vec<Option<Hit<P::Real>>>) {
        hits.clear();
        hits.extend(queries.iter().map(|query| self.closest(&query.ray, query.range, &mut ())));
    }

    /// Whether something lies in the way: a hit with `range.min < t < range.max` of an opaque object, or one that `ask` says
    /// yes to of an object about which it is asked. The order of calls is free; a hit that is refused does not stop the
    /// search. A primitive of the scene's own set is shown once, at its nearest hit; of an instance, each primitive in it.
    #[inline(never)]
    pub fn any<T: Tally>(
        &self,
        ray: &Ray<P::Real>,
        range: Interval<P::Real>,
        ask: &mut dyn FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        match &self.accelerator {
            Accelerator::Wide(wide, _) => {
                let unbounded = self.unbounded > self.planes && self.any_unbounded(ray, range, ask, tally);
                unbounded || self.any_wide(wide, ray, range, ask, tally)
            }
            Accelerator::Walked(walked) => self.any_walked(walked, ray, range, ask, tally),
        }
    }

    #[inline(never)]
    fn any_walked<T: Tally>(
        &self,
        walked: &Walked,
        ray: &Ray<P::Real>,
        range: Interval<P::Real>,
        ask: &mut dyn FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let probe = self.probe(*ray);
        let mut blocks = |slot: (u32, &Slot), tally: &mut T| self.blocks(slot, &probe, range, ask, tally);
        if self.unbounded().any(|slot| blocks(slot, tally)) {
            return true;
        }
        let mut blocked = false;
        walked.walk(&probe.ray, range, tally, |places, far, tally| {
            blocked = self.bounded(places).any(|slot| blocks(slot, tally));
            if blocked { ControlFlow::Break(()) } else { ControlFlow::Continue(far) }
        });
        blocked
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

    /// `INNER`: inside an instance. There the probe's stored copy was rounded once more, far from the object even by more
    /// than the boxes are padded, so the tree is walked with the core's copy.
    #[inline(always)]
    fn nearest<T: Tally, const INNER: bool>(
        &self,
        walked: &Walked,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Nearest<P::Real> {
        let origin = Vector::abs(probe.ray.origin).max_element();
        let mut best = Nearest { origin, ..Nearest::new(range) };
        for slot in self.unbounded() {
            best.consider(self, self.test::<T, INNER>(slot, probe, best.range, tally));
        }
        if INNER {
            let ray = Ray::<P::Core>::new(probe.origin, probe.direction);
            walked.walk(&ray, widened::<P>(best.range), tally, |places, _, tally| {
                for slot in self.bounded(places) {
                    best.consider(self, self.test::<T, INNER>(slot, probe, best.range, tally));
                }
                ControlFlow::Continue(convert(best.range.max))
            });
        } else {
            walked.walk(&probe.ray, best.range, tally, |places, _, tally| {
                for slot in self.bounded(places) {
                    best.consider(self, self.test::<T, INNER>(slot, probe, best.range, tally));
                }
                ControlFlow::Continue(best.range.max)
            });
        }
        best
    }

    /// The nearest hit of one primitive.
    #[inline(always)]
    fn test<T: Tally, const INNER: bool>(
        &self,
        (slot, own): (u32, &Slot),
        probe: &Probe<P>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Option<Found<P::Real>> {
        let (index, side) = (own.index as usize, own.visibility.side.to(probe.ray.culls));
        tally.primitive();
        let hit = match own.kind {
            Kind::Sphere => self.group.spheres[index].intersect(probe, range, side),
            Kind::Triangle => self.triangle(index).intersect(probe, range, side),
            Kind::Plane => self.group.planes[index].intersect(probe, range, side),
            Kind::Shape => self.group.shapes[index].intersect(probe, range, side),
            Kind::Placed => self.group.placed[index].intersect(probe, range, side),
            // What an instance shows holds none.
            Kind::Instance if INNER => None,
            Kind::Instance => {
                let found = self.nearest_in(index, probe, range, tally)?;
                return self.admit(slot, probe, range, Found { slot, inner: found.slot, ..found });
            }
        };
        let ShapeHit { t, u, v } = hit?;
        self.admit(slot, probe, range, Found { t, u, v, slot, inner: NO_PART })
    }

    #[inline(never)]
    fn nearest_in<T: Tally>(
        &self,
        instance: usize,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Option<Found<P::Real>> {
        let (instance, mut room) = (&self.group.instances[instance], None);
        let inner = self.group.transform(instance, probe.ray.time, &mut room).probe_to_object(probe);
        let part = &self.group.parts[instance.part as usize];
        match &part.accelerator {
            Accelerator::Wide(wide, _) => part.nearest_mapped(wide, &inner, range, tally),
            Accelerator::Walked(walked) => part.nearest::<T, true>(walked, &inner, range, tally).found,
        }
    }

    /// A ray with what the tests of these primitives need.
    #[inline(always)]
    pub(crate) fn probe(&self, ray: Ray<P::Real>) -> Probe<P> {
        Probe::of(ray, self.faces)
    }

    /// The hit where and if it counts; see [`crate::admission`].
    #[inline(always)]
    fn admit(&self, slot: u32, probe: &Probe<P>, range: Interval<P::Real>, found: Found<P::Real>) -> Option<Found<P::Real>> {
        if P::ROBUST {
            return Some(found);
        }
        let bounds = self.group.bounds(&self.group.slots[slot as usize]);
        admitted(bounds, &probe.ray, range, found.t).map(|t| Found { t, ..found })
    }

    /// Whether one primitive ends an any-hit query.
    #[inline(always)]
    fn blocks<T: Tally>(
        &self,
        (slot, own): (u32, &Slot),
        probe: &Probe<P>,
        range: Interval<P::Real>,
        ask: &mut dyn FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let opaque = match own.visibility.occlusion {
            Occlusion::None => return false,
            Occlusion::Opaque => true,
            Occlusion::Ask => false,
        };
        let mut counts = |found: &Found<P::Real>| opaque || ask(&self.named(found));
        if own.kind == Kind::Instance {
            let mut counts = |found: Found<P::Real>| {
                let found = Found { slot, inner: found.slot, ..found };
                self.admit(slot, probe, range, found).is_some_and(|found| counts(&found))
            };
            return self.blocks_in(own.index as usize, probe, range, &mut counts, tally);
        }
        self.test::<T, true>((slot, own), probe, range, tally).is_some_and(|found| counts(&found))
    }

    /// Shows the hits in an instance until one counts.
    #[inline(never)]
    fn blocks_in<T: Tally>(
        &self,
        instance: usize,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        counts: &mut dyn FnMut(Found<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let (instance, mut room) = (&self.group.instances[instance], None);
        let probe = self.group.transform(instance, probe.ray.time, &mut room).probe_to_object(probe);
        let part = &self.group.parts[instance.part as usize];
        let mut blocks =
            |slot: (u32, &Slot), tally: &mut T| part.test::<T, true>(slot, &probe, range, tally).is_some_and(&mut *counts);
        if part.unbounded().any(|slot| blocks(slot, tally)) {
            return true;
        }
        match &part.accelerator {
            Accelerator::Wide(wide, _) => part.any_mapped(wide, &probe, range, counts, tally),
            Accelerator::Walked(walked) => {
                let mut blocked = false;
                let ray = Ray::<P::Core>::new(probe.origin, probe.direction);
                walked.walk(&ray, widened::<P>(range), tally, |places, far, tally| {
                    blocked = part.bounded(places).any(|slot| blocks(slot, tally));
                    if blocked { ControlFlow::Break(()) } else { ControlFlow::Continue(far) }
                });
                blocked
            }
        }
    }

    /// The hit with its names.
    #[inline(always)]
    fn named(&self, &Found { t, u, v, slot, inner }: &Found<P::Real>) -> Hit<P::Real> {
        let own = &self.group.slots[slot as usize];
        let slots = [slot, inner];
        if inner == NO_PART {
            let (object, primitive) = own.order();
            return Hit { t, u, v, object, primitive, instance: Hit::<P::Real>::NO_INSTANCE, slots };
        }
        let part = &self.group.parts[self.group.instances[own.index as usize].part as usize];
        let (object, primitive) = part.group.slots[inner as usize].order();
        Hit { t, u, v, object, primitive, instance: own.object, slots }
    }
}

/// A range of stored distances in the core's scalar.
fn widened<P: Precision>(range: Interval<P::Real>) -> Interval<P::Core> {
    Interval { min: convert(range.min), max: convert(range.max) }
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
    fn consider<P: Precision<Real = R>>(&mut self, geometry: &Geometry<P>, candidate: Option<Found<R>>) {
        let Some(candidate) = candidate else { return };
        let order = |found: &Found<R>| geometry.group.slots[found.slot as usize].order();
        // Whether distances are neither rounded to f32 nor computed in it.
        let is_exact = P::ROBUST && !has_wider_core::<P>();
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
