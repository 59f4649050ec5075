//! Closest-hit and any-hit queries over a set of primitives. Every accelerator gives the same bits.
//!
//! Each query is a separate function per scalar type. So a caller's loop contains a call, not a
//! copy of every primitive's test. During a query a hit is identified by its slot (the primitive's
//! record in the set). The object and primitive ids are added after the query.

mod kinds;
mod packet;
mod visitor;

pub use packet::{PacketBackoff, RayPacket};

use core::ops::Range;

use glam::DVec3;

use crate::aabb::Aabb;
use crate::bvh8::optimisation_barrier;
use crate::geometry::Geometry;
use crate::ray::{Hit, Interval, Ray};
use crate::ray_ends::{RayEndTriangles, TriangleSlot};
use crate::scalar::{Real, Vector};
use crate::shapes::{Plane, PreparedRay, Shape, ShapeHit};
use crate::slot::{PrimitiveKind, PrimitiveSlot};
use crate::stats::{TraversalCounter, TraversalStats};

use self::kinds::{AnyHitQuery, ClosestHitQuery, QueryKind};
use self::visitor::QueryVisitor;

/// Value of [`SlotHit`]'s inner slot for a hit outside any instance.
const NO_INNER_SLOT: u32 = u32::MAX;

/// A hit, identified by `slot`: the index of the primitive's record in the set. If that primitive
/// is an instance, `inner` is the slot in the instanced geometry; otherwise it is
/// [`NO_INNER_SLOT`].
#[derive(Clone, Copy)]
struct SlotHit<R> {
    t: R,
    u: R,
    v: R,
    slot: u32,
    inner: u32,
}

/// Whether all numbers of a ray, and their sum, are finite. A ray with a NaN would hit nothing but
/// enter every box, at the cost of a linear scan. Each number is read by itself: a ray was written
/// just before, number by number, and a read of two together would wait for both writes.
#[inline(always)]
fn is_finite_ray<R: Real>(ray: &Ray<R>) -> bool {
    let sum = |axis| {
        let (origin, direction) = (ray.origin.component(axis), ray.direction.component(axis));
        if R::IS_SINGLE {
            let alone = |number: R| R::from_f32(optimisation_barrier(number.to_f32()));
            alone(origin) + alone(direction)
        } else {
            origin + direction
        }
    };
    (sum(0) + sum(1) + sum(2)).abs() < R::INFINITY
}

impl<R: Real> Geometry<R> {
    /// Finds the closest hit with `range.min < t < range.max`. Of hits at equal distance, the hit
    /// with the lowest object id is returned; of several in that object, the one with the lowest
    /// primitive id.
    #[inline(always)]
    #[doc(alias("rtcIntersect1", "Intersect"))]
    pub fn closest<T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        stats: &mut T,
    ) -> Option<Hit<R>> {
        self.closest_with_ray_ends(ray, range, &RayEndTriangles::NONE, stats)
    }

    /// Finds the closest hit as [`Self::closest`]. `ends` names the triangle that the ray leaves,
    /// which the query then need not test.
    #[inline(never)]
    pub fn closest_with_ray_ends<T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        ends: &RayEndTriangles,
        stats: &mut T,
    ) -> Option<Hit<R>> {
        if !is_finite_ray(ray) {
            return None;
        }
        let Some(bvh) = self.simd_tree() else {
            return self
                .closest_by_prepared_ray(ray, range, stats)
                .map(|slot_hit| self.to_hit(&slot_hit));
        };
        let mut visitor = QueryVisitor {
            geometry: self,
            query: ClosestHitQuery::new(range),
            stats,
        };
        self.visit_f32_ray(bvh, (ray, ends), &mut visitor);
        visitor
            .query
            .slot_hit
            .as_ref()
            .map(|slot_hit| self.to_hit(slot_hit))
    }

    /// Finds the closest hit by a prepared ray, in a linear scan or for primitives stored in f64.
    /// This function is separate from its caller, since its stack frame is much larger.
    #[inline(never)]
    fn closest_by_prepared_ray<T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        stats: &mut T,
    ) -> Option<SlotHit<R>> {
        let ray = self.prepare_ray(*ray);
        let closest = self
            .run_query(
                &ray,
                ClosestHitQuery::new(range).adapt_to_mapped_ray(&ray),
                stats,
            )
            .1;
        let slot_hit = closest.slot_hit?;
        Some(if closest.is_contested {
            self.break_tie(&ray, closest.range, slot_hit, stats)
        } else {
            slot_hit
        })
    }

    /// Returns the hit with the lowest object id among all hits of a ray in `range`. `range` is the
    /// final range of a closest-hit query: every hit in it has the distance of `nearest`, up to
    /// rounding.
    #[cold]
    fn break_tie<T: TraversalCounter>(
        &self,
        ray: &PreparedRay,
        range: Interval<R>,
        nearest: SlotHit<R>,
        stats: &mut T,
    ) -> SlotHit<R> {
        let order =
            |slot_hit: &SlotHit<R>| self.primitives.slots[slot_hit.slot as usize].tie_order();
        let mut first = nearest;
        let mut consider = |slot_hit: SlotHit<R>| {
            first = if order(&slot_hit) < order(&first) {
                slot_hit
            } else {
                first
            };
            false
        };
        self.run_query(
            ray,
            AnyHitQuery::<_, false> {
                range,
                accept: &mut consider,
            },
            stats,
        );
        first
    }

    /// Whether a hit with `range.min < t < range.max` occludes the ray. A hit of an opaque object
    /// does. A hit of an [`Occlusion::Filtered`](crate::Occlusion::Filtered) object does if
    /// `filter` returns true for it; otherwise the query goes on.
    ///
    /// Hits are passed to `filter` in any order. A primitive of the set itself is passed once, at
    /// its nearest hit. Of an instance, each primitive in it is passed once.
    #[inline(always)]
    #[doc(alias("rtcOccluded1", "any_hit", "IntersectP"))]
    pub fn occluded<T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        filter: &mut dyn FnMut(&Hit<R>) -> bool,
        stats: &mut T,
    ) -> bool {
        self.occluded_with_ray_ends(ray, range, &RayEndTriangles::NONE, filter, stats)
    }

    /// Whether the ray is occluded, as [`Self::occluded`]. `ends` names the triangle that the ray
    /// leaves, and the triangles before which it ends. The query need not test these.
    #[inline(never)]
    pub fn occluded_with_ray_ends<T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        ends: &RayEndTriangles,
        filter: &mut dyn FnMut(&Hit<R>) -> bool,
        stats: &mut T,
    ) -> bool {
        if !is_finite_ray(ray) {
            return false;
        }
        let mut accept = |slot_hit: SlotHit<R>| filter(&self.to_hit(&slot_hit));
        let accept = &mut accept;
        // The query is written where it is used: one that was written elsewhere and copied had to
        // be waited for.
        match self.simd_tree() {
            Some(bvh) => self.visit_f32_ray(
                bvh,
                (ray, ends),
                &mut QueryVisitor {
                    geometry: self,
                    query: AnyHitQuery::<_, true> { range, accept },
                    stats,
                },
            ),
            None => self.visit_prepared_ray(ray, AnyHitQuery::<_, true> { range, accept }, stats),
        }
    }

    /// Passes the hits with `range.min < t < range.max` to `visit`, in any order, until it returns
    /// true. Hits at one distance are all passed. A primitive or an instance is passed once, at its
    /// nearest hit in the range.
    pub fn visit_hits(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        visit: &mut dyn FnMut(&Hit<R>) -> bool,
    ) {
        let accept = &mut |slot_hit: SlotHit<R>| visit(&self.to_hit(&slot_hit));
        if is_finite_ray(ray) {
            self.visit_prepared_ray(ray, AnyHitQuery::<_, false> { range, accept }, &mut ());
        }
    }

    /// Prepares a ray and runs a query with it. Returns whether a hit ended the query.
    #[inline(never)]
    fn visit_prepared_ray<Q: QueryKind<R>, T: TraversalCounter>(
        &self,
        ray: &Ray<R>,
        query: Q,
        stats: &mut T,
    ) -> bool {
        self.run_query(&self.prepare_ray(*ray), query, stats).0
    }

    /// Calls `visit` with each primitive whose box meets a box, and with each unbounded primitive but
    /// planes beside it, until it returns true: with the object id, the primitive id (`u32::MAX` for all of
    /// an instance), and the corners of a triangle. Returns whether it did.
    pub fn visit_box(
        &self,
        bounds: &Aabb,
        visit: &mut dyn FnMut(u32, u32, Option<[DVec3; 3]>) -> bool,
    ) -> bool {
        let set = &self.primitives;
        let is_beside_plane = |plane: &Plane<R>| {
            let (point, normal) = (plane.point.to_f64(), plane.normal.to_f64());
            let heights = bounds.corners().map(|corner| normal.dot(corner - point));
            heights.iter().all(|&height| height > 0.0) || heights.iter().all(|&height| height < 0.0)
        };
        let mut visit_slots = |slots: Range<usize>| {
            set.slots[slots].iter().any(|slot| {
                let index = slot.index as usize;
                let (corners, own) = match slot.kind {
                    PrimitiveKind::Triangle => {
                        let vertices = self.triangle(index).vertices.map(Vector::to_f64);
                        (Some(vertices), Some(Aabb::from_points(vertices)))
                    }
                    PrimitiveKind::Plane if is_beside_plane(&set.planes[index]) => return false,
                    _ => (None, set.bounds(slot)),
                };
                let primitive = match slot.kind {
                    PrimitiveKind::Instance => u32::MAX,
                    _ => slot.primitive,
                };
                own.is_none_or(|own| !own.intersection(*bounds).is_empty())
                    && visit(slot.object, primitive, corners)
            })
        };
        visit_slots(0..self.unbounded)
            || match self
                .bvh
                .visit_leaves_in_box(bounds, self.unbounded, &mut visit_slots)
            {
                Some(ended) => ended,
                None => visit_slots(self.unbounded..set.slots.len()),
            }
    }

    /// Whether queries of this geometry can skip the triangles in a [`RayEndTriangles`].
    pub fn can_skip_ray_ends(&self) -> bool {
        self.bvh.has_triangle_blocks()
    }

    /// Returns each triangle outside instances, with its object id and its primitive id.
    pub fn triangle_slots(&self) -> impl Iterator<Item = (TriangleSlot, u32, u32)> {
        (0..)
            .zip(&self.primitives.slots)
            .filter(|(_, slot)| slot.kind == PrimitiveKind::Triangle)
            .map(|(index, slot)| (TriangleSlot::new(index), slot.object, slot.primitive))
    }

    /// Returns the slots of the unbounded primitives that every query tests one by one, each with
    /// its index. Planes in rows are not among them.
    #[inline(always)]
    fn unbounded_slots(&self) -> impl Iterator<Item = (u32, &PrimitiveSlot)> {
        (self.planes as u32..).zip(&self.primitives.slots[self.planes..self.unbounded])
    }

    /// Returns the slots at the given positions of the accelerator, each with its index in the set.
    #[inline(always)]
    fn bounded_slots(&self, places: Range<usize>) -> impl Iterator<Item = (u32, &PrimitiveSlot)> {
        let range = self.unbounded + places.start..self.unbounded + places.end;
        (range.start as u32..).zip(&self.primitives.slots[range])
    }

    /// Intersects a ray with the primitive in a slot, which is given with its index. Returns the
    /// nearest hit in the range.
    #[inline(always)]
    fn intersect_primitive_in_slot<T: TraversalCounter>(
        &self,
        (slot, own_slot): (u32, &PrimitiveSlot),
        ray: &PreparedRay,
        range: Interval<R>,
        stats: &mut T,
    ) -> Option<SlotHit<R>> {
        let (index, side) = (
            own_slot.index as usize,
            own_slot.visibility.side.resolve_for_ray(ray.is_camera_ray),
        );
        stats.count(TraversalStats::ONE);
        let hit = match own_slot.kind {
            PrimitiveKind::Sphere => self.primitives.spheres[index].intersect(ray, range, side),
            PrimitiveKind::Triangle => self.triangle(index).intersect(ray, range, side),
            PrimitiveKind::Plane => self.primitives.planes[index].intersect(ray, range, side),
            PrimitiveKind::Shape => self.primitives.shapes[index].intersect(ray, range, side),
            PrimitiveKind::TransformedShape => {
                self.primitives.transformed_shapes[index].intersect(ray, range, side)
            }
            PrimitiveKind::Instance => {
                let slot_hit = self
                    .visit_instance(index, ray, ClosestHitQuery::new(range), stats)
                    .1
                    .slot_hit?;
                return Some(SlotHit {
                    slot,
                    inner: slot_hit.slot,
                    ..slot_hit
                });
            }
        };
        let ShapeHit { t, u, v } = hit?;
        Some(SlotHit {
            t,
            u,
            v,
            slot,
            inner: NO_INNER_SLOT,
        })
    }

    /// Prepares a ray for the tests of this geometry's primitives.
    #[inline(always)]
    pub(crate) fn prepare_ray(&self, ray: Ray<R>) -> PreparedRay {
        PreparedRay::from_ray(ray, self.has_faces)
    }

    /// Converts a hit identified by slots to a hit with object, primitive and instance ids.
    #[inline(always)]
    fn to_hit(
        &self,
        &SlotHit {
            t,
            u,
            v,
            slot,
            inner,
        }: &SlotHit<R>,
    ) -> Hit<R> {
        let own_slot = &self.primitives.slots[slot as usize];
        let slots = [slot, inner];
        if inner == NO_INNER_SLOT {
            let (object, primitive) = own_slot.tie_order();
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
        let part = &self.primitives.parts
            [self.primitives.instances[own_slot.index as usize].part as usize];
        let (object, primitive) = part.primitives.slots[inner as usize].tie_order();
        Hit {
            t,
            u,
            v,
            object,
            primitive,
            instance: own_slot.object,
            slots,
        }
    }
}
