//! A query as the data of a traversal: the accepted range, the ray, and the counts of work. Nothing
//! in this module depends on the scalar of the stored primitives. So each traversal is compiled
//! once, in this crate.

use super::row::RowHits;
use super::traversal_ray::RayReparametrisation;
use super::triangle8::LeafHeader;
use super::{MaskLanes, WIDTH};
use crate::ray::{Interval, Ray};
use crate::ray_ends::RayEndTriangles;
use crate::shapes::{PreparedRay, Transform, TriangleHit};
use crate::stats::TraversalStats;

/// Compile-time properties of a query's traversal.
pub(crate) trait TraversalMode {
    /// Whether any accepted hit ends the query. If so, children are visited in any order.
    const ANY: bool;
    /// Whether the ray is in f64 and rounded for the traversal: a ray in an instance's space, or a
    /// ray of a set stored in f64. If so:
    ///
    /// - Exact tests use [`TraversalQuery::prepared_ray`].
    /// - Every hit is passed to the visitor, since the primitives belong to an instance, or are
    ///   stored in f64.
    ///
    /// Otherwise the hit of an opaque primitive ends an any-hit query without a call of the
    /// visitor.
    const IS_RAY_ROUNDED: bool;
    /// Whether the traversal counts its work.
    const COUNTS: bool;
}

/// A [`TraversalMode`] whose properties are parameters of the type.
pub(super) struct StaticTraversalMode<const ANY: bool, const MAPPED: bool, const COUNTS: bool>;

impl<const ANY: bool, const MAPPED: bool, const COUNTS: bool> TraversalMode
    for StaticTraversalMode<ANY, MAPPED, COUNTS>
{
    const ANY: bool = ANY;
    const IS_RAY_ROUNDED: bool = MAPPED;
    const COUNTS: bool = COUNTS;
}

/// Source from which the ray for exact tests is prepared.
#[derive(Clone, Copy)]
pub(crate) enum RaySource<'a> {
    /// A stored ray, then whether to prepare it for triangles and quads too, then the triangles at
    /// its ends. The pointer to these triangles makes the enum no larger, since another variant
    /// also has two pointers.
    StoredRay(&'a Ray<f32>, bool, &'a RayEndTriangles),
    /// The object-to-world map of an instance, and the world-space ray to map.
    InInstance(&'a Transform, &'a PreparedRay),
    /// A ray that is already prepared.
    PreparedRay(&'a PreparedRay),
}

/// Receiver of a traversal's hits. Each method returns whether the traversal ends. It may also
/// shorten the range of the query.
pub(crate) trait HitVisitor {
    /// Handles a hit that SIMD lanes found within the range, of the primitive in `slot` (its record
    /// in the set). `u` and `v` are the shape-specific numbers of [`crate::Hit`].
    fn visit_hit(
        &mut self,
        query: &mut TraversalQuery<'_>,
        slot: u32,
        t: f32,
        u: f32,
        v: f32,
    ) -> bool;
    /// Tests the primitive at position `index` of the tree's order, which is in no block and no
    /// row.
    fn visit_single_primitive(&mut self, query: &mut TraversalQuery<'_>, index: usize) -> bool;
}

/// A query as the data of a traversal, independent of the scalar of the stored primitives.
pub(crate) struct TraversalQuery<'a> {
    /// Whether any accepted hit ends the query, see [`TraversalMode::ANY`].
    pub ends_at_any_hit: bool,
    /// Whether the traversal counts its work, see [`TraversalMode::COUNTS`].
    pub counts_work: bool,
    /// Open interval of accepted distances.
    pub range: Interval<f32>,
    /// Greatest distance at which a hit is accepted. In a closest-hit query, it becomes the distance
    /// of each closer hit.
    pub far: f32,
    /// Whether the ray is a camera ray, which passes through the inside of culled surfaces.
    pub is_camera_ray: bool,
    /// Source of `prepared_ray`.
    pub source: RaySource<'a>,
    /// The ray for exact tests, made from `source` at its first use.
    pub prepared_ray: Option<PreparedRay>,
    /// Conversion of distances to those of the traversal, for a ray in f64 that is rounded.
    pub reparametrisation: RayReparametrisation,
    /// Counts of this traversal's work, if `counts_work` is set.
    pub stats: TraversalStats,
}

impl TraversalQuery<'_> {
    /// Returns the ray for exact tests.
    #[inline(always)]
    pub fn prepared_ray(&mut self) -> &PreparedRay {
        match self.source {
            RaySource::PreparedRay(ray) => ray,
            RaySource::StoredRay(ray, faces, _) => self
                .prepared_ray
                .get_or_insert_with(|| PreparedRay::from_ray(*ray, faces)),
            RaySource::InInstance(transform, ray) => self
                .prepared_ray
                .get_or_insert_with(|| transform.ray_to_object(ray)),
        }
    }

    /// Returns the greatest accepted distance, in the distances of the traversal
    /// ([`RayReparametrisation`]).
    #[inline(always)]
    pub(super) fn max_distance<M: TraversalMode>(&self) -> f32 {
        if M::IS_RAY_ROUNDED {
            self.reparametrisation.traversal_far_distance(self.far)
        } else {
            self.far
        }
    }

    #[inline(always)]
    pub(super) fn count_node<M: TraversalMode>(&mut self) {
        if M::COUNTS {
            self.stats.nodes += 1;
        }
    }

    #[inline(always)]
    pub(super) fn count_leaf<M: TraversalMode>(&mut self, primitives: impl FnOnce() -> u8) {
        if M::COUNTS {
            self.stats.leaves += 1;
            self.stats.primitives += u64::from(primitives());
        }
    }

    /// Returns two masks of a leaf's lanes: the lanes that the query tests, and the lanes whose
    /// hits within the range end the traversal without a call of the visitor.
    #[inline(always)]
    fn leaf_lane_masks<M: TraversalMode>(leaf_header: &LeafHeader) -> [u8; 2] {
        if M::ANY && !M::IS_RAY_ROUNDED {
            [
                leaf_header.opaque | leaf_header.filtered,
                leaf_header.opaque,
            ]
        } else {
            [u8::MAX, 0]
        }
    }

    /// Returns two masks of a block's lanes: the lanes that the query tests, and the lanes whose
    /// hits, from either side, end the traversal without a call of the visitor.
    #[inline(always)]
    pub(super) fn block_lane_masks<M: TraversalMode>(&self, leaf_header: &LeafHeader) -> [u32; 2] {
        let [requested, ends] = Self::leaf_lane_masks::<M>(leaf_header);
        [
            requested.into(),
            if M::ANY {
                (ends & !(leaf_header.outside_only_lanes(self.is_camera_ray) | leaf_header.inside))
                    .into()
            } else {
                0
            },
        ]
    }

    /// Returns the mask of the block's triangles that are at the ends of the ray, see [`RayEndTriangles`].
    #[inline(always)]
    pub(super) fn ray_end_lanes<M: TraversalMode>(&self, leaf_header: &LeafHeader) -> u32 {
        match &self.source {
            RaySource::StoredRay(_, _, ends) if !M::IS_RAY_ROUNDED => {
                let start = ends.start.lane_mask(leaf_header.first);
                // Only shadow rays end before a surface.
                ends.target
                    .iter()
                    .take(if M::ANY { 2 } else { 0 })
                    .fold(start, |lanes, slot| {
                        lanes | slot.lane_mask(leaf_header.first)
                    })
            }
            _ => 0,
        }
    }

    /// Handles the hit of a triangle in a block. If its side and distance are accepted, passes it
    /// to the visitor. Returns whether the traversal ends.
    #[inline(always)]
    pub(super) fn visit_triangle_hit<M: TraversalMode>(
        &mut self,
        leaf_header: &LeafHeader,
        lane: usize,
        hit: &TriangleHit,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        if !(leaf_header.accepts_hit(lane, hit.from_outside, self.is_camera_ray)
            && self.range.contains(hit.t))
        {
            return false;
        }
        let ends = Self::leaf_lane_masks::<M>(leaf_header)[1] >> lane & 1 != 0;
        ends || visitor.visit_hit(
            self,
            leaf_header.first + lane as u32,
            hit.t,
            hit.weights[0],
            hit.weights[1],
        )
    }

    /// Handles the hits of a row of spheres or planes, all within the range, by passing them to the
    /// visitor. Returns whether the traversal ends.
    #[inline(always)]
    pub(super) fn visit_row_hits<M: TraversalMode>(
        &mut self,
        leaf_header: &LeafHeader,
        row_hits: &RowHits<[f32; WIDTH]>,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        let [requested, ends] = Self::leaf_lane_masks::<M>(leaf_header);
        row_hits.hits & u32::from(ends) != 0
            || MaskLanes(row_hits.hits & u32::from(requested)).any(|lane| {
                let v = if row_hits.exits >> lane & 1 == 0 {
                    0.0
                } else {
                    1.0
                };
                visitor.visit_hit(
                    self,
                    leaf_header.first + lane as u32,
                    row_hits.t[lane],
                    0.0,
                    v,
                )
            })
    }
}
