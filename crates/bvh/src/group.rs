//! Primitives as they are collected, and the tests of each.

use core::mem::take;
use std::sync::Arc;

use glam::DAffine3;

use crate::aabb::Aabb;
use crate::admission::admitted;
use crate::error::GeometryError;
use crate::geometry::Geometry;
use crate::instance::Instance;
use crate::ray::{Hit, Interval, Visibility};
use crate::scalar::{Precision, Vec3Of, Vector};
use crate::shapes::{AnyShape, Located, Maps, Parameters, Placed, Plane, Probe, Shape, ShapeHit, Sphere, Triangle};
use crate::tally::Tally;
use crate::tree::MAX_PRIMITIVES;

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
pub(crate) struct Slot {
    id: u32,
    entry: Entry,
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
        let (entries, spheres, triangles, planes) = Default::default();
        Self { entries, spheres, triangles, planes, shapes: vec![], placed: vec![], instances: vec![] }
    }
}

impl<P: Precision> Group<P> {
    /// Bytes of a primitive of any kind, besides its data: its entry, and its slot in a geometry.
    pub(crate) const BYTES_EACH: usize = size_of::<Entry>() + size_of::<Slot>();

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

    /// Adds another geometry, which holds no instances itself, under an affine map and returns its id.
    pub fn instance(
        &mut self,
        geometry: Arc<Geometry<P>>,
        to_world: DAffine3,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        self.instances.push(Instance::new(geometry, to_world)?);
        self.push(Kind::Instance, visibility, self.instances.len() - 1)
    }

    /// All primitives with their boxes; none where one has no bounds.
    pub(crate) fn slots(&self) -> impl Iterator<Item = (Slot, Option<Aabb>)> {
        self.entries.iter().enumerate().map(|(id, &entry)| (Slot { id: id as u32, entry }, self.bounds(entry)))
    }

    /// How many instances there are.
    pub(crate) fn instance_count(&self) -> usize {
        self.instances.len()
    }

    /// Bytes of primitives.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.entries.as_slice())
            + size_of_val(self.spheres.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.planes.as_slice())
            + size_of_val(self.shapes.as_slice())
            + size_of_val(self.placed.as_slice())
            + size_of_val(self.instances.as_slice())
    }

    fn bounds(&self, entry: Entry) -> Option<Aabb> {
        let index = entry.index as usize;
        match entry.kind {
            Kind::Sphere => Shape::bounds(&self.spheres[index]),
            Kind::Triangle => Shape::bounds(&self.triangles[index]),
            Kind::Plane => None,
            Kind::Shape => Shape::bounds(&self.shapes[index]),
            Kind::Placed => self.placed[index].bounds(),
            Kind::Instance => self.instances[index].bounds(),
        }
    }

    /// As [`few`], for these primitives.
    pub(crate) fn few(&self) -> usize {
        few(self.entries.len() == self.spheres.len() + self.planes.len())
    }

    /// Puts the primitives that come in great numbers into the order of queries, so that what is tested one after the other
    /// lies side by side. Each of them has a slot, because none without a box was let in.
    pub(crate) fn follow(&mut self, slots: &mut [Slot]) {
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
    pub(crate) fn test<T: Tally>(
        &self,
        slot: &Slot,
        probe: &Probe<P>,
        range: Interval<P::Real>,
        tally: &mut T,
    ) -> Option<Hit<P::Real>> {
        let Slot { id, entry } = *slot;
        let (index, side) = (entry.index as usize, entry.visibility.side);
        tally.primitive();
        let hit = match entry.kind {
            Kind::Sphere => self.spheres[index].intersect(probe, range, side),
            Kind::Triangle => self.triangles[index].intersect(probe, range, side),
            Kind::Plane => self.planes[index].intersect(probe, range, side),
            Kind::Shape => self.shapes[index].intersect(probe, range, side),
            Kind::Placed => self.placed[index].intersect(probe, range, side),
            Kind::Instance => {
                let hit = self.instances[index].closest(probe, range, id, tally)?;
                return self.admit(entry, probe, range, hit);
            }
        };
        let ShapeHit { t, u, v } = hit?;
        self.admit(entry, probe, range, Hit { t, u, v, primitive: id, instance: Hit::<P::Real>::NO_INSTANCE })
    }

    /// The hit where and if it counts; see [`crate::admission`].
    #[inline(always)]
    fn admit(&self, entry: Entry, probe: &Probe<P>, range: Interval<P::Real>, hit: Hit<P::Real>) -> Option<Hit<P::Real>> {
        if P::ROBUST {
            return Some(hit);
        }
        admitted(self.bounds(entry), &probe.ray, range, hit.t).map(|t| Hit { t, ..hit })
    }

    /// Shows one primitive's hit to an any-hit query; true when the query is over.
    #[inline(always)]
    pub(crate) fn offer<T: Tally>(
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
            let mut accept = |hit: &Hit<P::Real>| self.admit(entry, probe, range, *hit).is_some_and(|hit| accept(&hit));
            return self.instances[entry.index as usize].any(probe, range, slot.id, &mut accept, tally);
        }
        self.test(slot, probe, range, tally).is_some_and(|hit| accept(&hit))
    }

    pub(crate) fn locate(&self, probe: &Probe<P>, hit: &Hit<P::Real>, maps: Option<Maps<'_, P::Core>>) -> Located<P::Core> {
        let entry = self.entries[hit.order() as usize];
        let index = entry.index as usize;
        let local = ShapeHit { t: hit.t, u: hit.u, v: hit.v };
        match entry.kind {
            Kind::Sphere => self.spheres[index].locate_under(probe, local, maps),
            Kind::Triangle => self.triangles[index].locate_under(probe, local, maps),
            Kind::Plane => self.planes[index].locate_under(probe, local, maps),
            Kind::Shape => self.shapes[index].locate_under(probe, local, maps),
            Kind::Placed => self.placed[index].locate_under(probe, local, maps),
            Kind::Instance => self.instances[index].locate(probe, hit),
        }
    }

    pub(crate) fn parameters(&self, probe: &Probe<P>, hit: &Hit<P::Real>) -> Parameters<P::Real> {
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

/// How many primitives are tested one by one as fast as by way of a node: a sphere's test is the cheapest there is, and a plane
/// has no box.
pub(crate) fn few(spheres_alone: bool) -> usize {
    const SPHERES: usize = 14;
    const OTHERS: usize = 2;
    if spheres_alone { SPHERES } else { OTHERS }
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
