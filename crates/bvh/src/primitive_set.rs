//! The set of primitives of a geometry, collected object by object.

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
use crate::slot::{MAX_PRIMITIVES, PrimitiveKind, PrimitiveSlot};

/// Primitives from which a [`Geometry`] is built, stored by kind. They are added as objects: a
/// shape is an object of one primitive, a mesh an object of one primitive per triangle, and an
/// instance is an object that places a whole geometry. A hit names the object and the primitive.
#[derive(Clone, Debug, Default)]
#[doc(alias("RTCGeometry", "rtcAttachGeometry"))]
pub struct PrimitiveSet<R: Real> {
    /// One slot (a record) for each primitive. In a set they are in the order of insertion, in a
    /// [`Geometry`] in the accelerator's order.
    pub(crate) slots: Vec<PrimitiveSlot>,
    objects: u32,
    pub(crate) spheres: Vec<Sphere<R>>,
    pub(crate) triangles: Vec<Triangle<R>>,
    pub(crate) planes: Vec<Plane<R>>,
    /// Shapes of all other kinds.
    pub(crate) shapes: Vec<AnyShape<R>>,
    pub(crate) transformed_shapes: Vec<TransformedShape<R>>,
    pub(crate) instances: Vec<Instance>,
    /// Motions of the moving instances, in the order of [`Instance`]'s motion index.
    pub(crate) motions: Vec<Motion>,
    /// Geometries that instances place, in the order of their part numbers.
    pub(crate) parts: Vec<Geometry<R>>,
}

impl<R: Real> PrimitiveSet<R> {
    /// Bytes of a primitive's slot. A primitive of any kind takes these besides its own data.
    pub(crate) const SLOT_BYTES: usize = size_of::<PrimitiveSlot>();

    /// Returns the object-to-world map of an instance at the given time, and the instanced
    /// geometry. The map of a moving instance is stored in `room`, since the result is a reference.
    #[inline(always)]
    pub(crate) fn resolve_instance<'a>(
        &'a self,
        instance: &'a Instance,
        time: f64,
        room: &'a mut Option<Transform>,
    ) -> (&'a Transform, &'a Geometry<R>) {
        let transform = match instance
            .motion()
            .and_then(|motion| self.motions.get(motion))
        {
            None => &instance.transform,
            Some(motion) => room.insert(motion.transform_at(time)),
        };
        (transform, &self.parts[instance.part as usize])
    }

    /// Number of primitives; an instance counts as one.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Whether the set has no primitives.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Number of objects, which is also the id of the next object.
    pub fn object_count(&self) -> usize {
        self.objects as usize
    }

    /// Adds an object with a single primitive, and returns the object's id. The primitive is
    /// already stored at `index` of the array for `kind`.
    fn push_object(
        &mut self,
        kind: PrimitiveKind,
        visibility: Visibility,
        index: usize,
    ) -> Result<u32, GeometryError> {
        self.push_slot(kind, visibility, 0, index)?;
        self.objects += 1;
        Ok(self.objects - 1)
    }

    /// Adds the slot of a primitive to the current object. `primitive` is the number of the
    /// primitive in that object, and `index` its index in the array for `kind`.
    fn push_slot(
        &mut self,
        kind: PrimitiveKind,
        visibility: Visibility,
        primitive: usize,
        index: usize,
    ) -> Result<(), GeometryError> {
        if self.slots.len() >= MAX_PRIMITIVES {
            return Err(GeometryError::TooManyPrimitives);
        }
        self.slots.push(PrimitiveSlot {
            object: self.objects,
            primitive: primitive as u32,
            index: index as u32,
            kind,
            visibility,
        });
        Ok(())
    }

    /// Adds a sphere and returns its object id.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] for a coordinate that is NaN, infinite or beyond the range of
    /// f32; [`GeometryError::TooManyPrimitives`] if the set is full.
    pub fn add_sphere(
        &mut self,
        sphere: Sphere<R>,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        check_bounds(sphere.bounds())?;
        self.spheres.push(sphere);
        self.push_object(PrimitiveKind::Sphere, visibility, self.spheres.len() - 1)
    }

    /// Adds a plane and returns its object id.
    ///
    /// # Errors
    /// As [`PrimitiveSet::add_sphere`].
    pub fn add_plane(
        &mut self,
        plane: Plane<R>,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        if !(plane.point.is_finite() && plane.normal.is_finite()) {
            return Err(GeometryError::NotFinite);
        }
        self.planes.push(plane);
        self.push_object(PrimitiveKind::Plane, visibility, self.planes.len() - 1)
    }

    /// Adds a single triangle and returns its object id.
    ///
    /// # Errors
    /// As [`PrimitiveSet::add_sphere`].
    pub fn add_triangle(
        &mut self,
        vertices: [R::Vec3; 3],
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        self.add_mesh([vertices], visibility)
    }

    /// Reserves capacity for `count` more triangles, before triangles are added from an iterator of
    /// unknown length.
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

    /// Adds triangles as one object and returns its id. The triangles are numbered from 0 in the
    /// order of the iterator. A mesh may be empty.
    ///
    /// # Errors
    /// As [`PrimitiveSet::add_sphere`], for any of the triangles. The set is then unchanged.
    #[doc(alias("RTC_GEOMETRY_TYPE_TRIANGLE", "TriangleMesh"))]
    pub fn add_mesh(
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
            let added = check_triangle_corners(&triangle).and_then(|()| {
                self.push_slot(
                    PrimitiveKind::Triangle,
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

    /// All triangles of the set, in the order of insertion.
    pub fn triangles(&self) -> &[Triangle<R>] {
        &self.triangles
    }

    /// Adds a shape of any kind and returns its object id.
    ///
    /// # Errors
    /// As [`PrimitiveSet::add_sphere`].
    pub fn add_shape(
        &mut self,
        shape: AnyShape<R>,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        match shape {
            AnyShape::Sphere(sphere) => self.add_sphere(sphere, visibility),
            AnyShape::Triangle(triangle) => self.add_triangle(triangle.vertices, visibility),
            AnyShape::Plane(plane) => self.add_plane(plane, visibility),
            shape if !shape.is_finite() => Err(GeometryError::NotFinite),
            shape => {
                self.shapes.push(shape);
                self.push_object(PrimitiveKind::Shape, visibility, self.shapes.len() - 1)
            }
        }
    }

    /// Adds a shape of any kind under an affine map and returns its object id.
    ///
    /// # Errors
    /// As [`PrimitiveSet::add_sphere`]; [`GeometryError::Singular`] for a map without an inverse.
    pub fn add_transformed_shape(
        &mut self,
        shape: AnyShape<R>,
        to_world: DAffine3,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        if to_world == DAffine3::IDENTITY {
            return self.add_shape(shape, visibility);
        }
        if !shape.is_finite() {
            return Err(GeometryError::NotFinite);
        }
        let transformed_shape =
            TransformedShape::new(shape, to_world).ok_or(GeometryError::Singular)?;
        check_bounds(transformed_shape.bounds())?;
        self.transformed_shapes.push(transformed_shape);
        self.push_object(
            PrimitiveKind::TransformedShape,
            visibility,
            self.transformed_shapes.len() - 1,
        )
    }

    /// Adds a geometry as a part, which instances can place. Returns the part number for
    /// [`PrimitiveSet::add_instance`].
    ///
    /// # Errors
    /// [`GeometryError::NestedInstance`] if the geometry itself contains instances: a hit can
    /// identify only one instance.
    pub fn add_part(&mut self, geometry: Geometry<R>) -> Result<u32, GeometryError> {
        if geometry.instance_count() > 0 {
            return Err(GeometryError::NestedInstance);
        }
        self.parts.push(geometry);
        Ok(self.parts.len() as u32 - 1)
    }

    /// Adds an instance of a part under an affine map, as one object, and returns the object's id.
    /// For any-hit queries `visibility.occlusion` replaces the occlusion of the part's objects.
    /// `visibility.side` has no effect: the part's objects keep their sides.
    ///
    /// # Errors
    /// As [`PrimitiveSet::add_transformed_shape`]; [`GeometryError::UnknownPart`] for an unknown
    /// part.
    #[doc(alias("RTC_GEOMETRY_TYPE_INSTANCE", "ObjectInstance"))]
    pub fn add_instance(
        &mut self,
        part: u32,
        to_world: DAffine3,
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        self.add_moving_instance(part, [to_world; 2], visibility)
    }

    /// Adds a moving instance of a part, otherwise as [`PrimitiveSet::add_instance`]. `to_world`
    /// holds the maps at ray times 0 and 1, and each entry is interpolated linearly. So each point
    /// moves along a straight line at constant speed. A rotating part shrinks during the motion: at
    /// time 0.5, perpendicular to the axis, by the cosine of half the angle. Equal maps give an
    /// instance at rest.
    ///
    /// # Errors
    /// As [`PrimitiveSet::add_instance`]; [`GeometryError::SingularDuringMotion`] if the map has no
    /// inverse at some time in [0, 1], or if the proof of its inverse fails. For example, a
    /// rotation by half a turn has no inverse at time 0.5.
    pub fn add_moving_instance(
        &mut self,
        part: u32,
        to_world: [DAffine3; 2],
        visibility: Visibility,
    ) -> Result<u32, GeometryError> {
        let bounds = self
            .parts
            .get(part as usize)
            .ok_or(GeometryError::UnknownPart)?
            .bounds();
        let instance = if to_world[0] == to_world[1] {
            Instance::new(part, bounds, to_world[0])?
        } else {
            let instance = Instance::new_moving(part, bounds, to_world, self.motions.len() as u32)?;
            self.motions.push(Motion::new(to_world)?);
            instance
        };
        self.instances.push(instance);
        self.push_object(
            PrimitiveKind::Instance,
            visibility,
            self.instances.len() - 1,
        )
    }

    /// Memory of the primitives and of the parts (the instanced geometries), in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.slots.as_slice())
            + size_of_val(self.spheres.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.planes.as_slice())
            + size_of_val(self.shapes.as_slice())
            + size_of_val(self.transformed_shapes.as_slice())
            + size_of_val(self.instances.as_slice())
            + size_of_val(self.motions.as_slice())
            + self
                .parts
                .iter()
                .map(|part| size_of::<Geometry<R>>() + part.memory_bytes())
                .sum::<usize>()
    }

    /// Returns the box of a primitive; `None` if it is unbounded.
    pub(crate) fn bounds(&self, slot: &PrimitiveSlot) -> Option<Aabb> {
        let index = slot.index as usize;
        match slot.kind {
            PrimitiveKind::Sphere => Shape::bounds(&self.spheres[index]),
            PrimitiveKind::Triangle => Shape::bounds(&self.triangles[index]),
            PrimitiveKind::Plane => None,
            PrimitiveKind::Shape => Shape::bounds(&self.shapes[index]),
            PrimitiveKind::TransformedShape => self.transformed_shapes[index].bounds(),
            PrimitiveKind::Instance => self.instances[index].bounds,
        }
    }
}

/// Greatest number of primitives that are tested one by one as fast as by a tree. The number is
/// greater for a set of spheres and planes alone. The test of a sphere is the cheapest, and a plane
/// has no box.
pub(crate) fn max_linear_scan_size(spheres_alone: bool) -> usize {
    const SPHERES: usize = 14;
    const OTHERS: usize = 2;
    if spheres_alone { SPHERES } else { OTHERS }
}

/// Returns an error for a triangle that no tree can hold. Only for very large triangles is the box
/// computed, which saves time.
fn check_triangle_corners<R: Real>(triangle: &Triangle<R>) -> Result<(), GeometryError> {
    let maximum = R::from_f64(f64::from(f32::MAX) * 0.5);
    let within = |corner: &R::Vec3| corner.is_finite() && corner.abs().max_element() < maximum;
    if triangle.vertices.iter().all(within) {
        Ok(())
    } else {
        check_bounds(triangle.bounds()).map(drop)
    }
}
