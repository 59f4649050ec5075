//! Error bounds of hits on every shape: the point lies within its bound of the surface.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, CylinderEnds, Disk, Ellipsoid, Hyperboloid, Paraboloid,
    Plane, Quad, Sphere, Torus, TransformedShape, Triangle,
};
use raywright_bvh::{Interval, PreparedRay, Ray, Real, Side, Vector};

use super::support::{
    CaseOutcome, Expect, Verdict, create_ray_towards, format_ray_bits, judge, round_to_f32,
    to_scalar, within,
};

/// One of each shape, from the same f32 numbers in every precision.
pub fn shapes<R: Real>() -> Vec<(&'static str, AnyShape<R>)> {
    sized::<R>(1.0)
}

/// The shapes with every length multiplied by a power of two.
pub fn sized<R: Real>(size: f64) -> Vec<(&'static str, AnyShape<R>)> {
    let v = |x: f64, y: f64, z: f64| to_scalar::<R>(round_to_f32(DVec3::new(x, y, z)) * size);
    let r = |x: f64| R::from_f64(f64::from(x as f32) * size);
    let (centre, axis) = (v(0.3, -0.2, 0.1), v(0.6, 1.3, -0.4));
    let vertices = [v(-1.1, -0.7, 0.2), v(1.3, -0.6, 0.4), v(0.1, 1.2, -0.3)];
    let corners = [
        v(-0.9, -1.1, 0.3),
        v(0.85, -0.85, 0.3),
        v(1.1, 0.4, 0.55),
        v(-0.65, 0.15, 0.55),
    ];
    vec![
        (
            "sphere",
            Sphere {
                centre,
                radius: r(1.1),
            }
            .into(),
        ),
        (
            "plane",
            Plane::new(
                centre,
                to_scalar::<R>(round_to_f32(DVec3::new(0.3, 0.9, 0.2).normalize())),
            )
            .into(),
        ),
        (
            "disk",
            Disk {
                centre,
                normal: axis,
                radius: r(1.2),
            }
            .into(),
        ),
        ("triangle", Triangle { vertices }.into()),
        ("quad", Quad { corners }.into()),
        (
            "box",
            Cuboid {
                min: v(-0.7, -0.9, -0.5),
                max: v(1.1, 0.4, 0.8),
            }
            .into(),
        ),
        (
            "tube",
            Cylinder {
                base: centre,
                axis,
                radius: r(0.7),
                ends: CylinderEnds::None,
            }
            .into(),
        ),
        (
            "open cylinder",
            Cylinder {
                base: centre,
                axis,
                radius: r(0.7),
                ends: CylinderEnds::Open,
            }
            .into(),
        ),
        (
            "cylinder",
            Cylinder {
                base: centre,
                axis,
                radius: r(0.7),
                ends: CylinderEnds::Capped,
            }
            .into(),
        ),
        (
            "cone",
            Cone {
                base: centre,
                axis,
                radius: r(1.1),
                top_radius: r(0.0),
            }
            .into(),
        ),
        (
            "truncated cone",
            Cone {
                base: centre,
                axis,
                radius: r(1.1),
                top_radius: r(0.3),
            }
            .into(),
        ),
        (
            "ellipsoid",
            Ellipsoid {
                centre,
                semi_axes: v(1.3, 0.6, 0.9),
            }
            .into(),
        ),
        (
            "hyperboloid",
            Hyperboloid {
                centre,
                waist: r(0.5),
                slope: r(0.8),
                half_height: r(1.1),
            }
            .into(),
        ),
        (
            "paraboloid",
            Paraboloid {
                apex: v(0.1, -0.9, 0.2),
                radius: r(1.1),
                height: r(1.7),
            }
            .into(),
        ),
        (
            "torus",
            Torus {
                centre,
                axis,
                major_radius: r(1.1),
                minor_radius: r(0.4),
            }
            .into(),
        ),
    ]
}

/// Signed distance of a point from a surface along a normal, in f64: by a ray down the normal from
/// slightly above.
fn height(shape: &TransformedShape<f64>, point: DVec3, normal: DVec3, above: f64) -> Option<f64> {
    let prepared_ray = PreparedRay::new(Ray::<f64>::new(point + normal * above, -normal));
    let hit = shape.intersect(
        &prepared_ray,
        Interval {
            min: 0.0,
            max: 2.0 * above,
        },
        Side::Both,
    )?;
    Some((hit.t - above).abs())
}

/// Hits from up to `far` sizes away on a shape of a given size and position: each point is off
/// along the normal by at most the reach of its error box.
fn stated<R: Real>(
    name: &str,
    shape: AnyShape<R>,
    best: AnyShape<f64>,
    size: f64,
    place: f64,
) -> CaseOutcome {
    let map = DAffine3::from_translation(DVec3::new(0.6, -0.3, 0.9) * place)
        * DAffine3::from_scale(DVec3::new(size, -size, size));
    let transformed_shape = TransformedShape::<R>::new(shape, map).expect("an invertible map");
    let best = TransformedShape::<f64>::new(best, map).expect("an invertible map");
    judge(
        &format!(
            "stated bound of the {name} in {}, size {size:e} at {place:e}",
            std::any::type_name::<R>()
        ),
        180,
        3000,
        |rng| {
            let middle = map.translation;
            let origin = middle + rng.sample_direction() * (size * rng.choose(&[3.0, 10.0, 100.0]));
            let ray = create_ray_towards::<R>(origin, middle + rng.sample_point_in_cube() * size);
            let prepared_ray = PreparedRay::new(ray);
            let Some(hit) =
                transformed_shape.intersect(&prepared_ray, Interval::positive(), Side::Both)
            else {
                return Verdict::Skipped;
            };
            let surface = transformed_shape
                .locate_surface_point(&prepared_ray, hit)
                .to_scalar::<R>();
            let (point, normal) = (surface.point.to_f64(), surface.normal.to_f64());
            let reach = surface.error.to_f64() * normal.abs().element_sum();
            // Near an edge, and where the surface curves within the bound, the normal gives no
            // distance.
            if reach > 1e-3 * size {
                return Verdict::Skipped;
            }
            let Some(height) = height(&best, point, normal, 4.0 * reach) else {
                return Verdict::Skipped;
            };
            within(height, reach, || {
                format!("beyond the stated bound{}", format_ray_bits::<R>(&ray))
            })
        },
    )
}

/// Protects: the error bound of a surface holds for every shape, of any size, at any position.
/// Textbook formulas have no such test: their error depends on the ray's origin and has no simple
/// bound.
#[test]
fn stated_bounds_hold() {
    for (size, place) in [(1.0, 0.0), (1.0, 1e3), (1e3, 1e5), (1e-4, 0.01), (1e4, 0.0)] {
        for ((name, robust), (_, best)) in shapes::<f32>().into_iter().zip(shapes::<f64>()) {
            stated::<f32>(name, robust, best, size, place).expect_right(500);
            stated::<f64>(name, best, best, size, place).expect_right(500);
        }
    }
}
