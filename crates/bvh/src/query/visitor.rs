//! The kinds of queries: the closest hit, and any hit that is accepted; and how each is shown what
//! a ray meets.

use core::any::Any;

use super::{NO_PART, SlotHit};
use crate::bvh8::{
    Bvh8, HitVisitor, RayReparametrisation, RaySource, TraversalQuery, TraversalRay, opaque,
};
use crate::geometry::Geometry;
use crate::instance::Instance;
use crate::processor::prefetch;
use crate::ray::{Interval, Occlusion, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::PreparedRay;
use crate::slot::{Kind, Slot};
use crate::stats::{TraversalCounter, TraversalStats};

/// A kind of query: what it makes of a hit.
pub(super) trait QueryKind<R: Real>: Sized {
    /// Whether any hit will do.
    const ANY: bool;
    /// Where hits count.
    fn range(&self) -> Interval<R>;
    /// The greatest distance that still counts.
    fn far(&self) -> R;
    /// The same query by this ray.
    #[inline(always)]
    fn in_space_of(self, _ray: &PreparedRay) -> Self {
        self
    }
    /// Takes a hit within the range. Whether it ends the query.
    fn take(&mut self, geometry: &Geometry<R>, found: SlotHit<R>) -> bool;
    /// Takes the hit of one primitive, where there is one. Whether it ends the query.
    #[inline(always)]
    fn test<T: TraversalCounter>(
        &mut self,
        geometry: &Geometry<R>,
        slot: (u32, &Slot),
        ray: &PreparedRay,
        tally: &mut T,
    ) -> bool {
        geometry
            .test(slot, ray, self.range(), tally)
            .is_some_and(|found| self.take(geometry, found))
    }
}

/// The running answer of a closest-hit query. `range.max` is kept one step above the best distance,
/// so that a hit at exactly the same distance is still seen and the lower one can win.
///
/// Distances that are rounded to f32 are equal of themselves where surfaces lie in one place. In
/// f64 each shape's test leaves last digits of its own, and now the one would win and now the
/// other. There `range.max` is kept as far beyond as rounding may reach, and whether another hit
/// came so close is kept too.
pub(super) struct ClosestHit<R: Real> {
    pub range: Interval<R>,
    pub found: Option<SlotHit<R>>,
    /// Greatest coordinate of the ray's origin in lengths of its direction, as distances are, where
    /// equal distances may differ.
    pub origin: R,
    pub is_contested: bool,
}

impl<R: Real> ClosestHit<R> {
    /// Of what distances and coordinates are, what equal distances differ by at most: some hundred
    /// roundings of f64, which a ray within two degrees of a surface makes of a test's ten.
    const EQUAL: f64 = 1.0 / (1_u64 << 44) as f64;

    #[inline(always)]
    pub fn new(range: Interval<R>) -> Self {
        Self {
            range,
            found: None,
            origin: R::ZERO,
            is_contested: false,
        }
    }

    /// What distances that are equal but for rounding differ by.
    #[inline(always)]
    fn slack(&self, t: R) -> R {
        (self.origin + t.abs()) * R::from_f64(Self::EQUAL)
    }
}

impl<R: Real> QueryKind<R> for ClosestHit<R> {
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
        self.found
            .as_ref()
            .map_or_else(|| self.range.max.next_down(), |found| found.t)
    }
    #[inline(always)]
    fn in_space_of(self, ray: &PreparedRay) -> Self {
        if R::IS_SINGLE {
            return self;
        }
        Self {
            origin: R::from_f64(ray.origin.abs().max_element() * ray.inverse_length_squared.sqrt()),
            ..self
        }
    }
    #[inline(always)]
    fn take(&mut self, geometry: &Geometry<R>, found: SlotHit<R>) -> bool {
        let order = |found: &SlotHit<R>| geometry.group.slots[found.slot as usize].order();
        // Whether distances are not rounded to f32.
        let is_exact = !R::IS_SINGLE;
        if is_exact && let Some(best) = &self.found {
            self.is_contested |= (found.t - best.t).abs() <= self.slack(best.t);
        }
        let better = match &self.found {
            None => true,
            Some(best) => found.t < best.t || (found.t == best.t && order(&found) < order(best)),
        };
        if better {
            let equal = if is_exact {
                found.t + self.slack(found.t)
            } else {
                found.t
            };
            self.range.max = if is_exact {
                self.range.max.min(equal.next_up())
            } else {
                equal.next_up()
            };
            self.found = Some(found);
        }
        false
    }
}

/// Any hit that is accepted. `BY_VISIBILITY`: by what its object is to such queries, so that an
/// opaque one is not shown first; otherwise each hit is shown, as in an instance, whose own
/// visibility decides.
pub(super) struct AnyHit<'f, R: Real, const BY_VISIBILITY: bool> {
    pub range: Interval<R>,
    pub accept: &'f mut dyn FnMut(SlotHit<R>) -> bool,
}

impl<R: Real, const BY_VISIBILITY: bool> QueryKind<R> for AnyHit<'_, R, BY_VISIBILITY> {
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
    fn take(&mut self, _: &Geometry<R>, found: SlotHit<R>) -> bool {
        (self.accept)(found)
    }
    #[inline(always)]
    fn test<T: TraversalCounter>(
        &mut self,
        geometry: &Geometry<R>,
        slot: (u32, &Slot),
        ray: &PreparedRay,
        tally: &mut T,
    ) -> bool {
        let (own, range) = (slot.1, self.range);
        let opaque = BY_VISIBILITY && own.visibility.occlusion == Occlusion::Opaque;
        if BY_VISIBILITY && own.visibility.occlusion == Occlusion::None {
            return false;
        }
        let mut accepts = |found: SlotHit<R>| opaque || (self.accept)(found);
        if BY_VISIBILITY && own.kind == Kind::Instance {
            let mut accepts = |found: SlotHit<R>| {
                accepts(SlotHit {
                    slot: slot.0,
                    inner: found.slot,
                    ..found
                })
            };
            let query = AnyHit::<_, false> {
                range,
                accept: &mut accepts,
            };
            return geometry
                .visit_instance(own.index as usize, ray, query, tally)
                .0;
        }
        geometry.test(slot, ray, range, tally).is_some_and(accepts)
    }
}

impl<R: Real> Geometry<R> {
    /// Shows a query what a ray in the tree's own scalar meets. Returns whether that ended it.
    #[inline(always)]
    pub(super) fn visit_stored<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        bvh: &Bvh8,
        ray: &Ray<R>,
        visitor: &mut Visitor<'_, R, Q, T>,
    ) -> bool {
        if self.unbounded > self.planes
            && self.visit_unbounded(ray, &mut visitor.query, visitor.tally)
        {
            return true;
        }
        // It is one: only of what is stored in f32 is a tree walked by the ray as it is.
        let Some(single) = (ray as &dyn Any).downcast_ref() else {
            return false;
        };
        let mut query = visitor.traversal(ray.culls, RaySource::Stored(single, self.faces));
        let one = |axis: usize| {
            (
                opaque(ray.origin.axis(axis).to_f32()),
                opaque(ray.direction.axis(axis).to_f32()),
            )
        };
        let ([(ox, dx), (oy, dy), (oz, dz)], near) = ([one(0), one(1), one(2)], query.range.min);
        let over = bvh.visit(ox, oy, oz, dx, dy, dz, near, &mut query, visitor);
        visitor.count(&query);
        over
    }

    #[inline(never)]
    fn visit_unbounded<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        query: &mut Q,
        tally: &mut T,
    ) -> bool {
        let ray = self.prepare(*ray);
        self.unbounded()
            .any(|slot| query.test(self, slot, &ray, tally))
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
        for slot in self
            .unbounded()
            .chain(self.bounded(alone.clone().unwrap_or(0..0)))
        {
            if query.test(self, slot, ray, tally) {
                return (true, query);
            }
        }
        if alone.is_some() {
            (false, query)
        } else {
            self.traverse(ray, query, tally)
        }
    }

    /// The same of a tree. Rounded to f32 the ray is another one, so it is moved to beside what is
    /// there, and boxes take its error into account.
    #[inline(always)]
    fn traverse<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &PreparedRay,
        query: Q,
        tally: &mut T,
    ) -> (bool, Q) {
        let near = query.range().min.to_f64();
        let (setup, rebase) =
            TraversalRay::mapped(ray.origin, ray.direction, near, &self.bounded_part());
        let mut visitor = Visitor {
            geometry: self,
            query,
            tally,
        };
        let mut query = TraversalQuery {
            rebase,
            ..visitor.traversal(ray.culls, RaySource::Prepared(ray))
        };
        let over = self.bvh.visit_mapped(&setup, &mut query, &mut visitor);
        visitor.count(&query);
        (over, visitor.query)
    }

    /// Shows a query what a ray of the world meets in an instance. Returns whether that ended it,
    /// and the query.
    ///
    /// Boxes and filters are asked by a ray that f32 maps, where that is good enough beside what is
    /// there; that of the exact tests is made once one of them is asked. Most rays that come to an
    /// instance's box meet nothing in it.
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
            let mut visitor = Visitor {
                geometry: part,
                query,
                tally: &mut *tally,
            };
            let mut traversal =
                visitor.traversal(ray.culls, RaySource::Under(&instance.transform, ray));
            let over = bvh.visit_instance(
                &instance.to_object,
                &part.sphere,
                ray,
                &mut traversal,
                &mut visitor,
            );
            visitor.count(&traversal);
            if let Some(over) = over {
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

/// Hands what a traversal meets to a query.
pub(super) struct Visitor<'a, R: Real, Q, T> {
    pub geometry: &'a Geometry<R>,
    pub query: Q,
    pub tally: &'a mut T,
}

impl<R: Real, Q: QueryKind<R>, T: TraversalCounter> Visitor<'_, R, Q, T> {
    /// The query as a traversal has it.
    #[inline(always)]
    fn traversal<'a>(&self, culls: bool, source: RaySource<'a>) -> TraversalQuery<'a> {
        let Interval { min, max } = self.query.range();
        TraversalQuery {
            any: Q::ANY,
            counts: T::COUNTS,
            range: Interval {
                min: min.to_f32(),
                max: max.to_f32(),
            },
            far: self.query.far().to_f32(),
            culls,
            source,
            prepared: None,
            rebase: RayReparametrisation::default(),
            stats: TraversalStats::default(),
        }
    }

    /// Lets a traversal know how far the query still looks.
    #[inline(always)]
    fn narrow(&self, query: &mut TraversalQuery<'_>) {
        if !Q::ANY {
            query.range.max = self.query.range().max.to_f32();
            query.far = self.query.far().to_f32();
        }
    }

    #[inline(always)]
    fn count(&mut self, query: &TraversalQuery<'_>) {
        if T::COUNTS {
            self.tally.count(query.stats);
        }
    }
}

impl<R: Real, Q: QueryKind<R>, T: TraversalCounter> HitVisitor for Visitor<'_, R, Q, T> {
    fn hit(&mut self, query: &mut TraversalQuery<'_>, slot: u32, t: f32, u: f32, v: f32) -> bool {
        if !Q::ANY {
            // Its names are asked for when the traversal is over.
            prefetch(&self.geometry.group.slots, slot as usize);
        }
        let [t, u, v] = [t, u, v].map(R::from_f32);
        let over = self.query.take(
            self.geometry,
            SlotHit {
                t,
                u,
                v,
                slot,
                inner: NO_PART,
            },
        );
        self.narrow(query);
        over
    }

    fn other(&mut self, query: &mut TraversalQuery<'_>, place: usize) -> bool {
        let (geometry, ray) = (self.geometry, query.prepared());
        let over = geometry
            .bounded(place..place + 1)
            .any(|slot| self.query.test(geometry, slot, ray, self.tally));
        self.narrow(query);
        over
    }
}
