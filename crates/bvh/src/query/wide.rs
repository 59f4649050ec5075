//! Queries of the wide tree: what a hit of it is to the answer.

use std::collections::BTreeSet;

use super::{Found, NO_PART, Nearest};
use crate::geometry::Geometry;
use crate::processor::prefetch;
use crate::ray::{Hit, Interval, Ray};
use crate::scalar::{Precision, Real};
use crate::shapes::Probe;
use crate::tally::Tally;
use crate::wide::{Answer, Facts, Met, Rebase, Roots, Setup, Wide};

impl<P: Precision> Geometry<P> {
    /// The nearest hit.
    #[inline(always)]
    pub(super) fn nearest_wide<T: Tally>(
        &self,
        wide: &Wide,
        ray: &Ray<P::Real>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Option<Found<P::Real>> {
        // In its place from the start: to move it would wait for its stores.
        let best = Nearest::new(range);
        let mut closest =
            Closest::<_, _, false> { geometry: self, wide, ray, best, probe: None, rebase: Rebase::default(), tally };
        if self.unbounded > self.planes {
            self.nearest_unbounded(ray, &mut closest.best, closest.tally);
        }
        wide.ask(ray, closest.best.range, &mut closest);
        closest.best.found
    }

    /// Whether anything in the tree ends an any-hit query.
    #[inline(always)]
    pub(super) fn any_wide<T: Tally>(
        &self,
        wide: &Wide,
        ray: &Ray<P::Real>,
        range: Interval<P::Real>,
        ask: &mut dyn FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let mut any = Any { geometry: self, wide, ray, range, ask, probe: None, seen: Seen::default(), tally };
        wide.ask(ray, range, &mut any)
    }

    /// The nearest hit, for a probe in the space of the instance that shows this.
    pub(super) fn nearest_mapped<T: Tally>(
        &self,
        wide: &Wide,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Option<Found<P::Real>> {
        let mut best = Nearest::new(range);
        for slot in self.unbounded() {
            best.consider(self, self.test::<T, true>(slot, probe, best.range, tally));
        }
        let wider = probe.widened();
        let (setup, rebase) = Setup::mapped(wider.origin, wider.direction, range.min.to_f64(), &self.bounded_part());
        let (ray, probe) = (&probe.ray, Some(*probe));
        let mut closest = Closest::<_, _, true> { geometry: self, wide, ray, best, probe, rebase, tally };
        wide.ask_mapped(&setup, wider, &mut closest);
        closest.best.found
    }

    /// Shows the hits of the tree, for a probe in the space of the instance that shows this, until one counts.
    pub(super) fn any_mapped<T: Tally>(
        &self,
        wide: &Wide,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        counts: &mut dyn FnMut(Found<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let wider = probe.widened();
        let (setup, rebase) = Setup::mapped(wider.origin, wider.direction, range.min.to_f64(), &self.bounded_part());
        let mut each = Each { geometry: self, wide, probe, range, rebase, counts, seen: Seen::default(), tally };
        wide.ask_mapped(&setup, wider, &mut each)
    }

    #[inline(never)]
    fn nearest_unbounded<T: Tally>(&self, ray: &Ray<P::Real>, best: &mut Nearest<P::Real>, tally: &mut T) {
        let probe = self.probe(*ray);
        for slot in self.unbounded() {
            best.consider(self, self.test::<T, false>(slot, &probe, best.range, tally));
        }
    }

    #[inline(never)]
    pub(super) fn any_unbounded<T: Tally>(
        &self,
        ray: &Ray<P::Real>,
        range: Interval<P::Real>,
        ask: &mut dyn FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let probe = self.probe(*ray);
        self.unbounded().any(|slot| self.blocks(slot, &probe, range, ask, tally))
    }
}

/// A hit of a lane.
#[inline(always)]
fn found<R: Real>(wide: &Wide, met: &Met, lane: usize, first: u32) -> Found<R> {
    let [t, u, v] = [met.t, met.weights[0], met.weights[1]].map(R::from_f32);
    Found { t, u, v, slot: wide.slot(first, lane), inner: NO_PART }
}

/// A hit of a row's lane.
#[inline(always)]
fn root<R: Real>(roots: &Roots, lane: usize, first: u32) -> Found<R> {
    let v = if roots.leaving >> lane & 1 == 0 { R::ZERO } else { R::ONE };
    Found { t: R::from_f32(roots.t[lane]), u: R::ZERO, v, slot: first + lane as u32, inner: NO_PART }
}

/// A range in the scalar that this tree's rays are stored in.
#[inline(always)]
fn stored<R: Real>(range: Interval<R>) -> Interval<f32> {
    Interval { min: range.min.to_f32(), max: range.max.to_f32() }
}

/// The nearest hit. `INNER`: in an instance.
struct Closest<'a, P: Precision, T, const INNER: bool> {
    geometry: &'a Geometry<P>,
    wide: &'a Wide,
    ray: &'a Ray<P::Real>,
    best: Nearest<P::Real>,
    /// Made for the first primitive that is no triangle.
    probe: Option<Probe<P>>,
    /// Of the walk, in an instance.
    rebase: Rebase,
    tally: &'a mut T,
}

impl<P: Precision, T: Tally, const INNER: bool> Answer for Closest<'_, P, T, INNER> {
    const ANY: bool = false;

    #[inline(always)]
    fn far(&self) -> f32 {
        let far = self.best.found.as_ref().map_or_else(|| self.best.range.max.next_down(), |found| found.t).to_f32();
        if INNER { self.rebase.far(far) } else { far }
    }

    #[inline(always)]
    fn range(&self) -> Interval<f32> {
        stored(self.best.range)
    }

    #[inline(always)]
    fn culls(&self) -> bool {
        self.ray.culls
    }

    #[inline(always)]
    fn node(&mut self) {
        self.tally.node();
    }

    #[inline(always)]
    fn several(&mut self, count: u64) {
        self.tally.primitives(|| count);
    }

    #[inline(always)]
    fn block(&mut self, block: usize) {
        self.tally.primitives(|| self.wide.facts(block).count.into());
    }

    #[inline(always)]
    fn lanes(&self, _: usize) -> [u32; 2] {
        [u32::MAX, 0]
    }

    #[inline(always)]
    fn row(&mut self, facts: &Facts, roots: &Roots) -> bool {
        let mut hits = roots.hits;
        while hits != 0 {
            let found = root(roots, hits.trailing_zeros() as usize & 7, facts.first);
            hits &= hits - 1;
            self.best.consider(self.geometry, Some(found));
        }
        false
    }

    #[inline(always)]
    fn triangle(&mut self, block: usize, lane: usize, met: &Met) -> bool {
        let facts = self.wide.facts(block);
        let found = found(self.wide, met, lane, facts.first);
        let counts = facts.accepts(lane, met.from_outside, self.culls()) && self.best.range.contains(found.t);
        // Its names are asked for when the walk is over.
        prefetch(&self.geometry.group.slots, found.slot as usize);
        self.best.consider(self.geometry, counts.then_some(found));
        false
    }

    #[inline(never)]
    fn other(&mut self, place: usize) -> bool {
        let geometry = self.geometry;
        let probe = self.probe.get_or_insert_with(|| geometry.probe(*self.ray));
        for slot in geometry.bounded(place..place + 1) {
            self.best.consider(geometry, geometry.test::<T, INNER>(slot, probe, self.best.range, self.tally));
        }
        false
    }
}

/// Triangles in several blocks that a query was asked about already.
#[derive(Default)]
struct Seen(BTreeSet<u32>);

impl Seen {
    /// Whether this is the first time.
    #[inline(always)]
    fn first(&mut self, facts: &Facts, lane: usize, slot: u32) -> bool {
        facts.twice >> lane & 1 == 0 || self.0.insert(slot)
    }
}

/// Any hit that counts.
struct Any<'a, 'f, P: Precision, T> {
    geometry: &'a Geometry<P>,
    wide: &'a Wide,
    ray: &'a Ray<P::Real>,
    range: Interval<P::Real>,
    ask: &'a mut (dyn FnMut(&Hit<P::Real>) -> bool + 'f),
    probe: Option<Probe<P>>,
    seen: Seen,
    tally: &'a mut T,
}

impl<P: Precision, T: Tally> Answer for Any<'_, '_, P, T> {
    const ANY: bool = true;

    #[inline(always)]
    fn far(&self) -> f32 {
        self.range.max.next_down().to_f32()
    }

    #[inline(always)]
    fn range(&self) -> Interval<f32> {
        stored(self.range)
    }

    #[inline(always)]
    fn culls(&self) -> bool {
        self.ray.culls
    }

    #[inline(always)]
    fn node(&mut self) {
        self.tally.node();
    }

    #[inline(always)]
    fn several(&mut self, count: u64) {
        self.tally.primitives(|| count);
    }

    #[inline(always)]
    fn block(&mut self, block: usize) {
        self.tally.primitives(|| self.wide.facts(block).count.into());
    }

    #[inline(always)]
    fn lanes(&self, block: usize) -> [u32; 2] {
        let facts = self.wide.facts(block);
        [(facts.opaque | facts.asks).into(), (facts.opaque & facts.two_sided(self.culls())).into()]
    }

    #[inline(always)]
    fn row(&mut self, facts: &Facts, roots: &Roots) -> bool {
        if roots.hits & facts.opaque != 0 {
            return true;
        }
        let mut asks = roots.hits & facts.asks;
        while asks != 0 {
            let found = root(roots, asks.trailing_zeros() as usize & 7, facts.first);
            asks &= asks - 1;
            if (self.ask)(&self.geometry.named(&found)) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn triangle(&mut self, block: usize, lane: usize, met: &Met) -> bool {
        let facts = self.wide.facts(block);
        let found = found(self.wide, met, lane, facts.first);
        facts.accepts(lane, met.from_outside, self.culls())
            && self.range.contains(found.t)
            && (facts.opaque >> lane & 1 != 0
                || self.seen.first(facts, lane, found.slot) && (self.ask)(&self.geometry.named(&found)))
    }

    #[inline(never)]
    fn other(&mut self, place: usize) -> bool {
        let (geometry, range) = (self.geometry, self.range);
        let probe = self.probe.get_or_insert_with(|| geometry.probe(*self.ray));
        let (ask, tally) = (&mut *self.ask, &mut *self.tally);
        geometry.bounded(place..place + 1).any(|slot| geometry.blocks(slot, probe, range, ask, tally))
    }
}

/// Each hit in an instance, whose own visibility decides what it is to the query.
struct Each<'a, 'f, P: Precision, T> {
    geometry: &'a Geometry<P>,
    wide: &'a Wide,
    probe: &'a Probe<P>,
    range: Interval<P::Real>,
    rebase: Rebase,
    counts: &'a mut (dyn FnMut(Found<P::Real>) -> bool + 'f),
    seen: Seen,
    tally: &'a mut T,
}

impl<P: Precision, T: Tally> Answer for Each<'_, '_, P, T> {
    const ANY: bool = true;

    #[inline(always)]
    fn far(&self) -> f32 {
        self.rebase.far(self.range.max.next_down().to_f32())
    }

    #[inline(always)]
    fn range(&self) -> Interval<f32> {
        stored(self.range)
    }

    #[inline(always)]
    fn culls(&self) -> bool {
        self.probe.ray.culls
    }

    #[inline(always)]
    fn node(&mut self) {
        self.tally.node();
    }

    #[inline(always)]
    fn several(&mut self, count: u64) {
        self.tally.primitives(|| count);
    }

    #[inline(always)]
    fn block(&mut self, block: usize) {
        self.tally.primitives(|| self.wide.facts(block).count.into());
    }

    #[inline(always)]
    fn lanes(&self, _: usize) -> [u32; 2] {
        [u32::MAX, 0]
    }

    #[inline(always)]
    fn row(&mut self, facts: &Facts, roots: &Roots) -> bool {
        let mut hits = roots.hits;
        while hits != 0 {
            let found = root(roots, hits.trailing_zeros() as usize & 7, facts.first);
            hits &= hits - 1;
            if (self.counts)(found) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn triangle(&mut self, block: usize, lane: usize, met: &Met) -> bool {
        let facts = self.wide.facts(block);
        let found = found(self.wide, met, lane, facts.first);
        facts.accepts(lane, met.from_outside, self.culls())
            && self.range.contains(found.t)
            && self.seen.first(facts, lane, found.slot)
            && (self.counts)(found)
    }

    #[inline(never)]
    fn other(&mut self, place: usize) -> bool {
        let (geometry, range) = (self.geometry, self.range);
        let mut slots = geometry.bounded(place..place + 1);
        slots.any(|slot| geometry.test::<T, true>(slot, self.probe, range, self.tally).is_some_and(&mut *self.counts))
    }
}
