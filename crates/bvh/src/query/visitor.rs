//! What the tree's hits are to a query: one visitor for every kind of query.

use super::kind::QueryKind;
use super::{NO_PART, SlotHit};
use crate::accelerator::Accelerator;
use crate::bvh8::{Bvh8, HitVisitor, LeafHeader, RayReparametrisation, SphereHits, TraversalRay, TriangleHit};
use crate::geometry::Geometry;
use crate::processor::prefetch;
use crate::ray::{Interval, Ray};
use crate::scalar::Real;
use crate::shapes::PreparedRay;
use crate::stats::TraversalCounter;

impl<R: Real> Geometry<R> {
    /// Shows a query what a ray in the tree's own scalar meets. Returns whether that ended it, and the query.
    #[inline(always)]
    pub(super) fn visit_stored<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        bvh: &Bvh8,
        ray: &Ray<R>,
        query: Q,
        tally: &mut T,
    ) -> (bool, Q) {
        // In its place from the start: to move it would wait for its stores.
        let mut visitor = Visitor::stored(self, bvh, ray, query, tally);
        let over = self.unbounded > self.planes && self.visit_unbounded(ray, &mut visitor.query, visitor.tally);
        let over = over || bvh.visit(ray, visitor.query.range(), &mut visitor);
        (over, visitor.query)
    }

    #[inline(never)]
    fn visit_unbounded<Q: QueryKind<R>, T: TraversalCounter>(&self, ray: &Ray<R>, query: &mut Q, tally: &mut T) -> bool {
        let ray = self.prepare(*ray);
        self.unbounded().any(|slot| query.test(self, slot, &ray, tally))
    }

    /// Shows a query what a prepared ray meets. Returns whether that ended it, and the query.
    #[inline(always)]
    pub(super) fn visit_all<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &PreparedRay,
        mut query: Q,
        tally: &mut T,
    ) -> (bool, Q) {
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
    fn traverse<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        bvh: &Bvh8,
        ray: &PreparedRay,
        query: Q,
        tally: &mut T,
    ) -> (bool, Q) {
        let near = query.range().min.to_f64();
        let (setup, rebase) = TraversalRay::mapped(ray.origin, ray.direction, near, &self.bounded_part());
        let (stored, prepared, culls) = (None, Some(*ray), ray.culls);
        let mut visitor = Visitor::<_, _, _, true> { geometry: self, bvh, culls, stored, prepared, query, rebase, tally };
        let over = bvh.visit_mapped(&setup, *ray, &mut visitor);
        (over, visitor.query)
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

impl<R: Real, Q: QueryKind<R>, T: TraversalCounter, const MAPPED: bool> HitVisitor for Visitor<'_, R, Q, T, MAPPED> {
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
        let found = SlotHit { t, u, v, slot: facts.first + lane as u32, inner: NO_PART };
        if !Q::ANY {
            // Its names are asked for when the traversal is over.
            prefetch(&self.geometry.group.slots, found.slot as usize);
        }
        if !(facts.accepts(lane, met.from_outside, self.culls) && self.query.range().contains(t)) {
            return false;
        }
        Q::opaque(facts) >> lane & 1 != 0 || self.query.take(self.geometry, found)
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
            if self.query.take(self.geometry, SlotHit { t, u: R::ZERO, v, slot: facts.first + lane as u32, inner: NO_PART }) {
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
