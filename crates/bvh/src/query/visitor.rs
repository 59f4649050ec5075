//! What the tree's hits are to a query: one visitor for every kind of query.

use std::collections::BTreeSet;

use super::{Found, NO_PART, Nearest};
use crate::accelerator::Accelerator;
use crate::bvh8::{Bvh8, HitVisitor, LeafHeader, RayReparametrisation, SphereHits, TraversalRay, TriangleHit};
use crate::geometry::Geometry;
use crate::group::Slot;
use crate::processor::prefetch;
use crate::ray::{Hit, Interval, Ray};
use crate::scalar::Real;
use crate::shapes::PreparedRay;
use crate::tally::Tally;

/// A kind of query: closest, any, or each hit until one counts.
pub(super) trait QueryKind<R: Real> {
    /// Whether any hit will do.
    const ANY: bool;
    /// Where hits count.
    fn range(&self) -> Interval<R>;
    /// The greatest distance that still counts.
    fn far(&self) -> R;
    /// The lanes of a leaf that matter.
    fn wanted(facts: &LeafHeader) -> u8;
    /// Those of them any hit of which ends the query.
    fn opaque(facts: &LeafHeader) -> u8;
    /// Whether a triangle was not tested before: one that was split lies in several leaves.
    fn is_first(&mut self, facts: &LeafHeader, lane: usize, slot: u32) -> bool;
    /// Takes a hit within the range. Whether it ends the query.
    fn take(&mut self, geometry: &Geometry<R>, found: Found<R>) -> bool;
    /// Takes the hit of one primitive, where there is one. Whether it ends the query.
    fn test<T: Tally>(&mut self, geometry: &Geometry<R>, slot: (u32, &Slot), ray: &PreparedRay, tally: &mut T) -> bool;
}

impl<R: Real> QueryKind<R> for Nearest<R> {
    const ANY: bool = false;

    #[inline(always)]
    fn range(&self) -> Interval<R> {
        self.range
    }
    #[inline(always)]
    fn far(&self) -> R {
        // In f64 hits count a little beyond the nearest.
        if !R::IS_SINGLE {
            return self.range.max;
        }
        self.found.as_ref().map_or_else(|| self.range.max.next_down(), |found| found.t)
    }
    #[inline(always)]
    fn wanted(_: &LeafHeader) -> u8 {
        u8::MAX
    }
    #[inline(always)]
    fn opaque(_: &LeafHeader) -> u8 {
        0
    }
    #[inline(always)]
    fn is_first(&mut self, _: &LeafHeader, _: usize, _: u32) -> bool {
        // Twice the nearest is the nearest.
        true
    }
    #[inline(always)]
    fn take(&mut self, geometry: &Geometry<R>, found: Found<R>) -> bool {
        self.consider(geometry, found);
        false
    }
    #[inline(always)]
    fn test<T: Tally>(&mut self, geometry: &Geometry<R>, slot: (u32, &Slot), ray: &PreparedRay, tally: &mut T) -> bool {
        if let Some(found) = geometry.test(slot, ray, self.range, tally) {
            self.consider(geometry, found);
        }
        false
    }
}

/// Any hit of what is opaque, or that the caller says yes to.
pub(super) struct Any<'f, R: Real> {
    pub range: Interval<R>,
    pub ask: &'f mut dyn FnMut(&Hit<R>) -> bool,
    pub mailbox: Mailbox,
}

impl<R: Real> QueryKind<R> for Any<'_, R> {
    const ANY: bool = true;

    #[inline(always)]
    fn range(&self) -> Interval<R> {
        self.range
    }
    #[inline(always)]
    fn far(&self) -> R {
        self.range.max.next_down()
    }
    #[inline(always)]
    fn wanted(facts: &LeafHeader) -> u8 {
        facts.opaque | facts.asks
    }
    #[inline(always)]
    fn opaque(facts: &LeafHeader) -> u8 {
        facts.opaque
    }
    #[inline(always)]
    fn is_first(&mut self, facts: &LeafHeader, lane: usize, slot: u32) -> bool {
        self.mailbox.is_first(facts, lane, slot)
    }
    #[inline(always)]
    fn take(&mut self, geometry: &Geometry<R>, found: Found<R>) -> bool {
        (self.ask)(&geometry.named(&found))
    }
    #[inline(always)]
    fn test<T: Tally>(&mut self, geometry: &Geometry<R>, slot: (u32, &Slot), ray: &PreparedRay, tally: &mut T) -> bool {
        geometry.blocks(slot, ray, self.range, self.ask, tally)
    }
}

/// Each hit, whatever its object is to any-hit queries, until one counts: in an instance, whose own visibility decides that.
pub(super) struct Each<'f, R: Real> {
    pub range: Interval<R>,
    pub counts: &'f mut dyn FnMut(Found<R>) -> bool,
    pub mailbox: Mailbox,
}

impl<R: Real> QueryKind<R> for Each<'_, R> {
    const ANY: bool = true;

    #[inline(always)]
    fn range(&self) -> Interval<R> {
        self.range
    }
    #[inline(always)]
    fn far(&self) -> R {
        self.range.max.next_down()
    }
    #[inline(always)]
    fn wanted(_: &LeafHeader) -> u8 {
        u8::MAX
    }
    #[inline(always)]
    fn opaque(_: &LeafHeader) -> u8 {
        0
    }
    #[inline(always)]
    fn is_first(&mut self, facts: &LeafHeader, lane: usize, slot: u32) -> bool {
        self.mailbox.is_first(facts, lane, slot)
    }
    #[inline(always)]
    fn take(&mut self, _: &Geometry<R>, found: Found<R>) -> bool {
        (self.counts)(found)
    }
    #[inline(always)]
    fn test<T: Tally>(&mut self, geometry: &Geometry<R>, slot: (u32, &Slot), ray: &PreparedRay, tally: &mut T) -> bool {
        geometry.test(slot, ray, self.range, tally).is_some_and(&mut *self.counts)
    }
}

impl<R: Real> Geometry<R> {
    /// The nearest hit of a ray in the tree's own scalar.
    #[inline(always)]
    pub(super) fn nearest_as_stored<T: Tally>(
        &self,
        bvh: &Bvh8,
        ray: &Ray<R>,
        range: Interval<R>,
        tally: &mut T,
    ) -> Option<Found<R>> {
        // In its place from the start: to move it would wait for its stores.
        let mut visitor = Visitor::stored(self, bvh, ray, Nearest::new(range), tally);
        if self.unbounded > self.planes {
            self.nearest_unbounded(ray, &mut visitor.query, visitor.tally);
        }
        bvh.ask(ray, visitor.query.range, &mut visitor);
        visitor.query.found
    }

    #[inline(never)]
    fn nearest_unbounded<T: Tally>(&self, ray: &Ray<R>, nearest: &mut Nearest<R>, tally: &mut T) {
        let ray = self.prepare(*ray);
        for slot in self.unbounded() {
            nearest.test(self, slot, &ray, tally);
        }
    }

    /// Whether anything in the tree ends an any-hit query, of a ray in the tree's own scalar.
    #[inline(always)]
    pub(super) fn any_as_stored<T: Tally>(
        &self,
        bvh: &Bvh8,
        ray: &Ray<R>,
        range: Interval<R>,
        ask: &mut dyn FnMut(&Hit<R>) -> bool,
        tally: &mut T,
    ) -> bool {
        bvh.ask(ray, range, &mut Visitor::stored(self, bvh, ray, Any { range, ask, mailbox: Mailbox::default() }, tally))
    }

    /// Shows a query what a prepared ray meets. Returns whether that ended it, and the query.
    #[inline(always)]
    pub(super) fn visit_all<Q: QueryKind<R>, T: Tally>(&self, ray: &PreparedRay, mut query: Q, tally: &mut T) -> (bool, Q) {
        let (tree, alone) = match &self.accelerator {
            Accelerator::Linear(count) => (None, 0..*count),
            Accelerator::Bvh8(bvh) => bvh.places_alone().map_or((Some(bvh), 0..0), |places| (None, places)),
        };
        for slot in self.unbounded().chain(self.bounded(alone)) {
            if query.test(self, slot, ray, tally) {
                return (true, query);
            }
        }
        match tree {
            Some(bvh) => self.traverse(bvh, ray, query, tally),
            None => (false, query),
        }
    }

    /// The same of a tree. Rounded to f32 the ray is another one, so it is moved to beside what is there, and boxes take its error into account.
    #[inline(always)]
    fn traverse<Q: QueryKind<R>, T: Tally>(&self, bvh: &Bvh8, ray: &PreparedRay, query: Q, tally: &mut T) -> (bool, Q) {
        let near = query.range().min.to_f64();
        let (setup, rebase) = TraversalRay::mapped(ray.origin, ray.direction, near, &self.bounded_part());
        let (stored, prepared, culls) = (None, Some(*ray), ray.culls);
        let mut visitor = Visitor::<_, _, _, true> { geometry: self, bvh, culls, stored, prepared, query, rebase, tally };
        let over = bvh.ask_mapped(&setup, *ray, &mut visitor);
        (over, visitor.query)
    }
}

/// Triangles in several leaves that a query has tested already.
#[derive(Default)]
pub(super) struct Mailbox(BTreeSet<u32>);

impl Mailbox {
    /// Whether this is the first time.
    #[inline(always)]
    fn is_first(&mut self, facts: &LeafHeader, lane: usize, slot: u32) -> bool {
        facts.twice >> lane & 1 == 0 || self.0.insert(slot)
    }
}

/// Hands what a traversal meets to a query. `MAPPED`: by a ray that was rounded, see [`TraversalRay::mapped`].
struct Visitor<'a, R: Real, Q, T, const MAPPED: bool> {
    geometry: &'a Geometry<R>,
    bvh: &'a Bvh8,
    culls: bool,
    /// One of the two: the ray as it is stored, from which the other one is made for the first primitive that has no leaf of its kind.
    stored: Option<&'a Ray<R>>,
    prepared: Option<PreparedRay>,
    query: Q,
    rebase: RayReparametrisation,
    tally: &'a mut T,
}

impl<'a, R: Real, Q, T> Visitor<'a, R, Q, T, false> {
    #[inline(always)]
    fn stored(geometry: &'a Geometry<R>, bvh: &'a Bvh8, ray: &'a Ray<R>, query: Q, tally: &'a mut T) -> Self {
        let rebase = RayReparametrisation::default();
        Self { geometry, bvh, culls: ray.culls, stored: Some(ray), prepared: None, query, rebase, tally }
    }
}

impl<R: Real, Q: QueryKind<R>, T: Tally, const MAPPED: bool> HitVisitor for Visitor<'_, R, Q, T, MAPPED> {
    const ANY: bool = Q::ANY;

    #[inline(always)]
    fn far(&self) -> f32 {
        let far = self.query.far().to_f32();
        if MAPPED { self.rebase.far(far) } else { far }
    }

    #[inline(always)]
    fn range(&self) -> Interval<f32> {
        let range = self.query.range();
        Interval { min: range.min.to_f32(), max: range.max.to_f32() }
    }

    #[inline(always)]
    fn culls(&self) -> bool {
        self.culls
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
        self.tally.primitives(|| self.bvh.facts(block).count.into());
    }

    #[inline(always)]
    fn lanes(&self, block: usize) -> [u32; 2] {
        if !Q::ANY {
            return [u32::MAX, 0];
        }
        let facts = self.bvh.facts(block);
        [Q::wanted(facts).into(), (Q::opaque(facts) & facts.two_sided(self.culls)).into()]
    }

    #[inline(always)]
    fn triangle(&mut self, block: usize, lane: usize, met: &TriangleHit) -> bool {
        let facts = self.bvh.facts(block);
        let [t, u, v] = [met.t, met.weights[0], met.weights[1]].map(R::from_f32);
        let found = Found { t, u, v, slot: self.bvh.slot(facts.first, lane), inner: NO_PART };
        if !Q::ANY {
            // Its names are asked for when the traversal is over.
            prefetch(&self.geometry.group.slots, found.slot as usize);
        }
        if !(facts.accepts(lane, met.from_outside, self.culls) && self.query.range().contains(t)) {
            return false;
        }
        Q::opaque(facts) >> lane & 1 != 0 || self.query.is_first(facts, lane, found.slot) && self.query.take(self.geometry, found)
    }

    #[inline(always)]
    fn row(&mut self, facts: &LeafHeader, roots: &SphereHits) -> bool {
        if roots.hits & Q::opaque(facts) != 0 {
            return true;
        }
        let mut hits = roots.hits & Q::wanted(facts);
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize & 7;
            hits &= hits - 1;
            let v = if roots.leaving >> lane & 1 == 0 { R::ZERO } else { R::ONE };
            let t = R::from_f32(roots.t[lane]);
            if self.query.take(self.geometry, Found { t, u: R::ZERO, v, slot: facts.first + lane as u32, inner: NO_PART }) {
                return true;
            }
        }
        false
    }

    #[inline(never)]
    fn other(&mut self, place: usize) -> bool {
        let geometry = self.geometry;
        if let (None, Some(ray)) = (&self.prepared, self.stored) {
            self.prepared = Some(geometry.prepare(*ray));
        }
        let Some(ray) = &self.prepared else { return false };
        geometry.bounded(place..place + 1).any(|slot| self.query.test(geometry, slot, ray, self.tally))
    }
}
