//! The narrow interface: closest hit and any hit over a set of primitives, by scan or by tree, with the same bits.
//!
//! A [`Group`] collects primitives; [`Geometry`] is the group with its accelerator. An instance is a primitive that holds
//! another geometry under an affine map, so a scene has two levels where it repeats something and one where it does not.

use core::mem::take;
use core::ops::ControlFlow;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::aabb::{Aabb, PaddedBox};
use crate::build::{BuildQuality, build};
use crate::ray::{Hit, Interval, Ray, Side};
use crate::scalar::{Precision, Real, Vec3Of, Vector, convert};
use crate::shapes::{AnyShape, Located, Parameters, Placed, Plane, Probe, Shape, ShapeHit, Sphere, Surface, Triangle};
use crate::transform::{Transform, transform_bounds};
use crate::tree::{MAX_LEAF, MAX_PRIMITIVES, Tally, Tree};

/// Why a primitive was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// A coordinate is NaN, infinite, or too large for a box in f32.
    #[error("a coordinate is not a finite number within ±3e38")]
    NotFinite,
    /// A transform can't be inverted.
    #[error("the transform can't be inverted")]
    Singular,
    /// More primitives than a tree can address.
    #[error("more than {MAX_PRIMITIVES} primitives in one set")]
    TooMany,
}

/// Which structure answers queries. Hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcceleratorKind {
    /// Every primitive is tested: the oracle, and the O(N) side of the benchmark.
    Linear,
    /// A bounding-volume hierarchy.
    Tree(BuildQuality),
}

impl Default for AcceleratorKind {
    fn default() -> Self {
        Self::Tree(BuildQuality::default())
    }
}

/// How a primitive takes part, besides its shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visibility {
    /// Which sides can be hit.
    pub side: Side,
    /// Whether any-hit queries see it.
    pub casts_shadow: bool,
}

impl Default for Visibility {
    fn default() -> Self {
        Self { side: Side::Both, casts_shadow: true }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Sphere,
    Triangle,
    Plane,
    Shape,
    Placed,
    Instance,
}

/// One primitive: its kind, its flags, and its place in the array of that kind.
#[derive(Clone, Copy, Debug)]
struct Entry {
    kind: Kind,
    visibility: Visibility,
    index: u32,
}

/// A primitive in the order of queries, with all that leads to its data: entries by id are for whoever has a hit.
#[derive(Clone, Copy, Debug)]
struct Slot {
    id: u32,
    entry: Entry,
}

/// Another geometry under an affine map.
#[derive(Clone, Debug)]
struct Instance<P: Precision> {
    geometry: Arc<Geometry<P>>,
    transform: Transform<P::Core>,
    bounds: Option<Aabb>,
}

/// Primitives in the order of their ids.
#[derive(Clone, Debug)]
pub struct Group<P: Precision> {
    entries: Vec<Entry>,
    spheres: Vec<Sphere<P::Real>>,
    triangles: Vec<Triangle<P::Real>>,
    planes: Vec<Plane<P::Real>>,
    /// The rarer shapes.
    shapes: Vec<AnyShape<P::Real>>,
    placed: Vec<Placed<P>>,
    instances: Vec<Instance<P>>,
}

impl<P: Precision> Default for Group<P> {
    fn default() -> Self {
        Self {
            entries: vec![],
            spheres: vec![],
            triangles: vec![],
            planes: vec![],
            shapes: vec![],
            placed: vec![],
            instances: vec![],
        }
    }
}

impl<P: Precision> Group<P> {
    /// Number of primitives; the next one's id.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is no primitive.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    fn push(&mut self, kind: Kind, visibility: Visibility, index: usize) -> Result<u32, GeometryError> {
        if self.entries.len() >= MAX_PRIMITIVES {
            return Err(GeometryError::TooMany);
        }
        self.entries.push(Entry { kind, visibility, index: index as u32 });
        Ok(self.entries.len() as u32 - 1)
    }

    /// Adds a sphere and returns its id.
    pub fn sphere(&mut self, sphere: Sphere<P::Real>, visibility: Visibility) -> Result<u32, GeometryError> {
        check_bounds(sphere.bounds())?;
        self.spheres.push(sphere);
        self.push(Kind::Sphere, visibility, self.spheres.len() - 1)
    }

    /// Adds a plane and returns its id.
    pub fn plane(&mut self, plane: Plane<P::Real>, visibility: Visibility) -> Result<u32, GeometryError> {
        if !(plane.point.is_finite() && plane.normal.is_finite()) {
            return Err(GeometryError::NotFinite);
        }
        self.planes.push(plane);
        self.push(Kind::Plane, visibility, self.planes.len() - 1)
    }

    /// Adds a triangle and returns its id.
    pub fn triangle(&mut self, vertices: [Vec3Of<P>; 3], visibility: Visibility) -> Result<u32, GeometryError> {
        let triangle = Triangle::new(vertices);
        check_bounds(triangle.bounds())?;
        self.triangles.push(triangle);
        self.push(Kind::Triangle, visibility, self.triangles.len() - 1)
    }

    /// The triangles added one by one, in their order.
    pub fn triangles(&self) -> &[Triangle<P::Real>] {
        &self.triangles
    }

    /// Adds any shape and returns its id.
    pub fn shape(&mut self, shape: AnyShape<P::Real>, visibility: Visibility) -> Result<u32, GeometryError> {
        match shape {
            AnyShape::Sphere(sphere) => self.sphere(sphere, visibility),
            AnyShape::Triangle(triangle) => self.triangle(triangle.vertices, visibility),
            AnyShape::Plane(plane) => self.plane(plane, visibility),
            shape if !shape.is_finite() => Err(GeometryError::NotFinite),
            shape => {
                self.shapes.push(shape);
                self.push(Kind::Shape, visibility, self.shapes.len() - 1)
            }
        }
    }

    /// Adds any shape under an affine map and returns its id.
    pub fn placed(&mut self, shape: AnyShape<P::Real>, to_world: DAffine3, visibility: Visibility) -> Result<u32, GeometryError> {
        if to_world == DAffine3::IDENTITY {
            return self.shape(shape, visibility);
        }
        if !shape.is_finite() {
            return Err(GeometryError::NotFinite);
        }
        let placed = Placed::new(shape, to_world).ok_or(GeometryError::Singular)?;
        check_bounds(placed.bounds())?;
        self.placed.push(placed);
        self.push(Kind::Placed, visibility, self.placed.len() - 1)
    }

    /// Adds another geometry under an affine map and returns its id.
    pub fn instance(
        &mut self,
        geometry: Arc<Geometry<P>>,
        to_world: DAffine3,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        let transform = Transform::new(to_world).ok_or(GeometryError::Singular)?;
        let bounds = geometry.bounds().map(|b| transform_bounds(&to_world, &b));
        if bounds.is_some_and(|b| !b.is_empty() && b.padded().is_none()) {
            return Err(GeometryError::NotFinite);
        }
        self.instances.push(Instance { geometry, transform, bounds });
        self.push(Kind::Instance, visibility, self.instances.len() - 1)
    }

    fn bounds(&self, entry: Entry) -> Option<Aabb> {
        let index = entry.index as usize;
        match entry.kind {
            Kind::Sphere => Shape::bounds(&self.spheres[index]),
            Kind::Triangle => Shape::bounds(&self.triangles[index]),
            Kind::Plane => None,
            Kind::Shape => Shape::bounds(&self.shapes[index]),
            Kind::Placed => self.placed[index].bounds(),
            Kind::Instance => self.instances[index].bounds,
        }
    }

    /// The box by which a tree may cull. The textbook formulas find hits beside their shapes, by a percent of the size where
    /// f32 solves the quartic of a torus; with room for that, tree and scan are wrong alike.
    fn reach(&self, entry: Entry, bounds: Aabb) -> Option<PaddedBox> {
        if P::ROBUST || matches!(entry.kind, Kind::Sphere | Kind::Triangle) {
            return bounds.padded();
        }
        let room = DVec3::splat(bounds.extent().max_element() / 32.0);
        Aabb { min: bounds.min - room, max: bounds.max + room }.padded().or_else(|| bounds.padded())
    }

    /// How many primitives are tested one by one as fast as by way of a node: a sphere's test is the cheapest there is.
    fn few(&self) -> usize {
        const SPHERES: usize = MAX_LEAF as usize;
        const OTHERS: usize = 2;
        if self.entries.len() == self.spheres.len() + self.planes.len() { SPHERES } else { OTHERS }
    }

    /// Puts the primitives that come in great numbers into the order of queries, so that what is tested one after the other
    /// lies side by side. Each of them has a slot, because none without a box was let in.
    fn follow(&mut self, slots: &mut [Slot]) {
        let (spheres, triangles) = (take(&mut self.spheres), take(&mut self.triangles));
        for slot in slots {
            let index = slot.entry.index as usize;
            let moved = match slot.entry.kind {
                Kind::Sphere => append(&mut self.spheres, spheres[index]),
                Kind::Triangle => append(&mut self.triangles, triangles[index]),
                _ => continue,
            };
            slot.entry.index = moved;
            self.entries[slot.id as usize].index = moved;
        }
    }

    /// The nearest hit of one primitive.
    #[inline(always)]
    fn test<T: Tally>(&self, slot: &Slot, probe: &Probe<P>, range: Interval<P::Real>, tally: &mut T) -> Option<Hit<P::Real>> {
        let Slot { id, entry } = *slot;
        let (index, side) = (entry.index as usize, entry.visibility.side);
        tally.primitive();
        let hit = match entry.kind {
            Kind::Sphere => self.spheres[index].intersect(probe, range, side),
            Kind::Triangle => self.triangles[index].intersect(probe, range, side),
            Kind::Plane => self.planes[index].intersect(probe, range, side),
            Kind::Shape => self.shapes[index].intersect(probe, range, side),
            Kind::Placed => self.placed[index].intersect(probe, range, side),
            Kind::Instance => return self.instances[index].closest(probe, range, id, tally),
        };
        hit.map(|ShapeHit { t, u, v }| Hit { t, u, v, primitive: id, instance: Hit::<P::Real>::NO_INSTANCE })
    }

    /// Shows one primitive's hit to an any-hit query; true when the query is over.
    #[inline(always)]
    fn offer<T: Tally>(
        &self,
        slot: &Slot,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        accept: &mut impl FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let entry = slot.entry;
        if !entry.visibility.casts_shadow {
            return false;
        }
        if entry.kind == Kind::Instance {
            return self.instances[entry.index as usize].any(probe, range, slot.id, &mut |hit| accept(hit), tally);
        }
        self.test(slot, probe, range, tally).is_some_and(|hit| accept(&hit))
    }

    fn locate(&self, probe: &Probe<P>, hit: &Hit<P::Real>) -> Located<P::Core> {
        let entry = self.entries[hit.order() as usize];
        let index = entry.index as usize;
        let local = ShapeHit { t: hit.t, u: hit.u, v: hit.v };
        match entry.kind {
            Kind::Sphere => self.spheres[index].locate(probe, local),
            Kind::Triangle => self.triangles[index].locate(probe, local),
            Kind::Plane => self.planes[index].locate(probe, local),
            Kind::Shape => self.shapes[index].locate(probe, local),
            Kind::Placed => self.placed[index].locate(probe, local),
            Kind::Instance => self.instances[index].locate(probe, hit),
        }
    }

    fn parameters(&self, probe: &Probe<P>, hit: &Hit<P::Real>) -> Parameters<P::Real> {
        let entry = self.entries[hit.order() as usize];
        let index = entry.index as usize;
        let local = ShapeHit { t: hit.t, u: hit.u, v: hit.v };
        match entry.kind {
            Kind::Sphere => self.spheres[index].parameters(probe, local),
            Kind::Triangle => self.triangles[index].parameters(probe, local),
            Kind::Plane => self.planes[index].parameters(probe, local),
            Kind::Shape => self.shapes[index].parameters(probe, local),
            Kind::Placed => self.placed[index].parameters(probe, local),
            Kind::Instance => self.instances[index].parameters(probe, hit),
        }
    }
}

/// Appends and says where.
fn append<T>(list: &mut Vec<T>, item: T) -> u32 {
    list.push(item);
    list.len() as u32 - 1
}

fn check_bounds(bounds: Option<Aabb>) -> Result<(), GeometryError> {
    match bounds {
        Some(b) if b.padded().is_none() => Err(GeometryError::NotFinite),
        _ => Ok(()),
    }
}

impl<P: Precision> Instance<P> {
    #[inline(never)]
    fn closest<T: Tally>(&self, probe: &Probe<P>, range: Interval<P::Real>, id: u32, tally: &mut T) -> Option<Hit<P::Real>> {
        let inner = self.transform.probe_to_object(probe);
        let hit = self.geometry.closest_probe::<T, true>(&inner, range, tally)?;
        Some(Hit { instance: id, ..hit })
    }

    #[inline(never)]
    fn any<T: Tally>(
        &self,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        id: u32,
        accept: &mut dyn FnMut(&Hit<P::Real>) -> bool,
        tally: &mut T,
    ) -> bool {
        let inner = self.transform.probe_to_object(probe);
        self.geometry.any_probe::<T, true>(&inner, range, &mut |hit| accept(&Hit { instance: id, ..*hit }), tally)
    }

    fn locate(&self, probe: &Probe<P>, hit: &Hit<P::Real>) -> Located<P::Core> {
        let inner = self.transform.probe_to_object(probe);
        self.transform.located_to_world(&self.geometry.group.locate(&inner, &own(hit)))
    }

    fn parameters(&self, probe: &Probe<P>, hit: &Hit<P::Real>) -> Parameters<P::Real> {
        let inner = self.transform.probe_to_object(probe);
        self.transform.parameters_to_world(&self.geometry.group.parameters(&inner, &own(hit)))
    }
}

/// The hit as the instanced geometry knows it.
fn own<R: Real>(hit: &Hit<R>) -> Hit<R> {
    Hit { instance: Hit::<R>::NO_INSTANCE, ..*hit }
}

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

#[derive(Clone, Debug)]
enum Accelerator {
    Linear,
    Tree(Tree),
}

impl<P: Precision> Geometry<P> {
    /// Builds the accelerator. Every primitive was checked when it was added, so this can't fail.
    pub fn new(mut group: Group<P>, kind: AcceleratorKind) -> Self {
        let (mut unbounded, mut bounded, mut boxes): (Vec<Slot>, Vec<Slot>, Vec<PaddedBox>) = Default::default();
        let mut bounds = Aabb::EMPTY;
        for (id, &entry) in group.entries.iter().enumerate() {
            let slot = Slot { id: id as u32, entry };
            match group.bounds(entry) {
                None => unbounded.push(slot),
                Some(b) => {
                    // An instance of an empty geometry has an empty box: nothing to test.
                    let Some(padded) = group.reach(entry, b) else { continue };
                    bounds = bounds.union(b);
                    bounded.push(slot);
                    boxes.push(padded);
                }
            }
        }
        let accelerator = match kind {
            AcceleratorKind::Linear => Accelerator::Linear,
            AcceleratorKind::Tree(quality) => {
                let (tree, order) = build(&boxes, quality, group.few());
                bounded = order.iter().map(|&place| bounded[place as usize]).collect();
                group.follow(&mut bounded);
                Accelerator::Tree(tree)
            }
        };
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
        self.group.instances.len()
    }

    /// Bytes of primitives and accelerator; shared geometry of instances is not counted here.
    pub fn bytes(&self) -> usize {
        let g = &self.group;
        let accelerator = match &self.accelerator {
            Accelerator::Linear => 0,
            Accelerator::Tree(tree) => tree.bytes(),
        };
        size_of_val(g.entries.as_slice())
            + size_of_val(g.spheres.as_slice())
            + size_of_val(g.triangles.as_slice())
            + size_of_val(g.planes.as_slice())
            + size_of_val(g.shapes.as_slice())
            + size_of_val(g.placed.as_slice())
            + size_of_val(g.instances.as_slice())
            + size_of_val(self.unbounded.as_slice())
            + size_of_val(self.bounded.as_slice())
            + accelerator
    }

    /// The nearest hit with `range.min < t < range.max`; of hits at the same distance the one of lowest id.
    #[inline]
    pub fn closest<T: Tally>(&self, ray: &Ray<P::Real>, range: Interval<P::Real>, tally: &mut T) -> Option<Hit<P::Real>> {
        self.closest_probe::<T, false>(&Probe::new(*ray), range, tally)
    }

    /// `INNER`: inside an instance. There the probe's stored copy was rounded once more, far from the object even by more
    /// than the boxes are padded, so the tree is walked with the core's copy.
    #[inline(always)]
    fn closest_probe<T: Tally, const INNER: bool>(
        &self,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Option<Hit<P::Real>> {
        let mut best = Closest { range, hit: None };
        for slot in &self.unbounded {
            best.consider(self.group.test(slot, probe, best.range, tally));
        }
        match &self.accelerator {
            Accelerator::Linear => {
                for slot in &self.bounded {
                    best.consider(self.group.test(slot, probe, best.range, tally));
                }
            }
            Accelerator::Tree(tree) if INNER => {
                let ray = Ray::<P::Core>::new(probe.origin, probe.direction);
                tree.walk::<P::Core, T>(&ray, widened::<P>(best.range), tally, |leaf, _, tally| {
                    for slot in &self.bounded[leaf] {
                        best.consider(self.group.test(slot, probe, best.range, tally));
                    }
                    ControlFlow::Continue(convert(best.range.max))
                });
            }
            Accelerator::Tree(tree) => {
                tree.walk::<P::Real, T>(&probe.ray, best.range, tally, |leaf, _, tally| {
                    for slot in &self.bounded[leaf] {
                        best.consider(self.group.test(slot, probe, best.range, tally));
                    }
                    ControlFlow::Continue(best.range.max)
                });
            }
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
    fn any_probe<T: Tally, const INNER: bool>(
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
        match &self.accelerator {
            Accelerator::Linear => found = self.bounded.iter().any(|slot| offer(slot, tally)),
            Accelerator::Tree(tree) if INNER => {
                let ray = Ray::<P::Core>::new(probe.origin, probe.direction);
                tree.walk::<P::Core, T>(&ray, widened::<P>(range), tally, |leaf, far, tally| {
                    found = self.bounded[leaf].iter().any(|slot| offer(slot, tally));
                    if found { ControlFlow::Break(()) } else { ControlFlow::Continue(far) }
                });
            }
            Accelerator::Tree(tree) => {
                tree.walk::<P::Real, T>(&probe.ray, range, tally, |leaf, far, tally| {
                    found = self.bounded[leaf].iter().any(|slot| offer(slot, tally));
                    if found { ControlFlow::Break(()) } else { ControlFlow::Continue(far) }
                });
            }
        }
        found
    }

    /// The surface at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn surface(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> Surface<P::Real> {
        self.group.locate(&Probe::new(*ray), hit).stored::<P>()
    }

    /// Texture coordinates at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn parameters(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> Parameters<P::Real> {
        self.group.parameters(&Probe::new(*ray), hit)
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
