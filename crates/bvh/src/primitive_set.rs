//! Primitives as they are collected, object by object.

mod leaves;

use glam::DAffine3;

use crate::aabb::Aabb;
use crate::error::{GeometryError, check_bounds};
use crate::geometry::Geometry;
use crate::instance::Instance;
use crate::memory::huge_page_vec;
use crate::motion::Motion;
use crate::ray::Visibility;
use crate::scalar::{Real, Vector};
use crate::shapes::{AnyShape, Plane, Shape, Sphere, Transform, TransformedShape, Triangle};
use crate::slot::{Kind, MAX_PRIMITIVES, Slot};

/// Primitives by kind, and what shows them. An object is a shape, a mesh or an instance.
#[derive(Clone, Debug, Default)]
pub struct PrimitiveSet<R: Real> {
    /// As they were added; once there is an accelerator, in its order.
    pub(crate) slots: Vec<Slot>,
    objects: u32,
    pub(crate) spheres: Vec<Sphere<R>>,
    pub(crate) triangles: Vec<Triangle<R>>,
    pub(crate) planes: Vec<Plane<R>>,
    /// The rarer shapes.
    pub(crate) shapes: Vec<AnyShape<R>>,
    pub(crate) placed: Vec<TransformedShape<R>>,
    pub(crate) instances: Vec<Instance>,
    /// Of the instances that move: nothing where none does.
    pub(crate) motions: Vec<Motion>,
    /// What instances show.
    pub(crate) parts: Vec<Geometry<R>>,
}

impl<R: Real> PrimitiveSet<R> {
    /// Bytes of a primitive of any kind, besides its data.
    pub(crate) const BYTES_EACH: usize = size_of::<Slot>();

    /// The map of an instance at a ray's time, its own, or where it moves one that is put into
    /// `room`, and what it shows.
    #[inline(always)]
    pub(crate) fn shown<'a>(
        &'a self,
        instance: &'a Instance,
        time: f64,
        room: &'a mut Option<Transform>,
    ) -> (&'a Transform, &'a Geometry<R>) {
        let transform = match self.motions.get(instance.motion as usize) {
            None => &instance.transform,
            Some(motion) => room.insert(motion.at(time)),
        };
        (transform, &self.parts[instance.part as usize])
    }

    /// Number of primitives, an instance counting as one.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Whether there is no primitive.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Number of objects; the next one's id.
    pub fn objects(&self) -> usize {
        self.objects as usize
    }

    /// Ends an object of one primitive and returns its id.
    fn single(
        &mut self,
        kind: Kind,
        visibility: Visibility,
        index: usize,
    ) -> Result<u32, GeometryError> {
        self.push(kind, visibility, 0, index)?;
        self.objects += 1;
        Ok(self.objects - 1)
    }

    fn push(
        &mut self,
        kind: Kind,
        visibility: Visibility,
        primitive: usize,
        index: usize,
    ) -> Result<(), GeometryError> {
        if self.slots.len() >= MAX_PRIMITIVES {
            return Err(GeometryError::TooMany);
        }
        self.slots.push(Slot {
            object: self.objects,
            primitive: primitive as u32,
            index: index as u32,
            kind,
            visibility,
        });
        Ok(())
    }

    /// Adds a sphere and returns its id, as of any object.
    pub fn sphere(
        &mut self,
        sphere: Sphere<R>,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        check_bounds(sphere.bounds())?;
        self.spheres.push(sphere);
        self.single(Kind::Sphere, visibility, self.spheres.len() - 1)
    }

    /// Adds a plane and returns its id.
    pub fn plane(&mut self, plane: Plane<R>, visibility: Visibility) -> Result<u32, GeometryError> {
        if !(plane.point.is_finite() && plane.normal.is_finite()) {
            return Err(GeometryError::NotFinite);
        }
        self.planes.push(plane);
        self.single(Kind::Plane, visibility, self.planes.len() - 1)
    }

    /// Adds a single triangle and returns its id.
    pub fn triangle(
        &mut self,
        vertices: [R::Vec3; 3],
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        self.mesh([vertices], visibility)
    }

    /// Makes room for so many more triangles, where they come from an iterator that can't say how
    /// many they will be.
    pub fn reserve_triangles(&mut self, count: usize) {
        fn reserve<T>(list: &mut Vec<T>, count: usize) {
            if list.is_empty() && list.capacity() < count {
                *list = huge_page_vec(count);
            }
            list.reserve(count);
        }
        let count = count.min(MAX_PRIMITIVES);
        reserve(&mut self.slots, count);
        reserve(&mut self.triangles, count);
    }

    /// Adds any number of triangles as one object, none included, and returns its id. They are its
    /// primitives, in their order.
    ///
    /// # Errors
    /// Where one is refused, none of them is added.
    pub fn mesh(
        &mut self,
        triangles: impl IntoIterator<Item = [R::Vec3; 3]>,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        let before = (self.slots.len(), self.triangles.len());
        let triangles = triangles.into_iter();
        self.reserve_triangles(triangles.size_hint().0);
        for (primitive, vertices) in triangles.enumerate() {
            let triangle = Triangle::new(vertices);
            self.triangles.push(triangle);
            let added = check_corners(&triangle).and_then(|()| {
                self.push(
                    Kind::Triangle,
                    visibility,
                    primitive,
                    self.triangles.len() - 1,
                )
            });
            if let Err(refused) = added {
                self.slots.truncate(before.0);
                self.triangles.truncate(before.1);
                return Err(refused);
            }
        }
        self.objects += 1;
        Ok(self.objects - 1)
    }

    /// The triangles of meshes, in the order in which they were added.
    pub fn triangles(&self) -> &[Triangle<R>] {
        &self.triangles
    }

    /// Adds any shape and returns its id.
    pub fn shape(
        &mut self,
        shape: AnyShape<R>,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        match shape {
            AnyShape::Sphere(sphere) => self.sphere(sphere, visibility),
            AnyShape::Triangle(triangle) => self.triangle(triangle.vertices, visibility),
            AnyShape::Plane(plane) => self.plane(plane, visibility),
            shape if !shape.is_finite() => Err(GeometryError::NotFinite),
            shape => {
                self.shapes.push(shape);
                self.single(Kind::Shape, visibility, self.shapes.len() - 1)
            }
        }
    }

    /// Adds any shape under an affine map and returns its id.
    pub fn placed(
        &mut self,
        shape: AnyShape<R>,
        to_world: DAffine3,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        if to_world == DAffine3::IDENTITY {
            return self.shape(shape, visibility);
        }
        if !shape.is_finite() {
            return Err(GeometryError::NotFinite);
        }
        let placed = TransformedShape::new(shape, to_world).ok_or(GeometryError::Singular)?;
        check_bounds(placed.bounds())?;
        self.placed.push(placed);
        self.single(Kind::TransformedShape, visibility, self.placed.len() - 1)
    }

    /// Takes in a geometry for instances to show, and returns its number for
    /// [`PrimitiveSet::instance`].
    ///
    /// # Errors
    /// [`GeometryError::Nested`] where it holds instances itself: a hit names one instance, so
    /// there would be no way back to what was hit.
    pub fn part(&mut self, geometry: Geometry<R>) -> Result<u32, GeometryError> {
        if geometry.instance_count() > 0 {
            return Err(GeometryError::Nested);
        }
        self.parts.push(geometry);
        Ok(self.parts.len() as u32 - 1)
    }

    /// Shows a part under an affine map, as one object, and returns its id. How it takes part in
    /// any-hit queries is told by the instance, whatever the objects in the part say; which sides
    /// can be hit, by those.
    pub fn instance(
        &mut self,
        part: u32,
        to_world: DAffine3,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        self.moving(part, [to_world; 2], visibility)
    }

    /// Shows a part under a map that runs from the first, where a ray's time is 0, to the second,
    /// where it is 1, each entry of it linearly; otherwise as [`PrimitiveSet::instance`], which
    /// this is where both are the same. So each point goes along a straight line at a constant
    /// speed: what turns is smaller on the way, halfway by the cosine of half the angle across the
    /// axis.
    ///
    /// # Errors
    /// [`GeometryError::SingularOnTheWay`] where the map can't be inverted, or can't be told from
    /// one that can't, at any time from 0 to 1, as halfway through half a turn.
    pub fn moving(
        &mut self,
        part: u32,
        to_world: [DAffine3; 2],
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        let bounds = self
            .parts
            .get(part as usize)
            .ok_or(GeometryError::NoPart)?
            .bounds();
        let instance = if to_world[0] == to_world[1] {
            Instance::new(part, bounds, to_world[0])?
        } else {
            let instance = Instance::moving(part, bounds, to_world, self.motions.len() as u32)?;
            self.motions.push(Motion::new(to_world)?);
            instance
        };
        self.instances.push(instance);
        self.single(Kind::Instance, visibility, self.instances.len() - 1)
    }

    /// Bytes of primitives and of what instances show.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.slots.as_slice())
            + size_of_val(self.spheres.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.planes.as_slice())
            + size_of_val(self.shapes.as_slice())
            + size_of_val(self.placed.as_slice())
            + size_of_val(self.instances.as_slice())
            + size_of_val(self.motions.as_slice())
            + self
                .parts
                .iter()
                .map(|part| size_of::<Geometry<R>>() + part.bytes())
                .sum::<usize>()
    }

    /// The box of a primitive; none where it has no bounds.
    pub(crate) fn bounds(&self, slot: &Slot) -> Option<Aabb> {
        let index = slot.index as usize;
        match slot.kind {
            Kind::Sphere => Shape::bounds(&self.spheres[index]),
            Kind::Triangle => Shape::bounds(&self.triangles[index]),
            Kind::Plane => None,
            Kind::Shape => Shape::bounds(&self.shapes[index]),
            Kind::TransformedShape => self.placed[index].bounds(),
            Kind::Instance => self.instances[index].bounds,
        }
    }
}

/// How many primitives are tested one by one as fast as by way of a node: a sphere's test is the
/// cheapest there is, and a plane has no box.
pub(crate) fn few(spheres_alone: bool) -> usize {
    const SPHERES: usize = 14;
    const OTHERS: usize = 2;
    if spheres_alone { SPHERES } else { OTHERS }
}

/// Refuses a triangle that no tree can hold. Its box need not be made unless it is very large.
fn check_corners<R: Real>(triangle: &Triangle<R>) -> Result<(), GeometryError> {
    let most = R::from_f64(f64::from(f32::MAX) * 0.5);
    let within = |corner: &R::Vec3| corner.is_finite() && corner.abs().max_element() < most;
    if triangle.vertices.iter().all(within) {
        Ok(())
    } else {
        check_bounds(triangle.bounds()).map(drop)
    }
}
