//! The kinds of queries: the closest hit, and any hit that is accepted.

use super::SlotHit;
use crate::bvh8::LeafHeader;
use crate::geometry::Geometry;
use crate::primitive_set::{Kind, Slot};
use crate::ray::{Interval, Occlusion};
use crate::scalar::Real;
use crate::shapes::PreparedRay;
use crate::stats::TraversalCounter;

/// A kind of query: what it takes of a leaf, and what it makes of a hit.
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
    /// The lanes of a leaf that matter, and those of them any hit of which ends the query: all and none unless said otherwise.
    #[inline(always)]
    fn lanes(_facts: &LeafHeader) -> [u8; 2] {
        [u8::MAX, 0]
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
        geometry.test(slot, ray, self.range(), tally).is_some_and(|found| self.take(geometry, found))
    }
}

/// The running answer of a closest-hit query. `range.max` is kept one step above the best distance, so that a hit at exactly
/// the same distance is still seen and the lower one can win.
///
/// Distances that are rounded to f32 are equal of themselves where surfaces lie in one place. In f64 each shape's test leaves last digits of
/// its own, and now the one would win and now the other. There `range.max` is kept as far beyond as rounding may reach, and whether
/// another hit came so close is kept too.
pub(super) struct ClosestHit<R: Real> {
    pub range: Interval<R>,
    pub found: Option<SlotHit<R>>,
    /// Greatest coordinate of the ray's origin in lengths of its direction, as distances are, where equal distances may differ.
    pub origin: R,
    pub is_contested: bool,
}

impl<R: Real> ClosestHit<R> {
    /// Of what distances and coordinates are, what equal distances differ by at most: some hundred roundings of f64, which a ray within two
    /// degrees of a surface makes of a test's ten.
    const EQUAL: f64 = 1.0 / (1_u64 << 44) as f64;

    #[inline(always)]
    pub fn new(range: Interval<R>) -> Self {
        Self { range, found: None, origin: R::ZERO, is_contested: false }
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
        self.found.as_ref().map_or_else(|| self.range.max.next_down(), |found| found.t)
    }
    #[inline(always)]
    fn in_space_of(self, ray: &PreparedRay) -> Self {
        if R::IS_SINGLE {
            return self;
        }
        Self { origin: R::from_f64(ray.origin.abs().max_element() * ray.inverse_length_squared.sqrt()), ..self }
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
            let equal = if is_exact { found.t + self.slack(found.t) } else { found.t };
            self.range.max = if is_exact { self.range.max.min(equal.next_up()) } else { equal.next_up() };
            self.found = Some(found);
        }
        false
    }
}

/// Any hit that is accepted. `BY_VISIBILITY`: by what its object is to such queries, so that an opaque one is not shown first; otherwise each
/// hit is shown, as in an instance, whose own visibility decides.
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
    fn lanes(facts: &LeafHeader) -> [u8; 2] {
        if BY_VISIBILITY { [facts.opaque | facts.asks, facts.opaque] } else { [u8::MAX, 0] }
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
            let mut accepts = |found: SlotHit<R>| accepts(SlotHit { slot: slot.0, inner: found.slot, ..found });
            let query = AnyHit::<_, false> { range, accept: &mut accepts };
            return geometry.visit_instance(own.index as usize, ray, query, tally).0;
        }
        geometry.test(slot, ray, range, tally).is_some_and(accepts)
    }
}
