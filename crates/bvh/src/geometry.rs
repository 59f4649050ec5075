//! The narrow interface: closest hit and any hit over a set of primitives, whatever structure answers, with the same bits.
//!
//! A [`Group`] collects primitives; [`Geometry`] is the group with its accelerator. An instance is a primitive that holds
//! another geometry under an affine map, so a scene has two levels where it repeats something and one where it does not.

use core::ops::ControlFlow;

use crate::aabb::{Aabb, PaddedBox};
use crate::accelerator::Accelerator;
use crate::build::BuildWork;
use crate::group::Slot;
use crate::ray::{Hit, Interval, Ray};
use crate::scalar::{Precision, Real, convert};
use crate::shapes::{Located, Maps, Parameters, Probe, Surface};
use crate::tally::Tally;

pub use crate::accelerator::AcceleratorKind;
pub use crate::error::GeometryError;
pub use crate::group::Group;
pub use crate::ray::Visibility;

/// A group with its accelerator.
#[derive(Clone, Debug)]
pub struct Geometry<P: Precision> {
    group: Group<P>,
    /// Without bounds, tested by every query.
    unbounded: Vec<Slot>,
    /// The others, in the accelerator's order.
    bounded: Vec<Slot>,
    accelerator: Accelerator,
    bounds: Aabb,
}

impl<P: Precision> Geometry<P> {
    /// Builds the accelerator. Every primitive was checked when it was added, so this can't fail.
    pub fn new(mut group: Group<P>, kind: AcceleratorKind) -> Self {
        let (mut unbounded, mut bounded, mut boxes): (Vec<Slot>, Vec<Slot>, Vec<PaddedBox>) = Default::default();
        let mut bounds = Aabb::EMPTY;
        for (slot, own) in group.slots() {
            // An instance of an empty geometry has an empty box: nothing to test. What has a box that no tree can hold is
            // tested by every query, since nothing may vanish from a scene without a word.
            match own {
                Some(b) if b.is_empty() => {}
                Some(b) => match b.padded() {
                    Some(padded) => {
                        bounds = bounds.union(b);
                        bounded.push(slot);
                        boxes.push(padded);
                    }
                    None => unbounded.push(slot),
                },
                None => unbounded.push(slot),
            }
        }
        let (accelerator, order) = Accelerator::new(kind, &boxes, group.few());
        if let Some(order) = order {
            bounded = order.iter().map(|&place| bounded[place as usize]).collect();
            group.follow(&mut bounded);
        }
        Self { group, unbounded, bounded, accelerator, bounds }
    }

    /// The box around everything bounded; none when something is without bounds.
    pub fn bounds(&self) -> Option<Aabb> {
        self.unbounded.is_empty().then_some(self.bounds)
    }

    /// The box around everything bounded, whatever else there is; empty when there is nothing.
    pub fn bounded_part(&self) -> Aabb {
        self.bounds
    }

    /// Number of primitives, an instance counting as one.
    pub fn len(&self) -> usize {
        self.group.len()
    }

    /// Whether there is nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.group.is_empty()
    }

    /// Number of primitives without bounds, which every query tests.
    pub fn unbounded_count(&self) -> usize {
        self.unbounded.len()
    }

    /// Number of instances.
    pub fn instance_count(&self) -> usize {
        self.group.instance_count()
    }

    /// Bytes of primitives and accelerator; shared geometry of instances is not counted here.
    pub fn bytes(&self) -> usize {
        self.group.bytes()
            + size_of_val(self.unbounded.as_slice())
            + size_of_val(self.bounded.as_slice())
            + self.accelerator.bytes()
    }

    /// What building the tree took; none for a scan.
    pub fn build_work(&self) -> Option<BuildWork> {
        self.accelerator.work()
    }

    /// The nearest hit with `range.min < t < range.max`; of hits at the same distance the one of lowest id.
    #[inline(always)]
    pub fn closest<T: Tally>(&self, ray: &Ray<P::Real>, range: Interval<P::Real>, tally: &mut T) -> Option<Hit<P::Real>> {
        self.closest_probe::<T, false>(&Probe::new(*ray), range, tally)
    }

    /// `INNER`: inside an instance. There the probe's stored copy was rounded once more, far from the object even by more
    /// than the boxes are padded, so the tree is walked with the core's copy.
    #[inline(always)]
    pub(crate) fn closest_probe<T: Tally, const INNER: bool>(
        &self,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Option<Hit<P::Real>> {
        let mut best = Closest { range, hit: None };
        for slot in &self.unbounded {
            best.consider(self.group.test(slot, probe, best.range, tally));
        }
        if INNER {
            let ray = Ray::<P::Core>::new(probe.origin, probe.direction);
            self.accelerator.walk(&ray, widened::<P>(best.range), tally, |places, _, tally| {
                for slot in &self.bounded[places] {
                    best.consider(self.group.test(slot, probe, best.range, tally));
                }
                ControlFlow::Continue(convert(best.range.max))
            });
        } else {
            self.accelerator.walk(&probe.ray, best.range, tally, |places, _, tally| {
                for slot in &self.bounded[places] {
                    best.consider(self.group.test(slot, probe, best.range, tally));
                }
                ControlFlow::Continue(best.range.max)
            });
        }
        best.hit
    }

    /// Whether `accept` says yes to some hit with `range.min < t < range.max` of a primitive that casts shadows. The order
    /// of calls is free; a hit that `accept` refuses does not stop the search. A primitive of the scene's own set is
    /// offered once, at its nearest hit; of an instance, each primitive in it.
    #[inline]
    pub fn any<T: Tally>(
        &self,
        ray: &Ray<P::Real>,
        range: Interval<P::Real>,
        mut accept: impl FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        self.any_probe::<T, false>(&Probe::new(*ray), range, &mut accept, tally)
    }

    #[inline(always)]
    pub(crate) fn any_probe<T: Tally, const INNER: bool>(
        &self,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        accept: &mut impl FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let mut offer = |slot: &Slot, tally: &mut T| self.group.offer(slot, probe, range, accept, tally);
        if self.unbounded.iter().any(|slot| offer(slot, tally)) {
            return true;
        }
        let mut found = false;
        if INNER {
            let ray = Ray::<P::Core>::new(probe.origin, probe.direction);
            self.accelerator.walk(&ray, widened::<P>(range), tally, |places, far, tally| {
                found = self.bounded[places].iter().any(|slot| offer(slot, tally));
                if found { ControlFlow::Break(()) } else { ControlFlow::Continue(far) }
            });
        } else {
            self.accelerator.walk(&probe.ray, range, tally, |places, far, tally| {
                found = self.bounded[places].iter().any(|slot| offer(slot, tally));
                if found { ControlFlow::Break(()) } else { ControlFlow::Continue(far) }
            });
        }
        found
    }

    /// Where a probe of this geometry's own space, which is under these maps, met it, in the core's scalar.
    pub(crate) fn locate(&self, probe: &Probe<P>, hit: &Hit<P::Real>, maps: Option<Maps<'_, P::Core>>) -> Located<P::Core> {
        self.group.locate(probe, hit, maps)
    }

    /// The surface at a hit that this geometry returned for the same ray, before it is rounded to the stored scalar.
    #[inline]
    pub fn located(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> Located<P::Core> {
        self.locate(&Probe::new(*ray), hit, None)
    }

    /// The surface at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn surface(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> Surface<P::Real> {
        self.located(ray, hit).stored::<P>()
    }

    /// Texture coordinates for a probe of this geometry's own space.
    pub(crate) fn parameters_probe(&self, probe: &Probe<P>, hit: &Hit<P::Real>) -> Parameters<P::Real> {
        self.group.parameters(probe, hit)
    }

    /// Texture coordinates at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn parameters(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> Parameters<P::Real> {
        self.parameters_probe(&Probe::new(*ray), hit)
    }
}

/// A range of stored distances in the core's scalar.
fn widened<P: Precision>(range: Interval<P::Real>) -> Interval<P::Core> {
    Interval { min: convert(range.min), max: convert(range.max) }
}

/// The running answer of a closest-hit query. `range.max` is kept one step above the best distance, so that a hit at exactly
/// the same distance is still seen and the lower id can win.
struct Closest<R: Real> {
    range: Interval<R>,
    hit: Option<Hit<R>>,
}

impl<R: Real> Closest<R> {
    #[inline(always)]
    fn consider(&mut self, candidate: Option<Hit<R>>) {
        let Some(hit) = candidate else { return };
        let better = match &self.hit {
            None => true,
            Some(best) => hit.t < best.t || (hit.t == best.t && hit.order() < best.order()),
        };
        if better {
            self.range.max = hit.t.next_up();
            self.hit = Some(hit);
        }
    }
}
