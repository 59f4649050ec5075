//! A shape under an affine map.

use glam::{DAffine3, DMat3, DVec3};

use super::sample::integrate_area;
use super::{
    AnyShape, OuterTransforms, PreparedRay, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    Transform, TransformChain,
};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A shape under an affine map. Rays are mapped to object space and intersected there. Distances
/// along a ray are the same numbers in object space and in the world ("Improving Ray Tracing
/// Precision by Object Space Intersection Computation", Dammertz, Keller 2006).
#[derive(Clone, Copy, Debug)]
pub struct TransformedShape<R: Real> {
    shape: AnyShape<R>,
    transform: Transform,
    /// Absolute value of the map's determinant: the volume of the image of a unit cube.
    volume: f64,
}

impl<R: Real> TransformedShape<R> {
    /// Creates a shape under an object-to-world map; `None` if the map has no finite inverse.
    pub fn new(shape: AnyShape<R>, to_world: DAffine3) -> Option<Self> {
        let volume = to_world.matrix3.determinant().abs();
        Transform::new(to_world).map(|transform| Self {
            shape,
            transform,
            volume,
        })
    }

    /// Returns the corners of a triangle in the world; `None` for other shapes.
    pub(crate) fn triangle_corners(&self) -> Option<[DVec3; 3]> {
        let AnyShape::Triangle(triangle) = &self.shape else {
            return None;
        };
        let to_world = |corner: R::Vec3| self.transform.to_world.transform_point3(corner.to_f64());
        Some(triangle.vertices.map(to_world))
    }

    /// Support function of the mapped shape in world space.
    pub fn support_function(&self, direction: DVec3) -> Option<f64> {
        let DAffine3 {
            matrix3: matrix,
            translation,
        } = self.transform.to_world;
        Some(
            self.shape
                .support_function(matrix.transpose() * direction)?
                + translation.dot(direction),
        )
    }

    /// Returns the smallest axis-aligned box around the mapped shape; `None` for an unbounded
    /// shape.
    pub fn bounds(&self) -> Option<Aabb> {
        Aabb::from_support(|d| self.support_function(d))
    }

    /// Returns the nearest hit of a world-space ray, as [`Shape::intersect`].
    #[inline]
    pub fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        self.shape
            .intersect(&self.transform.ray_to_object(prepared_ray), range, side)
    }

    /// Computes the surface point of a hit in the world, as [`Shape::locate_surface_point`].
    pub fn locate_surface_point(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> SurfacePoint {
        self.locate_point_under_transforms(prepared_ray, hit, None)
    }

    /// Computes the surface point of a hit in the space of the ray. `outer` holds the maps from the
    /// ray's space to the world.
    pub(crate) fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        outer: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let transform_chain = TransformChain {
            map: &self.transform,
            outer: outer.as_ref(),
        };
        self.transform
            .surface_point_to_world(&self.shape.locate_point_under_transforms(
                &self.transform.ray_to_object(prepared_ray),
                hit,
                Some(transform_chain),
            ))
    }

    /// Computes the texture coordinates at a hit, as [`Shape::texture_coordinates`].
    pub fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        self.transform.texture_coordinates_to_world(
            &self
                .shape
                .texture_coordinates(&self.transform.ray_to_object(prepared_ray), hit),
        )
    }

    /// Local factor by which the map changes areas, at a unit normal in object space.
    fn area_scale_at_normal(&self, normal: DVec3) -> f64 {
        self.volume * self.transform.normal_to_world(normal).length()
    }

    /// Area of the mapped shape; `None` if it is infinite. Similarities, flat shapes and boxes have
    /// a closed form. Other areas are integrated numerically.
    pub fn area(&self) -> Option<f64> {
        let shape_area = self.shape.area()?;
        if is_similarity(self.transform.to_world.matrix3) {
            let scale = libm::cbrt(self.volume);
            return Some(shape_area * scale * scale);
        }
        if matches!(
            self.shape,
            AnyShape::Disk(_) | AnyShape::Quad(_) | AnyShape::Triangle(_)
        ) {
            let (any_point, _) = self.shape.sample_area(R::from_f64(0.5), R::from_f64(0.5))?;
            return Some(shape_area * self.area_scale_at_normal(any_point.normal));
        }
        if let AnyShape::Cuboid(cuboid) = &self.shape {
            let s = cuboid.max.to_f64() - cuboid.min.to_f64();
            let faces = DVec3::new(s.y * s.z, s.z * s.x, s.x * s.y);
            return Some(
                2.0 * faces.dot(
                    DVec3::AXES
                        .map(|axis| self.area_scale_at_normal(axis))
                        .into(),
                ),
            );
        }
        Some(integrate_area(|u, v| {
            self.sample_area(R::from_f64(u), R::from_f64(v))
                .map_or(0.0, |(_, density)| 1.0 / density)
        }))
    }

    /// Samples a point of the mapped shape as [`super::SampleArea::sample_area`], with its density
    /// per world-space area. `None` if the area is infinite.
    pub fn sample_area(&self, u: R, v: R) -> Option<(SurfacePoint, f64)> {
        let (surface_point, density) = self.shape.sample_area(u, v)?;
        let stretch = self.area_scale_at_normal(surface_point.normal);
        Some((
            self.transform.surface_point_to_world(&surface_point),
            density / stretch,
        ))
    }

    /// Density, per world-space area, with which [`Self::sample_area`] samples a point of the
    /// mapped shape. `None` if the area is infinite.
    pub fn area_density(&self, point: &SurfacePoint) -> Option<f64> {
        // The density needs no error bound, so the point is mapped by the inverse alone, and the
        // normal by the transpose.
        let Transform {
            to_world, inverse, ..
        } = &self.transform;
        let normal = to_world
            .matrix3
            .transpose_mul_vec3(point.normal)
            .normalize();
        let surface_point =
            SurfacePoint::new(*inverse * (point.point - to_world.translation), normal, 0.0);
        let stretch = self.area_scale_at_normal(surface_point.normal);
        Some(self.shape.area_density(&surface_point)? / stretch)
    }

    /// Returns the shape before the map, in object space.
    pub fn shape(&self) -> &AnyShape<R> {
        &self.shape
    }
}

/// Whether a map preserves angles, up to the rounding of its entries.
fn is_similarity(map: DMat3) -> bool {
    let [x, y, z] = [map.x_axis, map.y_axis, map.z_axis];
    let size = x.length_squared();
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * size;
    close(y.length_squared(), size)
        && close(z.length_squared(), size)
        && [x.dot(y), y.dot(z), z.dot(x)]
            .iter()
            .all(|&lean| close(lean, 0.0))
}

#[cfg(test)]
mod tests {
    use super::super::{
        Cuboid, Cylinder, Disk, Ellipsoid, Quad, SampleArea, Sphere, Torus, Triangle,
    };
    use super::*;
    use glam::Vec3;

    fn area<R: Real>(shape: impl Into<AnyShape<R>>, map: DAffine3) -> f64 {
        TransformedShape::<R>::new(shape.into(), map)
            .and_then(|transformed_shape| transformed_shape.area())
            .expect("the area is finite")
    }

    /// Protects: a similarity multiplies every area by the square of its scale, including
    /// reflections.
    #[test]
    fn similar_shapes_have_similar_areas() {
        let turn = DAffine3::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 2.1);
        let map = DAffine3::from_translation(DVec3::new(50.0, 2.0, -7.0))
            * turn
            * DAffine3::from_scale(DVec3::new(-3.0, 3.0, 3.0));
        assert!(is_similarity(map.matrix3) && is_similarity(DMat3::IDENTITY));
        for stretched in [DVec3::new(1.0, 1.0, 1.001), DVec3::new(2.0, 1.0, 1.0)] {
            assert!(!is_similarity(
                turn.matrix3 * DMat3::from_diagonal(stretched)
            ));
        }
        assert!(!is_similarity(DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.1, 0.995_f64.sqrt(), 0.0),
            DVec3::Z
        )));
        let sphere = Sphere {
            centre: DVec3::ONE,
            radius: 0.5,
        };
        let torus = Torus::new(DVec3::X, DVec3::ONE, 2.0, 0.3);
        let egg = Ellipsoid::new(DVec3::Y, DVec3::new(1.0, 2.0, 30.0));
        let tin = Cylinder::new(DVec3::Z, DVec3::ONE, 0.7, Some(3.0), true);
        let (ball, ring, egg, tin) = (
            (sphere.area(), area::<f64>(sphere, map)),
            (torus.area(), area::<f64>(torus, map)),
            (egg.area(), area::<f64>(egg, map)),
            (tin.area(), area::<f64>(tin, map)),
        );
        for (own, image) in [ball, ring, egg, tin] {
            assert!((image / (9.0 * own) - 1.0).abs() < 1e-9, "{image} of {own}");
        }
    }

    /// Protects: the area of a mapped flat shape follows from its mapped edges.
    #[test]
    fn flat_shapes_stay_flat() {
        let map = DAffine3::from_mat3(DMat3::from_cols_array(&[
            1.5, 0.2, 0.0, -0.7, 2.0, 0.4, 0.1, 0.0, 0.25,
        ]));
        let (corner, u, v) = (
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(0.5, 1.0, 0.25),
            DVec3::new(-1.0, 0.5, 2.0),
        );
        let spanned = (map.matrix3 * u).cross(map.matrix3 * v).length();
        assert!((area::<f32>(Quad::new(corner, u, v), map) / spanned - 1.0).abs() < 1e-9);
        let triangle = Triangle::new([corner, corner + u, corner + v]);
        assert!((area::<f64>(triangle, map) / (0.5 * spanned) - 1.0).abs() < 1e-9);
        // A disk perpendicular to z becomes an ellipse between the images of x and y.
        let disk = Disk::new(corner, DVec3::Z, 2.0);
        let ellipse =
            core::f64::consts::PI * 4.0 * map.matrix3.x_axis.cross(map.matrix3.y_axis).length();
        assert!((area::<f32>(disk, map) / ellipse - 1.0).abs() < 1e-9);
    }

    /// Protects: the area of a mapped box is the sum of its flat faces.
    #[test]
    fn boxes_keep_flat_faces() {
        let map = DAffine3::from_mat3(DMat3::from_cols_array(&[
            1.5, 0.2, 0.0, -0.7, 2.0, 0.4, 0.1, 0.0, 0.25,
        ]));
        let (size, m) = (DVec3::new(2.0, 0.5, 3.0), map.matrix3);
        let [x, y, z] = [m.x_axis * size.x, m.y_axis * size.y, m.z_axis * size.z];
        let faces = 2.0 * (x.cross(y).length() + y.cross(z).length() + z.cross(x).length());
        let image = area::<f32>(Cuboid::new(DVec3::ONE, DVec3::ONE + size), map);
        assert!(
            (image / faces - 1.0).abs() < 1e-9,
            "{image} instead of {faces}"
        );
    }

    /// Protects: the area of other mapped shapes by quadrature, for a sphere that becomes a
    /// spheroid of known area.
    #[test]
    fn stretched_shapes_are_measured() {
        let sphere = Sphere {
            centre: Vec3::ZERO,
            radius: 1.0,
        };
        let image = area::<f32>(sphere, DAffine3::from_scale(DVec3::new(1.0, 1.0, 5.0)));
        let e = (1.0 - 1.0 / 25.0_f64).sqrt();
        let spheroid = core::f64::consts::TAU * (1.0 + 5.0 / e * libm::asin(e));
        assert!(
            (image / spheroid - 1.0).abs() < 1e-3,
            "{image} instead of {spheroid}"
        );
    }
}
