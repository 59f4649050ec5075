//! Conversion of a shape in a scene to a primitive of the accelerator. All callers share it.

use glam::{DAffine3, DMat3, DVec3};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad,
    Sphere, Torus, Triangle,
};
use raywright_bvh::{Aabb, Real, Shape as _, Vector};

use crate::origin_grid::{MESH_DISTANCE_LIMIT, storage_origin_near};
use crate::scene::{MeshData, Shape, Triple};

/// Converts a transformed shape to a primitive. `None` for a mesh. There are two cases:
///
/// - If the transform is only a translation, it is added to the shape's coordinates. No transform
///   is returned.
/// - Otherwise, the primitive stays in the shape's own space, relative to an origin near the shape.
///   The transform from there to the world is returned too.
pub(crate) fn convert_shape<R: Real>(
    shape: &Shape,
    map: DAffine3,
) -> Option<(AnyShape<R>, Option<DAffine3>)> {
    if map.matrix3 == DMat3::IDENTITY {
        return Some((convert_moved_shape(shape, map.translation)?, None));
    }
    let (stored, origin) = convert_shape_in_own_space(shape)?;
    Some((stored, Some(transform_relative_to(map, origin))))
}

/// Converts a shape to a primitive in the shape's own space. Its coordinates are relative to an
/// origin near the shape, which is returned too. `None` for a mesh.
pub(crate) fn convert_shape_in_own_space<R: Real>(shape: &Shape) -> Option<(AnyShape<R>, DVec3)> {
    let origin = shape_origin(shape);
    Some((convert_moved_shape(shape, -origin)?, origin))
}

/// Returns an origin near a shape, in the shape's own space. The shape's stored coordinates are
/// relative to it.
pub(crate) fn shape_origin(shape: &Shape) -> DVec3 {
    convert_moved_shape::<f64>(shape, DVec3::ZERO)
        .and_then(|shape| shape.bounds())
        .map_or(DVec3::ZERO, |bounds| {
            storage_origin_near(&bounds, MESH_DISTANCE_LIMIT)
        })
}

/// Returns the transform for points that are stored relative to `origin`. It adds the origin to a
/// point, and then applies `map`.
pub(crate) fn transform_relative_to(map: DAffine3, origin: DVec3) -> DAffine3 {
    if origin == DVec3::ZERO {
        map
    } else {
        map * DAffine3::from_translation(origin)
    }
}

/// Converts a shape to a primitive in the scalar `R`, after adding `offset` to its coordinates.
/// `None` for a mesh, which consists of many primitives.
pub(crate) fn convert_moved_shape<R: Real>(shape: &Shape, offset: DVec3) -> Option<AnyShape<R>> {
    let at = |p: Triple| DVec3::from(p) + offset;
    let v = |p: Triple| DVec3::from(p);
    Some(match *shape {
        Shape::Sphere { centre, radius } => AnyShape::Sphere(Sphere {
            centre: Vector::from_f64(at(centre)),
            radius: R::from_f64(radius),
        }),
        Shape::Plane { point, normal } => AnyShape::Plane(Plane::new(
            Vector::from_f64(at(point)),
            Vector::from_f64(v(normal).normalize()),
        )),
        Shape::Disk {
            centre,
            normal,
            radius,
        } => AnyShape::Disk(Disk::new(at(centre), v(normal), radius)),
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => AnyShape::Quad(Quad::new(at(corner), v(edge_u), v(edge_v))),
        Shape::Box { min, max } => AnyShape::Cuboid(Cuboid::new(at(min), at(max))),
        Shape::Cylinder {
            base,
            axis,
            radius,
            height,
            caps,
        } => AnyShape::Cylinder(Cylinder::new(at(base), v(axis), radius, height, caps)),
        Shape::Cone {
            base,
            axis,
            radius,
            top_radius,
            height,
        } => AnyShape::Cone(Cone::new(at(base), v(axis), radius, top_radius, height)),
        Shape::Ellipsoid { centre, semi_axes } => {
            AnyShape::Ellipsoid(Ellipsoid::new(at(centre), v(semi_axes)))
        }
        Shape::Hyperboloid {
            centre,
            waist_radius,
            c,
            half_height,
        } => AnyShape::Hyperboloid(Hyperboloid::new(at(centre), waist_radius, c, half_height)),
        Shape::Paraboloid {
            apex,
            radius,
            height,
        } => AnyShape::Paraboloid(Paraboloid::new(at(apex), radius, height)),
        Shape::Torus {
            centre,
            axis,
            major_radius,
            minor_radius,
        } => AnyShape::Torus(Torus::new(at(centre), v(axis), major_radius, minor_radius)),
        Shape::Triangle { vertices } => {
            AnyShape::Triangle(Triangle::new(vertices.map(|p| Vector::from_f64(at(p)))))
        }
        Shape::Mesh(_) => return None,
    })
}

/// Returns the box around the triangles of a mesh that have an area as stored in `R`. With `map`,
/// the triangles are transformed; without it, they are relative to the mesh's own origin.
pub(crate) fn mesh_bounds<R: Real>(data: &MeshData, map: Option<DAffine3>) -> Aabb {
    let position = |i: u32| {
        let own = || DVec3::from(data.positions.offsets()[i as usize].map(f64::from));
        Vector::from_f64(map.map_or_else(own, |map| {
            map.transform_point3(data.positions.position(i as usize))
        }))
    };
    // Whether a triangle has an area matters only if it reaches beyond the others.
    let include = |all: Aabb, corners: &[u32; 3]| {
        let corners = corners.map(position);
        let is_inside = |corner: &R::Vec3| {
            let corner = corner.to_f64();
            all.min.cmple(corner).all() && corner.cmple(all.max).all()
        };
        if corners.iter().all(is_inside) {
            return all;
        }
        let own = Triangle::<R>::new(corners).bounds();
        own.filter(Aabb::has_area).map_or(all, |own| all.union(own))
    };
    let parts = data.indices.par_iter().fold(|| Aabb::EMPTY, include);
    parts.reduce(|| Aabb::EMPTY, Aabb::union)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the box of a mesh holds every triangle with an area, also one of which a single corner lies
    /// beyond the others, and no triangle without an area.
    #[test]
    fn boxes_of_meshes_hold_what_has_an_area() {
        // So many, and a power of two, that each thread meets the first of a pair before the second.
        let mut indices = [[0, 1, 2], [0, 1, 3]].repeat(1023);
        indices.extend([[4, 4, 0], [4, 4, 4]]);
        let data = serde_json::json!({
            "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0.5, 3], [9, 9, 9]],
            "indices": indices
        });
        let data: MeshData = serde_json::from_value(data).expect("a mesh");
        let all = mesh_bounds::<f32>(&data, Some(DAffine3::from_scale(DVec3::splat(2.0))));
        assert_eq!((all.min, all.max), (DVec3::ZERO, DVec3::new(2.0, 2.0, 6.0)));
    }
}
