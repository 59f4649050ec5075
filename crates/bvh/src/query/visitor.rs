//! The two kinds of queries, closest hit and any accepted hit, and their connection to traversals.

use core::any::Any;

use super::{NO_PART, SlotHit};
use crate::bvh8::{
    Bvh8, HitVisitor, RayReparametrisation, RaySource, TraversalQuery, TraversalRay,
    optimisation_barrier,
};
use crate::geometry::Geometry;
use crate::instance::Instance;
use crate::processor::prefetch;
use crate::ray::{Interval, Occlusion, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::PreparedRay;
use crate::slot::{PrimitiveKind, Slot};
use crate::stats::{TraversalCounter, TraversalStats};

/// Kind of query: closest hit or any hit, with its state and its reaction to a hit.
pub(super) trait QueryKind<R: Real>: Sized {
    /// Whether an accepted hit ends the query.
    const ANY: bool;
    /// Open interval of accepted distances.
    fn range(&self) -> Interval<R>;
    /// Greatest accepted distance.
    fn far(&self) -> R;
    /// Adapts the query to the ray mapped into another space.
    #[inline(always)]
    fn in_space_of(self, _ray: &PreparedRay) -> Self {
        self
    }
    /// Handles a hit within the range. Returns whether the query ends.
    fn accept(&mut self, geometry: &Geometry<R>, slot_hit: SlotHit<R>) -> bool;
    /// Tests one primitive and handles its hit, if any. Returns whether the query ends.
    #[inline(always)]
    fn test<T: TraversalCounter>(
        &mut self,
        geometry: &Geometry<R>,
        slot: (u32, &Slot),
        ray: &PreparedRay,
        stats: &mut T,
    ) -> bool {
        geometry
            .test(slot, ray, self.range(), stats)
            .is_some_and(|slot_hit| self.accept(geometry, slot_hit))
    }
}

/// State of a closest-hit query. `range.max` is kept one step above the best distance, so that a
/// hit at equal distance is still found and the lower id can win.
///
/// Distances rounded to f32 are equal if surfaces coincide. In f64 the last digits of a distance
/// depend on the shape's test, so either of two coincident surfaces could win. For f64, `range.max`
/// is therefore kept as far beyond the best distance as rounding may reach, and `is_contested`
/// records whether another hit came that close.
pub(super) struct ClosestHit<R: Real> {
    pub range: Interval<R>,
    pub slot_hit: Option<SlotHit<R>>,
    /// Greatest coordinate of the ray's origin, in units of distance (lengths of the direction).
    /// Zero for f32.
    pub origin: R,
    pub is_contested: bool,
}

impl<R: Real> ClosestHit<R> {
    /// Greatest relative difference of distances that count as equal: some hundred roundings of
    /// f64. An intersection test makes about ten, and a ray within two degrees of a surface
    /// multiplies them.
    const EQUAL: f64 = 1.0 / (1_u64 << 44) as f64;

    #[inline(always)]
    pub fn new(range: Interval<R>) -> Self {
        Self {
            range,
            slot_hit: None,
            origin: R::ZERO,
            is_contested: false,
        }
    }

    /// Greatest difference from `t` of a distance that equals `t` up to rounding.
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
        // In f64, hits slightly beyond the nearest hit count too.
        if !R::IS_SINGLE {
            return self.range.max;
        }
        self.slot_hit
            .as_ref()
            .map_or_else(|| self.range.max.next_down(), |slot_hit| slot_hit.t)
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
    fn accept(&mut self, geometry: &Geometry<R>, slot_hit: SlotHit<R>) -> bool {
        let order = |slot_hit: &SlotHit<R>| geometry.group.slots[slot_hit.slot as usize].order();
        // Whether distances are stored in f64, without rounding to f32.
        let is_exact = !R::IS_SINGLE;
        if is_exact && let Some(best) = &self.slot_hit {
            self.is_contested |= (slot_hit.t - best.t).abs() <= self.slack(best.t);
        }
        let better = match &self.slot_hit {
            None => true,
            Some(best) => {
                slot_hit.t < best.t || (slot_hit.t == best.t && order(&slot_hit) < order(best))
            }
        };
        if better {
            let equal = if is_exact {
                slot_hit.t + self.slack(slot_hit.t)
            } else {
                slot_hit.t
            };
            self.range.max = if is_exact {
                self.range.max.min(equal.next_up())
            } else {
                equal.next_up()
            };
            self.slot_hit = Some(slot_hit);
        }
        false
    }
}

/// A query for any accepted hit. With `BY_VISIBILITY` the object's occlusion decides, and an opaque
/// hit ends the query without a call of `accept`. Otherwise every hit is passed to `accept`, as for
/// the contents of an instance, for which the instance's visibility decides.
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
    fn accept(&mut self, _: &Geometry<R>, slot_hit: SlotHit<R>) -> bool {
        (self.accept)(slot_hit)
    }
    #[inline(always)]
    fn test<T: TraversalCounter>(
        &mut self,
        geometry: &Geometry<R>,
        slot: (u32, &Slot),
        ray: &PreparedRay,
        stats: &mut T,
    ) -> bool {
        let (own_slot, range) = (slot.1, self.range);
        let opaque = BY_VISIBILITY && own_slot.visibility.occlusion == Occlusion::Opaque;
        if BY_VISIBILITY && own_slot.visibility.occlusion == Occlusion::None {
            return false;
        }
        let mut accepts = |slot_hit: SlotHit<R>| opaque || (self.accept)(slot_hit);
        if BY_VISIBILITY && own_slot.kind == PrimitiveKind::Instance {
            let mut accepts = |slot_hit: SlotHit<R>| {
                accepts(SlotHit {
                    slot: slot.0,
                    inner: slot_hit.slot,
                    ..slot_hit
                })
            };
            let query = AnyHit::<_, false> {
                range,
                accept: &mut accepts,
            };
            return geometry
                .visit_instance(own_slot.index as usize, ray, query, stats)
                .0;
        }
        geometry.test(slot, ray, range, stats).is_some_and(accepts)
    }
}

impl<R: Real> Geometry<R> {
    /// Runs a query by a ray in f32, the scalar of the tree. Returns whether a hit ended the query.
    #[inline(always)]
    pub(super) fn visit_stored<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        bvh: &Bvh8,
        ray: &Ray<R>,
        visitor: &mut Visitor<'_, R, Q, T>,
    ) -> bool {
        if self.unbounded > self.planes
            && self.visit_unbounded(ray, &mut visitor.query, visitor.stats)
        {
            return true;
        }
        // Always succeeds: only a tree of f32 primitives is traversed by a stored ray.
        let Some(single) = (ray as &dyn Any).downcast_ref() else {
            return false;
        };
        let mut query = visitor.traversal(ray.culls, RaySource::Stored(single, self.faces));
        let one = |axis: usize| {
            (
                optimisation_barrier(ray.origin.axis(axis).to_f32()),
                optimisation_barrier(ray.direction.axis(axis).to_f32()),
            )
        };
        let ([(ox, dx), (oy, dy), (oz, dz)], near) = ([one(0), one(1), one(2)], query.range.min);
        let over = bvh.visit(ox, oy, oz, dx, dy, dz, near, &mut query, visitor);
        visitor.count(&query);
        over
    }

    /// Tests the unbounded primitives one by one, before the traversal. Returns whether a hit ended
    /// the query.
    #[inline(never)]
    fn visit_unbounded<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        query: &mut Q,
        stats: &mut T,
    ) -> bool {
        let ray = self.prepare(*ray);
        self.unbounded()
            .any(|slot| query.test(self, slot, &ray, stats))
    }

    /// Runs a query by a prepared ray over all primitives. Returns whether a hit ended the query,
    /// and the query.
    #[inline(always)]
    pub(super) fn visit_all<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &PreparedRay,
        mut query: Q,
        stats: &mut T,
    ) -> (bool, Q) {
        let alone = self.bvh.places_alone();
        for slot in self
            .unbounded()
            .chain(self.bounded(alone.clone().unwrap_or(0..0)))
        {
            if query.test(self, slot, ray, stats) {
                return (true, query);
            }
        }
        if alone.is_some() {
            (false, query)
        } else {
            self.traverse(ray, query, stats)
        }
    }

    /// Traverses the tree by a prepared ray, for [`Self::visit_all`]. The ray is rounded to f32. To
    /// keep its error small, it is first moved along itself to the bounds of the tree, and box
    /// tests include the remaining error.
    #[inline(always)]
    fn traverse<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &PreparedRay,
        query: Q,
        stats: &mut T,
    ) -> (bool, Q) {
        let near = query.range().min.to_f64();
        let (traversal_ray, rebase) =
            TraversalRay::mapped(ray.origin, ray.direction, near, &self.bounded_part());
        let mut visitor = Visitor {
            geometry: self,
            query,
            stats,
        };
        let mut query = TraversalQuery {
            rebase,
            ..visitor.traversal(ray.culls, RaySource::Prepared(ray))
        };
        let over = self
            .bvh
            .visit_mapped(&traversal_ray, &mut query, &mut visitor);
        visitor.count(&query);
        (over, visitor.query)
    }

    /// Runs a query inside an instance by a world-space ray. Returns whether a hit ended the query,
    /// and the query.
    ///
    /// Box tests and filters use the ray mapped in f32, if that is precise enough for the instanced
    /// geometry. The ray for exact tests is mapped in f64 at its first use, since most rays that
    /// enter an instance's box hit nothing in it.
    #[inline(always)]
    pub(super) fn visit_instance<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        instance: usize,
        ray: &PreparedRay,
        mut query: Q,
        stats: &mut T,
    ) -> (bool, Q) {
        let instance = &self.group.instances[instance];
        let part = &self.group.parts[instance.part as usize];
        if let Some(bvh) = part.lanes()
            && part.unbounded == 0
        {
            let mut visitor = Visitor {
                geometry: part,
                query,
                stats: &mut *stats,
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
        self.visit_exactly(instance, ray, query, stats)
    }

    /// Runs the query of [`Self::visit_instance`] by a ray that is mapped in f64.
    #[inline(never)]
    fn visit_exactly<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        instance: &Instance,
        ray: &PreparedRay,
        query: Q,
        stats: &mut T,
    ) -> (bool, Q) {
        let mut room = None;
        let (transform, part) = self.group.shown(instance, ray.time, &mut room);
        let ray = transform.probe_to_object(ray);
        part.visit_all(&ray, query.in_space_of(&ray), stats)
    }
}

/// Visitor of a traversal that passes its hits to a query.
pub(super) struct Visitor<'a, R: Real, Q, T> {
    pub geometry: &'a Geometry<R>,
    pub query: Q,
    pub stats: &'a mut T,
}

impl<R: Real, Q: QueryKind<R>, T: TraversalCounter> Visitor<'_, R, Q, T> {
    /// Describes the query as the data of a traversal.
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

    /// Shortens the traversal's range to the range of the query, after a hit.
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
            self.stats.count(query.stats);
        }
    }
}

impl<R: Real, Q: QueryKind<R>, T: TraversalCounter> HitVisitor for Visitor<'_, R, Q, T> {
    fn hit(&mut self, query: &mut TraversalQuery<'_>, slot: u32, t: f32, u: f32, v: f32) -> bool {
        if !Q::ANY {
            // Prefetched, since the slot is read after the traversal.
            prefetch(&self.geometry.group.slots, slot as usize);
        }
        let [t, u, v] = [t, u, v].map(R::from_f32);
        let over = self.query.accept(
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

    fn other(&mut self, query: &mut TraversalQuery<'_>, index: usize) -> bool {
        let (geometry, ray) = (self.geometry, query.prepared());
        let over = geometry
            .bounded(index..index + 1)
            .any(|slot| self.query.test(geometry, slot, ray, self.stats));
        self.narrow(query);
        over
    }
}
