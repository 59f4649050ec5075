//! Roundings magnified by an ill-conditioned map: the error bound of a mapped point includes those
//! of the inverse map.

use glam::{DAffine3, DMat3};
use raywright_bvh::shapes::{AnyShape, Quad, TransformedShape};
use raywright_bvh::{Interval, PreparedRay, Ray, Side};

use super::support::{Expect, Verdict, format_ray_bits, judge};

/// Protects: the part of the error bound for the inverse map. A map that flattens within the plane
/// of a face keeps the length of the face's normal, while the roundings of the inverse map grow
/// with the flattening. In any other direction the normal grows as much and hides them. All in f64,
/// since f32 storage would hide them too.
#[test]
fn bounds_include_the_inverse_map() {
    judge(
        "rays that leave a face flattened along itself",
        424,
        40_000,
        |rng| {
            let (u, v) = (rng.sample_direction(), rng.sample_direction());
            let normal = u.cross(v);
            if normal.length() < 0.3 {
                return Verdict::Skipped;
            }
            let by = 10_f64.powf(rng.next_uniform(-6.0, -3.0));
            let along =
                (u * rng.next_uniform(-1.0, 1.0) + v * rng.next_uniform(-1.0, 1.0)).normalize();
            let squeeze = DMat3::IDENTITY
                + DMat3::from_cols(along * along.x, along * along.y, along * along.z) * (by - 1.0);
            let turn = DMat3::from_axis_angle(rng.sample_direction(), rng.next_uniform(0.0, 6.0));
            let map = DAffine3::from_mat3(turn * squeeze);
            let quad: AnyShape<f64> = Quad::new(rng.sample_point_in_cube(), u, v).into();
            let transformed_shape =
                TransformedShape::<f64>::new(quad, map).expect("an invertible map");
            let AnyShape::Quad(own) = quad else {
                return Verdict::Skipped;
            };
            let corner =
                own.corners[0] + u * rng.next_uniform(0.2, 0.8) + v * rng.next_uniform(0.2, 0.8);
            let target = map.transform_point3(corner);
            let origin = target + turn * normal * rng.choose(&[1.0, 30.0]);
            let prepared_ray =
                PreparedRay::new(Ray::<f64>::new(origin, (target - origin).normalize()));
            let Some(hit) =
                transformed_shape.intersect(&prepared_ray, Interval::positive(), Side::Outside)
            else {
                return Verdict::Skipped;
            };
            let surface = transformed_shape
                .locate_surface_point(&prepared_ray, hit)
                .to_scalar::<f64>();
            for _ in 0..4 {
                let d = rng.sample_direction();
                let d = if surface.normal.dot(d) < 0.0 { -d } else { d };
                let leaving = Ray::new(surface.spawn_ray_origin(d), d);
                if let Some(again) = transformed_shape.intersect(
                    &PreparedRay::new(leaving),
                    Interval::positive(),
                    Side::Both,
                ) {
                    return Verdict::Wrong(format!(
                        "{again:?} {surface:?} {map:?}{}",
                        format_ray_bits::<f64>(&leaving)
                    ));
                }
            }
            Verdict::Right(0.0)
        },
    )
    .expect_right(20_000);
}
