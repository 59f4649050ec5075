//! What the tree's hits are to a query: one visitor for every kind of query.

use super::kind::QueryKind;
use super::{NO_PART, SlotHit};
use crate::bvh8::{Bvh8, HitVisitor, Lanes, LeafHeader, RayReparametrisation, RowHits, TraversalRay, WIDTH};
use crate::geometry::Geometry;
use crate::instance::Instance;
use crate::processor::prefetch;
use crate::ray::{Interval, Ray};
use crate::scalar::Real;
use crate::shapes::{PreparedRay, Transform, TriangleHit};
use crate::stats::TraversalCounter;

impl<R: Real> Geometry<R> {
    /// Shows a query what a ray in the tree's own scalar meets. Returns whether that ended it.
    #[inline(always)]
    pub(super) fn visit_stored<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        bvh: &Bvh8,
        ray: &Ray<R>,
        visitor: &mut Visitor<'_, R, Q, T, false>,
    ) -> bool {
        self.unbounded > self.planes && self.visit_unbounded(ray, &mut visitor.query, visitor.tally)
            || bvh.visit(ray, visitor.query.range(), visitor)
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
        let alone = self.bvh.places_alone();
        for slot in self.unbounded().chain(self.bounded(alone.clone().unwrap_or(0..0))) {
            if query.test(self, slot, ray, tally) {
                return (true, query);
            }
        }
        if alone.is_some() { (false, query) } else { self.traverse(ray, query, tally) }
    }

    /// The same of a tree. Rounded to f32 the ray is another one, so it is moved to beside what is there, and boxes take its error into account.
    #[inline(always)]
    fn traverse<Q: QueryKind<R>, T: TraversalCounter>(&self, ray: &PreparedRay, query: Q, tally: &mut T) -> (bool, Q) {
        let near = query.range().min.to_f64();
        let (setup, rebase) = TraversalRay::mapped(ray.origin, ray.direction, near, &self.bounded_part());
        let mut visitor = Visitor::<_, _, _, true>::new(self, ray.culls, RaySource::Prepared(ray), query, tally);
        visitor.rebase = rebase;
        let over = self.bvh.visit_mapped(&setup, &mut visitor);
        (over, visitor.query)
    }

    /// Shows a query what a ray of the world meets in an instance. Returns whether that ended it, and the query.
    ///
    /// Boxes and filters are asked by a ray that f32 maps, where that is good enough beside what is there; that of the exact tests is made
    /// once one of them is asked. Most rays that come to an instance's box meet nothing in it.
    #[inline(always)]
    pub(super) fn visit_instance<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        instance: usize,
        ray: &PreparedRay,
        mut query: Q,
        tally: &mut T,
    ) -> (bool, Q) {
        let instance = &self.group.instances[instance];
        let part = &self.group.parts[instance.part as usize];
        if let Some(bvh) = part.lanes()
            && part.unbounded == 0
        {
            let source = RaySource::Under(&instance.transform, ray);
            let mut visitor = Visitor::<_, _, _, true>::new(part, ray.culls, source, query, tally);
            if let Some(over) = bvh.visit_instance(&instance.to_object, &part.sphere, ray, &mut visitor) {
                return (over, visitor.query);
            }
            query = visitor.query;
        }
        self.visit_exactly(instance, ray, query, tally)
    }

    /// The same by the ray that f64 maps.
    #[inline(never)]
    fn visit_exactly<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        instance: &Instance,
        ray: &PreparedRay,
        query: Q,
        tally: &mut T,
    ) -> (bool, Q) {
        let mut room = None;
        let (transform, part) = self.group.shown(instance, ray.time, &mut room);
        let ray = transform.probe_to_object(ray);
        part.visit_all(&ray, query.in_space_of(&ray), tally)
    }
}

/// From what the ray of exact tests is made.
#[derive(Clone, Copy)]
pub(super) enum RaySource<'a, R: Real> {
    Stored(&'a Ray<R>),
    /// A ray of the world, and the map of an instance.
    Under(&'a Transform, &'a PreparedRay),
    Prepared(&'a PreparedRay),
}

impl<'a, R: Real> RaySource<'a, R> {
    /// The ray of exact tests, where it is or in a place of its own.
    #[inline(always)]
    fn prepared<'b>(self, geometry: &Geometry<R>, place: &'b mut Option<PreparedRay>) -> &'b PreparedRay
    where
        'a: 'b,
    {
        match self {
            RaySource::Prepared(ray) => ray,
            RaySource::Stored(ray) => place.get_or_insert_with(|| geometry.prepare(*ray)),
            RaySource::Under(transform, ray) => place.get_or_insert_with(|| transform.probe_to_object(ray)),
        }
    }
}

/// Hands what a traversal meets to a query. `MAPPED`: by a ray that was rounded, see [`TraversalRay::mapped`].
pub(super) struct Visitor<'a, R: Real, Q, T, const MAPPED: bool> {
    geometry: &'a Geometry<R>,
    culls: bool,
    ray: RaySource<'a, R>,
    /// Made from it once something asks.
    prepared: Option<PreparedRay>,
    pub query: Q,
    rebase: RayReparametrisation,
    tally: &'a mut T,
}

impl<'a, R: Real, Q, T, const MAPPED: bool> Visitor<'a, R, Q, T, MAPPED> {
    /// In its place from the start, where it is read: to move it would wait for its stores.
    #[inline(always)]
    pub fn new(geometry: &'a Geometry<R>, culls: bool, ray: RaySource<'a, R>, query: Q, tally: &'a mut T) -> Self {
        Self { geometry, culls, ray, prepared: None, query, rebase: RayReparametrisation::default(), tally }
    }
}

impl<R: Real, Q: QueryKind<R>, T: TraversalCounter, const MAPPED: bool> HitVisitor for Visitor<'_, R, Q, T, MAPPED> {
    const ANY: bool = Q::ANY;
    const MAPPED: bool = MAPPED;
    type Counter = T;

    #[inline(always)]
    fn starts(&mut self, at: f32) {
        self.rebase = RayReparametrisation { start: at.into(), scale: 1.0 };
    }

    #[inline(always)]
    fn prepared(&mut self) -> &PreparedRay {
        self.ray.prepared(self.geometry, &mut self.prepared)
    }

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
    fn counter(&mut self) -> &mut T {
        self.tally
    }

    #[inline(always)]
    fn lanes(&self, facts: &LeafHeader) -> [u32; 2] {
        if !Q::ANY {
            return [u32::MAX, 0];
        }
        let [wanted, opaque] = Q::lanes(facts);
        [wanted.into(), (opaque & !(facts.outside_alone(self.culls) | facts.inside)).into()]
    }

    #[inline(always)]
    fn triangle(&mut self, facts: &LeafHeader, lane: usize, met: &TriangleHit) -> bool {
        let [t, u, v] = [met.t, met.weights[0], met.weights[1]].map(R::from_f32);
        let found = SlotHit { t, u, v, slot: facts.first + lane as u32, inner: NO_PART };
        if !Q::ANY {
            // Its names are asked for when the traversal is over.
            prefetch(&self.geometry.group.slots, found.slot as usize);
        }
        if !(facts.accepts(lane, met.from_outside, self.culls) && self.query.range().contains(t)) {
            return false;
        }
        Q::lanes(facts)[1] >> lane & 1 != 0 || self.query.take(self.geometry, found)
    }

    #[inline(always)]
    fn row(&mut self, facts: &LeafHeader, roots: &RowHits<[f32; WIDTH]>) -> bool {
        let [wanted, opaque] = Q::lanes(facts);
        if roots.hits & u32::from(opaque) != 0 {
            return true;
        }
        for lane in Lanes(roots.hits & u32::from(wanted)) {
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
        let ray = self.ray.prepared(geometry, &mut self.prepared);
        geometry.bounded(place..place + 1).any(|slot| self.query.test(geometry, slot, ray, self.tally))
    }
}
