//! A group with its accelerator, ready for queries.
//!
//! A [`Group`] collects primitives; [`Geometry`] is the group with its accelerator. An instance is a primitive that shows
//! another geometry under an affine map, so a scene has two levels where it repeats something and one where it does not.

use core::mem::take;

use crate::aabb::{Aabb, PaddedBox};
use crate::accelerator::{Accelerator, AcceleratorKind};
use crate::build::BuildWork;
use crate::group::{Group, Kind, Slot};
use crate::scalar::{Precision, Vector};
use crate::shapes::Triangle;
use crate::wide::{Kernel, Wide};

/// A group with its accelerator.
#[derive(Clone, Debug)]
pub struct Geometry<P: Precision> {
    /// Its slots: first those without bounds, which every query tests, then the others in the accelerator's order, then
    /// instances of nothing, which none does.
    pub(crate) group: Group<P>,
    pub(crate) unbounded: usize,
    /// How many of the first are planes in rows of the accelerator.
    pub(crate) planes: usize,
    pub(crate) accelerator: Accelerator,
    /// Whether some primitive is tested in the plane across the ray.
    pub(crate) faces: bool,
    bounds: Aabb,
}

impl<P: Precision> Geometry<P> {
    /// Builds the accelerator. Every primitive was checked when it was added, so this can't fail.
    ///
    /// # Panics
    /// Never: nothing gives the build up.
    pub fn new(group: Group<P>, kind: AcceleratorKind) -> Self {
        Self::unless(group, kind, &|| false).expect("no one gave the build up")
    }

    /// The same, given up where `stop` says so: none. It is asked between the passes of a build, from any thread of the pool; a
    /// pass of clustering or of reinsertion, once begun, goes to its end.
    pub fn unless(mut group: Group<P>, kind: AcceleratorKind, stop: &(dyn Fn() -> bool + Sync)) -> Option<Self> {
        let (mut slots, mut bounded, mut nothing): (Vec<Slot>, Vec<Slot>, Vec<Slot>) = Default::default();
        let mut boxes: Vec<PaddedBox> = Vec::with_capacity(group.len());
        let mut bounds = Aabb::EMPTY;
        for slot in take(&mut group.slots) {
            // An instance of an empty geometry has an empty box: nothing to test. What has a box that no tree can hold is
            // tested by every query, since nothing may vanish from a scene without a word.
            match group.bounds(&slot).map(|own| (own, own.padded())) {
                Some((own, _)) if own.is_empty() => nothing.push(slot),
                Some((own, Some(padded))) => {
                    bounds = bounds.union(own);
                    bounded.push(slot);
                    boxes.push(padded);
                }
                Some((_, None)) | None => slots.push(slot),
            }
        }
        let (unbounded, count) = (slots.len(), |kind: Kind| bounded.iter().filter(|slot| slot.kind == kind).count());
        let (spheres, triangles) = (count(Kind::Sphere), count(Kind::Triangle));
        let wide = P::WIDE && matches!(kind, AcceleratorKind::Tree(_));
        let others = bounded.len() - spheres - triangles;
        let (mut accelerator, order) = if wide && Wide::is_flat(spheres as u64, triangles as u64, others as u64) {
            bounded.sort_by_key(|slot| {
                [Kind::Triangle, Kind::Sphere].iter().position(|&kind| kind == slot.kind).map_or(2, |i| 1 - i)
            });
            (Accelerator::Wide(Wide::flat(spheres, triangles, others), BuildWork::default()), None)
        } else {
            let few = group.few(unbounded + bounded.len() + nothing.len());
            let is_triangle = |place: u32| bounded[place as usize].kind == Kind::Triangle;
            let triangles: Option<&dyn Fn(u32) -> bool> = if P::WIDE { Some(&is_triangle) } else { None };
            Accelerator::new(kind, &boxes, few, triangles, stop)?
        };
        drop(boxes);
        let planes = if matches!(accelerator, Accelerator::Wide(..)) { planes_first(&mut slots) } else { 0 };
        slots.reserve_exact(bounded.len() + nothing.len());
        match order {
            Some(order) => slots.extend(order.iter().map(|&place| bounded[place as usize])),
            None => slots.append(&mut bounded),
        }
        slots.append(&mut nothing);
        let faces = group.has_faces();
        group.follow(slots);
        if let Accelerator::Wide(wide, _) = &mut accelerator {
            group.move_triangles(wide, unbounded);
            let spheres = if wide.has_nodes() { 0 } else { spheres };
            group.make_rows(wide, planes, unbounded..unbounded + spheres);
        }
        Some(Self { faces, group, unbounded, planes, accelerator, bounds })
    }

    /// The box around everything bounded; none when something is without bounds.
    pub fn bounds(&self) -> Option<Aabb> {
        (self.unbounded == 0).then_some(self.bounds)
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
        self.unbounded
    }

    /// Number of instances.
    pub fn instance_count(&self) -> usize {
        self.group.instances.len()
    }

    /// Bytes of primitives and accelerators, those of what instances show included.
    pub fn bytes(&self) -> usize {
        self.group.bytes() + self.accelerator.bytes()
    }

    /// A triangle by its place in its array, wherever that is.
    #[inline(always)]
    pub(crate) fn triangle(&self, index: usize) -> Triangle<P::Real> {
        match &self.accelerator {
            Accelerator::Wide(wide, _) => {
                Triangle { vertices: wide.triangle(index as u32).vertices.map(|v| Vector::from_f64(v.as_dvec3())) }
            }
            _ => self.group.triangles[index],
        }
    }

    /// Which code walks the tree; none where there is no wide one.
    pub fn kernel(&self) -> Option<Kernel> {
        match &self.accelerator {
            Accelerator::Wide(wide, _) => Some(wide.kernel()),
            _ => None,
        }
    }

    /// Lets other code walk the tree, here and in what instances show: for comparisons, since hits are the same. One that the
    /// processor can't run is as [`Kernel::Portable`].
    pub fn set_kernel(&mut self, kernel: Kernel) {
        if let Accelerator::Wide(wide, _) = &mut self.accelerator {
            wide.set_kernel(kernel);
        }
        self.group.parts.iter_mut().for_each(|part| part.set_kernel(kernel));
    }

    /// What building the tree took; none for a scan.
    pub fn build_work(&self) -> Option<BuildWork> {
        self.accelerator.work()
    }
}

/// Puts planes before what else has no bounds. How many there are.
fn planes_first(slots: &mut [Slot]) -> usize {
    slots.sort_by_key(|slot| slot.kind != Kind::Plane);
    slots.iter().take_while(|slot| slot.kind == Kind::Plane).count()
}
