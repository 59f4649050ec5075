//! Surface points and texture coordinates of hits, which are computed after the query.

use glam::DVec3;

use crate::geometry::Geometry;
use crate::processor::{SimdTask, run_widest};
use crate::ray::{Hit, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::{
    OuterTransforms, PreparedRay, Shape, ShapeHit, Surface, SurfacePoint, TextureCoordinates,
    TransformChain, Triangle,
};
use crate::slot::PrimitiveKind;

/// Number of triangle hits whose surface points are computed together.
const LANES: usize = 8;

impl<R: Real> Geometry<R> {
    /// Computes the surface point of a hit in f64. `hit` must be the result of a query of this
    /// geometry with `ray`.
    #[inline]
    pub fn surface_point(&self, ray: &Ray<R>, hit: &Hit<R>) -> SurfacePoint {
        // Spheres and planes are inlined here, so that the parts of the prepared ray that they do
        // not use are not computed.
        let slot = &self.primitives.slots[hit.slots[0] as usize];
        match slot.kind {
            PrimitiveKind::Sphere => self.primitives.spheres[slot.index as usize]
                .locate_surface_point(&self.prepare_ray(*ray), to_shape_hit(hit)),
            PrimitiveKind::Plane => self.primitives.planes[slot.index as usize]
                .locate_surface_point(&self.prepare_ray(*ray), to_shape_hit(hit)),
            _ => self.locate_surface_point_in_slot(
                &self.prepare_ray(*ray),
                to_shape_hit(hit),
                hit.slots,
                None,
            ),
        }
    }

    /// Computes the surface at a hit in the stored scalar. `hit` must be the result of a query of
    /// this geometry with `ray`.
    #[inline]
    pub fn surface(&self, ray: &Ray<R>, hit: &Hit<R>) -> Surface<R> {
        self.surface_point(ray, hit).to_scalar()
    }

    /// Computes the surfaces at many hits, each as [`Self::surface`]. Eight triangles are evaluated
    /// at a time, which is faster. `out` is called for each hit in any order, with the index of the
    /// hit in `hits` and its surface.
    #[inline]
    pub fn surfaces<'a>(
        &self,
        hits: impl Iterator<Item = (&'a Ray<R>, &'a Hit<R>)>,
        mut out: impl FnMut(usize, Surface<R>),
    ) {
        let (mut pending, mut indices) = (TriangleHitLanes::<R>::default(), [0; LANES]);
        for (index, (ray, hit)) in hits.enumerate() {
            let slot = &self.primitives.slots[hit.slots[0] as usize];
            if slot.kind != PrimitiveKind::Triangle {
                out(index, self.surface(ray, hit));
                continue;
            }
            indices[pending.len] = index;
            pending.push_hit(self, hit);
            if pending.len == LANES {
                pending.flush_surfaces(&indices, &mut out);
            }
        }
        pending.flush_surfaces(&indices, &mut out);
    }

    /// Computes the texture coordinates at a hit. `hit` must be the result of a query of this
    /// geometry with `ray`.
    #[inline]
    pub fn texture_coordinates(&self, ray: &Ray<R>, hit: &Hit<R>) -> TextureCoordinates<R> {
        self.texture_coordinates_in_slot(&self.prepare_ray(*ray), to_shape_hit(hit), hit.slots)
    }

    /// Returns the world-space corners of the hit triangle at the ray's time; `None` for any other
    /// shape. The hit's `u` and `v` are the barycentric weights of the second and third corner.
    pub fn triangle_corners(&self, ray: &Ray<R>, hit: &Hit<R>) -> Option<[DVec3; 3]> {
        self.triangle_corners_in_slot(ray.time.to_f64(), hit.slots)
    }

    /// Maps a normal from the space of the hit instance to the world, at the ray's time. The result
    /// is not normalised. For a hit outside any instance the normal is returned unchanged. Shading
    /// uses this function for the normals of a mesh under a moving instance.
    pub fn normal_to_world(&self, ray: &Ray<R>, hit: &Hit<R>, normal: R::Vec3) -> R::Vec3 {
        let (group, slot) = (
            &self.primitives,
            &self.primitives.slots[hit.slots[0] as usize],
        );
        if slot.kind != PrimitiveKind::Instance {
            return normal;
        }
        let mut moving_transform = None;
        let (transform, _) = group.resolve_instance(
            &group.instances[slot.index as usize],
            ray.time.to_f64(),
            &mut moving_transform,
        );
        R::Vec3::from_f64(transform.normal_to_world(normal.to_f64()))
    }

    /// Computes the surface point of a hit by a ray in this geometry's own space. `slot` is the
    /// index of the hit primitive's slot (its record in the set). If that primitive is an instance,
    /// `inner` is a slot index in the instanced geometry. `transform_chain` holds the maps from
    /// this geometry's space to the world.
    #[inline(never)]
    fn locate_surface_point_in_slot(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        [slot, inner]: [u32; 2],
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let (group, slot) = (&self.primitives, &self.primitives.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            PrimitiveKind::Sphere => group.spheres[index].locate_point_under_transforms(
                prepared_ray,
                hit,
                transform_chain,
            ),
            PrimitiveKind::Triangle => self.triangle(index).locate_point_under_transforms(
                prepared_ray,
                hit,
                transform_chain,
            ),
            PrimitiveKind::Plane => group.planes[index].locate_point_under_transforms(
                prepared_ray,
                hit,
                transform_chain,
            ),
            PrimitiveKind::Shape => group.shapes[index].locate_point_under_transforms(
                prepared_ray,
                hit,
                transform_chain,
            ),
            PrimitiveKind::TransformedShape => group.transformed_shapes[index]
                .locate_point_under_transforms(prepared_ray, hit, transform_chain),
            PrimitiveKind::Instance => {
                let mut moving_transform = None;
                let (transform, part) = group.resolve_instance(
                    &group.instances[index],
                    prepared_ray.time,
                    &mut moving_transform,
                );
                let transform_chain = TransformChain {
                    map: transform,
                    outer: None,
                };
                transform.surface_point_to_world(&part.locate_surface_point_in_slot(
                    &transform.ray_to_object(prepared_ray),
                    hit,
                    [inner, inner],
                    Some(transform_chain),
                ))
            }
        }
    }

    /// Returns the corners of the triangle in a slot, in the space of this geometry. If the slot is
    /// an instance, the triangle is in the slot `inner` of the instanced geometry.
    fn triangle_corners_in_slot(&self, time: f64, [slot, inner]: [u32; 2]) -> Option<[DVec3; 3]> {
        let (group, slot) = (&self.primitives, &self.primitives.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            PrimitiveKind::Triangle => Some(self.triangle(index).vertices.map(Vector::to_f64)),
            PrimitiveKind::Instance => {
                let mut moving_transform = None;
                let (transform, part) =
                    group.resolve_instance(&group.instances[index], time, &mut moving_transform);
                let corners = part.triangle_corners_in_slot(time, [inner, inner])?;
                Some(corners.map(|corner| transform.to_world.transform_point3(corner)))
            }
            PrimitiveKind::TransformedShape => group.transformed_shapes[index].triangle_corners(),
            PrimitiveKind::Sphere | PrimitiveKind::Plane | PrimitiveKind::Shape => None,
        }
    }

    /// Computes the texture coordinates of a hit for a ray in this geometry's own space. `slot` and
    /// `inner` identify the primitive as in [`Self::locate_surface_point_in_slot`].
    fn texture_coordinates_in_slot(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        [slot, inner]: [u32; 2],
    ) -> TextureCoordinates<R> {
        let (group, slot) = (&self.primitives, &self.primitives.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            PrimitiveKind::Sphere => group.spheres[index].texture_coordinates(prepared_ray, hit),
            PrimitiveKind::Triangle => self.triangle(index).texture_coordinates(prepared_ray, hit),
            PrimitiveKind::Plane => group.planes[index].texture_coordinates(prepared_ray, hit),
            PrimitiveKind::Shape => group.shapes[index].texture_coordinates(prepared_ray, hit),
            PrimitiveKind::TransformedShape => {
                group.transformed_shapes[index].texture_coordinates(prepared_ray, hit)
            }
            PrimitiveKind::Instance => {
                let mut moving_transform = None;
                let (transform, part) = group.resolve_instance(
                    &group.instances[index],
                    prepared_ray.time,
                    &mut moving_transform,
                );
                let object_coordinates = part.texture_coordinates_in_slot(
                    &transform.ray_to_object(prepared_ray),
                    hit,
                    [inner, inner],
                );
                transform.texture_coordinates_to_world(&object_coordinates)
            }
        }
    }
}

/// Hits of up to eight triangles outside instances, in structure-of-arrays layout.
#[derive(Clone, Copy, Debug)]
pub struct TriangleHitLanes<R: Real> {
    len: usize,
    /// Corners as `corners[corner][axis][lane]`.
    corners: [[[R; LANES]; 3]; 3],
    /// Barycentric weights of the second and the third corner.
    weights: [[R; LANES]; 2],
}

impl<R: Real> Default for TriangleHitLanes<R> {
    fn default() -> Self {
        let none = [R::ZERO; LANES];
        Self {
            len: 0,
            corners: [[none; 3]; 3],
            weights: [none; 2],
        }
    }
}

impl<R: Real> TriangleHitLanes<R> {
    /// Adds a hit of a triangle of `geometry` in the next lane. There must be a free lane.
    #[inline(always)]
    pub fn push_hit(&mut self, geometry: &Geometry<R>, hit: &Hit<R>) {
        let slot = &geometry.primitives.slots[hit.slots[0] as usize];
        let coordinates = geometry.triangle_coordinates(slot.index as usize);
        let lane = self.len;
        self.len += 1;
        for (columns, corner) in self.corners.iter_mut().zip(coordinates) {
            for (column, coordinate) in columns.iter_mut().zip(corner) {
                column[lane] = coordinate;
            }
        }
        (self.weights[0][lane], self.weights[1][lane]) = (hit.u, hit.v);
    }

    /// Removes all hits and returns their surfaces, each as [`Geometry::surface`] computes it.
    #[inline(always)]
    pub fn take_surfaces(&mut self) -> TriangleSurfaceLanes<R> {
        let mut lanes = run_widest(LocateTrianglesTask(self));
        for lane in 0..self.len {
            if !lanes.is_inside[lane] {
                let surface = self
                    .triangle(lane)
                    .eval_inset_surface_point(self.weights(lane))
                    .to_scalar();
                lanes.surfaces.set_lane(lane, &surface);
            }
        }
        self.len = 0;
        lanes.surfaces
    }

    /// Passes the surfaces of all collected hits to `out`, then clears the collection. `indices`
    /// holds the indices of the hits in the caller's list.
    #[inline(always)]
    fn flush_surfaces(
        &mut self,
        indices: &[usize; LANES],
        out: &mut impl FnMut(usize, Surface<R>),
    ) {
        if self.len == 0 {
            return;
        }
        let len = self.len;
        let surfaces = self.take_surfaces();
        for (lane, &index) in indices.iter().enumerate().take(len) {
            out(index, surfaces.get_lane(lane));
        }
    }

    #[inline(always)]
    fn triangle(&self, lane: usize) -> Triangle<R> {
        Triangle {
            vertices: self
                .corners
                .map(|[x, y, z]| Vector::new(x[lane], y[lane], z[lane])),
        }
    }

    #[inline(always)]
    fn weights(&self, lane: usize) -> [f64; 2] {
        // Component by component: `map` would copy whole arrays, which prevents vectorisation of
        // the loops over lanes.
        [
            self.weights[0][lane].to_f64(),
            self.weights[1][lane].to_f64(),
        ]
    }
}

/// Surfaces of up to eight triangle hits outside instances, as a structure of arrays. Rays to either
/// side start at the hit point itself.
#[derive(Clone, Copy, Debug)]
pub struct TriangleSurfaceLanes<R> {
    /// Hit points, as `point[axis][lane]`.
    pub point: [[R; LANES]; 3],
    /// Outward geometric unit normals, as `normal[axis][lane]`.
    pub normal: [[R; LANES]; 3],
    /// Error bounds, see [`Surface::error`].
    pub error: [R; LANES],
}

impl<R: Real> TriangleSurfaceLanes<R> {
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, surface: &Surface<R>) {
        for ([x, y, z], v) in [
            (&mut self.point, surface.point),
            (&mut self.normal, surface.normal),
        ] {
            (x[lane], y[lane], z[lane]) = (v.x(), v.y(), v.z());
        }
        self.error[lane] = surface.error;
    }

    #[inline(always)]
    fn get_lane(&self, lane: usize) -> Surface<R> {
        let [point, normal] =
            [self.point, self.normal].map(|[x, y, z]| Vector::new(x[lane], y[lane], z[lane]));
        Surface {
            point,
            above: point,
            below: point,
            error: self.error[lane],
            normal,
        }
    }
}

/// Surfaces of triangle hits before they are moved off edges. A lane is valid only if its
/// `is_inside` is set: the hit point is not near an edge. The caller evaluates the other hits one
/// by one.
struct LocatedTriangles<R> {
    surfaces: TriangleSurfaceLanes<R>,
    is_inside: [bool; LANES],
}

/// Task of [`run_widest`]: evaluates the surfaces of all collected hits.
struct LocateTrianglesTask<'a, R: Real>(&'a TriangleHitLanes<R>);

impl<R: Real> SimdTask for LocateTrianglesTask<'_, R> {
    type Output = LocatedTriangles<R>;
    #[inline(always)]
    fn run(self) -> LocatedTriangles<R> {
        let none = [R::ZERO; LANES];
        let mut out = LocatedTriangles {
            surfaces: TriangleSurfaceLanes {
                point: [none; 3],
                normal: [none; 3],
                error: none,
            },
            is_inside: [false; LANES],
        };
        for lane in 0..LANES {
            let corner = |k: usize| {
                let [x, y, z] = &self.0.corners[k];
                DVec3::new(x[lane].to_f64(), y[lane].to_f64(), z[lane].to_f64())
            };
            let (point, is_inside) = Triangle::<R>::eval_interior_surface_point(
                [corner(0), corner(1), corner(2)],
                self.0.weights(lane),
            );
            out.surfaces.set_lane(lane, &point.to_scalar::<R>());
            out.is_inside[lane] = is_inside;
        }
        out
    }
}

/// Returns the distance and the two shape-specific numbers of a hit.
#[inline(always)]
fn to_shape_hit<R: Real>(hit: &Hit<R>) -> ShapeHit<R> {
    ShapeHit {
        t: hit.t,
        u: hit.u,
        v: hit.v,
    }
}
