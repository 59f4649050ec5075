//! A query as a traversal has it: where hits count, whose ray it is and what was counted, and what
//! takes its hits. Nothing here depends on the scalar that primitives are stored in, so each
//! traversal is compiled once, in this crate.

use super::row::RowHits;
use super::traversal_ray::RayReparametrisation;
use super::triangle8::LeafHeader;
use super::{Lanes, WIDTH};
use crate::ray::{Interval, Ray};
use crate::shapes::{PreparedRay, Transform, TriangleHit};
use crate::stats::TraversalStats;

/// What a traversal is compiled for.
pub(crate) trait TraversalMode {
    /// Whether any hit will do. Then children are visited in no order.
    const ANY: bool;
    /// Whether its ray was rounded, see [`super::TraversalRay::mapped`]: then the exact tests take
    /// [`TraversalQuery::prepared`]. What it comes to is shown by an instance, or stored in f64 and
    /// in no lanes, so that every hit is shown; otherwise opaque ones end a search for any.
    const MAPPED: bool;
    /// Whether it counts.
    const COUNTS: bool;
}

/// Each of them as a type.
pub(super) struct Mode<const ANY: bool, const MAPPED: bool, const COUNTS: bool>;

impl<const ANY: bool, const MAPPED: bool, const COUNTS: bool> TraversalMode
    for Mode<ANY, MAPPED, COUNTS>
{
    const ANY: bool = ANY;
    const MAPPED: bool = MAPPED;
    const COUNTS: bool = COUNTS;
}

/// From what the ray of exact tests is made.
#[derive(Clone, Copy)]
pub(crate) enum RaySource<'a> {
    /// A ray as it is stored, and whether it is prepared for faces too.
    Stored(&'a Ray<f32>, bool),
    /// A ray of the world, and the map of an instance.
    Under(&'a Transform, &'a PreparedRay),
    Prepared(&'a PreparedRay),
}

/// Takes the hits of a traversal. Each method says whether that ends it, and may bring the query's
/// ends nearer.
pub(crate) trait HitVisitor {
    /// A primitive in lanes is hit within the range.
    fn hit(&mut self, query: &mut TraversalQuery<'_>, slot: u32, t: f32, u: f32, v: f32) -> bool;
    /// A primitive is met that is tested alone.
    fn other(&mut self, query: &mut TraversalQuery<'_>, place: usize) -> bool;
}

/// A query as data.
pub(crate) struct TraversalQuery<'a> {
    /// See [`TraversalMode`].
    pub any: bool,
    pub counts: bool,
    /// Where hits count.
    pub range: Interval<f32>,
    /// The greatest distance that still counts.
    pub far: f32,
    /// Whether the ray passes backs that are culled.
    pub culls: bool,
    pub source: RaySource<'a>,
    /// Made from it once something asks.
    pub prepared: Option<PreparedRay>,
    /// How a traversal by a rounded ray counts distances.
    pub rebase: RayReparametrisation,
    pub stats: TraversalStats,
}

impl TraversalQuery<'_> {
    /// The ray as exact tests have it.
    #[inline(always)]
    pub fn prepared(&mut self) -> &PreparedRay {
        match self.source {
            RaySource::Prepared(ray) => ray,
            RaySource::Stored(ray, faces) => self
                .prepared
                .get_or_insert_with(|| PreparedRay::of(*ray, faces)),
            RaySource::Under(transform, ray) => self
                .prepared
                .get_or_insert_with(|| transform.probe_to_object(ray)),
        }
    }

    /// The greatest distance that still counts, as the traversal counts it.
    #[inline(always)]
    pub(super) fn far<M: TraversalMode>(&self) -> f32 {
        if M::MAPPED {
            self.rebase.far(self.far)
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

    /// The lanes of a leaf that matter, and those of which a hit within the range ends the
    /// traversal whatever it is.
    #[inline(always)]
    fn wanted<M: TraversalMode>(facts: &LeafHeader) -> [u8; 2] {
        if M::ANY && !M::MAPPED {
            [facts.opaque | facts.asks, facts.opaque]
        } else {
            [u8::MAX, 0]
        }
    }

    /// The same of a block, before it is known from which side a triangle is hit.
    #[inline(always)]
    pub(super) fn lanes<M: TraversalMode>(&self, facts: &LeafHeader) -> [u32; 2] {
        let [wanted, ends] = Self::wanted::<M>(facts);
        [
            wanted.into(),
            if M::ANY {
                (ends & !(facts.outside_alone(self.culls) | facts.inside)).into()
            } else {
                0
            },
        ]
    }

    /// A triangle of a block is hit at some distance. True ends the traversal.
    #[inline(always)]
    pub(super) fn triangle<M: TraversalMode>(
        &mut self,
        facts: &LeafHeader,
        lane: usize,
        hit: &TriangleHit,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        if !(facts.accepts(lane, hit.from_outside, self.culls) && self.range.contains(hit.t)) {
            return false;
        }
        let ends = Self::wanted::<M>(facts)[1] >> lane & 1 != 0;
        ends || visitor.hit(
            self,
            facts.first + lane as u32,
            hit.t,
            hit.weights[0],
            hit.weights[1],
        )
    }

    /// These of a row are hit within the range. True ends the traversal.
    #[inline(always)]
    pub(super) fn row<M: TraversalMode>(
        &mut self,
        facts: &LeafHeader,
        roots: &RowHits<[f32; WIDTH]>,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        let [wanted, ends] = Self::wanted::<M>(facts);
        roots.hits & u32::from(ends) != 0
            || Lanes(roots.hits & u32::from(wanted)).any(|lane| {
                let v = if roots.leaving >> lane & 1 == 0 {
                    0.0
                } else {
                    1.0
                };
                visitor.hit(self, facts.first + lane as u32, roots.t[lane], 0.0, v)
            })
    }
}
