//! Connection of queries to traversals: the visits of primitives, trees and instances.

use core::any::Any;

use super::kinds::QueryKind;
use super::{NO_INNER_SLOT, SlotHit};
use crate::bvh8::{
    Bvh8, HitVisitor, RayReparametrisation, RaySource, TraversalQuery, TraversalRay,
    optimisation_barrier,
};
use crate::geometry::Geometry;
use crate::instance::Instance;
use crate::processor::prefetch;
use crate::ray::{Interval, Ray};
use crate::ray_ends::RayEndTriangles;
use crate::scalar::{Real, Vector};
use crate::shapes::PreparedRay;
use crate::stats::{TraversalCounter, TraversalStats};

impl<R: Real> Geometry<R> {
    /// Runs a query by a ray in f32, the scalar of the tree, with the triangles at its ends.
    /// Returns whether a hit ended the query.
    #[inline(always)]
    pub(super) fn visit_f32_ray<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        bvh: &Bvh8,
        (ray, ends): (&Ray<R>, &RayEndTriangles),
        visitor: &mut QueryVisitor<'_, R, Q, T>,
    ) -> bool {
        if self.unbounded > self.planes
            && self.visit_unbounded_primitives(ray, &mut visitor.query, visitor.stats)
        {
            return true;
        }
        // Always succeeds: only a tree of f32 primitives is traversed by a stored ray.
        let Some(single) = (ray as &dyn Any).downcast_ref() else {
            return false;
        };
        let mut query = visitor.to_traversal_query(
            ray.is_camera_ray,
            RaySource::StoredRay(single, self.has_faces, ends),
        );
        let one = |axis: usize| {
            (
                optimisation_barrier(ray.origin.component(axis).to_f32()),
                optimisation_barrier(ray.direction.component(axis).to_f32()),
            )
        };
        let ([(ox, dx), (oy, dy), (oz, dz)], near) = ([one(0), one(1), one(2)], query.range.min);
        let ended = bvh.visit_hits(ox, oy, oz, dx, dy, dz, near, &mut query, visitor);
        visitor.add_work_counts(&query);
        ended
    }

    /// Tests the unbounded primitives one by one, before the traversal. Returns whether a hit ended
    /// the query.
    #[inline(never)]
    fn visit_unbounded_primitives<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        query: &mut Q,
        stats: &mut T,
    ) -> bool {
        let ray = self.prepare_ray(*ray);
        self.unbounded_slots()
            .any(|slot| query.test_primitive(self, slot, &ray, stats))
    }

    /// Runs a query by a prepared ray over all primitives. Returns whether a hit ended the query,
    /// and the query.
    #[inline(always)]
    pub(super) fn run_query<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &PreparedRay,
        mut query: Q,
        stats: &mut T,
    ) -> (bool, Q) {
        let single_positions = self.bvh.single_primitive_positions();
        for slot in self
            .unbounded_slots()
            .chain(self.bounded_slots(single_positions.clone().unwrap_or(0..0)))
        {
            if query.test_primitive(self, slot, ray, stats) {
                return (true, query);
            }
        }
        if single_positions.is_some() {
            (false, query)
        } else {
            self.traverse_f64_ray(ray, query, stats)
        }
    }

    /// Traverses the tree by a prepared ray, for [`Self::run_query`]. The ray is rounded to f32. To
    /// keep its error small, it is first moved along itself to the bounds of the tree, and box
    /// tests include the remaining error.
    #[inline(always)]
    fn traverse_f64_ray<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &PreparedRay,
        query: Q,
        stats: &mut T,
    ) -> (bool, Q) {
        let near = query.range().min.to_f64();
        let (traversal_ray, rebase) = TraversalRay::from_f64_ray(
            ray.origin,
            ray.direction,
            near,
            &self.bounded_primitives_box(),
        );
        let mut visitor = QueryVisitor {
            geometry: self,
            query,
            stats,
        };
        let mut query = TraversalQuery {
            reparametrisation: rebase,
            ..visitor.to_traversal_query(ray.is_camera_ray, RaySource::PreparedRay(ray))
        };
        let ended = self
            .bvh
            .visit_hits_of_rounded_ray(&traversal_ray, &mut query, &mut visitor);
        visitor.add_work_counts(&query);
        (ended, visitor.query)
    }

    /// Runs a query inside an instance by a world-space ray. Returns whether a hit ended the query,
    /// and the query.
    ///
    /// Box tests and filters use the mapped ray rounded to f32, if that is precise enough for the
    /// instanced geometry. The ray for exact tests is prepared at its first use, since most rays
    /// that enter an instance's box hit nothing in it.
    #[inline(always)]
    pub(super) fn visit_instance<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        instance: usize,
        ray: &PreparedRay,
        mut query: Q,
        stats: &mut T,
    ) -> (bool, Q) {
        let instance = &self.primitives.instances[instance];
        let part = &self.primitives.parts[instance.part as usize];
        if let Some(bvh) = part.simd_tree()
            && part.unbounded == 0
            && instance.motion().is_none()
        {
            let mut visitor = QueryVisitor {
                geometry: part,
                query,
                stats: &mut *stats,
            };
            let mut traversal = visitor.to_traversal_query(
                ray.is_camera_ray,
                RaySource::InInstance(&instance.transform, ray),
            );
            let ended = bvh.visit_instance(
                &instance.transform,
                &part.sphere,
                ray,
                &mut traversal,
                &mut visitor,
            );
            visitor.add_work_counts(&traversal);
            if let Some(ended) = ended {
                return (ended, visitor.query);
            }
            query = visitor.query;
        }
        self.visit_instance_in_f64(instance, ray, query, stats)
    }

    /// Runs the query of [`Self::visit_instance`] by a ray that is mapped in f64.
    #[inline(never)]
    fn visit_instance_in_f64<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        instance: &Instance,
        ray: &PreparedRay,
        query: Q,
        stats: &mut T,
    ) -> (bool, Q) {
        let mut moving_transform = None;
        let (transform, part) =
            self.primitives
                .resolve_instance(instance, ray.time, &mut moving_transform);
        let ray = transform.ray_to_object(ray);
        part.run_query(&ray, query.adapt_to_mapped_ray(&ray), stats)
    }
}

/// Visitor of a traversal that passes its hits to a query.
pub(super) struct QueryVisitor<'a, R: Real, Q, T> {
    pub geometry: &'a Geometry<R>,
    pub query: Q,
    pub stats: &'a mut T,
}

impl<R: Real, Q: QueryKind<R>, T: TraversalCounter> QueryVisitor<'_, R, Q, T> {
    /// Describes the query as the data of a traversal.
    #[inline(always)]
    fn to_traversal_query<'a>(&self, culls: bool, source: RaySource<'a>) -> TraversalQuery<'a> {
        let Interval { min, max } = self.query.range();
        TraversalQuery {
            ends_at_any_hit: Q::ANY,
            counts_work: T::COUNTS,
            // Each by itself: they were written just before, one by one.
            range: Interval {
                min: optimisation_barrier(min.to_f32()),
                max: optimisation_barrier(max.to_f32()),
            },
            far: self.query.max_distance().to_f32(),
            is_camera_ray: culls,
            source,
            prepared_ray: None,
            reparametrisation: RayReparametrisation::default(),
            stats: TraversalStats::default(),
        }
    }

    /// Shortens the traversal's range to the range of the query, after a hit.
    #[inline(always)]
    fn shorten_range(&self, query: &mut TraversalQuery<'_>) {
        if !Q::ANY {
            query.range.max = self.query.range().max.to_f32();
            query.far = self.query.max_distance().to_f32();
        }
    }

    /// Adds the counts of a traversal to the counts of the query.
    #[inline(always)]
    fn add_work_counts(&mut self, query: &TraversalQuery<'_>) {
        if T::COUNTS {
            self.stats.count(query.stats);
        }
    }
}

impl<R: Real, Q: QueryKind<R>, T: TraversalCounter> HitVisitor for QueryVisitor<'_, R, Q, T> {
    fn visit_hit(
        &mut self,
        query: &mut TraversalQuery<'_>,
        slot: u32,
        t: f32,
        u: f32,
        v: f32,
    ) -> bool {
        if !Q::ANY {
            // Prefetched, since the slot is read after the traversal.
            prefetch(&self.geometry.primitives.slots, slot as usize);
        }
        let [t, u, v] = [t, u, v].map(R::from_f32);
        let ended = self.query.accept_hit(
            self.geometry,
            SlotHit {
                t,
                u,
                v,
                slot,
                inner: NO_INNER_SLOT,
            },
        );
        self.shorten_range(query);
        ended
    }

    fn visit_single_primitive(&mut self, query: &mut TraversalQuery<'_>, index: usize) -> bool {
        let (geometry, ray) = (self.geometry, query.prepared_ray());
        let ended = geometry
            .bounded_slots(index..index + 1)
            .any(|slot| self.query.test_primitive(geometry, slot, ray, self.stats));
        self.shorten_range(query);
        ended
    }
}
