//! The two kinds of queries: closest hit, and any accepted hit.

use super::SlotHit;
use crate::geometry::Geometry;
use crate::ray::{Interval, Occlusion};
use crate::scalar::Real;
use crate::shapes::PreparedRay;
use crate::slot::{PrimitiveKind, PrimitiveSlot};
use crate::stats::TraversalCounter;

/// Kind of query: closest hit or any hit, with its state and its reaction to a hit.
pub(super) trait QueryKind<R: Real>: Sized {
    /// Whether an accepted hit ends the query.
    const ANY: bool;
    /// Open interval of accepted distances.
    fn range(&self) -> Interval<R>;
    /// Greatest accepted distance.
    fn max_distance(&self) -> R;
    /// Adapts the query to a ray that was mapped into the space of an instance.
    #[inline(always)]
    fn adapt_to_mapped_ray(self, _ray: &PreparedRay) -> Self {
        self
    }
    /// Handles a hit within the range. Returns whether the query ends.
    fn accept_hit(&mut self, geometry: &Geometry<R>, slot_hit: SlotHit<R>) -> bool;
    /// Tests one primitive and handles its hit, if any. Returns whether the query ends.
    #[inline(always)]
    fn test_primitive<T: TraversalCounter>(
        &mut self,
        geometry: &Geometry<R>,
        slot: (u32, &PrimitiveSlot),
        ray: &PreparedRay,
        stats: &mut T,
    ) -> bool {
        geometry
            .intersect_primitive_in_slot(slot, ray, self.range(), stats)
            .is_some_and(|slot_hit| self.accept_hit(geometry, slot_hit))
    }
}

/// State of a closest-hit query. `range.max` is kept one step above the best distance: a hit at
/// equal distance is still found, and the lower id can win.
///
/// Distances rounded to f32 are equal if surfaces coincide. In f64 the last digits of a distance
/// depend on the shape's test, so either of two coincident surfaces could win. For f64, `range.max`
/// is therefore kept as far beyond the best distance as rounding may reach. `is_contested` records
/// whether another hit came that close.
pub(super) struct ClosestHitQuery<R: Real> {
    pub range: Interval<R>,
    pub slot_hit: Option<SlotHit<R>>,
    /// Greatest coordinate of the ray's origin, in units of distance (lengths of the direction).
    /// Zero for f32.
    pub origin_size: R,
    pub is_contested: bool,
}

impl<R: Real> ClosestHitQuery<R> {
    /// Greatest relative difference of distances that count as equal: some hundred roundings of
    /// f64. An intersection test makes about ten, and a ray within two degrees of a surface
    /// multiplies them.
    const TIE_RATIO: f64 = 1.0 / (1_u64 << 44) as f64;

    /// Creates a query without a hit in a range of distances.
    #[inline(always)]
    pub fn new(range: Interval<R>) -> Self {
        Self {
            range,
            slot_hit: None,
            origin_size: R::ZERO,
            is_contested: false,
        }
    }

    /// Greatest difference from `t` of a distance that equals `t` up to rounding.
    #[inline(always)]
    fn tie_tolerance(&self, t: R) -> R {
        (self.origin_size + t.abs()) * R::from_f64(Self::TIE_RATIO)
    }
}

impl<R: Real> QueryKind<R> for ClosestHitQuery<R> {
    const ANY: bool = false;

    #[inline(always)]
    fn range(&self) -> Interval<R> {
        self.range
    }
    #[inline(always)]
    fn max_distance(&self) -> R {
        // In f64, hits slightly beyond the nearest hit count too.
        if !R::IS_SINGLE {
            return self.range.max;
        }
        self.slot_hit
            .as_ref()
            .map_or_else(|| self.range.max.next_down(), |slot_hit| slot_hit.t)
    }
    #[inline(always)]
    fn adapt_to_mapped_ray(self, ray: &PreparedRay) -> Self {
        if R::IS_SINGLE {
            return self;
        }
        Self {
            origin_size: R::from_f64(
                ray.origin.abs().max_element() * ray.inverse_length_squared.sqrt(),
            ),
            ..self
        }
    }
    #[inline(always)]
    fn accept_hit(&mut self, geometry: &Geometry<R>, slot_hit: SlotHit<R>) -> bool {
        let order =
            |slot_hit: &SlotHit<R>| geometry.primitives.slots[slot_hit.slot as usize].tie_order();
        // Whether distances are stored in f64, without rounding to f32.
        let is_exact = !R::IS_SINGLE;
        if is_exact && let Some(best) = &self.slot_hit {
            self.is_contested |= (slot_hit.t - best.t).abs() <= self.tie_tolerance(best.t);
        }
        let better = match &self.slot_hit {
            None => true,
            Some(best) => {
                slot_hit.t < best.t || (slot_hit.t == best.t && order(&slot_hit) < order(best))
            }
        };
        if better {
            let equal = if is_exact {
                slot_hit.t + self.tie_tolerance(slot_hit.t)
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
pub(super) struct AnyHitQuery<'f, R: Real, const BY_VISIBILITY: bool> {
    pub range: Interval<R>,
    pub accept: &'f mut dyn FnMut(SlotHit<R>) -> bool,
}

impl<R: Real, const BY_VISIBILITY: bool> QueryKind<R> for AnyHitQuery<'_, R, BY_VISIBILITY> {
    const ANY: bool = true;

    #[inline(always)]
    fn range(&self) -> Interval<R> {
        self.range
    }
    #[inline(always)]
    fn max_distance(&self) -> R {
        self.range.max.next_down()
    }
    #[inline(always)]
    fn accept_hit(&mut self, _: &Geometry<R>, slot_hit: SlotHit<R>) -> bool {
        (self.accept)(slot_hit)
    }
    #[inline(always)]
    fn test_primitive<T: TraversalCounter>(
        &mut self,
        geometry: &Geometry<R>,
        slot: (u32, &PrimitiveSlot),
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
            let query = AnyHitQuery::<_, false> {
                range,
                accept: &mut accepts,
            };
            return geometry
                .visit_instance(own_slot.index as usize, ray, query, stats)
                .0;
        }
        geometry
            .intersect_primitive_in_slot(slot, ray, range, stats)
            .is_some_and(accepts)
    }
}
